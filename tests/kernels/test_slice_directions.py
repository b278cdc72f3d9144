"""From slices to mean directions and harmonics in the view frame, as the march goes: golden values of both."""

import numpy as np
import pytest
from oracles import golden, harmonics, slice_oracle

from gtao.kernels import moments, slices
from gtao.kernels.directions import in_view_frame, n_sums, summands
from gtao.kernels.visible_arc import visible_arc

MANY = 1 << 16
"""Slices for an integral over the hemisphere; see test_moments.py."""


def numbers(arrays):
    return np.stack([np.array(a, dtype=np.float64) for a in arrays])


def clamped(precision, nV, nT, h0, h1):
    """Cosines of the horizons within the hemisphere of the normal."""
    start = slices.clamped_start(nV, nT)
    return tuple(precision.lanes(np.maximum(np.array(c), np.cos(h))) for c, h in zip(start, (h0, h1), strict=True))


def means(precision, inputs, n, offset, weighting="cosine", order=2, *, averaged=False):
    """Share, mean direction and band 2 from n slices, whose tangents are R (cos φ, sin φ, 0)."""
    nV, nT, h0, h1, T = slice_oracle.horizon_slices(inputs, n, offset)
    V = slice_oracle.unit(inputs["V"])
    nV, nT = precision.lanes(nV), precision.lanes(nT)
    ends = clamped(precision, nV, nT, h0, h1)
    if averaged:
        values = (*visible_arc(weighting, 0, nV, nT, ends), *moments.mean_horizon(*ends))
    else:
        values = visible_arc(weighting, order, nV, nT, ends)
    c, s = (precision.lanes(T @ slice_oracle.tangent(V, phi)) for phi in (0.0, np.pi / 2))
    sums = [precision.Float(float(mean)) for mean in numbers(summands(values, c, s)).mean(axis=1)]
    return numbers(in_view_frame(sums, [precision.Float(v) for v in V.tolist()]))[:, 0]


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("B.slices"))
def test_few_slices_golden(precision, inputs, outputs):
    count = inputs["n"], inputs["offset"]
    for order in (1, 2):
        share, *direction = means(precision, inputs, *count, order=order)[:4]
        assert share == pytest.approx(outputs["A_cos"], abs=precision.tolerance)
        assert np.array(direction) == pytest.approx(np.array(outputs["bent_vec"]), abs=precision.tolerance)
        assert slice_oracle.unit(direction) == pytest.approx(np.array(outputs["bent_dir"]), abs=precision.tolerance)
    share = means(precision, inputs, *count, "uniform")[0]
    assert share == pytest.approx(outputs["A_uniform"], abs=precision.tolerance)
    average = slice_oracle.unit(means(precision, inputs, *count, averaged=True)[1:])
    assert average == pytest.approx(np.array(outputs["avg_horizon_dir"]), abs=precision.tolerance)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.horizon"))
def test_many_slices_golden(precision, inputs, outputs):
    share, x, y, z, *band2 = means(precision, inputs, MANY, 0.5)
    assert np.array([x, y, z]) == pytest.approx(np.array(outputs["bent_vec"]), abs=precision.tolerance)
    first = np.sqrt(3 / (4 * np.pi)) * np.array([y, z, x])
    got = np.pi * np.array([np.sqrt(1 / (4 * np.pi)) * share, *first, *band2])
    assert got == pytest.approx(np.array(outputs["sh9"]), abs=precision.tolerance)
    uniform = slice_oracle.unit(means(precision, inputs, MANY, 0.5, "uniform", 1)[1:])
    assert uniform == pytest.approx(np.array(outputs["uniform_bent_dir"]), abs=precision.tolerance)


@pytest.mark.parametrize("V", [(0, 0, 1), (0.3, -0.4, 0.6), (-0.9, 0.5, 0.02)])
def test_sums_turn_with_the_zenith(precision, V):
    """Directions about V, summed one by one, have the means of the turned directions."""
    V = slice_oracle.unit(V)
    R = rotation(precision, V)
    rng = np.random.default_rng(1)
    theta, phi = rng.uniform(0, np.pi, 50), rng.uniform(0, 2 * np.pi, 50)
    s, c = np.sin(theta), np.cos(theta)
    values = [precision.lanes(v) for v in (np.ones(50), s, c, s * s, s * c)]
    sums = numbers(summands(values, precision.lanes(np.cos(phi)), precision.lanes(np.sin(phi)))).mean(axis=1)
    assert len(sums) == n_sums(2)
    got = in_view_frame([precision.Float(float(v)) for v in sums], [precision.Float(v) for v in V.tolist()])
    turned = np.stack([s * np.cos(phi), s * np.sin(phi), c], axis=-1) @ R.T
    want = [1.0, *turned.mean(axis=0), *harmonics.basis(turned).mean(axis=0)[4:]]
    assert numbers(got)[:, 0] == pytest.approx(np.array(want), abs=precision.tolerance)


def rotation(precision, V):
    """Rows of the minimal rotation from +z to V, whose golden values test_slices.py meets."""
    Array3 = precision.types.Array3
    rows = slices.minimal_rotation(Array3(0, 0, 1), Array3(*V.tolist()))
    return np.array([[float(np.array(x)[0]) for x in row] for row in rows])
