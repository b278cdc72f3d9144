"""Reflection of rough surfaces: normalisation, a second way to write each term, narrow lobes, corners, derivatives."""

import numpy as np
import pytest
from oracles import golden
from oracles import specular as oracle

import drjit as dr  # isort: skip

from gtao.kernels import microfacet


def vectors(precision, rows):
    return [precision.lanes(column) for column in np.transpose(rows)]


def directions(n, seed, least=0.0):
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(least, 1, n), rng.uniform(-np.pi, np.pi, n)
    s = np.sqrt(1 - z * z)
    return np.stack([s * np.cos(phi), s * np.sin(phi), z], axis=-1)


@pytest.mark.parametrize("alpha", [0.01, 0.1, 0.5, 1.0])
def test_distributions_weigh_the_hemisphere_by_one(precision, alpha):
    """∫ D cos θ_h dω_h = 1, over rings finer toward the normal."""
    edges = [0.0, *(alpha * 2.0**k for k in range(-3, 12) if alpha * 2.0**k < np.pi / 2), np.pi / 2]
    theta, w = oracle.panels(edges)
    w = w * 2 * np.pi * np.cos(theta) * np.sin(theta)
    sine = microfacet.ggx_of_sine(precision.lanes(np.sin(theta) ** 2), alpha)
    assert w @ np.array(sine, dtype=float) == pytest.approx(1, abs=precision.tolerance)
    # A cosine of single precision leaves 1e-7 of the squared sine.
    rounding = 6e-8 / alpha**2 if precision.name == "float32" else 1e-9
    for f in (microfacet.ggx, microfacet.phong):
        assert w @ np.array(f(precision.lanes(np.cos(theta)), alpha), dtype=float) == pytest.approx(1, abs=2 * rounding)
        assert np.array(f(precision.lanes([-0.1, 0.0]), alpha)).tolist() == [0, 0]


def test_terms_against_the_definition(precision):
    for alpha in (0.05, 0.4, 1.0):
        wi, wo = directions(2000, 1), directions(2000, 2, 0.05)
        got = np.array(microfacet.brdf_terms(vectors(precision, wi), vectors(precision, wo), alpha), dtype=float)
        want = np.stack(oracle.brdf(wi, wo, alpha))
        assert got == pytest.approx(want, rel=1e-4, abs=precision.tolerance)


def test_narrow_lobes_keep_their_digits(precision):
    """Half vectors 1e-4 from the normal, whose cosine rounds to 1: what counts is how well directions are mirrored."""
    alpha = 1e-3
    theta, phi = np.meshgrid(alpha * np.linspace(-3, 3, 13), [0.0, 1.0, 2.0])
    theta, phi = theta.ravel(), phi.ravel()
    h = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    wo = np.array([-0.6, 0, 0.8])
    wi = 2 * (h @ wo)[:, None] * h - wo
    kind = np.float32 if precision.name == "float32" else np.float64
    wi, wo = wi.astype(kind).astype(float), np.broadcast_to(wo.astype(kind).astype(float), wi.shape)
    a, _ = microfacet.brdf_terms(vectors(precision, wi), vectors(precision, wo), alpha)
    want = oracle.brdf(wi, wo, alpha)[0]
    peak = 1 / (4 * np.pi * alpha**2)
    # The oracle's cosine of h rounds to 1e-16 / α²; the kernel's sum wi + wo to 1e-7 / α.
    assert np.array(a) / peak == pytest.approx(want / peak, abs=5e-4 if precision.name == "float32" else 1e-9)


def test_reciprocity(precision):
    wi, wo = directions(500, 3, 0.02), directions(500, 4, 0.02)
    there = np.array(microfacet.brdf_terms(vectors(precision, wi), vectors(precision, wo), 0.3), dtype=float)
    back = np.array(microfacet.brdf_terms(vectors(precision, wo), vectors(precision, wi), 0.3), dtype=float)
    assert there / wi[:, 2] == pytest.approx(back / wo[:, 2], rel=1e-4, abs=precision.tolerance)


def test_what_a_white_dome_gives_golden(precision):
    """A, B: the integral of the kernel's terms over the oracle's directions."""
    for i, want in golden.cases("E.full_brdf"):
        wo, _, _ = oracle.geometry(0.0, 0.0, i["theta_o"])
        theta, w = oracle.panels([0.0, *sorted({0.2, 0.5 * i["theta_o"], i["theta_o"], 1.4}), np.pi / 2])
        phi = 2 * np.pi * (np.arange(256) + 0.5) / 256
        t, f = (x.ravel() for x in np.meshgrid(theta, phi, indexing="ij"))
        wi = np.stack([np.sin(t) * np.cos(f), np.sin(t) * np.sin(f), np.cos(t)], axis=-1)
        lanes = vectors(precision, wi), [precision.lanes(np.full(len(wi), x)) for x in wo]
        a, b = np.array(microfacet.brdf_terms(*lanes, i["alpha"]), dtype=float)
        weight = np.repeat(w * np.sin(theta), 256) * (2 * np.pi / 256)
        tolerance = max(precision.tolerance, 1e-8)
        assert weight @ a == pytest.approx(want["A"], abs=tolerance)
        assert weight @ b == pytest.approx(want["B"], abs=tolerance)


def corner_directions():
    rows = [(0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 0, -1), (0.6, 0, 0.8), (-0.6, 0, 0.8), (-0.6, 0, -0.8)]
    rows += [(1, 0, 1e-9), (-1, 0, 1e-9), (0.8, 0.6, 1e-4)]
    pairs = [(a, b) for a in rows for b in rows]
    return np.array([a for a, _ in pairs], float), np.array([b for _, b in pairs], float)


@pytest.mark.parametrize("alpha", [0.0, 1e-6, 1e-3, 0.3, 1.0])
def test_corners_have_values_and_derivatives(precision, alpha):
    wi, wo = (vectors(precision, rows) for rows in corner_directions())
    width = precision.lanes(np.full(len(corner_directions()[0]), alpha))
    dr.enable_grad(wi, wo, width)
    a, b = microfacet.brdf_terms(wi, wo, width)
    below = (corner_directions()[0][:, 2] <= 0) | (corner_directions()[1][:, 2] < 0)
    assert not np.array(a)[below].any()
    assert np.isfinite(np.array(a)).all()
    assert np.isfinite(np.array(b)).all()
    dr.backward(dr.sum(a + b))
    assert all(np.isfinite(np.array(dr.grad(x))).all() for x in (*wi, *wo, width))


@pytest.mark.parametrize("f", [microfacet.ggx, microfacet.phong])
def test_distributions_have_derivatives_everywhere(precision, f):
    cos_h, alpha = (precision.lanes(x) for x in ([-0.5, 0.0, 1e-6, 0.5, 1.0] * 3, np.repeat([0.0, 0.2, 1.0], 5)))
    dr.enable_grad(cos_h, alpha)
    dr.backward(dr.sum(f(cos_h, alpha)))
    got = np.array([dr.grad(cos_h), dr.grad(alpha)], dtype=float)
    assert np.isfinite(got).all()
    assert not got[:, :2].any()
    assert got[0, [8, 9]].min() > 0


def test_derivatives_by_central_differences(precision):
    Float = dr.float64_array_t(precision.Float)
    wi, wo = directions(200, 6, 0.1), directions(200, 7, 0.1)
    alpha = np.random.default_rng(8).uniform(0.1, 1, 200)
    arguments = [*vectors(precision, wi), *vectors(precision, wo), precision.lanes(alpha)]
    dr.enable_grad(arguments)
    a, b = microfacet.brdf_terms(arguments[:3], arguments[3:6], arguments[6])
    dr.backward(dr.sum(a + 2 * b))
    plain, h = [*wi.T, *wo.T, alpha], 1e-6

    def value(columns):
        x = [Float(c) for c in columns]
        a, b = microfacet.brdf_terms(x[:3], x[3:6], x[6])
        return np.array(a + 2 * b)

    for k in range(7):
        up, down = (value([c + (s * h if j == k else 0) for j, c in enumerate(plain)]) for s in (1, -1))
        want = (up - down) / (2 * h)
        rel = 2e-4 if precision.name == "float32" else 1e-6
        assert np.array(dr.grad(arguments[k])) == pytest.approx(want, rel=rel, abs=rel)
