"""Ray-traced directional visibility: spherical harmonics of visibility, the reference for directional estimators."""

import functools
import math
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np

from gtao import display
from gtao.errors import ConfigError
from gtao.lighting import basis

from .chunks import Progress
from .hemisphere import DIRECTIONS, bent, check_rays, image, mean_over_batches, normals_v, open_sums
from .loading import select_sensor
from .primary import check_normals, shoot
from .sampling import check_sampling
from .sensor import rotation
from .variant import ensure_variant
from .walk import Origins, origins

__all__ = ["DirectionalVisibility", "directional"]

MAX_ORDER = 4
#: Integral of the weighting over the hemisphere: what the mean over rays is to be multiplied by.
MEASURE = {"cosine": math.pi, "uniform": 2 * math.pi}


@dataclass(frozen=True, kw_only=True)
class DirectionalVisibility:
    """Spherical harmonics of one view's visibility, with their uncertainty.

    The basis is real and orthonormal, without the Condon-Shortley phase, in the order (0, 0), (1, -1), (1, 0), (1, 1),
    (2, -2) … (see :func:`gtao.lighting.basis`); n = (order + 1)².

    Attributes:
        mean: (H, W, n) tensor: the integral of V(ω) max(<N, ω>, 0) Y(ω), or, for uniform weighting, that of V(ω) Y(ω)
            over the hemisphere above N; view frame; 0 on the background. Times the coefficients of radiance in
            the same frame, summed: irradiance.
        variance: (H, W, n) variance *of the mean*, from independent batches; 0 on the background. Single pixels
            have few degrees of freedom (``n_batches - 1``): pool them before testing. Coefficients of one pixel
            are correlated.
        normal_v: (H, W, 3) normals that directions are drawn about, view frame; +z on the background.
        mask: (H, W) tensor, True where there is a surface.
        count: rays per pixel.
        n_batches: batches that the variance rests on.
        order: highest band.
        max_distance: distance beyond which nothing occludes, in scene units.
        seed: of the random numbers.
        weighting: "cosine" or "uniform" over the hemisphere.
    """

    mean: Any
    variance: Any
    normal_v: Any
    mask: Any
    count: int
    n_batches: int
    order: int = 2
    max_distance: float = math.inf
    seed: int = 0
    weighting: str = "cosine"

    @property
    def visibility(self) -> Any:
        """(H, W) tensor in [0, 1], 1 on the background: ``Visibility.mean`` of the same rays."""
        share = self._band(1)[..., 0] * (2 * math.sqrt(math.pi) / MEASURE[self.weighting])
        return mi.TensorXf(np.where(self.mask.numpy(), share, 1).astype(np.float32))

    @property
    def mean_direction(self) -> Any:
        """(H, W, 3) tensor, ``Visibility.mean_direction`` of the same rays; None without band 1."""
        if self.order < 1:
            return None
        y, z, x = np.moveaxis(self._band(4)[..., 1:] * (math.sqrt(4 * math.pi / 3) / MEASURE[self.weighting]), -1, 0)
        return mi.TensorXf(np.stack([x, y, z], -1).astype(np.float32))

    @property
    def bent_normal(self) -> Any:
        """(H, W, 3) unit mean direction; the normal where nothing is visible, +z on the background; or None."""
        if self.order < 1:
            return None
        return mi.TensorXf(bent(self.mean_direction.numpy(), self.normal_v.numpy()).astype(np.float32))

    def _band(self, n: int) -> np.ndarray:
        return self.mean.numpy()[..., :n].astype(np.float64)

    def _repr_png_(self) -> bytes:
        return display.grey_png(self.visibility)

    def __repr__(self) -> str:
        height, width = self.mean.shape[:2]
        return f"DirectionalVisibility({width}x{height}, order {self.order}, {self.count} rays per pixel)"


def directional(
    scene: Any,
    g: Any = None,
    max_distance: float = math.inf,
    spp: int = 256,
    seed: int = 0,
    *,
    order: int = 2,
    weighting: str = "cosine",
    sensor: Any = 0,
    normals: str = "shading",
    n_batches: int = 8,
    progress: Progress | None = None,
) -> DirectionalVisibility:
    """Trace rays over the hemisphere at every pixel centre and project what is open (theory, eq. (125)).

    The rays are those of :func:`gtao.render.visibility` with the same numbers: band 0 is its visibility, band 1 its
    mean direction. What is said there about occluders, start points and backgrounds holds here.

    Args:
        scene: ``mitsuba.Scene``; see :func:`gtao.render.load_scene`.
        g: G-buffer of the same scene and sensor whose normals count. ``None`` uses those of the scene.
        max_distance: surfaces farther than this do not occlude; scene units, may be inf.
        spp: rays per pixel, a multiple of ``n_batches``; powers of two stratify best.
        seed: non-negative; the same seed gives the same bits.
        order: highest band, 0 to 4.
        weighting: "cosine", the clamped cosine to the normal is part of the projected function, or "uniform",
            visibility alone is, and 0 below the normal's horizon.
        sensor: index of the sensor, or a ``mitsuba.Sensor``.
        normals: "shading" or "geometric"; only looked at without ``g``.
        n_batches: independent batches, at least two, that the variance is estimated from.
        progress: called as ``progress(done, total)`` after each piece of work.

    Raises:
        SceneError: no such sensor, or ``g`` is not of this scene and sensor.
        ConfigError: a parameter is out of range.
        BackendError: there is no usable backend.
    """
    ensure_variant()
    check_sampling(spp, n_batches, seed)
    check_normals(normals)
    check_rays(max_distance, weighting)
    if isinstance(order, bool) or not isinstance(order, int) or not 0 <= order <= MAX_ORDER:
        raise ConfigError(f"order must be an integer from 0 to {MAX_ORDER}, got {order!r}")
    hits = shoot(scene, select_sensor(scene, sensor), normals)
    start = origins(hits, g)
    to_view = rotation(hits.view_to_world.T)
    coefficients = MEASURE[weighting] * _coefficients(order)

    def values(direction: Any, _: Any) -> tuple:
        return _monomials(*(to_view @ direction), order)

    def estimate(part: Origins, key: int, n_rays: int) -> np.ndarray:
        return (
            coefficients @ open_sums(scene, part, key, n_rays, max_distance, (DIRECTIONS[weighting],), values) / n_rays
        )

    mean, variance = mean_over_batches(start, len(coefficients), spp, n_batches, seed, estimate, progress)
    shape = hits.camera.shape
    return DirectionalVisibility(
        mean=mi.TensorXf(image(mean, start, shape)),
        variance=mi.TensorXf(image(variance, start, shape)),
        normal_v=mi.TensorXf(normals_v(start, hits)),
        mask=mi.TensorXb(image(np.ones(len(start)), start, shape) > 0),
        count=spp,
        n_batches=n_batches,
        order=order,
        max_distance=float(max_distance),
        seed=seed,
        weighting=weighting,
    )


def _monomials(x: Any, y: Any, z: Any, order: int) -> tuple:
    """The (order + 1)² products x^i y^j z^k of degree ``order`` and ``order - 1`` (theory, eq. (126))."""
    one = x * 0 + 1
    powers = [[one], [one], [one]]
    for axis, value in zip(powers, (x, y, z), strict=True):
        for _ in range(order):
            axis.append(axis[-1] * value)
    return tuple(
        powers[0][i] * powers[1][j] * powers[2][degree - i - j]
        for degree in (order, order - 1)
        for i in range(degree + 1)
        for j in range(degree + 1 - i)
    )


@functools.cache
def _coefficients(order: int) -> np.ndarray:
    """(n, n) matrix that takes the monomials to the basis, from their values at directions enough to tell them."""
    n_points = 4 * (order + 1) ** 2
    z = 1 - (2 * np.arange(n_points) + 1) / n_points
    azimuth = np.arange(n_points) * math.pi * (3 - math.sqrt(5))
    radius = np.sqrt(1 - z * z)
    w = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], -1)
    return np.linalg.lstsq(np.stack(_monomials(*w.T, order), -1), basis(w, order), rcond=None)[0].T
