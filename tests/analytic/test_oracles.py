"""The oracles themselves against golden values and closed forms: a reference that is wrong proves nothing."""

import numpy as np
import pytest
from analytic import _tables
from oracles import closed_forms, fields, golden, heightfield, slice_oracle


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.arc"))
def test_arc_quadrature_golden(inputs, outputs):
    gamma = inputs["gamma"]
    got = slice_oracle.arc(np.cos(gamma), np.sin(gamma), inputs["h0"], inputs["h1"])
    want = [outputs[k] for k in ("arc_cosine", "arc_uniform", "t0", "t1")]
    assert [got.cosine, got.uniform, got.t0, got.t1] == pytest.approx(want, abs=golden.FLOAT64_TOLERANCE)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.slice"))
def test_slice_quadrature_golden(inputs, outputs):
    got = slice_oracle.clamped_arc(inputs["nV"], inputs["nT"], inputs["h0"], inputs["h1"])
    names = {"cosine": "cos_arc_weighted", "uniform": "uniform_arc", "t0": "bT", "t1": "bV"}
    names |= {k: k for k in ("ss", "sc", "cc")}
    for mine, theirs in names.items():
        assert getattr(got, mine) == pytest.approx(outputs[theirs], abs=golden.FLOAT64_TOLERANCE), mine
    assert got.ss + got.cc == pytest.approx(got.cosine, abs=golden.FLOAT64_TOLERANCE)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.horizon"))
def test_hemisphere_quadrature_golden(inputs, outputs):
    horizon = slice_oracle.harmonic_horizon(inputs["c"], inputs["harmonics"])
    got = slice_oracle.hemisphere(inputs["N"], inputs["V"], horizon)
    assert got.cosine == pytest.approx(outputs["A_cos"], abs=golden.FLOAT64_TOLERANCE)
    assert got.bent == pytest.approx(np.array(outputs["bent_vec"]), abs=golden.FLOAT64_TOLERANCE)
    assert got.second == pytest.approx(np.array(outputs["M2_over_pi"]), abs=golden.FLOAT64_TOLERANCE)
    # The uniform integrand jumps where the horizon meets the tangent plane: the azimuth rule is second order there.
    assert got.uniform == pytest.approx(outputs["A_uniform"], abs=1e-6)
    direction = slice_oracle.unit(got.uniform_bent)
    assert direction == pytest.approx(np.array(outputs["uniform_bent_dir"]), abs=1e-6)
    # Sampling by directions about N, which knows no azimuth about V: indicator function, error n^-3/4 = 2.4e-4.
    sampled = slice_oracle.hemisphere_qmc(inputs["N"], inputs["V"], horizon)
    assert sampled == pytest.approx(outputs["A_cos"], abs=5e-4)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.unoccluded"))
def test_open_slices_golden(inputs, outputs):
    assert slice_oracle.unoccluded_mean(**inputs) == pytest.approx(outputs["A"], abs=golden.FLOAT64_TOLERANCE)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.slice_cdf"))
def test_slice_density_golden(inputs, outputs):
    assert slice_oracle.slice_density_cdf(**inputs) == pytest.approx(outputs["F"], abs=golden.FLOAT64_TOLERANCE)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.slice_cdf_inverse"))
def test_inverse_slice_density_golden(inputs, outputs):
    got = slice_oracle.slice_density_cdf(inputs["Gamma"], outputs["phi"])
    assert got == pytest.approx(inputs["u"], abs=golden.FLOAT64_TOLERANCE)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.perspective"))
def test_tangents_golden(inputs, outputs):
    V = -slice_oracle.unit(inputs["P"])
    assert pytest.approx(outputs["V"], abs=golden.FLOAT64_TOLERANCE) == V
    got = slice_oracle.tangent(V, inputs["phi"])
    assert got == pytest.approx(outputs["T"], abs=golden.FLOAT64_TOLERANCE)
    direction = slice_oracle.screen_direction(inputs["P"], got)
    assert direction == pytest.approx(outputs["screen_dir"], abs=golden.FLOAT64_TOLERANCE)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.naive_bias")[::2])
def test_published_mean_golden(inputs, outputs):
    """The front-facing cases; a normal near edge-on takes many slices."""
    got = slice_oracle.published_open_mean(inputs["N"], -np.array(inputs["P"]), n_azimuth=2048)
    assert got == pytest.approx(outputs["naive"], abs=golden.FLOAT64_TOLERANCE)


@pytest.mark.parametrize("tilt", _tables.TILTS)
def test_marching_over_a_plane_is_open(tilt):
    """Exactly: no ray of the hemisphere meets its own plane, whatever the rounding."""
    for place in _tables.PLACES[::2]:
        field = fields.tilted_plane(np.radians(tilt), 1.0, np.radians(place), size=8)
        assert (heightfield.visibility(field, n_rays=256).visibility == 1).all()


def middle_row(field, keep):
    columns = np.flatnonzero(keep)
    return np.stack([np.full(len(columns), len(field.view_z) // 2), columns], axis=1)


def assert_agrees(estimate, exact, extra=0.0):
    """Within 4.5 standard errors (three degrees of freedom pooled over pixels) plus a derived remainder."""
    pooled = np.sqrt(np.mean(estimate.standard_error**2))
    assert np.abs(estimate.visibility - exact).max() < 4.5 * pooled + extra
    assert np.abs(np.mean(estimate.visibility - exact)) < 4.5 * pooled / np.sqrt(len(exact)) + extra


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
def test_marching_in_a_trench_of_texels(weighting):
    """Blocks make vertical walls exactly; what remains is that the trench ends with the frame (first/third order)."""
    field = fields.walls(0.5, 1.0, 1.0, 1.5, n_px=60, pixel=0.05, length_px=400)
    x = field.plane_coordinates()[0][0]
    floor = (x > -0.5) & (x < 1.0)
    left, right = x[floor] + 0.5, 1.0 - x[floor]
    estimate = heightfield.visibility(
        field, middle_row(field, floor), n_rays=4096, surface="nearest", weighting=weighting
    )
    exact = closed_forms.walls if weighting == "cosine" else closed_forms.walls_uniform
    ends = (left + 1.5 * right).max() / (2 * np.pi * 10**2) if weighting == "uniform" else 5e-4
    assert_agrees(estimate, exact(left, right, 1.0, 1.5), ends)


def test_marching_in_a_groove():
    """Tilted normals. The rim is blurred over a pixel; the error of the mean halves with the pixel."""
    errors = []
    for n_px in (40, 80):
        field = fields.groove(0.8, 1.2, n_px=n_px, pixel=2 / n_px, length_px=6 * n_px)
        x = field.plane_coordinates()[0][0]
        inside = np.abs(x) < 0.7
        estimate = heightfield.visibility(field, middle_row(field, inside), n_rays=4096)
        errors.append(np.mean(estimate.visibility - closed_forms.groove(x[inside], 0.8, 1.2)))
    assert 0 < errors[1] < 0.75 * errors[0] < 0.01


def test_marching_in_a_bowl_converges():
    """Constant visibility; the linear surface cuts the rim, a first-order error."""
    errors = []
    for n_px in (24, 48, 96):
        field = fields.bowl(1.0, 0.8, n_px=n_px, pixel=2.2 / n_px)
        inside = np.argwhere(np.hypot(*field.plane_coordinates()) < 0.85)
        some = inside[np.random.default_rng(0).choice(len(inside), 100)]
        estimate = heightfield.visibility(field, some, n_rays=2304)
        errors.append(np.mean(estimate.visibility) - closed_forms.bowl(1.0, 0.8))
    assert _tables.orders(errors) == pytest.approx([1.0, 1.0], abs=0.35)


@pytest.mark.parametrize("centre", [(0.0, 0.0, 0.0), (0.3, -0.2, -0.4)])
def test_marching_inside_a_sphere_in_perspective(centre):
    """Oblique normals, with and without a finite radius; interpolation errs by (pixel)²/8 R, a few 1e-4."""
    size, tan_half = 64, 1.0
    field = fields.inside_sphere(1.0, centre, size=size, tan_half=tan_half)
    pixels = np.random.default_rng(1).integers(0, size, (100, 2))
    estimate = heightfield.visibility(field, pixels, n_rays=2304)
    assert_agrees(estimate, np.full(100, closed_forms.inside_sphere(1.0, centre, tan_half)), 5e-4)
    reach = 0.4
    P = field.positions()
    border = np.concatenate([P[0], P[-1], P[:, 0], P[:, -1]])
    in_view = np.argwhere(np.linalg.norm(P[:, :, None] - border, axis=-1).min(axis=-1) > reach)
    assert len(in_view) > 50
    estimate = heightfield.visibility(field, in_view[:100], n_rays=2304, radius=reach)
    assert_agrees(estimate, np.full(len(in_view[:100]), closed_forms.inside_sphere_within(1.0, reach)), 5e-4)


def test_marching_reports_its_own_error():
    """The spread about the exact value is what the standard error says (64 pixels: ± 20 %)."""
    field = fields.walls(0.5, 0.5, 1.0, 1.0, n_px=64, pixel=1 / 32, length_px=320)
    x = field.plane_coordinates()[0][0]
    floor = np.abs(x) < 0.5
    estimate = heightfield.visibility(
        field, np.repeat(middle_row(field, floor), 8, axis=0), n_rays=256, surface="nearest"
    )
    exact = np.repeat(closed_forms.walls(x[floor] + 0.5, 0.5 - x[floor], 1.0, 1.0), 8)
    spread = np.sqrt(np.mean((estimate.visibility - exact) ** 2))
    assert spread == pytest.approx(np.sqrt(np.mean(estimate.standard_error**2)), rel=0.2)


def test_marching_ignores_the_background():
    """A wall of background hides nothing; nor does what stands behind a hole hide through it."""
    field = fields.walls(0.5, 0.5, 1.0, 1.0, n_px=24, pixel=0.1, length_px=48)
    view_z = field.view_z.copy()
    view_z[:, 17:] = np.inf
    holed = fields.Field(view_z, field.normal_v, field.camera, orthographic=True)
    for surface in ("nearest", "linear"):
        whole = heightfield.visibility(holed, n_rays=64, surface=surface)
        assert (whole.visibility[:, 17:] == 1).all()
        pixel = heightfield.visibility(holed, [[24, 12]], n_rays=16384, surface=surface)
        # One wall on the left only; the linear surface slants it over a pixel of its five.
        exact = closed_forms.walls(0.55, 1.0, 1.0, 0.0)
        assert pixel.visibility[0] == pytest.approx(exact, abs=0.005 if surface == "nearest" else 0.03)


def test_marching_over_its_own_texel_is_open():
    """A tilted normal sends rays below the flat top of its own block; alone in the image, nothing is in their way."""
    field = fields.tilted_plane(np.radians(60), 1.0, size=1)
    assert (heightfield.visibility(field, n_rays=256, surface="nearest").visibility == 1).all()
