"""A view with the visibility that it should have."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gtao.errors import ConfigError, ShapeError
from gtao.gbuffer import GBuffer

__all__ = ["Problem"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Problem:
    """One view with the visibility that it should have.

    Args:
        name: for tables; unique.
        g: the frame.
        truth: (H, W) visibility; only pixels that show a surface count.
        radius: reach of the truth's occluders in scene units, which the method's lengths are scaled to; None leaves
            them alone.
        scene: views of one scene are left out together; the name if left out.
        weight: of the view's mean squared error in the loss, positive.
        variance: (H, W) variance of the truth, which reported errors are corrected by; None for none.

    Raises:
        ShapeError: truth or variance are not of the frame, not finite on the surface, or there is no surface.
        ConfigError: the weight or the radius is not positive and finite.
    """

    name: str
    g: GBuffer
    truth: ArrayLike
    radius: float | None = None
    scene: str = ""
    weight: float = 1.0
    variance: ArrayLike | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.g, GBuffer):
            raise ConfigError(f"g of problem {self.name!r} must be a gtao.GBuffer, got {type(self.g).__name__}")
        for what, value in (("weight", self.weight), ("radius", 1.0 if self.radius is None else self.radius)):
            if not 0 < value < np.inf:
                raise ConfigError(f"{what} of problem {self.name!r} must be positive and finite, got {value}")
        surface = self.g.mask.numpy().astype(bool)
        if not surface.any():
            raise ShapeError(f"no pixel of problem {self.name!r} shows a surface; leave the view out")
        for what in ("truth", "variance"):
            given = getattr(self, what)
            if given is None:
                continue
            image = np.array(given, dtype=np.float64)
            if image.shape != self.g.shape:
                raise ShapeError(f"{what} of problem {self.name!r} has shape {image.shape}, its frame {self.g.shape}")
            if not np.isfinite(image[surface]).all():
                raise ShapeError(f"{what} of problem {self.name!r} is not finite on the surface")
            object.__setattr__(self, what, np.where(surface, image, 1.0 if what == "truth" else 0.0))
        object.__setattr__(self, "scene", self.scene or self.name)

    @property
    def noise(self) -> float:
        """Mean variance of the truth over the surface."""
        return 0.0 if self.variance is None else float(np.mean(self.variance[self.g.mask.numpy().astype(bool)]))
