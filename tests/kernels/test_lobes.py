"""Half angles of cones that stand for lobes of reflection."""

import numpy as np
import pytest
from oracles import golden

import drjit as dr  # isort: skip

from gtao.kernels import cones, lobes


def test_golden(precision):
    cases = golden.cases("E.aperture")
    A, r, p = (precision.lanes([i[k] for i, _ in cases]) for k in ("A", "r", "p"))
    want = {name: np.array([o[name] for _, o in cases]) for name in cases[0][1]}
    width = lobes.alpha_of_power(p)
    got = {
        "cos_alpha_v_cosine": cones.aperture(A),
        "cos_alpha_v_uniform": cones.uniform_aperture(A),
        "cos_alpha_s_from_r": dr.cos(lobes.power_aperture(r)),
        "p_from_r": lobes.power_of_alpha(r),
        "r_from_p": width,
        "alpha_s_ours_p": lobes.power_aperture(width),
        "alpha_s_drobot_p": lobes.drobot_aperture(width),
        "alpha_s_uludag_p": lobes.uludag_aperture(width),
    }
    for name, value in got.items():
        assert np.array(value) == pytest.approx(want[name], rel=precision.tolerance, abs=precision.tolerance), name


@pytest.mark.parametrize("u", [0.001, 0.01, 0.3])
def test_the_cone_leaves_the_share_of_the_power_lobe(precision, u):
    """∫ cos^(p + 1) over what is outside, of half vectors as the distribution weighs them: the share u."""
    alpha = np.array([0.1, 0.3, 0.8, 1.0])
    half = np.array(lobes.power_aperture(precision.lanes(alpha), u), dtype=float)
    p = 2 / alpha**2 - 2
    x, w = np.polynomial.legendre.leggauss(400)
    for k in range(4):
        # As an integral over t = cos θ from 0 to cos α_s; its whole is 1 / (p + 2).
        t = np.cos(half[k]) * (x + 1) / 2
        outside = np.sum(w * t ** (p[k] + 1)) * np.cos(half[k]) / 2 * (p[k] + 2)
        assert outside == pytest.approx(u, rel=1e-3 if precision.name == "float32" else 1e-10)


def test_power_and_width_are_inverse(precision):
    alpha = np.array([2e-3, 0.1, 0.5, 1.0])
    back = lobes.alpha_of_power(lobes.power_of_alpha(precision.lanes(alpha)))
    assert np.array(back) == pytest.approx(alpha, rel=precision.tolerance)
    assert np.isfinite(np.array(lobes.power_of_alpha(precision.lanes([0.0])))).all()


def test_half_angles_of_narrow_lobes_keep_their_digits(precision):
    """cos α_s rounds to 1 in single precision for widths below 1e-4; α_s is √(ln 1/u) α there."""
    alpha = 10.0 ** -np.arange(2, 9)
    power, uludag = (
        np.array(f(precision.lanes(alpha)), dtype=float) for f in (lobes.power_aperture, lobes.uludag_aperture)
    )
    x = 0.5 * alpha**2 * np.log(100)
    assert power == pytest.approx(np.arctan(np.sqrt(np.expm1(2 * x))), rel=precision.tolerance)
    x = alpha**2 / (2 - alpha**2) * np.log(1 / 0.244)
    assert uludag == pytest.approx(np.arctan(np.sqrt(np.expm1(2 * x))), rel=precision.tolerance)
    assert power == pytest.approx(np.sqrt(np.log(100)) * alpha, rel=1e-3)


@pytest.mark.parametrize("name", ["power_aperture", "drobot_aperture", "uludag_aperture"])
def test_derivatives_down_to_mirrors(precision, name):
    f = getattr(lobes, name)
    values = np.array([0.0, 1e-7, 1e-3, 0.02, 0.1, 0.5, 1.0])
    alpha = precision.lanes(values)
    dr.enable_grad(alpha)
    dr.backward(dr.sum(f(alpha)))
    Float = dr.float64_array_t(precision.Float)
    h = 1e-6
    want = (np.array(f(Float(values + h))) - np.array(f(Float(values - h)))) / (2 * h)
    assert np.array(dr.grad(alpha)) == pytest.approx(want, rel=1e-5)


def test_derivative_of_the_share(precision):
    u = precision.lanes([0.005, 0.01, 0.2])
    dr.enable_grad(u)
    dr.backward(dr.sum(lobes.power_aperture(precision.lanes([0.3, 0.5, 1.0]), u)))
    Float = dr.float64_array_t(precision.Float)
    at, h = np.array([0.005, 0.01, 0.2]), 1e-7
    up, down = (np.array(lobes.power_aperture(Float([0.3, 0.5, 1.0]), Float(at + s * h))) for s in (1, -1))
    assert np.array(dr.grad(u)) == pytest.approx((up - down) / (2 * h), rel=1e-4)
