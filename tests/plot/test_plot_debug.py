"""Slices of a pixel over the depth buffer, and weights of filters: figures show the numbers they are given."""

import io

import numpy as np
import pytest
from oracles import fields

import gtao
from gtao import plot
from gtao.errors import ShapeError


def frame():
    field = fields.in_perspective(fields.gaussians(0.5, 0.25, seed=2), size=24, slope=(0.4, 0.3))
    z = field.view_z.copy()
    z[8:20, 13:15] *= 0.85
    z[:6, :9] = np.inf
    return gtao.GBuffer(z, field.normal_v, gtao.PerspectiveCamera(**field.camera))


FRAME = frame()
METHODS = [
    gtao.GTAO(radius=1.5, n_slices=3, n_steps=5),
    gtao.HBAO(radius=1.5, n_directions=10, n_steps=4),
    gtao.VisibilityBitmask(radius=1.5, n_slices=2, n_steps=5),
]


def points(axis, marker="o"):
    """Coordinates of everything drawn with a marker, as a set."""
    return {tuple(np.round(p, 9)) for line in axis.lines if line.get_marker() == marker for p in line.get_xydata()}


def drawn(figure):
    figure.savefig(io.BytesIO(), format="png")
    return figure


@pytest.mark.parametrize("method", METHODS)
def test_samples_are_drawn_where_they_lie(method):
    found = gtao.inspect_slices(FRAME, method, 11, 13)
    figure = drawn(plot.slices(found, FRAME))
    image, *profiles = figure.axes
    assert points(image) == {(s.x, s.y) for sl in found.slices for s in sl.samples}
    assert points(image, "+") == {(11, 13)}
    assert f"{found.visibility:.3f}" in image.get_title(loc="left")
    profiles = [a for a in profiles if a.get_title(loc="left")]
    assert len(profiles) == len(found.slices)
    for axis, sl in zip(profiles, found.slices, strict=True):
        assert f"{sl.contribution:.3f}" in axis.get_title(loc="left")
        seen = [s for s in sl.samples if np.isfinite(s.distance)]
        along = [(2 * s.side - 1) * s.distance * np.sqrt(1 - s.cosine**2) for s in seen]
        want = {(round(x, 9), round(s.distance * s.cosine, 9)) for x, s in zip(along, seen, strict=True)}
        assert points(axis) == want


def test_horizons_are_drawn_and_what_they_block():
    found = gtao.inspect_slices(FRAME, METHODS[0], 11, 13)
    _, *profiles = drawn(plot.slices(found, FRAME)).axes
    for axis, sl in zip(profiles, found.slices, strict=True):
        lines = [line.get_xydata() for line in axis.lines]
        rays = [line for line in lines if len(line) == 2 and tuple(line[0]) == (0, 0)]
        slopes = {round(float(ray[1, 1] / np.hypot(*ray[1])), 9) for ray in rays}
        assert {round(upper, 9) for upper, _ in sl.horizons} <= slopes
        assert {round(c, 9) for c in sl.tangent} <= slopes
        assert len(axis.patches) >= sum(upper > lower for upper, lower in sl.horizons)


def test_sectors_are_a_strip():
    found = gtao.inspect_slices(FRAME, METHODS[2], 11, 13)
    axes = drawn(plot.slices(found, FRAME)).axes
    strips = [a.child_axes[0] for a in axes if a.child_axes]
    for strip, sl in zip(strips, found.slices, strict=True):
        shown = np.asarray(strip.get_images()[0].get_array())[0]
        assert shown.astype(bool).tolist() == list(sl.open_sectors)


def test_the_background_is_not_a_depth():
    found = gtao.inspect_slices(FRAME, METHODS[0], 9, 6)
    image = plot.slices(found, FRAME).axes[0].get_images()[0]
    shown = image.get_array()
    assert np.ma.getmaskarray(shown).any()
    low, high = image.get_clim()
    assert low < shown.min() <= shown.max() <= high


@pytest.mark.parametrize("spatial", [gtao.SpatialFilter(), gtao.PlaneAwareFilter(), gtao.EdgeAwareFilter(passes=2)])
def test_weights_are_written_into_their_cells(spatial):
    found = gtao.filter_weights(FRAME, spatial, 12, 13, frame_index=1)
    depth, axis = drawn(plot.filter_weights(found, FRAME)).axes
    assert np.asarray(axis.get_images()[0].get_array()) == pytest.approx(np.array(found.weights))
    reach = len(found.weights) // 2
    written = {tuple(t.xy): float(t.get_text()) / 100 for t in axis.texts}
    want = {
        (12 - reach + j, 13 - reach + i): w for i, row in enumerate(found.weights) for j, w in enumerate(row) if w != 0
    }
    assert written == pytest.approx(want, abs=5e-4)
    assert points(depth, "+") == {(12, 13)}


def test_large_footprints_are_drawn_without_numbers():
    found = gtao.filter_weights(FRAME, gtao.PlaneAwareFilter(size=11), 12, 13)
    assert not drawn(plot.filter_weights(found, FRAME)).axes[1].texts


def test_another_frame_is_refused():
    small = gtao.GBuffer(np.full((4, 4), 2.0), None, gtao.PerspectiveCamera(4, 4, 0.9))
    for draw, found in (
        (plot.slices, gtao.inspect_slices(FRAME, METHODS[0], 11, 13)),
        (plot.filter_weights, gtao.filter_weights(FRAME, gtao.SpatialFilter(), 11, 13)),
    ):
        with pytest.raises(ShapeError, match="does not lie in the frame"):
            draw(found, small)
