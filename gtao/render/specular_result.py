"""What a render of glossy reflections returns, for any reflectance at normal incidence from the same rays."""

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import mitsuba as mi
import numpy as np

from gtao import display
from gtao.errors import ConfigError, ShapeError

__all__ = ["Estimate", "Pair", "Specular", "Terms", "estimate_of"]

#: Reflected shares below this count as none: what a mirror without F0 reflects straight back is in no ray.
DARK = 1e-8


class Estimate(NamedTuple):
    """Mean over rays, and the variance *of the mean* from independent batches; two tensors of one shape."""

    mean: Any
    variance: Any


@dataclass(frozen=True)
class Pair:
    """Two correlated estimates a and b, which stand for F0 a + b.

    Attributes:
        mean: (…, 2) a and b, float32.
        covariance: (…, 3) variances of the means of a and of b, and their covariance, float32.
    """

    mean: np.ndarray
    covariance: np.ndarray

    def at(self, f0: Any) -> tuple[np.ndarray, np.ndarray]:
        """F0 a + b and its variance, float64."""
        (a, b), (va, vb, c) = self._rows()
        return f0 * a + b, np.maximum(f0 * (f0 * va + 2 * c) + vb, 0)

    def ratio(self) -> tuple[np.ndarray, np.ndarray]:
        """a / b, 1 where b is 0, and its variance to first order in the noise, float64."""
        (a, b), (va, vb, c) = self._rows()
        safe = np.where(b > 0, b, 1)
        mean = np.where(b > 0, a / safe, 1)
        return mean, np.maximum(va - mean * (2 * c - mean * vb), 0) / safe**2

    def _rows(self) -> tuple[np.ndarray, np.ndarray]:
        mean, covariance = (np.moveaxis(x.astype(np.float64), -1, 0) for x in (self.mean, self.covariance))
        return mean, covariance


@dataclass(frozen=True, kw_only=True)
class Terms:
    """What a microfacet surface sends to the viewer, split by Schlick's term (theory, eqs. (143) and (144)).

    Attributes:
        visible: :class:`Pair` of (H, W): A_V and B_V, of the white dome behind the scene.
        hemisphere: (H, W, 2) float32: A and B, of the whole dome.
        mask: (H, W), True where there is a surface.
        radiance, unoccluded: :class:`Pair` of (H, W, 3), of the environment behind the scene and of all of it.
    """

    visible: Pair
    hemisphere: np.ndarray
    mask: np.ndarray
    radiance: Pair | None = None
    unoccluded: Pair | None = None

    def estimates(self, f0: Any) -> dict[str, Estimate]:
        """Occlusion, and under an environment radiance with and without it, for a reflectance at normal incidence."""
        f0 = _channels(f0, self.mask.shape)
        A, B = np.moveaxis(self.hemisphere.astype(np.float64), -1, 0)[..., None]
        seen = Pair(self.visible.mean[..., None, :], self.visible.covariance[..., None, :])
        # Where nothing is reflected, S is what it is for the least F0.
        dark = f0 * A + B < DARK
        f0_s = np.where(dark, 1, f0)
        mean, variance = seen.at(f0_s)
        whole = np.where(self.mask[..., None], f0_s * A + B, 1)
        mean = np.where(self.mask[..., None], mean / whole, 1)
        channels = 0 if f0.shape[-1] == 1 else slice(None)
        found = {"occlusion": estimate_of(mean[..., channels], (variance / whole**2)[..., channels])}
        for name in ("radiance", "unoccluded"):
            pair = getattr(self, name)
            if pair is not None:
                found[name] = estimate_of(*pair.at(f0))
        return found


@dataclass(frozen=True, kw_only=True)
class Specular:
    """Occlusion of glossy reflection in one view, with its uncertainty.

    Attributes:
        occlusion: :class:`Estimate` of S in [0, 1] up to noise, 1 = open: the share of what the surface would reflect
            of a white dome that the scene lets through. (H, W), or (H, W, 3) where reflectance has colours; 1 on the
            background, with variance 0.
        radiance: :class:`Estimate` of (H, W, 3) radiance toward the viewer, linear RGB: what the surface reflects of
            the environment, straight from it; 0 on the background. None without an environment.
        unoccluded: the same if nothing occluded, by the same rays.
        terms: what holds for any reflectance at normal incidence (:meth:`with_f0`); None for a BSDF of Mitsuba.
        f0: reflectance at normal incidence; None for a BSDF of Mitsuba.
        count: samples per pixel: rays, or under an environment pairs of rays.
        n_batches: batches that variances rest on; single pixels have one degree of freedom fewer: pool before testing.
        max_distance: distance beyond which nothing occludes, in scene units.
        seed: of the random numbers.
    """

    occlusion: Estimate
    radiance: Estimate | None = None
    unoccluded: Estimate | None = None
    terms: Terms | None = None
    f0: Any = None
    count: int
    n_batches: int
    max_distance: float = math.inf
    seed: int = 0

    def with_f0(self, f0: Any) -> "Specular":
        """The same rays for another reflectance at normal incidence.

        Args:
            f0: in [0, 1]: a number, (3,) linear RGB, or an (H, W) or (H, W, 3) image.

        Raises:
            ConfigError: the reflection is that of a BSDF of Mitsuba.
            ShapeError: ``f0`` is something else.
        """
        return dataclasses.replace(self, f0=f0, **self._split.estimates(f0))

    @property
    def lobes(self) -> Any:
        """(H, W, 2) tensor of A_V and B_V: the dome behind the scene is reflected by F0 A_V + B_V; 0 on the background.

        Raises:
            ConfigError: the reflection is that of a BSDF of Mitsuba.
        """
        return mi.TensorXf(self._split.visible.mean)

    @property
    def hemisphere(self) -> Any:
        """(H, W, 2) tensor of A and B, the same for the whole dome, by quadrature; 0 on the background.

        Raises:
            ConfigError: the reflection is that of a BSDF of Mitsuba.
        """
        return mi.TensorXf(self._split.hemisphere)

    @property
    def _split(self) -> Terms:
        if self.terms is None:
            raise ConfigError("a BSDF of Mitsuba has no terms that hold for every F0; render without bsdf")
        return self.terms

    def _repr_png_(self) -> bytes:
        mean = self.occlusion.mean
        return display.grey_png(mean if len(mean.shape) == 2 else mi.TensorXf(mean.numpy().mean(-1)))

    def __repr__(self) -> str:
        height, width = self.occlusion.mean.shape[:2]
        light = "" if self.radiance is None else ", with an environment"
        return f"Specular({width}x{height}, {self.count} samples per pixel{light})"


def estimate_of(mean: np.ndarray, variance: np.ndarray) -> Estimate:
    """Tensors of arrays of any precision."""
    return Estimate(mi.TensorXf(mean.astype(np.float32)), mi.TensorXf(variance.astype(np.float32)))


def _channels(f0: Any, shape: tuple[int, int]) -> np.ndarray:
    """Reflectance as float64 that is broadcast to (H, W, 1) or (H, W, 3)."""
    values = np.asarray(f0.numpy() if hasattr(f0, "numpy") else f0)
    if values.dtype.kind not in "fiu" or values.shape not in ((), (1,), (3,), shape, (*shape, 3)):
        raise ShapeError(
            f"f0 must be a number, (3,) linear RGB or an image of shape {shape} or {(*shape, 3)},"
            f" got shape {values.shape} of {values.dtype}"
        )
    if not np.all((values >= 0) & (values <= 1)):
        raise ShapeError("f0 must be in [0, 1]")
    values = values.astype(np.float64)
    return values[..., None] if values.shape in ((), shape) else values
