"""Quadratic programs of a handful of coefficients and thousands of inequalities, of which few ever bind."""

import numpy as np
from scipy import linalg, optimize

from gtao.errors import FitError

from .constraints import ConstraintSet

__all__ = ["UNDETERMINED", "definite", "quadratic", "quadratics"]

#: Normal matrices whose extreme eigenvalues, after scaling to unit diagonal, differ by more determine
#: nothing.
MAX_CONDITION = 1e10

#: Largest violation of an inequality that counts as rounding.
FEASIBLE = 1e-9

MAX_ROUNDS = 50


def quadratic(A: np.ndarray, b: np.ndarray, constraints: ConstraintSet) -> np.ndarray:
    """Minimise θᵀAθ/2 - bᵀθ subject to E θ = d, G θ ≥ h.

    Equations are solved away, the rest is a least-distance program, solved by non-negative least squares
    (Lawson and Hanson 1974, ch. 23) on the few inequalities that were found violated; more are added until
    none is.

    Args:
        A: Positive definite on the null space of E, (P, P).
        b: (P,).
        constraints: E, d, G, h.

    Returns:
        θ, (P,).

    Raises:
        FitError: A is not positive definite there, or the constraints contradict each other.
    """
    start, null = _equations(constraints, len(b))
    reduced = null.T @ A @ null
    if not definite(reduced[None])[0]:
        raise FitError(UNDETERMINED)
    factor = np.linalg.cholesky(reduced)
    centre = linalg.cho_solve((factor, True), null.T @ (b - A @ start))
    theta = start + null @ centre
    slack = constraints.G @ theta - constraints.h
    if slack.size == 0 or slack.min() >= -FEASIBLE:
        return theta
    # Coordinates in which the objective is the squared length: t = centre + L^-T x.
    rows = linalg.solve_triangular(factor, (constraints.G @ null).T, lower=True).T
    used = np.zeros(len(slack), bool)
    for _ in range(MAX_ROUNDS):
        worst = np.argsort(slack)[:4]
        used[worst[slack[worst] < -FEASIBLE]] = True
        x = _least_distance(rows[used], -(constraints.G[used] @ (start + null @ centre) - constraints.h[used]))
        theta = start + null @ (centre + linalg.solve_triangular(factor, x, lower=True, trans="T"))
        slack = constraints.G @ theta - constraints.h
        if slack.min() >= -FEASIBLE:
            return theta
    raise FitError("the constraints leave no room for a solution; drop one of them")


UNDETERMINED = (
    "the data do not determine the coefficients: visibility takes too few values, or its noise is as large "
    "as its spread; add scenes or paths per pixel, or fit a form with fewer parameters"
)


def _least_distance(G: np.ndarray, h: np.ndarray) -> np.ndarray:
    """The shortest x with G x ≥ h."""
    scale = np.maximum(np.linalg.norm(G, axis=1), 1e-300)
    E = np.vstack([(G / scale[:, None]).T, h / scale])
    f = np.zeros(len(E))
    f[-1] = 1.0
    residual = E @ optimize.nnls(E, f)[0] - f
    if -residual[-1] < 1e-14:
        raise FitError("the constraints contradict each other; drop one of them")
    return -residual[:-1] / residual[-1]


def _equations(constraints: ConstraintSet, n: int) -> tuple[np.ndarray, np.ndarray]:
    """A solution of E θ = d and a basis of the null space of E."""
    if len(constraints.d) == 0:
        return np.zeros(n), np.eye(n)
    return np.linalg.lstsq(constraints.E, constraints.d)[0], linalg.null_space(constraints.E)


def definite(A: np.ndarray) -> np.ndarray:
    """Which of the matrices (D, P, P) are safely positive definite."""
    diagonal = np.einsum("dii->di", A)
    positive = np.all(diagonal > 0, axis=1)
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    values = np.linalg.eigvalsh(A * scale[:, :, None] * scale[:, None, :])
    return positive & (values[:, 0] > values[:, -1] / MAX_CONDITION)


def quadratics(A: np.ndarray, b: np.ndarray, constraints: ConstraintSet) -> np.ndarray:
    """:func:`quadratic` for many (A, b): only those that violate an inequality are solved one by one."""
    start, null = _equations(constraints, b.shape[1])
    reduced = null.T @ A @ null
    good = definite(reduced)
    theta = np.full(b.shape, np.nan)
    right = (b[good] - A[good] @ start) @ null
    theta[good] = start + np.linalg.solve(reduced[good], right[..., None])[..., 0] @ null.T
    if len(constraints.h):
        worst = np.min(theta @ constraints.G.T - constraints.h, axis=1)
        for i in np.flatnonzero(worst < -FEASIBLE):
            theta[i] = quadratic(A[i], b[i], constraints)
    return theta
