"""Horizon-based ambient occlusion of one direction: golden values, the published formulas, the line of the tangent."""

import numpy as np
import pytest
from oracles import golden, slice_oracle

import drjit as dr  # isort: skip

from gtao.kernels import hbao, slices


def vector(precision, v):
    return tuple(precision.Float(float(x)) for x in v)


def slope(n, theta):
    """t = -arctan((n_x cos θ + n_y sin θ) / n_z), seen along parallel rays from +z."""
    return np.arctan(-(n[0] * np.cos(theta) + n[1] * np.sin(theta)) / n[2])


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("F.tangent"))
def test_tangent_golden(precision, inputs, outputs):
    n, theta = slice_oracle.unit(inputs["n"]), inputs["theta"]
    left = hbao.left_of(precision.Float(np.cos(theta)), precision.Float(np.sin(theta)))
    got = hbao.tangent(vector(precision, n), left, (0, 0, 1))[0]
    assert np.arcsin(got) == pytest.approx(outputs["t"], abs=precision.tolerance)


def march(precision, t, radius, samples):
    """(sin h, single horizon, per sample, no attenuation) of samples (|D_xy|, D_z), outward."""
    Float = precision.Float
    start = Float(float(np.sin(t)))
    h, w_h, blocked = start, Float(0), Float(0)
    everything = Float(0)
    for run, rise in samples:
        r = np.hypot(run, rise)
        c = Float(float(rise / r)) if r <= radius else Float(float("nan"))
        w = hbao.attenuation(Float(float(r * r)), Float(1 / radius))
        before = h
        h, blocked = hbao.by_sample(c, w, before, blocked)
        again, w_h = hbao.by_horizon(c, w, before, w_h)
        _, everything = hbao.by_sample(c, 1, before, everything)
        assert again[0] == h[0]
    return h[0], ((h - start) * w_h)[0], blocked[0], everything[0]


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("F.direction"))
def test_direction_golden(precision, inputs, outputs):
    h, single, per_sample, plain = march(precision, inputs["t"], inputs["R"], inputs["samples"])
    assert np.arcsin(h) == pytest.approx(outputs["h"], abs=precision.tolerance)
    assert single == pytest.approx(outputs["occ_single_horizon"], abs=precision.tolerance)
    assert per_sample == pytest.approx(outputs["occ_per_sample"], abs=precision.tolerance)
    assert plain == pytest.approx(outputs["occ_no_attenuation"], abs=precision.tolerance)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("F.integral"))
def test_integral_golden(precision, inputs, outputs):
    """Horizon c + Σ a cos(kθ + p) from the zenith, horizon points at distance r0 + r1 cos(θ - δ).

    The integrand is smooth and periodic: the mean over 256 directions is exact.
    """
    n = 256
    theta = 2 * np.pi * (np.arange(n) + 0.5) / n
    normal = vector(precision, slice_oracle.unit(inputs["N"]))
    c, s = precision.lanes(np.cos(theta)), precision.lanes(np.sin(theta))
    t = hbao.tangent(normal, hbao.left_of(c, s), (0, 0, 1))
    polar = np.clip(slice_oracle.harmonic_horizon(inputs["c"], inputs["harmonics"])(theta), 0, np.pi)
    r = inputs["r0"] + inputs["r1"] * np.cos(theta - inputs["delta"])
    sine, w = precision.lanes(np.cos(polar)), hbao.attenuation(precision.lanes(r * r), 1 / inputs["R"])
    h, w_h = hbao.by_horizon(sine, w, t, precision.Float(0))
    got = {"A_no_attenuation": h - t, "A_attenuated": (h - t) * w_h}
    for name in ("A_no_attenuation", "A_attenuated"):
        visible = 1 - np.mean(np.array(got[name], dtype=np.float64))
        assert visible == pytest.approx(outputs[name], abs=precision.tolerance)


def test_tangent_is_where_eye_rays_meet_the_tangent_plane(precision):
    """Perspective, any zenith: the elevation of the point in which the eye ray a little ahead meets the plane."""
    rng = np.random.default_rng(3)
    for _ in range(40):
        a = np.array([*rng.uniform(-1, 1, 2), -1.0])
        P = rng.uniform(1, 5) * a
        n = slice_oracle.unit(rng.normal(size=3))
        n = n if n @ P < 0 else -n
        if n @ slice_oracle.unit(-P) < 0.1:
            continue
        u = slice_oracle.unit(rng.normal(size=2))
        ahead = a + 1e-3 * np.array([*u, 0.0])
        line = slice_oracle.unit(ahead * (n @ P) / (n @ ahead) - P)
        left = hbao.left_of(*(precision.Float(float(v)) for v in (*u, *a[:2])))
        for zenith in (slice_oracle.unit(-P), np.array([0.0, 0.0, 1.0])):
            got = hbao.tangent(vector(precision, n), left, vector(precision, zenith))[0]
            assert got == pytest.approx(line @ zenith, abs=max(precision.tolerance, 1e-8))


def test_tangent_about_the_view_vector_starts_the_horizon_search(precision):
    rng = np.random.default_rng(4)
    P = np.array([0.7, -0.4, -1.3])
    V = slice_oracle.unit(-P)
    for phi in rng.uniform(0, np.pi, 20):
        n = slice_oracle.unit(V + 0.8 * slice_oracle.unit(rng.normal(size=3)))
        T = slice_oracle.tangent(V, phi)
        u = T[:2] - T[2] * P[:2] / P[2]
        left = hbao.left_of(*(precision.Float(float(v)) for v in (*u, *(P[:2] / -P[2]))))
        ahead = hbao.tangent(vector(precision, n), left, vector(precision, V))
        behind, start = slices.clamped_start(precision.Float(float(n @ V)), precision.Float(float(n @ T)))
        assert ahead[0] == pytest.approx(start[0], abs=precision.tolerance)
        assert ahead[0] == pytest.approx(-behind[0], abs=precision.tolerance)


def test_random_marches_against_branches(precision):
    """Both attenuations as their authors write them, with branches and angles."""
    rng = np.random.default_rng(5)
    changed = 0
    for _ in range(60):
        t, radius = rng.uniform(-1.2, 1.2), 2.0
        samples = np.stack([np.sort(rng.uniform(0.1, 2.5, 8)), rng.uniform(-1.5, 1.5, 8)], axis=1)
        h = np.sin(t)
        single = per_sample = 0.0
        for run, rise in samples:
            r = np.hypot(run, rise)
            sine = np.sin(np.arctan2(rise, run))
            if r > radius or sine <= h:
                continue
            per_sample += (sine - h) * (1 - r / radius)
            h = sine
            single = (h - np.sin(t)) * (1 - r / radius)
        got = march(precision, t, radius, samples)
        assert got == pytest.approx((h, single, per_sample, h - np.sin(t)), abs=precision.tolerance)
        changed += per_sample - single > 0.1
    assert changed > 5


def test_attenuation_ends_at_the_radius(precision):
    got = hbao.attenuation(precision.lanes(np.square([0, 0.5, 1, 2, 3])), 0.5)
    assert list(got) == pytest.approx([1, 0.75, 0.5, 0, 0], abs=precision.tolerance)
    assert dr.all(got >= 0)
