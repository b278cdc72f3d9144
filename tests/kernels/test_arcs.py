"""Slice integrals against golden values and quadrature."""

import numpy as np
import pytest
from oracles import golden, slice_oracle

from gtao.kernels import arcs, slices
from gtao.kernels.visible_arc import visible_arc

HALF_PI = np.pi / 2


def random_slices(n=64, seed=1):
    """(nV, nT, h0, h1) with h0 <= 0 <= h1 inside the normal's hemisphere, |np| <= 1."""
    rng = np.random.default_rng(seed)
    length, gamma = rng.uniform(0.05, 1.0, n), rng.uniform(-HALF_PI, HALF_PI, n)
    h0 = np.maximum(-rng.uniform(0.0, np.pi, n), gamma - HALF_PI)
    h1 = np.minimum(rng.uniform(0.0, np.pi, n), gamma + HALF_PI)
    return length * np.cos(gamma), length * np.sin(gamma), h0, h1


def test_acos_over_its_whole_domain(precision):
    x = np.concatenate([np.linspace(-1, 1, 4001), 1 - np.logspace(-7, -1, 50), np.logspace(-7, -1, 50) - 1])
    lanes = precision.lanes(x)
    x = np.array(lanes, dtype=np.float64)
    # Two units in the last place of pi.
    limit = 2 * np.spacing(np.array(np.pi, dtype=precision.name))
    assert np.abs(np.array(arcs.acos(lanes)) - np.arccos(x)).max() <= limit


def test_cosine_arc_golden(precision):
    cases = [(i, o) for i, o in golden.cases("A.slice") if o["h0"] <= 0 <= o["h1"]]
    assert len(cases) >= 4

    def column(key, side):
        return precision.lanes([c[side][key] for c in cases])

    c0 = precision.lanes([np.cos(o["h0"]) for _, o in cases])
    c1 = precision.lanes([np.cos(o["h1"]) for _, o in cases])
    got = np.array(visible_arc("cosine", 0, column("nV", 0), column("nT", 0), (c0, c1))[0])
    assert got == pytest.approx([o["cos_arc_weighted"] for _, o in cases], abs=precision.tolerance)
    got = 2 * np.array(visible_arc("uniform", 0, None, None, (c0, c1))[0])
    assert got == pytest.approx([o["uniform_arc"] for _, o in cases], abs=precision.tolerance)


def test_cosine_arc_against_quadrature(precision):
    nV, nT, h0, h1 = random_slices()
    want = [slice_oracle.arc(*case) for case in zip(nV, nT, h0, h1, strict=True)]
    c0, c1 = precision.lanes(np.cos(h0)), precision.lanes(np.cos(h1))
    got = np.array(visible_arc("cosine", 0, precision.lanes(nV), precision.lanes(nT), (c0, c1))[0])
    assert got == pytest.approx([w.cosine for w in want], abs=precision.tolerance)
    assert 2 * np.array(visible_arc("uniform", 0, None, None, (c0, c1))[0]) == pytest.approx(
        [w.uniform for w in want], abs=precision.tolerance
    )


def test_horizon_cosine_of_one_by_rounding_is_no_nan(precision):
    """A sample straight toward the eye has cosine 1 and, rounded, a little more."""
    above = precision.lanes([1.0, 1.0 + 1e-6, 1.0 + 1e-3])
    got = np.array(visible_arc("cosine", 0, precision.lanes([0.8] * 3), precision.lanes([0.6] * 3), (above, above))[0])
    assert got == pytest.approx(0.0, abs=precision.tolerance)


def test_high_horizons_keep_their_digits(precision):
    """The two terms of h - s c cancel as h³: near the viewer an arc is small, and still right in its own digits."""
    c = precision.lanes(1 - np.logspace(-6, np.log10(2), 400))
    zero, one = precision.lanes(np.zeros(400)), precision.lanes(np.ones(400))
    got = np.array(visible_arc("cosine", 0, zero, 2 * one, (one, c))[0], dtype=np.float64)
    h = np.arccos(np.array(c, dtype=np.float64))
    # h - sin 2h / 2 by its series where the difference of doubles has few digits itself.
    want = np.where(h < 0.1, 2 / 3 * h**3 - 2 / 15 * h**5 + 4 / 315 * h**7, h - 0.5 * np.sin(2 * h))
    # In single precision a few roundings; in double the terms do cancel, in digits that are left.
    rel = 8 * float(np.finfo(np.float32).eps) if precision.name == "float32" else precision.tolerance
    assert got == pytest.approx(want, rel=rel)


def test_signed_arcs_golden(precision):
    """Every arc, also those that leave out θ = 0, where the published formula does not hold."""
    cases = golden.cases("A.arc")
    assert any(i["h0"] > 0 for i, _ in cases)
    assert any(i["h1"] < 0 for i, _ in cases)
    gamma, a, b = (precision.lanes([i[k] for i, _ in cases]) for k in ("gamma", "h0", "h1"))
    got = np.array(arcs.cosine_arc_signed(gamma, a, b))
    assert got == pytest.approx([o["arc_cosine"] for _, o in cases], abs=precision.tolerance)
    got = np.array(arcs.uniform_arc_signed(a, b))
    assert got == pytest.approx([o["arc_uniform"] for _, o in cases], abs=precision.tolerance)


def test_signed_slice_golden_with_back_facing_normal(precision):
    """A normal beyond edge-on (nV < 0) leaves an arc that excludes θ = 0."""
    cases = golden.cases("A.slice")
    assert any(i["nV"] < 0 for i, _ in cases)
    gamma, a, b, length = (precision.lanes([o[k] for _, o in cases]) for k in ("gamma", "h0", "h1", "len"))
    got = np.array(length * arcs.cosine_arc_signed(gamma, a, b))
    assert got == pytest.approx([o["cos_arc_weighted"] for _, o in cases], abs=precision.tolerance)


def test_full_slice_golden_and_clamped_start(precision):
    """Starting the search at the tangent plane gives the horizons of the open slice, hence the full integral."""

    def lanes(cases):
        return tuple(precision.lanes([i[k] for i, _ in cases]) for k in ("nV", "nT"))

    cases = golden.cases("A.slice")
    want = [o["full_slice"] for _, o in cases]
    assert np.array(arcs.full_slice(*lanes(cases))) == pytest.approx(want, abs=precision.tolerance)
    cases = [(i, o) for i, o in cases if i["nV"] >= 0]
    nV, nT = lanes(cases)
    want = [o["full_slice"] for _, o in cases]
    c0, c1 = slices.clamped_start(nV, nT)
    assert np.array(visible_arc("cosine", 0, nV, nT, (c0, c1))[0]) == pytest.approx(want, abs=precision.tolerance)
    gamma = np.array([o["gamma"] for _, o in cases])
    edge_on = visible_arc("cosine", 0, nV, nT, (c0, c1), (c0, c1), (c0, c1))[0]
    assert np.array(edge_on) == pytest.approx(want, abs=precision.tolerance)
    assert np.array(c0) == pytest.approx(np.cos(gamma - HALF_PI), abs=precision.tolerance)
    assert np.array(c1) == pytest.approx(np.cos(gamma + HALF_PI), abs=precision.tolerance)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.unoccluded"))
def test_open_point_with_few_slices_golden(precision, inputs, outputs):
    """The mean over n slices of an open, tilted point is not 1 but a known number."""
    n = inputs["n"]
    phi = np.pi * (np.arange(n) + inputs["offset"]) / n
    nV = precision.lanes(np.full(n, np.cos(inputs["Gamma"])))
    nT = precision.lanes(np.sin(inputs["Gamma"]) * np.cos(phi))
    assert np.mean(np.array(arcs.full_slice(nV, nT))) == pytest.approx(outputs["A"], abs=precision.tolerance)


def slice_means(precision, nV, nT, h0, h1):
    """Mean over slices of both weightings, horizons clamped by the search's start values."""
    nV, nT = precision.lanes(nV), precision.lanes(nT)
    c0, c1 = slices.clamped_start(nV, nT)
    c0 = precision.lanes(np.maximum(np.array(c0), np.cos(h0)))
    c1 = precision.lanes(np.maximum(np.array(c1), np.cos(h1)))
    cosine = np.array(visible_arc("cosine", 0, nV, nT, (c0, c1))[0], dtype=np.float64).mean()
    return cosine, np.array(visible_arc("uniform", 0, nV, nT, (c0, c1))[0], dtype=np.float64).mean()


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("B.slices"))
def test_few_slices_of_a_horizon_function_golden(precision, inputs, outputs):
    got = slice_means(precision, *slice_oracle.horizon_slices(inputs, inputs["n"], inputs["offset"])[:4])
    assert got == pytest.approx((outputs["A_cos"], outputs["A_uniform"]), abs=precision.tolerance)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.horizon"))
def test_many_slices_of_a_horizon_function_golden(precision, inputs, outputs):
    """The slice sum converges to the two-dimensional integral over the hemisphere.

    A horizon that meets the tangent plane has a kink in azimuth: error O(n^-2), below 1e-9 from 2^15 slices on.
    """
    got = slice_means(precision, *slice_oracle.horizon_slices(inputs, 1 << 16, 0.5)[:4])
    assert got == pytest.approx((outputs["A_cos"], outputs["A_uniform"]), abs=precision.tolerance)


def skyline(scene):
    """Tangent of the elevation that the scene's walls block, per azimuth."""

    def wall(height, distance, towards):
        return lambda phi: height * np.maximum(np.cos(phi - towards), 0) / distance

    kind = scene["kind"]
    if kind == "pit":
        return lambda phi: np.full_like(phi, scene["k"] / scene["R"])
    if kind == "wall":
        return wall(scene["k"], scene["d"], 0)
    walls = {
        "trench": lambda: (wall(scene["k"], scene["d1"], 0), wall(scene["k"], scene["d2"], np.pi)),
        "corner": lambda: (wall(scene["k1"], scene["d1"], 0), wall(scene["k2"], scene["d2"], np.pi / 2)),
    }[kind]()
    return lambda phi: np.maximum(*(f(phi) for f in walls))


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.scene"))
def test_walls_seen_from_above_golden(precision, inputs, outputs):
    """Slices of a floor point with N = V. The skyline has kinks in azimuth: error O(n^-2), as above."""
    n = 1 << 16
    phi, tangent = np.pi * (np.arange(n) + 0.5) / n, skyline(inputs)
    # An elevation e is a polar angle of π/2 - e.
    h0, h1 = np.arctan(tangent(phi + np.pi)) - np.pi / 2, np.pi / 2 - np.arctan(tangent(phi))
    got = slice_means(precision, np.ones(n), np.zeros(n), h0, h1)
    assert got == pytest.approx((outputs["A_cos"], outputs["A_uniform"]), abs=precision.tolerance)
