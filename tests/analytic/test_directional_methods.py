"""The methods of irradiance on points under random horizons, against quadrature: which are exact, and for which light.

Points and lights are drawn once. Visibility, mean directions and harmonics are those that slices sum up for the same
horizons, with the kernels of the estimate.
"""

import re
from pathlib import Path

import numpy as np
import pytest
from oracles import directional

import gtao

import drjit as dr  # isort: skip

from gtao.kernels import moments, sh

N_POINTS, N_LIGHTS = 96, 24
N_SLICES = 512
"""Slices per point: a horizon that meets the tangent plane has a kink in azimuth, whose error is of the order n^-2."""

#: RMS errors over the RMS irradiance, by method and light, as the documentation prints them.
PAGE = Path(__file__).parents[2] / "docs" / "howto" / "lighting.md"
PRINTED = {
    name: [float(number) for number in numbers.split("|")]
    for name, numbers in re.findall(
        r"^\| `(\w+\(.*\))` \| ([\d. |]+) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE
    )
}
#: The methods of that table, by the way they are written there.
METHODS = {name: eval(f"gtao.{name}") for name in PRINTED}
LIGHTS = ("bands 0-2", 4, 20, 80)


def slices_of(point):
    """A, B and the nine harmonics from the slices of a point, each the mean over slices times π."""
    Float = dr.float64_array_t(gtao.backend.default_float())
    phi = np.pi * (np.arange(N_SLICES) + 0.5) / N_SLICES
    T = np.stack([np.cos(phi), np.sin(phi), 0 * phi], axis=-1)
    V = np.array([0.0, 0, 1])
    nV, nT = np.full(N_SLICES, point.normal[2]), T @ point.normal
    gamma = np.arctan2(nT, nV)
    c0 = Float(np.cos(np.maximum(-point.horizon(phi + np.pi), gamma - np.pi / 2)))
    c1 = Float(np.cos(np.minimum(point.horizon(phi), gamma + np.pi / 2)))
    nV, nT = Float(nV), Float(nT)
    t0, t1 = (np.array(x) for x in moments.first(nV, nT, c0, c1))
    ss, sc, cc = (np.array(x) for x in moments.second(nV, nT, c0, c1))
    A, B = np.mean(ss + cc), t0 @ T / N_SLICES + t1.mean() * V
    cross = np.einsum("n,ni,j->ij", sc, T, V)
    M = (np.einsum("n,ni,nj->ij", ss, T, T) + cross + cross.T + cc.sum() * np.outer(V, V)) / N_SLICES
    upper = [Float(np.pi * m) for m in M[np.triu_indices(3)]]
    harmonics = sh.from_moments(Float(np.pi * A), [Float(np.pi * b) for b in B], upper)
    return A, B, np.array([h[0] for h in harmonics])


@pytest.fixture(scope="module")
def ensemble():
    """(frame, estimate, {light: (coefficients, irradiance of every point and light)}, points)."""
    rng = np.random.default_rng(1)
    points = [directional.random_point(rng) for _ in range(N_POINTS)]
    A, B, harmonics = (np.array(v)[None] for v in zip(*map(slices_of, points), strict=True))
    N = np.array([p.normal for p in points])[None]
    g = gtao.GBuffer(np.full((1, N_POINTS), 2.0), N, gtao.OrthographicCamera(N_POINTS, 1, 1.0))
    T = g.types.Tensor
    ao = gtao.AmbientOcclusion(visibility=T(A), mean_direction=T(B), visibility_sh=T(harmonics), normal_v=g.normal_v)
    smooth = 0.7 * rng.standard_normal((N_LIGHTS, 9))
    smooth[:, 0] = np.sqrt(4 * np.pi)
    projected = np.array([p.projected(2) for p in points])
    lights = {"bands 0-2": (smooth, projected @ smooth.T)}
    for kappa in LIGHTS[1:]:
        lobes = [directional.random_lobe(rng, kappa) for _ in range(N_LIGHTS)]
        truth = np.array([[p.irradiance(lobe) for lobe in lobes] for p in points])
        lights[kappa] = np.array([lobe.projected(4) for lobe in lobes]), truth
    return g, ao, lights, points


@pytest.fixture(scope="module")
def errors(ensemble):
    """{method: RMS errors by light}."""
    g, ao, lights, _ = ensemble
    found = {}
    for name, method in METHODS.items():
        row = []
        for coefficients, truth in lights.values():
            got = gtao.irradiance(np.ascontiguousarray(coefficients.T), g, ao, method).numpy()[0]
            row.append(np.sqrt(np.mean((got - truth) ** 2) / np.mean(truth**2)))
        found[name] = np.array(row)
    return found


def test_slices_sum_up_what_is_visible(ensemble):
    _, ao, _, points = ensemble
    want = np.array([[p.visibility, *p.mean_direction, *p.projected(2)] for p in points])
    got = [ao.visibility.numpy()[..., None], ao.mean_direction.numpy(), ao.visibility_sh.numpy()]
    # Kinks in azimuth: the 360 azimuths of the quadrature err by some 1e-5.
    assert np.concatenate(got, axis=-1)[0] == pytest.approx(want, abs=5e-5)


def test_slice_moments_are_exact_under_smooth_light(ensemble, errors):
    g, ao, lights, _ = ensemble
    coefficients, truth = lights["bands 0-2"]
    got = gtao.irradiance(np.ascontiguousarray(coefficients.T), g, ao, gtao.SliceMoments()).numpy()[0]
    # As above, in nine terms of light of order 1.
    assert got == pytest.approx(truth, abs=2e-4)
    assert errors["SliceMoments()"][0] < 5e-5
    assert errors["SliceMoments(order=4)"][0] == errors["SliceMoments()"][0]
    assert min(e[0] for name, e in errors.items() if not name.startswith("SliceMoments")) > 0.01


def test_ranking(errors):
    assert len(errors) == 13
    smooth, _, sharp, sharpest = np.array(list(errors.values())).T
    names = list(errors)
    # Smooth light: the more is known of the visible directions the better, and a match beats the published aperture.
    order = [
        "SliceMoments()",
        "MomentZH()",
        'ConeSH(aperture="matched")',
        "ConeSH()",
        "ClippedCone()",
        'ClippedCone(aperture="seed")',
        "TripleProduct()",
        "OcclusionTimesIrradiance()",
    ]
    assert [smooth[names.index(n)] for n in order] == sorted(smooth[names.index(n)] for n in order)
    assert smooth.argmax() == names.index("OcclusionTimesIrradiance()")
    # Sharp light: bands 3 and 4 of a guess are worth more than exact bands 0 to 2.
    for column in (sharp, sharpest):
        error = dict(zip(names, column, strict=True))
        for n in ("SliceMoments(order=4)", "MomentZH(order=4)", "ClippedCone(order=4)", "TripleProduct(order=4)"):
            assert error[n] < 0.9 * error["SliceMoments()"]
        assert error["SliceMoments()"] < error["BentNormalIrradiance()"] < error["OcclusionTimesIrradiance()"]
        assert sorted(names, key=error.get)[:2] == ["SliceMoments(order=4)", "MomentZH(order=4)"]


@pytest.mark.parametrize("name", METHODS)
def test_errors_are_those_of_the_documentation(errors, name):
    # Three printed digits.
    assert errors[name] == pytest.approx(PRINTED[name], abs=6e-4)


def test_the_published_aperture_loses_light(ensemble):
    """Under a constant sky a whole cone keeps A cos β; matched, and about its own axis, it keeps A."""
    g, ao, _, points = ensemble
    sky = np.array([np.sqrt(4 * np.pi)])
    A = np.array([p.visibility for p in points])
    B = np.array([p.mean_direction for p in points])
    cosine = np.sum(B * [p.normal for p in points], axis=1) / np.linalg.norm(B, axis=1)
    got = {n: gtao.irradiance(sky, g, ao, METHODS[n]).numpy()[0] / np.pi for n in METHODS}
    # √(1 - A) >= sin β: none of these cones touches the tangent plane.
    assert (cosine**2 >= A).all()
    assert got['ClippedCone(aperture="seed")'] / A == pytest.approx(cosine, abs=1e-4)
    assert cosine.mean() < 0.97
    for n in (
        "ClippedCone()",
        "ConeSH()",
        'ConeSH(aperture="matched")',
        "MomentZH()",
        "SliceMoments()",
        "OcclusionTimesIrradiance()",
        "BentNormalIrradiance()",
    ):
        assert got[n] == pytest.approx(A, abs=1e-4), n
