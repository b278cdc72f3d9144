"""What the estimators return: arrays together with the configuration that made them."""

from dataclasses import dataclass
from typing import Any

from . import display

__all__ = ["AmbientOcclusion"]


@dataclass(frozen=True, kw_only=True)
class AmbientOcclusion:
    """Ambient occlusion of one frame.

    Attributes:
        visibility: (H, W) tensor, 1 = open, 1 on the background. An unbiased estimate: with few slices single pixels
            of tilted surfaces exceed 1 (others fall short; theory, eq. (17)), so average or denoise before clamping.
        bent_normal: (H, W, 3) mean unoccluded direction in the view frame, or None.
        config: the method that made it.
    """

    visibility: Any
    bent_normal: Any = None
    config: Any = None

    def _repr_png_(self) -> bytes:
        return display.grey_png(self.visibility)

    def __repr__(self) -> str:
        height, width = self.visibility.shape
        return f"AmbientOcclusion({width}x{height}, config={self.config})"
