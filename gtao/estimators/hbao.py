"""HBAO's accumulator from its configuration."""

import math

from gtao.config import HBAO, plain
from gtao.gbuffer import GBuffer
from gtao.kernels.accumulators import TangentToHorizon

from .job import Job
from .marching import march_job, opaque

__all__ = ["hbao_job"]


def hbao_job(g: GBuffer, method: HBAO, frame_index: int) -> Job:
    """The march of :class:`gtao.HBAO`."""
    radius = method.search_radius
    limited = not math.isinf(plain(radius))
    accumulator = TangentToHorizon(
        attenuation=method.attenuation,
        limited=limited,
        radius2=opaque(g, radius * radius),
        rcp_radius=opaque(g, 1 / radius),
    )
    return march_job(g, method, accumulator, radius, frame_index)
