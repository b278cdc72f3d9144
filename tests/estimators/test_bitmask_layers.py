"""The visibility bitmask with measured thickness, and with samples linked to bodies."""

import numpy as np
import pytest
from analytic._frames import holed, image
from estimators._bitmask import FIELDS, ROUNDING, THICKNESSES, along_eye_rays, compare
from oracles import fields

import gtao


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
    assert np.abs(thin - solid).max() > 0.02


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
