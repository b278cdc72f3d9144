"""HBAO's accumulator from its configuration."""

import math

from gtao.config import HBAO, plain
from gtao.gbuffer import GBuffer
from gtao.kernels.accumulators import TangentToHorizon

from .marching import march_frame, opaque

__all__ = ["hbao_visibility"]


def hbao_visibility(g: GBuffer, method: HBAO, frame_index: int, max_pixels: int | None):
    """The flat visibility of :class:`gtao.HBAO`."""
    radius = method.search_radius
    limited = not math.isinf(plain(radius))
    accumulator = TangentToHorizon(
        attenuation=method.attenuation,
        limited=limited,
        radius2=opaque(g, radius * radius),
        rcp_radius=opaque(g, 1 / radius),
    )
    return march_frame(g, method, accumulator, radius, frame_index, max_pixels)
