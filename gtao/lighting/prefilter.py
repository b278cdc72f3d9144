"""Environment maps blurred by the lobes of rough mirrors: the probes of the split-integral approximation."""

import itertools
import math
import numbers
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gtao.errors import ConfigError, ShapeError

from ._checks import as_directions, as_order
from ._lobe import texel_weights
from .environment import EnvironmentMap

__all__ = ["PrefilteredEnvironment", "prefilter"]

#: Perceptual roughness of the default's levels.
LEVELS = tuple(i / 16 for i in range(17))
#: Rows of a level for one microfacet width: a point of light blurred by the lobe is then interpolated to 1 %.
ROWS_PER_WIDTH = 4 * math.pi
#: Fewest rows that levels are halved down to.
MIN_ROWS = 32


@dataclass(frozen=True, eq=False)
class PrefilteredEnvironment:
    """Mean radiance in the lobe of a rough mirror, by the direction of its axis and by roughness.

    Attributes:
        roughness: perceptual roughness of each level, increasing, in [0, 1].
        levels: an :class:`EnvironmentMap` for each of them; sizes may differ.

    Raises:
        ConfigError: the roughnesses are not increasing numbers in [0, 1], or not as many as the levels.
    """

    roughness: tuple[float, ...]
    levels: tuple[EnvironmentMap, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "roughness", _increasing(self.roughness))
        if len(self.levels) != len(self.roughness):
            raise ConfigError(f"{len(self.roughness)} roughnesses need as many levels, got {len(self.levels)}")

    def __repr__(self) -> str:
        sizes = ", ".join(f"{r:g}: {m.shape[1]}x{m.shape[0]}" for r, m in zip(self.roughness, self.levels, strict=True))
        return f"PrefilteredEnvironment({sizes})"

    def lookup(self, directions: ArrayLike, roughness: ArrayLike) -> np.ndarray:
        """Pre-filtered radiance, bilinear within a level and linear in perceptual roughness between two.

        Args:
            directions: (…, 3) axes of the lobes, the reflections of the view; world frame, of any length but 0.
            roughness: perceptual roughness, a number or an array that broadcasts to (…); within the levels' range.

        Returns:
            (…, 3) float64 linear radiance.

        Raises:
            ShapeError: the directions are not (…, 3), not finite, or zero; the roughness has another shape.
            ConfigError: a roughness lies outside the range of the levels.
        """
        axes = as_directions("directions", directions)
        wanted = self._positions(roughness, axes.shape[:-1]).reshape(-1)
        flat = axes.reshape(-1, 3)
        out = np.zeros_like(flat)
        for index, level in enumerate(self.levels):
            share = np.maximum(1 - np.abs(wanted - index), 0)
            used = np.flatnonzero(share)
            if len(used):
                out[used] += share[used, None] * level.lookup(flat[used])
        return out.reshape(axes.shape)

    def _positions(self, roughness: ArrayLike, shape: tuple[int, ...]) -> np.ndarray:
        """Fractional indices of the levels, of the shape."""
        wanted, low, high = np.asarray(roughness, dtype=np.float64), self.roughness[0], self.roughness[-1]
        if not ((wanted >= low) & (wanted <= high)).all():
            raise ConfigError(f"roughness must be in [{low:g}, {high:g}], the range of the levels")
        try:
            return np.broadcast_to(np.interp(wanted, self.roughness, np.arange(len(self.roughness))), shape)
        except ValueError:
            raise ShapeError(f"roughness must be a number or broadcast to {shape}, got shape {wanted.shape}") from None


def prefilter(
    environment: EnvironmentMap,
    roughness: Sequence[float] = LEVELS,
    height: int = 128,
) -> PrefilteredEnvironment:
    """Blur a map by the lobes of rough mirrors, one level for each roughness; theory, eq. (138).

    A lobe is that of GGX with the normal and the view along its axis: symmetric, D(cos t/2) ⟨cos t⟩₊ at the angle t
    from it. That is what probes of the split-integral approximation hold (Karis 2013); what it leaves out is the
    stretch of reflections at grazing angles. A level of roughness 0 is the map itself; at roughness 1 all directions
    of microfacets are as frequent, and the level is irradiance over π.

    At the centres of texels, integrals of the interpolated map are by quadrature that follows the lobe, right to 1e-4
    of the level's largest value; constant maps stay constant to rounding. Between texels, levels are bilinear like
    the map, which is off by 1 % of the largest value where a level has 4π/α rows (α the microfacet width), and by more
    where the map itself has fewer. Levels are halved while they keep those rows, and 32. Between levels, lookups are
    linear: with the default's 17, off by less than 1 % of the standard deviation of the light where light is smooth,
    but by up to a sixth of its peak near a small sun, at roughnesses below 0.3. Give the roughness that is wanted as a
    level of its own where that matters.

    Args:
        environment: the map.
        roughness: increasing perceptual roughnesses in [0, 1]; the microfacet width is the square. The default has 17,
            evenly spaced from 0 to 1.
        height: most rows that are worked on: larger maps are averaged down first, but not for roughness 0. The time
            grows with the third to fourth power; 64 rows and the default's levels take about a second.

    Raises:
        ConfigError: the environment is no map, the roughnesses are not increasing numbers in [0, 1], or the height is
            below 2.
    """
    if not isinstance(environment, EnvironmentMap):
        raise ConfigError(f"environment must be a gtao.lighting.EnvironmentMap, got {type(environment).__name__}")
    if as_order(height) < 2:
        raise ConfigError(f"height must be an integer of at least 2, got {height!r}")
    levels = _increasing(roughness)
    source = environment.resized(min(height, environment.shape[0]))
    return PrefilteredEnvironment(levels, tuple(_blurred(source, r * r) if r else environment for r in levels))


def _blurred(source: EnvironmentMap, alpha: float) -> EnvironmentMap:
    """The map's mean in the lobe about the centre of every texel of a grid that suits the lobe."""
    height, width = source.shape
    factor = _reduction(height, width, alpha)
    rows = height // factor
    spectrum = np.fft.rfft(source.radiance.astype(np.float64), axis=1)
    out = np.empty((rows, width // factor, 3))
    # Column 0 of the level stands at the middle of the first ``factor`` columns of the map. All others see the same
    # weights, turned: a correlation. So does the mirrored row, upside down.
    for row in range((rows + 1) // 2):
        weights = texel_weights(source.shape, math.pi * (row + 0.5) / rows, (factor - 1) / 2, alpha)
        turned = np.conj(np.fft.rfft(weights, axis=1))
        for target, kernel in ((row, turned), (rows - 1 - row, turned[::-1])):
            mean = np.fft.irfft(np.einsum("rk,rkc->kc", kernel, spectrum), n=width, axis=0)
            out[target] = mean[::factor]
    # Transforms leave dark texels beside a sun a rounding error below zero.
    return EnvironmentMap(np.maximum(out, 0).astype(np.float32), source.to_world)


def _reduction(height: int, width: int, alpha: float) -> int:
    """How often both sides can be divided by two while the lobe is still resolved."""
    rows, factor = max(MIN_ROWS, ROWS_PER_WIDTH / alpha), 1
    while height % (2 * factor) == 0 and width % (2 * factor) == 0 and height // (2 * factor) >= rows:
        factor *= 2
    return factor


def _increasing(roughness: Any) -> tuple[float, ...]:
    values = tuple(roughness) if isinstance(roughness, Sequence | np.ndarray) else (roughness,)
    numeric = all(isinstance(r, numbers.Real) and not isinstance(r, bool) and 0 <= r <= 1 for r in values)
    if not values or not numeric or any(b <= a for a, b in itertools.pairwise(values)):
        raise ConfigError(f"roughness must be increasing numbers in [0, 1], one for each level, got {roughness!r}")
    return tuple(float(r) for r in values)
