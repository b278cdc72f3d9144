"""The visibility bitmask: against arcs found point by point, against GTAO, and its limits."""

import dataclasses

import numpy as np
import pytest
from analytic._frames import frame, holed, image, pixels
from drjit.llvm.ad import TensorXf64
from estimators._bitmask import FIELDS, ROUNDING, THICKNESSES, along_eye_rays, compare
from oracles import bitmask_oracle, fields

import drjit as dr  # isort: skip

import gtao


@pytest.mark.parametrize("cut", ["sphere", "sample", "none"])
@pytest.mark.parametrize("thickness", THICKNESSES)
@pytest.mark.parametrize("name", FIELDS)
def test_against_arcs_found_point_by_point(name, thickness, cut):
    field = holed(FIELDS[name]())
    model, length = THICKNESSES[thickness]
    options = {"thickness": model, "sector_rounding": "nearest"}
    got, want = compare(field, options, along_eye_rays(field, length), cut=cut, rounding="nearest")
    assert got == pytest.approx(want, abs=ROUNDING)
    assert np.ptp(want) > 0.05


@pytest.mark.parametrize("thickness", THICKNESSES)
def test_outward_rounding(thickness):
    field = holed(FIELDS["from above"]())
    model, length = THICKNESSES[thickness]
    options = {"thickness": model, "sector_rounding": "outward"}
    got, want = compare(field, options, along_eye_rays(field, length), rounding="outward")
    assert got == pytest.approx(want, abs=ROUNDING)


@pytest.mark.parametrize("n_sectors", [7, 32, 64, 128])
@pytest.mark.parametrize("weighting", ["cosine", "uniform", "angle"])
def test_every_weighting_and_any_number_of_sectors(weighting, n_sectors):
    field = FIELDS["stretched, off-centre"]()
    model, length = THICKNESSES["constant"]
    options = {"thickness": model, "weighting": weighting, "n_sectors": n_sectors, "sector_rounding": "nearest"}
    got, want = compare(field, options, along_eye_rays(field, length), n_pixels=4, rounding="nearest")
    assert got == pytest.approx(want, abs=ROUNDING)


@pytest.mark.parametrize("thickness", THICKNESSES)
@pytest.mark.parametrize("weighting", ["cosine", "uniform", "angle"])
def test_jittered_sectors_are_unbiased(weighting, thickness):
    """The mean over jitters is the exact length of the union of arcs.

    A piece of x sectors closes ⌊x⌋ or ⌈x⌉ of them: of n = 16, with a standard deviation of at most ½ in 16 per slice.
    """
    field = FIELDS["from above"]()
    model, length = THICKNESSES[thickness]
    options = {"radius": 0.6, "n_slices": 3, "n_steps": 7, "weighting": weighting}
    method = gtao.VisibilityBitmask(noise="none", thickness=model, n_sectors=16, **options)
    where, n_frames = pixels(field, 10), 80
    frames = np.array([image(field, method, frame_index=i)[where[:, 0], where[:, 1]] for i in range(n_frames)])
    bodies = along_eye_rays(field, length)
    want = np.array([bitmask_oracle.visibility(field, *pixel, bodies=bodies, **options) for pixel in where])
    error = frames.mean(axis=0) - want
    spread = 0.5 / 16 / np.sqrt(3 * n_frames)
    assert np.abs(error).max() < 4 * spread
    assert abs(error.mean()) < 4 * spread / np.sqrt(len(where))
    assert frames.std(axis=0).max() > 0.005
    outward = image(field, dataclasses.replace(method, sector_rounding="outward"))[where[:, 0], where[:, 1]]
    assert (outward - want).mean() < -0.02


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
@pytest.mark.parametrize("radius", [np.inf, 0.6], ids=["unlimited", "samples within a radius"])
def test_solid_sectors_converge_to_gtao(radius, weighting):
    """Without thickness the open part of a slice is one piece, of x sectors. Jitter closes all but ⌊x⌋ or ⌈x⌉ of them.

    With f = x - ⌊x⌋ the variance is f (1 - f) / n², on average over f 1/(6 n²): m slices leave 1 / (√(6 m) n). Fewer
    where x depends on nothing, as on a side without occluders.
    """
    field, m = FIELDS["from above"](), 8
    falloff = None if np.isinf(radius) else gtao.SampleCut(end=radius)
    options = {"radius": radius, "n_slices": m, "n_steps": 24, "weighting": weighting, "falloff": falloff}
    want = image(field, gtao.GTAO(**options))
    counts = np.array([8, 16, 32, 64, 128])
    errors = [image(field, gtao.VisibilityBitmask(n_sectors=int(n), **options)) - want for n in counts]
    rms = np.array([np.sqrt(np.mean(e**2)) for e in errors])
    predicted = 1 / (np.sqrt(6 * m) * counts)
    assert np.all((0.75 * predicted < rms) & (rms < 1.1 * predicted))
    # 1024 pixels; four standard errors.
    assert all(abs(e.mean()) < 4 * p / 32 for e, p in zip(errors, predicted, strict=True))
    slope = np.polyfit(np.log(counts), np.log(rms), 1)[0]
    assert slope == pytest.approx(-1, abs=0.05)


@pytest.mark.parametrize(("dtype", "n_sectors"), [(np.float32, 32), (np.float64, 32), (np.float64, 128)])
def test_open_plane_closes_no_sector(dtype, n_sectors):
    """Every sample lies at the end of the hemisphere but for rounding, and no jitter comes that close to its ends.

    Positions round to 2e-7 at this distance, next to a pixel of 0.0075: 1e-5 of the hemisphere or 4e-4 of 32 sectors.
    The jitter keeps 2e-3 away.
    """
    for tilt, azimuth, off_axis in ((0.0, 0.0, (0.0, 0.0)), (0.7, 1.0, (0.5, -0.3)), (1.3, 4.0, (0.0, 0.4))):
        field = fields.tilted_plane(tilt, azimuth, off_axis)
        march = {"n_slices": 3, "n_steps": 6, "fetch": "linear", "weighting": "uniform", "n_sectors": n_sectors}
        for thickness in (None, gtao.ConstantThickness(thickness=0.05), gtao.LinearThickness(slope=0.1)):
            method = gtao.VisibilityBitmask(thickness=thickness, **march)
            assert (image(field, method, dtype) == 1).all()


@pytest.mark.parametrize("name", FIELDS)
def test_thickness_from_nothing_to_everything(name):
    field = FIELDS[name]()
    march = {"radius": 0.6, "n_slices": 4, "n_steps": 8, "weighting": "uniform"}
    solid = image(field, gtao.VisibilityBitmask(**march))

    def constant(thickness):
        model = gtao.ConstantThickness(thickness=thickness)
        return image(field, gtao.VisibilityBitmask(thickness=model, **march))

    # A sample of thickness t at distance d closes at most t/d of the hemisphere, d being a pixel's 0.06 at least.
    assert 1 - constant(1e-6).mean() < 1e-4
    means = [constant(t).mean() for t in (0.01, 0.05, 0.2, 2.0)]
    assert (np.diff(means) < 0).all()
    # Longer than any chord of the sphere of the radius.
    assert (constant(1.3) == solid).all()
    linear = gtao.VisibilityBitmask(thickness=gtao.LinearThickness(slope=10.0), **march)
    assert (image(field, linear) == solid).all()


def test_what_it_refuses():
    field = FIELDS["from above"]()
    with pytest.raises(gtao.ConfigError, match="layers"):
        image(field, gtao.VisibilityBitmask(thickness=gtao.MeasuredThickness()))
    z = TensorXf64(field.view_z)
    dr.enable_grad(z)
    g = frame(field, np.float64)
    attached = gtao.GBuffer(z, g.normal_v, g.camera)
    with pytest.raises(gtao.ConfigError, match="no gradient"):
        gtao.ambient_occlusion(attached, gtao.VisibilityBitmask())
