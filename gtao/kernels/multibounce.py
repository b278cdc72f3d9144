"""Multi-bounce visibility V'(V, ρ) of one colour channel, in every form that can be fitted.

V is cosine-weighted visibility in [0, 1], ρ the albedo of the neighbourhood in [0, 1]. Every form is 0 at V = 0 and
1 at V = 1 (the published cubic to within 5e-4).
"""

import drjit as dr

__all__ = ["evaluate"]


def linear_cubic(coefficients, V, rho):
    """Cubic in V whose coefficients are linear in ρ (Jimenez et al. 2016, Eq. 10; theory, eq. (41)), never below V."""
    a1, a0, b1, b0, c1, c0 = coefficients
    a = dr.fma(rho, a1, a0)
    b = dr.fma(rho, b1, b0)
    c = dr.fma(rho, c1, c0)
    f = dr.fma(dr.fma(a, V, b), V, c) * V
    return dr.select(f >= V, f, V)


def four_parameter(coefficients, V, rho):
    """V + ρ V (1 - V) (k0 + k1 V + ρ (k2 + k3 V)): equals V at ρ = 0 and 1 at V = 1 by construction.

    It is theory, eq. (42).
    """
    k0, k1, k2, k3 = coefficients
    return dr.fma(rho * V * (1 - V), dr.fma(V, k1, k0) + rho * dr.fma(V, k3, k2), V)


def _ratio(V, rho, denominator):
    """V over the share of light that leaves; past the pole the energy bound V + ρ (1 - V) is all that limits it."""
    return dr.select(denominator > 0, V / denominator, dr.fma(rho, 1 - V, V))


def one_parameter(coefficients, V, rho):
    """V / (1 - κ ρ (1 - V)): an integrating sphere that keeps the share κ of the reflected light; theory, eq. (43)."""
    (kappa,) = coefficients
    return _ratio(V, rho, 1 - kappa * rho * (1 - V))


def two_parameter(coefficients, V, rho):
    """V / (1 - ρ (1 - V) (κ0 + κ1 V)); theory, eq. (43)."""
    kappa0, kappa1 = coefficients
    return _ratio(V, rho, 1 - rho * (1 - V) * dr.fma(V, kappa1, kappa0))


def sphere(coefficients, V, rho):
    """V / (1 - ρ (1 - V)): exact in an integrating sphere with open fraction V; theory, eq. (39)."""
    return _ratio(V, rho, 1 - rho * (1 - V))


def sphere_truncated(coefficients, V, rho):
    """V Σ_{k<n} (ρ (1 - V))^k: the integrating sphere after n bounces; theory, eq. (39)."""
    (n,) = coefficients
    q = rho * (1 - V)
    total = q * 0 + 1
    for _ in range(int(n) - 1):
        total = dr.fma(total, q, 1)
    return V * total


FORMS = {
    "linear_cubic": linear_cubic,
    "four_parameter": four_parameter,
    "one_parameter": one_parameter,
    "two_parameter": two_parameter,
    "sphere": sphere,
    "sphere_truncated": sphere_truncated,
}


def evaluate(form, coefficients, V, rho):
    """V' of ``form`` with its ``coefficients`` (floats or Dr.Jit floats)."""
    return FORMS[form](coefficients, V, rho)
