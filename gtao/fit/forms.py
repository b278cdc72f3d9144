"""The families of functions that are fitted: multi-bounce visibility V' from visibility V and albedo ρ.

Two families cover all of them, and in both every constraint is linear in the coefficients:

- polynomials, V' = offset(V) + Σ_j θ_j p_j(V) ρ^m_j, linear in the coefficients: ``linear_cubic`` (Jimenez et
  al. 2016, Eq. 10) and ``four_parameter``; - rationals V / (1 - ρ (1 - V) κ(V)) with κ linear in the
  coefficients: ``one_parameter`` and ``two_parameter``. With κ = 1 they are the closed form of the
  integrating sphere, where every point sees the same share of the sky.

``sphere`` and ``sphere_truncated`` have nothing to fit. Everything here is NumPy in float64.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gtao.data.multibounce import FORM_PARAMETERS, MultibounceFit
from gtao.errors import ConfigError

__all__ = ["FITTED_FORMS", "Polynomial", "Rational", "coefficients_of_cubics", "evaluate", "fitted_form"]


@dataclass(frozen=True)
class Polynomial:
    """A form that is linear in its coefficients.

    Attributes:
        name: Key of ``FORM_PARAMETERS``.
        terms: One per coefficient: the polynomial p(V) by ascending powers (4,), and the power of ρ.
        offset: The part without coefficients, by ascending powers of V (4,).
    """

    name: str
    terms: tuple[tuple[tuple[float, float, float, float], int], ...]
    offset: tuple[float, float, float, float]

    @property
    def n_coefficients(self) -> int:
        """Number of coefficients."""
        return len(self.terms)

    def design(self, albedos: np.ndarray) -> np.ndarray:
        """Powers of V that each coefficient multiplies at each albedo: (coefficients, albedos, 4)."""
        return np.array([np.outer(albedos**m, p) for p, m in self.terms])

    def basis(self, V: np.ndarray, rho: np.ndarray) -> np.ndarray:
        """What each coefficient multiplies, (coefficients, …)."""
        return np.array([np.polynomial.polynomial.polyval(V, p) * rho**m for p, m in self.terms])

    def slopes(self, V: np.ndarray, rho: np.ndarray) -> np.ndarray:
        """Derivative of :meth:`basis` by V."""
        derivative = np.polynomial.polynomial.polyder
        polyval = np.polynomial.polynomial.polyval
        return np.array([polyval(V, derivative(np.array(p))) * rho**m for p, m in self.terms])

    def raw(self, theta: np.ndarray, V: np.ndarray, rho: np.ndarray) -> np.ndarray:
        """The polynomial itself: what the normal equations fit, before the ``max`` of ``linear_cubic``."""
        offset = np.polynomial.polynomial.polyval(V, self.offset)
        return offset + np.tensordot(theta, self.basis(V, rho), axes=1)


@dataclass(frozen=True)
class Rational:
    """A form V / (1 - ρ (1 - V) κ(V)), κ(V) = Σ_j θ_j V^j.

    Attributes:
        name: Key of ``FORM_PARAMETERS``.
        n_coefficients: Number of coefficients of κ.
        start: Coefficients to start the fit from.
    """

    name: str
    n_coefficients: int
    start: tuple[float, ...]

    def kappa_basis(self, V: np.ndarray) -> np.ndarray:
        """What each coefficient multiplies in κ, (coefficients, …)."""
        return np.array([V**j for j in range(self.n_coefficients)])

    def raw(self, theta: np.ndarray, V: np.ndarray, rho: np.ndarray) -> np.ndarray:
        """The function; 1 where ρ (1 - V) κ(V) = 1, its limit if nothing is absorbed and nothing seen."""
        return _ratio(V, 1 - rho * (1 - V) * np.tensordot(theta, self.kappa_basis(V), axes=1))

    def jacobian(self, theta: np.ndarray, V: np.ndarray, rho: np.ndarray) -> np.ndarray:
        """Derivatives by the coefficients, (coefficients, …)."""
        basis = self.kappa_basis(V)
        remaining = 1 - rho * (1 - V) * np.tensordot(theta, basis, axes=1)
        return basis * (V * rho * (1 - V) / remaining**2)

    def bend(self, theta: np.ndarray, V: np.ndarray, rho: np.ndarray) -> np.ndarray:
        """Factor q of the second derivatives, ∂²V'/∂θj∂θk = q ∂V'/∂θj ∂V'/∂θk; 0 at V = 0."""
        remaining = 1 - rho * (1 - V) * np.tensordot(theta, self.kappa_basis(V), axes=1)
        return 2 * remaining / np.where(V > 0, V, np.inf)


def _linear_cubic() -> Polynomial:
    powers = {"a": (0.0, 0.0, 0.0, 1.0), "b": (0.0, 0.0, 1.0, 0.0), "c": (0.0, 1.0, 0.0, 0.0)}
    return Polynomial(
        "linear_cubic",
        tuple((powers[name[0]], int(name[1])) for name in FORM_PARAMETERS["linear_cubic"]),
        (0.0, 0.0, 0.0, 0.0),
    )


def _four_parameter() -> Polynomial:
    # V (1 - V) and V² (1 - V); k0, k1 go with ρ, k2, k3 with ρ².
    first, second = (0.0, 1.0, -1.0, 0.0), (0.0, 0.0, 1.0, -1.0)
    return Polynomial("four_parameter", ((first, 1), (second, 1), (first, 2), (second, 2)), (0.0, 1.0, 0.0, 0.0))


#: Forms that have something to fit.
FITTED_FORMS: dict[str, Polynomial | Rational] = {
    "linear_cubic": _linear_cubic(),
    "four_parameter": _four_parameter(),
    "one_parameter": Rational("one_parameter", 1, (0.85,)),
    "two_parameter": Rational("two_parameter", 2, (0.85, 0.0)),
}


def fitted_form(name: str) -> Polynomial | Rational:
    """Look a form up by name.

    Raises:
        ConfigError: There is no such form, or it has no coefficients to fit.
    """
    if name in FITTED_FORMS:
        return FITTED_FORMS[name]
    if name in FORM_PARAMETERS:
        raise ConfigError(f"form {name!r} has no coefficients to fit; compare_forms scores it as it is")
    raise ConfigError(f"unknown form {name!r}; choose one of {', '.join(FITTED_FORMS)}")


def evaluate(fit: MultibounceFit, visibility: ArrayLike, albedo: ArrayLike) -> np.ndarray:
    """Multi-bounce visibility of a fit, in NumPy and float64.

    Args:
        fit: Published or refitted coefficients.
        visibility: V in [0, 1].
        albedo: ρ in [0, 1], broadcastable to the visibility.

    Returns:
        V', of the broadcast shape; ``linear_cubic`` is max(V, cubic) as published.
    """
    V, rho = np.broadcast_arrays(np.asarray(visibility, float), np.asarray(albedo, float))
    if fit.form == "sphere":
        return _ratio(V, 1 - rho * (1 - V))
    if fit.form == "sphere_truncated":
        ratio = rho * (1 - V)
        return V * sum(ratio**k for k in range(round(fit.coefficients[0])))
    form = fitted_form(fit.form)
    value = form.raw(np.asarray(fit.coefficients, float), V, rho)
    return np.maximum(V, value) if fit.form == "linear_cubic" else value


def _ratio(V: np.ndarray, absorbed: np.ndarray) -> np.ndarray:
    """V / absorbed, and 1 where both vanish: the limit along ρ = 1."""
    vanishes = absorbed <= 0
    return np.where(vanishes, 1.0, V / np.where(vanishes, 1.0, absorbed))


def coefficients_of_cubics(cubics: np.ndarray, albedos: np.ndarray) -> np.ndarray:
    """Second step of the published procedure: a, b, c of the cubics as straight lines in the albedo.

    Args:
        cubics: a, b, c of ((aV + b)V + c)V at each albedo, (albedos, 3).
        albedos: Albedos, (albedos,), at least two different ones.

    Returns:
        The coefficients of ``linear_cubic``: slope and intercept of a, of b, of c.
    """
    slope, intercept = np.polynomial.polynomial.polyfit(albedos, cubics, 1)[::-1]
    return np.column_stack([slope, intercept]).ravel()
