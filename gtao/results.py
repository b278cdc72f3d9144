"""What the estimators return: arrays together with the configuration that made them."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from . import display
from .backend import types_of
from .planes import PlanarImage, Planes
from .tensors import vectors, window

__all__ = ["AmbientOcclusion", "Stages"]


@dataclass(frozen=True, kw_only=True)
class AmbientOcclusion:
    """Ambient occlusion of one frame.

    Attributes:
        visibility: (H, W) tensor, 1 = open, 1 on the background. An unbiased estimate: with few slices single pixels
            of tilted surfaces exceed 1 (others fall short; theory, eq. (17)), so average or denoise before clamping.
        mean_direction: (H, W, 3) mean unoccluded direction in the view frame as it is integrated, or None: with cosine
            weighting the integral of V(ω) ⟨N, ω⟩ ω over the hemisphere divided by π, of length 2/3 in the open; with
            uniform weighting that of V(ω) ω divided by 2π, of length 1/2. The more the visible directions spread, the
            shorter it is beside the visibility. 0 on the background and where nothing is visible. Power, floor and
            ceiling leave it alone. Of "average_horizon" only its direction means anything.
        visibility_sh: (H, W, 9) visibility times cosine in real spherical harmonics of bands 0 to 2 in the view frame,
            or None (docs/conventions: no Condon-Shortley phase); with uniform weighting without the cosine, over the
            normal's hemisphere. 0 on the background. Power, floor and ceiling leave it alone.
        normal_v: (H, W, 3) normals of the frame, where there are directions, else None. Where one faces away from the
            viewer, visibility and directions are those of the normal turned until it is seen edge-on (docs/departures).
        unshaped: (H, W) visibility that belongs to the directions, where power, floor, ceiling, a fade of small radii
            or the clamp of a pipeline changed the visibility itself, else None.
        variance: (H, W) variance of the visibility, 0 on the background; from Monte Carlo methods, else None.
        config: the method that made it.

    Directions are kept in planes, one flat array per channel, and become tensors when they are first asked for. Code
    that runs every frame reads :meth:`planes`.
    """

    visibility: Any
    mean_direction: Any = PlanarImage()  # noqa: RUF009  (a descriptor)
    visibility_sh: Any = PlanarImage()  # noqa: RUF009  (a descriptor)
    normal_v: Any = None
    unshaped: Any = None
    variance: Any = None
    config: Any = None

    @property
    def bent_normal(self):
        """(H, W, 3) unit mean unoccluded direction in the view frame, or None.

        The normal where nothing is visible (+z without normals), +z on the background.
        """
        planes = self.planes("mean_direction")
        if planes is None:
            return None
        B = planes.arrays
        T = types_of(type(self.visibility))
        length2 = sum(b * b for b in B)
        seen = length2 > 0
        rcp = dr.rsqrt(dr.select(seen, length2, 1))
        fallback = (0, 0, 1) if self.normal_v is None else vectors(self.normal_v.array, T)
        unit = (dr.select(seen, b * rcp, n) for b, n in zip(B, fallback, strict=True))
        return Planes(tuple(unit), planes.shape).tensor()

    @property
    def cosine_visibility(self):
        """(H, W) cosine-weighted visibility, 1 on the background, or None where the estimate does not know it.

        With cosine weighting the visibility itself. With uniform weighting 2 ⟨N, mean_direction⟩, theory, eq. (153):
        exactly what the same horizons, or open sectors, give with the other weighting, so that one uniform estimate
        with bent normals has both. Neither power, floor and ceiling nor a fade of small radii, which change the
        visibility alone, are in it; where a normal faces away, it belongs to that normal and not to the turned one.
        None with uniform weighting without directions or with those of "average_horizon", and with other weightings.
        """
        weighting = getattr(self.config, "weighting", "cosine")
        if weighting == "cosine":
            return self.visibility
        directions = self.planes("mean_direction")
        average = getattr(self.config, "bent_normal", None) == "average_horizon"
        if weighting != "uniform" or average or directions is None or self.normal_v is None:
            return None
        T = types_of(type(self.visibility))
        B, seen = T.Array3(*directions.arrays), self.visibility if self.unshaped is None else self.unshaped
        # The background is visible, without a direction.
        background = (dr.squared_norm(B) == 0) & (seen.array > 0)
        cosine = 2 * dr.dot(vectors(self.normal_v.array, T), B)
        return T.Tensor(dr.select(background, 1, cosine), self.visibility.shape)

    def planes(self, name: str) -> Planes | None:
        """The channels of "mean_direction" or "visibility_sh" as flat arrays, or None: ``.arrays`` and ``.shape``."""
        return vars(type(self))[name].planes(self)

    def crop(self, x0: int, y0: int, width: int, height: int) -> "AmbientOcclusion":
        """The result in the window whose top left pixel is ``(x0, y0)``, for example within a guard band.

        Raises:
            ShapeError: the window reaches beyond the frame.
        """
        names = ("visibility", "mean_direction", "visibility_sh", "normal_v", "unshaped", "variance")
        images = {name: getattr(self, name) for name in names}
        cropped = {name: None if v is None else window(v, x0, y0, width, height) for name, v in images.items()}
        return AmbientOcclusion(**cropped, config=self.config)

    def _repr_png_(self) -> bytes:
        return display.grey_png(self.visibility)

    def __repr__(self) -> str:
        height, width = self.visibility.shape
        return f"AmbientOcclusion({width}x{height}, config={self.config})"


@dataclass(frozen=True, kw_only=True)
class Stages:
    """What the stages of a pipeline made of one frame; None of those that it has not.

    Attributes:
        frame: the :class:`gtao.GBuffer` that was estimated, the smaller one where there is one.
        occlusion: estimate of that frame.
        spatial: the estimate, filtered in the image.
        temporal: the same, accumulated with the frames before.
        upsampled: the last of these at full size.
        result: the last of these, limited to [0, 1] where the pipeline does that.
    """

    frame: Any
    occlusion: AmbientOcclusion
    spatial: AmbientOcclusion | None = None
    temporal: AmbientOcclusion | None = None
    upsampled: AmbientOcclusion | None = None
    result: AmbientOcclusion
