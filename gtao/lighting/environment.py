"""Light from infinitely far away, as a latitude-longitude image: looking up, resizing, projecting, integrating."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gtao.errors import ConfigError, ShapeError

from ._checks import as_directions, as_order, as_orthogonal
from ._latlong import (
    POLAR_TO_LOCAL,
    angles_of,
    directions_of,
    hat_moments,
    overlaps,
    texel_solid_angles,
)
from .rotation import rotate

__all__ = ["EnvironmentMap"]

#: Fewest rows that irradiance is summed over.
MIN_ROWS = 128
#: Products of normals and texels that are held at once, 64 MiB.
CHUNK = 2**23


@dataclass(frozen=True, eq=False)
class EnvironmentMap:
    """Radiance that arrives from infinity, by direction.

    Row i holds the polar angle θ = π (i + ½)/H from the local +y, column j the azimuth φ = 2π (j + ½)/W, of the local
    direction (sin φ sin θ, cos θ, -cos φ sin θ): column 0 begins at -z, and +x is a quarter of the width to the right.
    The world direction is ``to_world`` times the local one. Between centres, radiance is bilinear in θ and φ,
    periodic in φ, and constant from the first and last rows' centres to the poles. All methods speak of this function.

    Mitsuba's ``envmap`` uses the same frame and the same columns, but stretches the rows, θ = π i/(H - 1), so that
    the first and the last lie on the poles: up to half a texel elsewhere.

    Attributes:
        radiance: (H, W, 3) float32, linear, finite and not negative; at least 2x2 texels; read-only.
        to_world: (3, 3) float64 rotation (or reflection) from the local frame to the world; also accepts 4x4.

    Raises:
        ShapeError: the radiance has another shape, NaN, infinite or negative values, or the matrix another shape.
        ConfigError: the matrix is not orthogonal.
    """

    radiance: np.ndarray
    to_world: np.ndarray = field(default_factory=lambda: np.eye(3))

    def __post_init__(self):
        object.__setattr__(self, "radiance", _checked(self.radiance))
        matrix = as_orthogonal("to_world", self.to_world)
        matrix.flags.writeable = False
        object.__setattr__(self, "to_world", matrix)

    @property
    def shape(self) -> tuple[int, int]:
        """(H, W)."""
        return self.radiance.shape[0], self.radiance.shape[1]

    @cached_property
    def solid_angles(self) -> np.ndarray:
        """(H,) float64 solid angle of a texel of each row, in steradians; they sum to 4π/W."""
        return texel_solid_angles(*self.shape)

    def directions(self) -> np.ndarray:
        """(H, W, 3) unit vectors of the texels' centres, world frame."""
        height, width = self.shape
        theta = math.pi * (np.arange(height) + 0.5) / height
        phi = 2 * math.pi * (np.arange(width) + 0.5) / width
        return directions_of(theta[:, None], phi) @ self.to_world.T

    def lookup(self, directions: ArrayLike) -> np.ndarray:
        """Bilinear radiance.

        Args:
            directions: (…, 3) in the world frame, of any length but 0, toward the light.

        Returns:
            (…, 3) float64 radiance.

        Raises:
            ShapeError: the directions are not (…, 3), not finite, or zero.
        """
        height, width = self.shape
        theta, phi = angles_of(as_directions("directions", directions) @ self.to_world)
        row = np.clip(theta / math.pi * height - 0.5, 0, height - 1)
        column = phi / (2 * math.pi) * width - 0.5
        i, j = np.minimum(row.astype(np.int64), height - 2), np.floor(column).astype(np.int64)
        f, g = (row - i)[..., None], (column - j)[..., None]
        image = self.radiance
        left, right = j % width, (j + 1) % width
        above = (1 - g) * image[i, left] + g * image[i, right]
        below = (1 - g) * image[i + 1, left] + g * image[i + 1, right]
        return (1 - f) * above + f * below

    def resized(self, height: int) -> "EnvironmentMap":
        """The map at another resolution; the proportions of the image are kept.

        Smaller maps hold averages over the solid angle, which keep the sum of radiance times solid angle; larger ones
        are looked up.

        Raises:
            ConfigError: the height is not an integer of at least 2.
        """
        rows, columns = self.shape
        if as_order(height) < 2:
            raise ConfigError(f"height must be an integer of at least 2, got {height!r}")
        width = max(2, round(columns * height / rows))
        if height == rows:
            return self
        if height > rows:
            theta = math.pi * (np.arange(height) + 0.5) / height
            phi = 2 * math.pi * (np.arange(width) + 0.5) / width
            values = self.lookup(directions_of(theta[:, None], phi) @ self.to_world.T)
        else:
            old, new = (1 - np.cos(math.pi * np.arange(n + 1) / n) for n in (rows, height))
            across = overlaps(np.arange(columns + 1) / columns, np.arange(width + 1) / width)
            half = np.einsum("ij,jkc->ikc", overlaps(old, new), self.radiance.astype(np.float64))
            values = np.einsum("jk,ikc->ijc", across, half)
        return EnvironmentMap(values.astype(np.float32), self.to_world)

    def project(self, order: int = 2) -> np.ndarray:
        """Coefficients of the radiance in the world frame, ∫ L Y_lm dω; theory, eq. (105).

        The integral of the interpolated map is exact but for rounding.

        Args:
            order: highest band.

        Returns:
            ((order + 1)², 3) float64.

        Raises:
            ConfigError: the order is not an integer of at least 0.
        """
        order = as_order(order)
        height, width = self.shape
        polar, azimuth = hat_moments(height, width, order)
        phi = 2 * math.pi * (np.arange(width) + 0.5) / width
        m = np.arange(order + 1)[:, None]
        radiance = self.radiance.astype(np.float64)
        cosines = np.einsum("mj,ijc->mic", np.cos(m * phi) * azimuth[:, None], radiance)
        sines = np.einsum("mj,ijc->mic", np.sin(m * phi) * azimuth[:, None], radiance)
        out = np.empty(((order + 1) ** 2, 3))
        for (band, k), weight in polar.items():
            middle, scale = band * band + band, math.sqrt(2) if k else 1.0
            if k:
                out[middle - k] = scale * weight @ sines[k]
            out[middle + k] = scale * weight @ cosines[k]
        return rotate(out, self.to_world @ POLAR_TO_LOCAL)

    def irradiance(self, normals: ArrayLike) -> np.ndarray:
        """Irradiance on open surfaces, ∫ L ⟨n, ω⟩₊ dω.

        Exact for the interpolated map but for the texels that the surface's own plane cuts, which make about 1e-4 of
        it. The cost is one product per normal and texel (at least 128 rows of them): resize a large map before.

        Args:
            normals: (…, 3) in the world frame, of any length but 0.

        Returns:
            (…, 3) float64.

        Raises:
            ShapeError: the normals are not (…, 3), not finite, or zero.
        """
        if self.shape[0] < MIN_ROWS:
            # Interpolated at an odd multiple of the resolution, the texels' centres among its own, it is the same map.
            return self.resized(self.shape[0] * (-(-MIN_ROWS // self.shape[0]) | 1)).irradiance(normals)
        n = as_directions("normals", normals) @ self.to_world
        flat, radiance = n.reshape(-1, 3), self.radiance.reshape(-1, 3).astype(np.float64)
        out = np.empty_like(flat)
        rows = max(1, CHUNK // len(radiance))
        for start in range(0, len(flat), rows):
            cosines = flat[start : start + rows] @ self._first_moments.T
            out[start : start + rows] = np.maximum(cosines, 0, out=cosines) @ radiance
        return out.reshape(n.shape)

    @cached_property
    def _first_moments(self) -> np.ndarray:
        """(H W, 3) integrals of ω times each texel's hat, local frame."""
        height, width = self.shape
        polar, azimuth = hat_moments(height, width, 1)
        phi = 2 * math.pi * (np.arange(width) + 0.5) / width
        one, plane = math.sqrt(4 * math.pi / 3), polar[1, 1][:, None] * azimuth[1] * math.sqrt(2)
        y = np.broadcast_to(polar[1, 0][:, None] * azimuth[0], (height, width))
        return one * np.stack([plane * np.sin(phi), y, -plane * np.cos(phi)], axis=-1).reshape(-1, 3)


def _checked(radiance: Any) -> np.ndarray:
    image = np.asarray(radiance)
    if image.ndim != 3 or image.shape[-1] != 3 or min(image.shape[:2]) < 2 or image.dtype.kind not in "fiu":
        raise ShapeError(
            f"radiance must be (H, W, 3) real numbers of at least 2x2 texels, got shape {image.shape} of {image.dtype}"
        )
    with np.errstate(over="ignore"):
        image = np.array(image, dtype=np.float32, order="C")
    broken, negative = ~np.isfinite(image), image < 0
    if broken.any() or negative.any():
        raise ShapeError(
            f"radiance must be finite and not negative: of {image.shape[0] * image.shape[1]} texels"
            f" {int(broken.any(-1).sum())} are NaN or infinite and {int(negative.any(-1).sum())} negative; repair them"
        )
    image.flags.writeable = False
    return image
