"""The visibility bitmask: against arcs found point by point, against GTAO, and its limits."""

import dataclasses

import numpy as np
import pytest
from analytic._frames import frame
from drjit.llvm.ad import TensorXf64
from oracles import bitmask_oracle, fields

import drjit as dr  # isort: skip

import gtao

FIELDS = {
    "from above": lambda: fields.from_above(fields.gaussians(0.35, 0.2, count=12, seed=4), size=32),
    "stretched, off-centre": lambda: fields.in_perspective(
        fields.gaussians(0.25, 0.12, count=14, seed=1), size=32, stretch=1.3, slope=(0.3, -0.2), shift_px=(5.0, -3.0)
    ),
}
# Both sides are float64 and agree to 1e-12; a sector whose middle lies that close to the end of an arc is not met.
ROUNDING = 1e-9


def image(field, method, dtype=np.float64, frame_index=0, layers=None):
    g = frame(field, dtype)
    if layers is not None:
        g = gtao.GBuffer(g.view_z, g.normal_v, g.camera, layers=gtao.DepthLayers(*layers))
    result = gtao.ambient_occlusion(g, method, frame_index=frame_index)
    return np.asarray(result.visibility, dtype=np.float64)


def holed(field):
    """The field with some background in it."""
    view_z = field.view_z.copy()
    view_z[10:14, 18:27] = np.inf
    return fields.Field(view_z, field.normal_v, field.camera, field.orthographic)


def pixels(field, n=8, seed=6):
    surface = np.argwhere(np.isfinite(field.view_z))
    return surface[np.random.default_rng(seed).choice(len(surface), n, replace=False)]


def along_eye_rays(field, length):
    """Bodies that reach ``length`` times a function of depth along the eye ray behind the surface."""
    x, y = field.plane_coordinates()
    stretch = np.ones_like(x) if field.orthographic else np.sqrt(x * x + y * y + 1)

    def bodies(row, column):
        z = field.view_z[row, column]
        return [(z, z + length(z, stretch[row, column]))]

    return bodies


THICKNESSES = {
    "solid": (None, lambda z, stretch: np.inf),
    "constant": (gtao.ConstantThickness(thickness=0.15), lambda z, stretch: 0.15 / stretch),
    "linear": (gtao.LinearThickness(slope=0.04), lambda z, stretch: 0.04 * z),
}


def compare(field, options, bodies, layers=None, n_pixels=6, **oracle):
    common = {"radius": 0.6, "n_slices": 3, "n_steps": 7} | options
    falloff = {"sphere": None, "sample": gtao.SampleCut(end=0.6), "none": gtao.NoCut()}[oracle.get("cut", "sphere")]
    method = gtao.VisibilityBitmask(noise="none", falloff=falloff, **common)
    got = image(field, method, layers=layers)
    common = {k: v for k, v in common.items() if k not in ("thickness", "sector_rounding")}
    where = pixels(field, n_pixels)
    want = np.array([bitmask_oracle.visibility(field, *pixel, bodies=bodies, **common, **oracle) for pixel in where])
    return got[where[:, 0], where[:, 1]], want


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


@pytest.mark.parametrize("linked", [False, True], ids=["alone", "linked"])
@pytest.mark.parametrize("name", FIELDS)
def test_one_layer_of_measured_thickness(name, linked):
    """Backs that are never reached are solid, backs at a constant length of constant thickness."""
    field = holed(FIELDS[name]())
    march = {"radius": 0.6, "n_slices": 4, "n_steps": 8, "linked": linked}
    measured = gtao.VisibilityBitmask(thickness=gtao.MeasuredThickness(), **march)
    front = field.view_z[None]
    solid = image(field, measured, layers=(front, np.full_like(front, np.inf)))
    assert (solid == image(field, gtao.VisibilityBitmask(**march))).all()
    bodies = along_eye_rays(field, THICKNESSES["constant"][1])
    back = np.array([[bodies(r, c)[0][1] for c in range(32)] for r in range(32)])[None]
    thin = image(field, measured, layers=(front, back))
    constant = image(field, gtao.VisibilityBitmask(thickness=THICKNESSES["constant"][0], **march))
    # Backs that differ by rounding close the same sectors but for a few.
    assert np.mean(thin == constant) > 0.99
    assert np.abs(thin - solid).max() > 0.03


@pytest.mark.parametrize("linked", [False, True], ids=["alone", "linked"])
@pytest.mark.parametrize("cut", ["sphere", "sample", "none"])
@pytest.mark.parametrize("name", FIELDS)
def test_layers_against_arcs_found_point_by_point(name, cut, linked):
    """Two bodies behind each other, sheets at some texels, the second missing at some and without end at others."""
    field = holed(FIELDS[name]())
    z = field.view_z
    rng = np.random.default_rng(2)
    first = z + np.where(rng.random(z.shape) < 0.5, 0, rng.uniform(0.02, 0.1, z.shape))
    front = np.stack([z, np.where(rng.random(z.shape) < 0.3, np.inf, first + rng.uniform(0.0, 0.3, z.shape))])
    end = np.where(rng.random(z.shape) < 0.2, np.inf, front[1] + rng.uniform(0.0, 0.2, z.shape))
    back = np.stack([first, end])

    def bodies(row, column):
        return [(front[k, row, column], back[k, row, column]) for k in (0, 1)]

    options = {"thickness": gtao.MeasuredThickness(), "sector_rounding": "nearest", "linked": linked}
    got, want = compare(field, options, bodies, layers=(front, back), cut=cut, rounding="nearest")
    assert got == pytest.approx(want, abs=ROUNDING)
    assert np.ptp(want) > 0.03


@pytest.mark.parametrize("thickness", THICKNESSES)
@pytest.mark.parametrize("name", FIELDS)
def test_linked_samples_against_arcs_found_point_by_point(name, thickness):
    field = holed(FIELDS[name]())
    model, length = THICKNESSES[thickness]
    options = {"thickness": model, "sector_rounding": "nearest", "linked": True}
    got, want = compare(field, options, along_eye_rays(field, length), rounding="nearest")
    assert got == pytest.approx(want, abs=ROUNDING)


@pytest.mark.parametrize("extent", [0.0, 0.01], ids=["sheets", "plates"])
@pytest.mark.parametrize("cut", ["sphere", "sample", "none"])
@pytest.mark.parametrize("name", FIELDS)
def test_links_of_thin_bodies_against_arcs_found_point_by_point(name, cut, extent):
    """Bodies in random depths: neighbours on both sides of the slope up to which they are one."""
    smooth = FIELDS[name]()
    z = smooth.view_z - np.random.default_rng(3).uniform(0.0, 1.2, smooth.view_z.shape)
    field = fields.Field(z, smooth.normal_v, smooth.camera, smooth.orthographic)
    options = {"thickness": gtao.MeasuredThickness(), "sector_rounding": "nearest", "linked": True}
    layers = z[None], z[None] + extent
    got, want = compare(field, options, lambda r, c: [(z[r, c], z[r, c] + extent)], layers, cut=cut, rounding="nearest")
    assert got == pytest.approx(want, abs=ROUNDING)
    assert np.ptp(want) > 0.1


def test_interpolated_fronts_keep_their_bodies():
    """On a plane the linear fetch puts samples between texels, in front of or behind the depth of the nearest."""
    field = fields.tilted_plane(1.0, 0.4)
    layers = field.view_z[None], field.view_z[None] + 0.002
    options = {"n_slices": 3, "n_steps": 6, "fetch": "linear", "weighting": "uniform"}
    method = gtao.VisibilityBitmask(thickness=gtao.MeasuredThickness(), **options)
    assert (image(field, method, layers=layers) == 1).all()


def bar(thickness, *, size=96, height=0.4, edges=(0.25, 0.45)):
    """A bar over a floor, endless along y, seen from above; its field, layers and the floor's visibility beside it.

    From a point of the floor it blocks, in the profile, elevations from that of its lower far edge to that of its
    upper near one: A = 1 - (cos e₀ - cos e₁)/2.
    """

    def surface(x, y):
        return np.where((x > edges[0]) & (x < edges[1]), height + thickness, 0.0), np.zeros_like(x), np.zeros_like(x)

    field = fields.from_above(surface, size=size)
    floor = field.view_z == field.view_z.max()
    front = np.stack([field.view_z, np.where(floor, np.inf, 5.0)])
    back = np.stack([np.where(floor, np.inf, 5.0 - height), np.full_like(field.view_z, np.inf)])
    x = field.plane_coordinates()[0]
    distances = np.sort([np.abs(edge - x) for edge in edges], axis=0)
    low, high = np.arctan2(height, distances[1]), np.arctan2(height + thickness, distances[0])
    return field, (front, back), 1 - (np.cos(low) - np.cos(high)) / 2, floor


@pytest.mark.parametrize("thickness", [0.0, 0.002, 0.15], ids=["sheet", "thin", "thick"])
def test_measured_thickness_is_the_truth_of_a_floating_bar(thickness):
    """What no horizon and no one thickness can know.

    Samples about a pixel of 1/48 apart place the edges of the bar within half of it, and the frame ends where the bar,
    endless in the closed form, is still seen under a few degrees: 0.02 in the rows of the middle. 32 sectors in each
    of 8 slices add 0.0045.
    """
    field, layers, truth, floor = bar(thickness)
    middle = slice(42, 54)
    where = floor[middle] & (np.abs(field.plane_coordinates()[0][middle]) < 0.9)
    march = {"n_slices": 8, "n_steps": 48, "step_exponent": 1.0}

    def error(model, **options):
        method = gtao.VisibilityBitmask(thickness=model, **march, **options)
        return np.sqrt(np.mean((image(field, method, layers=layers) - truth)[middle][where] ** 2))

    measured = error(gtao.MeasuredThickness())
    assert measured < 0.02
    assert error(None) > 4 * measured
    assert error(gtao.ConstantThickness(thickness=0.4)) > 2 * measured
    if thickness < 0.01:
        # Between samples that stand alone, bodies have gaps that are wider than they are.
        assert error(gtao.MeasuredThickness(), linked=False) > 2 * measured


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
