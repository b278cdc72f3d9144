"""What the estimators return: arrays together with the configuration that made them."""

from dataclasses import dataclass, replace
from typing import Any

import drjit as dr

from . import display
from .tensors import window

__all__ = ["AmbientOcclusion"]


@dataclass(frozen=True, kw_only=True)
class AmbientOcclusion:
    """Ambient occlusion of one frame.

    Attributes:
        visibility: (H, W) tensor, 1 = open, 1 on the background. An unbiased estimate: with few slices single pixels
            of tilted surfaces exceed 1 (others fall short; theory, eq. (17)), so average or denoise before clamping.
        bent_normal: (H, W, 3) mean unoccluded direction in the view frame, or None.
        variance: (H, W) variance of the visibility, 0 on the background; from Monte Carlo methods, else None.
        config: the method that made it.
    """

    visibility: Any
    bent_normal: Any = None
    variance: Any = None
    config: Any = None

    def crop(self, x0: int, y0: int, width: int, height: int) -> "AmbientOcclusion":
        """The result in the window whose top left pixel is ``(x0, y0)``, for example within a guard band.

        Raises:
            ShapeError: the window reaches beyond the frame.
        """
        images = {name: window(v, x0, y0, width, height) for name, v in vars(self).items() if dr.is_tensor_v(type(v))}
        return replace(self, **images)

    def _repr_png_(self) -> bytes:
        return display.grey_png(self.visibility)

    def __repr__(self) -> str:
        height, width = self.visibility.shape
        return f"AmbientOcclusion({width}x{height}, config={self.config})"
