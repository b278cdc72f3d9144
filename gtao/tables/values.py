"""What tables hold, as functions of their arguments: the truth that texels are made of and compared with."""

from collections.abc import Callable
from typing import Any

import numpy as np

from gtao.kernels.caps import cap_share
from gtao.kernels.cone_lobe import cone_lobe
from gtao.kernels.table_axes import ARGUMENTS
from gtao.kernels.table_axes_cones import aperture
from gtao.kernels.table_axes_lobes import LEAST_ALPHA

from .brdf import TOLERANCE, Quadrature, cone_shares, hemisphere_terms
from .lanes import lanes, numbers

__all__ = ["DISTRIBUTIONS", "value_of"]

DISTRIBUTIONS = ("ggx", "phong")
#: Nodes along half of a cone's rim, and those that tell the error.
LOBE_NODES = 64, 48


def value_of(
    kind: str,
    arguments: tuple[np.ndarray, ...],
    *,
    distribution: str = "ggx",
    brdf: Callable[[float], Callable[[Any, Any], Any]] | None = None,
    tolerance: float = TOLERANCE,
    progress: Callable[[int, int], None] | None = None,
) -> Quadrature:
    """Values (n, C) at arguments of a kind, each (n,), with an estimate of their error (n,).

    Args:
        distribution, brdf, tolerance: see :func:`gtao.tables.bake`.
        progress: called with (done, total).
    """
    given = dict(zip(ARGUMENTS[kind], arguments, strict=True))
    if kind == "environment-brdf":
        return hemisphere_terms(given["alpha"], given["theta_o"], tolerance=tolerance)
    alpha_v, beta, alpha = (given[name] for name in ("alpha_v", "beta", "alpha"))
    if kind.startswith("brdf"):
        chi = given.get("chi", np.zeros_like(beta))
        # What a cone wider than a hemisphere leaves out is a cone about the opposite axis, which has fewer cuts.
        wide = alpha_v > 0.5 * np.pi
        alpha_v, beta_, chi = (np.where(wide, np.pi - x, x) for x in (alpha_v, beta, chi))
        full = alpha_v, beta_, alpha, given.get("theta_o", beta), chi
        if brdf is None:
            found = cone_shares(*full, tolerance=tolerance, progress=progress)
        else:
            found = _materials(full, brdf, tolerance, progress)
        return found._replace(values=np.where(wide[:, None], 1 - found.values, found.values))
    v, b, a = lanes(alpha_v, beta, alpha)
    if kind == "cone-cone":
        return Quadrature(numbers(cap_share(v, aperture(a), b), like=beta)[:, None], np.zeros(len(beta)))
    finer, coarser = (numbers(cone_lobe(v, b, a, distribution, n), like=beta) for n in LOBE_NODES)
    return Quadrature(finer[:, None], np.abs(finer - coarser))


def _materials(arguments, brdf, tolerance, progress):
    """One material per width; a mirror's lobe, which no BRDF of a material has, counts as the narrowest."""
    alpha = np.maximum(arguments[2], LEAST_ALPHA)
    arguments = (*arguments[:2], alpha, *arguments[3:])
    values, error = np.empty((len(alpha), 1)), np.empty(len(alpha))
    done = 0
    for width in np.unique(alpha):
        chosen = alpha == width
        part = cone_shares(*(x[chosen] for x in arguments), brdf=brdf(float(width)), tolerance=tolerance)
        values[chosen], error[chosen] = part.values, part.error
        done += int(np.count_nonzero(chosen))
        if progress is not None:
            progress(done, len(alpha))
    return Quadrature(values, error)
