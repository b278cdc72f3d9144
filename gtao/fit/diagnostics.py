"""What the plots of a refit draw, computed once so that plotting computes nothing."""

import math
from dataclasses import dataclass

import numpy as np

from gtao.data.multibounce import JIMENEZ2016, MultibounceFit

from .forms import evaluate
from .result import MultibounceResult
from .samples import Samples

__all__ = ["Diagnostics", "diagnose"]

#: Most cells of V in the density: finer than the noise of one pixel at 256 paths, coarse enough to fill.
DENSITY_CELLS = 64

#: Cells of V' in the density.
TARGET_CELLS = 80

#: Bins of V of the residuals and of the coverage. V is a multiple of 1/paths: a power of two keeps bins equally full.
VISIBILITY_BINS = 16

#: Share of a scene's pixels below which the mean of a bin is noise and is masked.
MIN_SHARE = 0.002

CURVE_POINTS = 201


@dataclass(frozen=True, kw_only=True, eq=False)
class Diagnostics:
    """Arrays behind the plots of one refit.

    Attributes:
        bounces: Surface bounces of the truth.
        albedos: (R,).
        scenes: Names, S of them.
        visibility: Abscissa of the curves, (G,), from 0 to 1.
        curves: V' of each function by its name, (R, G): "refit", "published" and "closed form".
        density: Share of the pixels per cell of V and V', (R, cells of V, cells of V'); scenes count
            the same. Noise is not taken out.
        bins: Edges of the bins of V, (bins + 1,).
        coverage: Share of the pixels of each scene in each bin, (S, bins).
        residuals: Mean of refit minus V' per scene, bin and albedo, (S, bins, R), masked where a bin is nearly empty.
            Noise is not taken out.
    """

    bounces: float
    albedos: np.ndarray
    scenes: tuple[str, ...]
    visibility: np.ndarray
    curves: dict[str, np.ndarray]
    density: np.ndarray
    bins: np.ndarray
    coverage: np.ndarray
    residuals: np.ma.MaskedArray


def diagnose(samples: Samples, result: MultibounceResult) -> Diagnostics:
    """Arrays behind the plots.

    Args:
        samples: What was fitted.
        result: The fit.

    Returns:
        The arrays. The closed form is that of the integrating sphere, cut off at the fit's number of bounces.
    """
    bounces, albedos = result.settings.bounces, np.array(result.settings.albedos)
    grid = np.linspace(0, 1, CURVE_POINTS)
    functions = {"refit": result.fit, "published": JIMENEZ2016, "closed form": _closed_form(bounces)}
    curves = {name: evaluate(fit, grid, albedos[:, None]) for name, fit in functions.items()}
    # As many cells as divide the levels of V evenly, or there would be stripes.
    cells = max(n for n in range(1, DENSITY_CELLS + 1) if samples.scenes[0].spp % n == 0)
    density = np.zeros((len(albedos), cells, TARGET_CELLS))
    coverage, residuals = [], []
    for scene in samples.scenes:
        V, target = scene.visibility, scene.target(bounces, albedos)
        for r in range(len(albedos)):
            counts = np.histogram2d(V, target[r], (cells, TARGET_CELLS), ((0, 1), (0, 1)))[0]
            density[r] += counts / scene.n_pixels / len(samples.scenes)
        index = np.minimum((V * VISIBILITY_BINS).astype(int), VISIBILITY_BINS - 1)
        share = np.bincount(index, minlength=VISIBILITY_BINS) / scene.n_pixels
        error = evaluate(result.fit, V, albedos[:, None]) - target
        total = np.array([np.bincount(index, row, VISIBILITY_BINS) for row in error]).T
        empty = share < MIN_SHARE
        mean = total / np.where(empty, 1.0, share * scene.n_pixels)[:, None]
        coverage.append(share)
        residuals.append(np.ma.array(mean, mask=np.broadcast_to(empty[:, None], mean.shape)))
    return Diagnostics(
        bounces=bounces,
        albedos=albedos,
        scenes=samples.names,
        visibility=grid,
        curves=curves,
        density=density,
        bins=np.linspace(0, 1, VISIBILITY_BINS + 1),
        coverage=np.array(coverage),
        residuals=np.ma.stack(residuals),
    )


def _closed_form(bounces: float) -> MultibounceFit:
    form, coefficients = ("sphere", ()) if math.isinf(bounces) else ("sphere_truncated", (bounces,))
    return MultibounceFit(form=form, coefficients=coefficients, bounces=bounces, source="integrating sphere")
