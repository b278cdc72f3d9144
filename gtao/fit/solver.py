"""Least squares with linear constraints, for one weighting of the clusters or for a thousand of them.

Polynomial forms come down to normal equations, whose matrices are sums over clusters: a bootstrap draw or a
left-out scene is another weighted sum of the same small matrices. Rational forms take Gauss-Newton steps on
the jackknifed sums per level of visibility, which are sums over clusters too. Both end in the quadratic
program of :func:`quadratic`.
"""

from dataclasses import replace

import numpy as np

from gtao.errors import FitError

from .constraints import ConstraintSet, constraint_set
from .forms import Polynomial, Rational, coefficients_of_cubics, fitted_form
from .lattice import Lattice
from .moments import Moments
from .quadratic import definite, quadratic, quadratics

__all__ = ["CUBIC", "Solver"]

#: The cubic of one albedo: a, b, c of ((aV + b)V + c)V.
CUBIC = Polynomial("cubic", (((0, 0, 0, 1), 0), ((0, 0, 1, 0), 0), ((0, 1, 0, 0), 0)), (0, 0, 0, 0))

MAX_STEPS = 60

#: Step of the coefficients at which Gauss-Newton stops: far below any standard error.
CONVERGED = 1e-9


class Solver:
    """Fits one form under one set of constraints to any weighting of the clusters.

    Args:
        form: Name of a fitted form.
        constraints: Names of constraints.
        two_step: Whether to fit a cubic per albedo and then lines through its coefficients.
        naive: Whether to take the noisy means at face value.

    Raises:
        ConfigError: Unknown form or constraint.
    """

    def __init__(self, form: str, constraints: tuple[str, ...], *, two_step: bool = False, naive: bool = False) -> None:
        self.form = fitted_form(form)
        self.constraints = constraint_set(self.form, constraints)
        self.two_step = two_step
        self.naive = naive
        self._cubic = constraint_set(CUBIC, tuple(c for c in constraints if c in ("zero_at_zero", "unit_at_one")))

    def solve(self, moments: Moments, weights: np.ndarray) -> np.ndarray:
        """Coefficients for each weighting.

        Args:
            moments: Of the clusters (C).
            weights: (D, C), not negative; their scale does not matter.

        Returns:
            θ, (D, P); rows of NaN where a weighting leaves the coefficients undetermined.
        """
        if isinstance(self.form, Rational):
            return self._rational(self.form, moments, weights)
        if self.two_step:
            cubics = self.cubics(moments, weights)
            return np.array([coefficients_of_cubics(c, moments.albedos) for c in cubics])
        return self._polynomial(self.form, self.constraints, moments, weights, slice(None))

    def cubics(self, moments: Moments, weights: np.ndarray) -> np.ndarray:
        """a, b, c of the cubic of each albedo alone, (D, R, 3): the first step of the published procedure."""
        per_albedo = [
            self._polynomial(CUBIC, self._cubic, moments, weights, slice(r, r + 1)) for r in range(len(moments.albedos))
        ]
        return np.stack(per_albedo, axis=1)

    def _polynomial(
        self, form: Polynomial, constraints: ConstraintSet, moments: Moments, weights: np.ndarray, part: slice
    ) -> np.ndarray:
        powers = moments.naive_powers if self.naive else moments.powers
        cross = (moments.naive_cross if self.naive else moments.cross)[:, part]
        index = np.arange(4)
        hankel = (weights @ powers)[:, index[:, None] + index]
        design = form.design(moments.albedos[part])
        A = np.einsum("jrp,dpq,krq->djk", design, hankel, design, optimize=True)
        rest = np.tensordot(weights, cross, axes=1) - (hankel @ np.array(form.offset))[:, None, :]
        b = np.einsum("jrp,drp->dj", design, rest)
        return quadratics(A, b, constraints)

    def resolve(self, moments: Moments, weights: np.ndarray, theta: np.ndarray) -> np.ndarray:
        """As :meth:`solve`, for weightings near the one that gave ``theta``: cheap enough for a bootstrap.

        A rational form takes a single Newton step, whose error is of second order in the change of θ; where
        the data do not bend the objective upwards, the step is Gauss and Newton's.
        """
        if isinstance(self.form, Polynomial):
            return self.solve(moments, weights)
        gradient, hessian, newton = _derivatives(self.form, self._sums(moments), moments.albedos, theta)
        hessians, newtons = np.tensordot(weights, hessian, axes=1), np.tensordot(weights, newton, axes=1)
        hessians = np.where(definite(newtons)[:, None, None], newtons, hessians)
        return quadratics(hessians, hessians @ theta - weights @ gradient, self.constraints)

    def _sums(self, moments: Moments) -> list[Lattice]:
        return [replace(moments.lattices[0], factor=1.0)] if self.naive else list(moments.lattices)

    def _rational(self, form: Rational, moments: Moments, weights: np.ndarray) -> np.ndarray:
        sums = self._sums(moments)
        theta = []
        for w in weights:
            pooled = [
                replace(x, weight=w[None] @ x.weight, target=np.tensordot(w[None], x.target, axes=1)) for x in sums
            ]
            theta.append(_gauss_newton(form, self.constraints, pooled, moments.albedos))
        return np.array(theta)


def _gauss_newton(form: Rational, constraints: ConstraintSet, sums: list[Lattice], albedos: np.ndarray) -> np.ndarray:
    """Least squares of a rational form on one cluster; NaN if the data do not determine it."""
    theta = np.array(form.start)
    value = _objective(form, sums, albedos, theta)
    for _ in range(MAX_STEPS):
        gradient, hessian, _ = _derivatives(form, sums, albedos, theta)
        if not definite(hessian)[0]:
            return np.full(theta.shape, np.nan)
        step = quadratic(hessian[0], hessian[0] @ theta - gradient[0], constraints) - theta
        if np.abs(step).max() < CONVERGED:
            return theta
        while (shorter := _objective(form, sums, albedos, theta + step)) >= value:
            step = step / 2
            if np.abs(step).max() < CONVERGED:
                return theta  # no descent is left but rounding
        theta, value = theta + step, shorter
    raise FitError(f"form {form.name!r} did not converge in {MAX_STEPS} Gauss-Newton steps; add paths per pixel")


def _objective(form: Rational, sums: list[Lattice], albedos: np.ndarray, theta: np.ndarray) -> float:
    """Squared error without the part that does not depend on θ, summed over clusters."""
    total = 0.0
    for x in sums:
        f = form.raw(theta, x.levels[:, None], albedos)
        total += x.factor * float(np.sum(f * (f * x.weight[..., None] - 2 * x.target)))
    return total


def _derivatives(
    form: Rational, sums: list[Lattice], albedos: np.ndarray, theta: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Half the gradient of the squared error, (C, P), and half its Hessian, (C, P, P): Gauss and Newton's,
    exact.
    """
    gradient, hessian, newton = 0.0, 0.0, 0.0
    for x in sums:
        V = x.levels[:, None]
        J = form.jacobian(theta, V, albedos)
        residual = form.raw(theta, V, albedos) * x.weight[..., None] - x.target
        gradient = gradient + x.factor * np.einsum("jlr,clr->cj", J, residual)
        bend = residual * form.bend(theta, V, albedos)
        outer = np.einsum("jlr,klr->jklr", J, J)
        hessian = hessian + x.factor * np.einsum("jklr,cl->cjk", outer, x.weight)
        newton = newton + x.factor * np.einsum("jklr,clr->cjk", outer, x.weight[..., None] + bend)
    return np.asarray(gradient), np.asarray(hessian), np.asarray(newton)
