"""HBAO: against the sketch written out in NumPy, against uniform GTAO, and on open planes."""

import numpy as np
import pytest
from analytic._frames import frame, holed, image, pixels
from drjit.llvm.ad import TensorXf64
from oracles import fields, hbao

import drjit as dr  # isort: skip

import gtao

FIELDS = {
    "from above": lambda: fields.from_above(fields.gaussians(0.35, 0.2, count=12, seed=4), size=32),
    "stretched, off-centre": lambda: fields.in_perspective(
        fields.waves(0.12, 7.0), size=32, stretch=1.3, slope=(0.3, -0.2), shift_px=(5.0, -3.0)
    ),
}
# Both sides are float64; a sample that lands on the border of two texels may still fall on either side.
ROUNDING = 1e-9
AXES = [("optical_axis", "screen"), ("view", "screen"), ("view", "view")]


@pytest.mark.parametrize(("zenith", "measure"), AXES)
@pytest.mark.parametrize("attenuation", ["sample", "horizon", "none"])
@pytest.mark.parametrize("name", FIELDS)
def test_against_the_sketch(name, attenuation, zenith, measure):
    field = holed(FIELDS[name]())
    options = {"radius": 0.6, "n_directions": 6, "n_steps": 7, "attenuation": attenuation, "zenith": zenith}
    got = image(field, gtao.HBAO(**options, slice_measure=measure, noise="none"))
    where = pixels(field, 20)
    want = [hbao.visibility(field, *pixel, **options, measure=measure) for pixel in where]
    assert got[where[:, 0], where[:, 1]] == pytest.approx(want, abs=ROUNDING)
    assert np.ptp(want) > 0.05
    assert (got[10:14, 18:27] == 1).all()


def test_unlimited_radius_against_the_sketch():
    field = FIELDS["stretched, off-centre"]()
    options = {"radius": np.inf, "n_directions": 10, "n_steps": 9, "attenuation": "none"}
    got = image(field, gtao.HBAO(**options, noise="none"))
    where = pixels(field, 10)
    want = [hbao.visibility(field, *pixel, **options) for pixel in where]
    assert got[where[:, 0], where[:, 1]] == pytest.approx(want, abs=ROUNDING)


def test_rotation_and_jitter_per_pixel():
    """The papers' 4×4 pattern in frame 0: rotations k/16 + 60/360 and offsets j/4 plus the golden ratio per pair."""
    field = FIELDS["from above"]()
    options = {"radius": 0.5, "n_directions": 4, "n_steps": 6, "attenuation": "sample"}
    got = image(field, gtao.HBAO(**options))
    for row, column in pixels(field, 16):
        rotation = ((4 * ((column + row) % 4) + column % 4) / 16 + 60 / 360) % 1
        first = ((row - column) % 4) / 4
        offsets = [(first + i * (np.sqrt(5) - 1) / 2) % 1 for i in range(2)]
        want = hbao.visibility(field, row, column, **options, rotation=rotation, offsets=offsets)
        assert got[row, column] == pytest.approx(want, abs=ROUNDING)


@pytest.mark.parametrize("zenith", ["view", "optical_axis"])
@pytest.mark.parametrize("measure", ["view", "screen"])
@pytest.mark.parametrize("radius", [np.inf, 0.7], ids=["unlimited", "radius"])
@pytest.mark.parametrize("name", FIELDS)
def test_without_attenuation_it_is_uniform_gtao(name, radius, measure, zenith):
    """1 - ½ Σ (sin h - sin t) = ½ Σ (1 - cos h₀ + 1 - cos h₁) as the two tangents of a slice are opposite."""
    march = {"radius": radius, "n_steps": 8, "slice_measure": measure, "zenith": zenith, "step_exponent": 1.0}
    field = holed(FIELDS[name]())
    ours = image(field, gtao.HBAO(n_directions=8, attenuation="none", **march), np.float32)
    falloff = None if np.isinf(radius) else gtao.SampleCut(end=radius)
    theirs = image(field, gtao.GTAO(n_slices=4, weighting="uniform", falloff=falloff, **march), np.float32)
    assert ours == pytest.approx(theirs, abs=1e-6)
    assert ours.min() < 0.9


@pytest.mark.parametrize("zenith", ["view", "optical_axis"])
@pytest.mark.parametrize("tilt", [0.0, 0.5, 1.0, 1.4])
@pytest.mark.parametrize("off_axis", [(0.0, 0.0), (0.6, -0.4)])
def test_open_plane(tilt, off_axis, zenith):
    """Every sample of a plane lies on its tangent, also off the axis, where slices do not contain the optical axis."""
    for azimuth in (0.3, 2.0, 4.4):
        field = fields.tilted_plane(tilt, azimuth, off_axis)
        for attenuation in ("sample", "horizon", "none"):
            method = gtao.HBAO(radius=1.0, attenuation=attenuation, zenith=zenith, fetch="linear")
            assert image(field, method) == pytest.approx(1, abs=ROUNDING)


def test_attenuation_forgives_far_occluders_only():
    field = FIELDS["from above"]()
    plain, sample, horizon = (
        image(field, gtao.HBAO(radius=0.6, attenuation=kind)) for kind in ("none", "sample", "horizon")
    )
    assert (plain <= sample + 1e-12).all()
    assert (plain <= horizon + 1e-12).all()
    assert np.abs(sample - horizon).max() > 0.01
    # Attenuated at a radius a hundred times the scene nothing is forgiven.
    near, free = (
        image(field, gtao.HBAO(radius=200.0, attenuation=kind, max_radius_px=10)) for kind in ("sample", "none")
    )
    assert near == pytest.approx(free, abs=0.01)


@pytest.mark.parametrize("attenuation", ["sample", "horizon", "none"])
def test_reverse_mode_is_the_derivative(attenuation):
    """Central differences in float64: rounding 1e-16 / 1e-6 and truncation 1e-12 of gradients of order 1."""
    field = fields.from_above(fields.gaussians(0.35, 0.2, count=12, seed=4), size=16)
    camera = frame(field, np.float64).camera
    # Depths that are no smooth function keep samples off ties, where the horizon has a kink.
    depth = field.view_z + np.random.default_rng(0).uniform(0, 0.02, field.view_z.shape)

    def total(view_z):
        g = gtao.GBuffer(view_z, TensorXf64(field.normal_v), camera)
        method = gtao.HBAO(radius=0.7, n_directions=4, n_steps=5, attenuation=attenuation)
        return dr.sum(gtao.ambient_occlusion(g, method).visibility, axis=None)

    z = TensorXf64(depth)
    dr.enable_grad(z)
    dr.backward(total(z))
    gradient = dr.grad(z).numpy()
    assert np.abs(gradient).max() > 0.1
    for row, column in pixels(field, 6):
        values = []
        for h in (1e-6, -1e-6):
            moved = depth.copy()
            moved[row, column] += h
            values.append(total(TensorXf64(moved)).array[0])
        assert gradient[row, column] == pytest.approx((values[0] - values[1]) / 2e-6, rel=1e-6, abs=1e-6)
