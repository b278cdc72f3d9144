"""What a fitted function must obey, as linear equations and inequalities of its coefficients.

Both families of :mod:`gtao.fit.forms` make every constraint linear: for the rational one (theory, eq. (45))

    V' ≥ V                ⇔  κ(V) ≥ 0
    V' ≤ V + ρ(1 - V)     ⇔  κ(V) (V + ρ(1 - V)) ≤ 1
    dV'/dV ≥ 0            ⇔  ρ (κ(V) - V(1 - V) κ'(V)) ≤ 1.

Inequalities are asked for on a grid of visibility and albedo that covers [0, 1] x [0, 1]: a guarantee for
every albedo, not only for the fitted ones.
"""

from dataclasses import dataclass

import numpy as np

from .forms import Polynomial, Rational

__all__ = ["CONSTRAINTS", "ConstraintSet", "constraint_set"]

#: Names and meanings. The energy bound (theory, eq. (38)) is the maximum principle: no surface of albedo ρ shines
#: brighter than ρ under a white dome, so that the occluded share 1 - V of the sky is worth at most ρ (1 - V).
CONSTRAINTS = {
    "zero_at_zero": "V'(0) = 0; every form has it",
    "unit_at_one": "V'(1) = 1 at every albedo",
    "above_visibility": "V' ≥ V: bounces add light",
    "monotone": "V' does not fall where V rises",
    "energy": "V' ≤ V + ρ(1 - V): no light out of nothing",
}

#: Cells of the grid; between its lines a constraint can be missed by the sagitta of a cell, V'' h²/8 ≈ 2e-5. What is
#: straight in the albedo needs its two ends only.
VISIBILITY_CELLS = 256
ALBEDO_CELLS = 32


@dataclass(frozen=True, eq=False)
class ConstraintSet:
    """E θ = d and G θ ≥ h.

    Attributes:
        E: (equations, P).
        d: (equations,).
        G: (inequalities, P).
        h: (inequalities,).
        labels: Name of the constraint of each inequality.
    """

    E: np.ndarray
    d: np.ndarray
    G: np.ndarray
    h: np.ndarray
    labels: np.ndarray

    def active(self, theta: np.ndarray, tolerance: float = 1e-7) -> tuple[str, ...]:
        """Names of the inequalities that bind at the coefficients: those with no slack but rounding."""
        binding = self.G @ theta - self.h < tolerance
        return tuple(sorted(set(self.labels[binding].tolist())))


def constraint_set(form: Polynomial | Rational, names: tuple[str, ...]) -> ConstraintSet:
    """Constraints of a form.

    Args:
        form: The form.
        names: Keys of :data:`CONSTRAINTS`.

    Returns:
        The equations and inequalities. A rational form always gets those that keep it finite: ρ(1 - V) κ(V) ≤
        1.
    """
    curved = isinstance(form, Polynomial) and max(m for _, m in form.terms) > 1
    lines = np.linspace(0, 1, ALBEDO_CELLS + 1) if curved else np.array([0.0, 1.0])
    grid = np.meshgrid(np.linspace(0, 1, VISIBILITY_CELLS + 1), lines, indexing="ij")
    V, rho = (axis.ravel() for axis in grid)
    if isinstance(form, Polynomial):
        E, d = _unit_at_one(form) if "unit_at_one" in names else (np.zeros((0, form.n_coefficients)), np.zeros(0))
        rows = _polynomial_rows(form, names, V, rho)
    else:
        E, d = np.zeros((0, form.n_coefficients)), np.zeros(0)
        rows = _rational_rows(form, names, V, rho)
    G, h, labels = [np.zeros((0, form.n_coefficients))], [np.zeros(0)], []
    for label, left, right in rows:
        # Rows without coefficients (V = 0, ρ = 0, …) say nothing that a fit could change.
        some = np.abs(left).max(axis=0) > 1e-12
        G.append(left[:, some].T)
        h.append(np.broadcast_to(right, V.shape)[some])
        labels += [label] * int(some.sum())
    return ConstraintSet(E, d, np.concatenate(G), np.concatenate(h), np.array(labels, dtype=object))


def _unit_at_one(form: Polynomial) -> tuple[np.ndarray, np.ndarray]:
    """f(1, ρ) = 1 for every ρ: one equation per power of ρ."""
    at_one = np.array([sum(p) for p, _ in form.terms])
    power = np.array([m for _, m in form.terms])
    rows, right = [], []
    for m in np.unique(power):
        row = np.where(power == m, at_one, 0.0)
        if np.any(row):
            rows.append(row)
            right.append(1.0 - sum(form.offset) if m == 0 else 0.0)
    return np.array(rows).reshape(-1, len(at_one)), np.array(right)


def _polynomial_rows(form: Polynomial, names: tuple[str, ...], V: np.ndarray, rho: np.ndarray) -> list:
    offset = np.polynomial.polynomial.polyval(V, form.offset)
    slope = np.polynomial.polynomial.polyval(V, np.polynomial.polynomial.polyder(np.array(form.offset)))
    basis = form.basis(V, rho)
    rows = []
    if "above_visibility" in names:
        rows.append(("above_visibility", basis, V - offset))
    if "monotone" in names:
        rows.append(("monotone", form.slopes(V, rho), -slope))
    if "energy" in names:
        rows.append(("energy", -basis, offset - V - rho * (1 - V)))
    return rows


def _rational_rows(form: Rational, names: tuple[str, ...], V: np.ndarray, rho: np.ndarray) -> list:
    kappa = form.kappa_basis(V)
    slope = np.array([j * V ** max(j - 1, 0) for j in range(form.n_coefficients)])
    rows = [("finite", -kappa * (1 - V), -1.0)]
    if "above_visibility" in names:
        rows.append(("above_visibility", kappa, 0.0))
    if "monotone" in names:
        rows.append(("monotone", -rho * (kappa - V * (1 - V) * slope), -1.0))
    if "energy" in names:
        rows.append(("energy", -kappa * (V + rho * (1 - V)), -1.0))
    return rows
