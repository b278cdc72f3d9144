"""Thickness by continuity: against arcs found point by point, and its limits."""

import numpy as np
import pytest
from analytic._frames import frame
from oracles import bitmask_oracle, fields

import gtao

MARCH = {"radius": 0.6, "n_slices": 3, "n_steps": 7, "noise": "none", "sector_rounding": "nearest"}
CONTINUING, ISOLATED, GAP = 0.3, 0.04, 0.06

FIELDS = {
    "from above": lambda: fields.from_above(fields.gaussians(0.35, 0.2, count=12, seed=4), size=32),
    "stretched, off-centre": lambda: fields.in_perspective(
        fields.gaussians(0.25, 0.12, count=14, seed=1), size=32, stretch=1.3, slope=(0.3, -0.2), shift_px=(5.0, -3.0)
    ),
}


def stepped(name):
    """The field with slabs that leap out of it, and a hole."""
    smooth = FIELDS[name]()
    z = smooth.view_z.copy()
    z[:, 5:7] -= 0.25
    z[20:24, 12:26] -= 0.2
    z[10:13, 20:27] = np.inf
    return fields.Field(z, smooth.normal_v, smooth.camera, smooth.orthographic)


def image(field, thickness, **changes):
    method = gtao.VisibilityBitmask(thickness=thickness, **MARCH | changes)
    return gtao.ambient_occlusion(frame(field, np.float64), method).visibility.numpy()


@pytest.mark.parametrize("name", FIELDS)
def test_against_arcs_found_point_by_point(name):
    field = stepped(name)
    x, y = field.plane_coordinates()
    stretch = np.ones_like(x) if field.orthographic else np.sqrt(x * x + y * y + 1)
    taken = set()

    def bodies(row, column, before):
        z = field.view_z[row, column]
        continues = abs(z - field.view_z[before]) < GAP
        taken.add(bool(continues))
        return [(z, z + (CONTINUING if continues else ISOLATED) / stretch[row, column])]

    thickness = gtao.ContinuityThickness(continuing=CONTINUING, isolated=ISOLATED, gap=GAP)
    got = image(field, thickness)
    surface = np.argwhere(np.isfinite(field.view_z))
    where = surface[np.random.default_rng(2).choice(len(surface), 12, replace=False)]
    oracle = {"radius": 0.6, "n_slices": 3, "n_steps": 7, "rounding": "nearest", "successive": True}
    with np.errstate(invalid="ignore"):
        want = [bitmask_oracle.visibility(field, *pixel, bodies=bodies, **oracle) for pixel in where]
    # Both sides are float64; a sector whose middle lies that close to the end of an arc is not met.
    assert got[where[:, 0], where[:, 1]] == pytest.approx(np.array(want), abs=1e-9)
    assert taken == {True, False}
    assert np.ptp(want) > 0.05


def test_between_the_two_constant_ones():
    """A gap that holds everything gives one of them; one that holds only a texel read twice, nearly the other."""
    field = FIELDS["from above"]()
    model = {"continuing": CONTINUING, "isolated": ISOLATED}
    thick, thin = (image(field, gtao.ConstantThickness(thickness=t)) for t in (CONTINUING, ISOLATED))
    assert np.array_equal(image(field, gtao.ContinuityThickness(**model, gap=1e6)), thick)
    nearly = image(field, gtao.ContinuityThickness(**model, gap=1e-12))
    # Thicker bodies close the same sectors and more.
    assert (nearly <= thin).all()
    assert (nearly >= thick).all()
    assert np.abs(nearly - thin).mean() < 0.2 * np.abs(nearly - thick).mean()
    mixed = image(stepped("from above"), gtao.ContinuityThickness(**model, gap=GAP))
    assert (thin > thick + 0.01).any()
    assert not np.array_equal(mixed, image(stepped("from above"), gtao.ConstantThickness(thickness=CONTINUING)))


def test_many_steps_in_a_symbolic_loop():
    """More steps than are unrolled: the depth before is carried from block to block."""
    field = FIELDS["from above"]()
    thickness = gtao.ContinuityThickness(continuing=CONTINUING, isolated=CONTINUING, gap=GAP)
    got = image(field, thickness, n_steps=48)
    assert np.array_equal(got, image(field, gtao.ConstantThickness(thickness=CONTINUING), n_steps=48))
