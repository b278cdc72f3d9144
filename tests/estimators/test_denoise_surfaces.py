"""What filters make of one noisy slice per pixel on a step edge, on slopes and on a floor seen at a grazing angle."""

from functools import cache

import numpy as np
import pytest
from oracles import fields

import gtao

SIZE = 48
BILATERAL = {order: gtao.SpatialFilter(derivatives=order) for order in ("none", "first", "second")}
PLANAR = gtao.SpatialFilter(derivatives="first", planar=True)
EDGE_AWARE = [gtao.EdgeAwareFilter(passes=n) for n in (1, 2, 3)]
EVERY = [*BILATERAL.values(), PLANAR, *EDGE_AWARE, gtao.PlaneAwareFilter(), gtao.PlaneAwareFilter(size=4)]
#: One slice of 8 samples, as in the slides.
METHOD = {"radius": 1.0, "n_slices": 1, "n_steps": 8}


def frame(view_z, normal_v, f):
    height, width = view_z.shape
    camera = gtao.PerspectiveCamera(width, height, fx=f, fy=f, cx=width / 2, cy=height / 2)
    return gtao.GBuffer(view_z, np.ascontiguousarray(normal_v), camera)


def filtered(g, image, spatial, k=0):
    ao = gtao.AmbientOcclusion(visibility=g.types.Tensor(np.ascontiguousarray(image, dtype=np.float64)))
    return np.array(gtao.denoise(ao, g, spatial, frame_index=k).visibility)


def step(share):
    z = np.full((SIZE, SIZE), 3.0)
    z[:, SIZE // 2 :] *= 1 + share
    return frame(z, np.broadcast_to([0.0, 0, 1], (SIZE, SIZE, 3)), 60.0)


@cache
def slope(degrees):
    field = fields.tilted_plane(np.radians(degrees), 1.2, size=SIZE, f=60.0)
    return frame(field.view_z, field.normal_v, 60.0)


@cache
def floor():
    """Up to the horizon above the first row: row n shows the depth 150 / (n + 1/2)."""
    z = np.broadcast_to(150 / (np.arange(SIZE) + 0.5)[:, None], (SIZE, SIZE))
    camera = gtao.PerspectiveCamera(SIZE, SIZE, fx=150.0, fy=150.0, cx=SIZE / 2, cy=0.0)
    return gtao.GBuffer(z, np.broadcast_to([0.0, 1, 0], (SIZE, SIZE, 3)).copy(), camera)


@pytest.mark.parametrize("share", [0.15, 0.5])
@pytest.mark.parametrize("spatial", EVERY, ids=repr)
@pytest.mark.parametrize("k", [0, 1])
def test_nothing_of_the_noise_crosses_a_step(spatial, share, k):
    """Whatever is on the other side of the edge: pixels of this side do not change at all."""
    g = step(share)
    noisy = np.array(gtao.ambient_occlusion(g, gtao.GTAO(**METHOD), frame_index=k).visibility)
    left = (np.arange(SIZE) < SIZE // 2)[None, :]
    want = filtered(g, noisy, spatial, k)
    for side in (left, ~left):
        poisoned = filtered(g, np.where(side, noisy, 1e3), spatial, k)
        assert np.abs(poisoned - want)[:, side[0]].max() < 1e-12
    assert np.abs(want - noisy).max() > 0.01


@pytest.mark.parametrize("spatial", EVERY, ids=repr)
def test_steps_below_the_threshold_leak_no_farther_than_the_footprint(spatial):
    """5 % are no edge to a bilateral filter with a threshold of 10 %; links and planes see it."""
    g = step(0.05)
    left = np.broadcast_to(np.arange(SIZE)[None, :] < SIZE // 2, g.shape).astype(float)
    error = np.max([np.abs(filtered(g, left, spatial, k) - left) for k in (0, 1)], axis=(0, 1))
    away = np.abs(np.arange(SIZE) + 0.5 - SIZE / 2)
    # Two texels away is the pixel whose footprint ends at the edge.
    assert error[away > 2].max() < 1e-12
    leaks = isinstance(spatial, gtao.SpatialFilter)
    # Of 16 taps up to 8 beyond the edge at half the weight: a third.
    assert error.max() == pytest.approx(1 / 3 if leaks else 0.0, abs=0.02 if leaks else 1e-12)


def residue(g, spatial, inside):
    """RMS of what is left of the noise: of the estimate less its mean over frames that cover all directions evenly."""
    even = gtao.GTAO(**METHOD, noise="hilbert_r2")
    limit = np.mean([np.array(gtao.ambient_occlusion(g, even, frame_index=k).visibility) for k in range(256)], axis=0)
    errors = []
    for k in range(4):
        noisy = np.array(gtao.ambient_occlusion(g, gtao.GTAO(**METHOD), frame_index=k).visibility)
        errors.append(filtered(g, noisy - limit, spatial, k) if spatial else noisy - limit)
    return float(np.sqrt(np.mean(np.square(errors)[:, *inside])))


INSIDE = (slice(4, -4), slice(4, -4))


@pytest.mark.parametrize("tilt", [45, 62])
def test_slopes_are_filtered_without_banding(tilt):
    """Where weights are not all alike, the 16 directions do not cancel, and the pattern of the noise stays."""
    g = slope(tilt)
    noisy = residue(g, None, INSIDE)
    left = {order: residue(g, spatial, INSIDE) for order, spatial in BILATERAL.items()}
    planar = residue(g, PLANAR, INSIDE)
    # Alike: what is left is the change of the integrand over 4 pixels.
    alike = residue(g, gtao.PlaneAwareFilter(size=4, fit="constant"), INSIDE)
    assert planar == pytest.approx(alike, rel=1e-3)
    assert planar < noisy / 50
    assert left["second"] < noisy / 50
    assert left["none"] > 2 * left["first"]
    if tilt > 60:
        # In perspective the depth of a plane bends, the more the steeper it is.
        assert left["first"] > 1.2 * left["second"] > 1.35 * planar


def test_passes_of_the_edge_aware_filter_leave_less_and_less_on_slopes():
    left = [residue(slope(45), spatial, INSIDE) for spatial in EDGE_AWARE]
    assert left[0] > 2 * left[1] > 2 * left[2]


def counted(g, spatial):
    """(Σ w)² / Σ w² from the weights of pixels in the middle column, row by row."""
    found = []
    for y in range(SIZE - 4):
        weights = np.array(gtao.filter_weights(g, spatial, SIZE // 2, y).weights)
        found.append(1 / (weights**2).sum())
    return np.array(found)


def test_second_derivatives_near_the_horizon():
    """z ~ 1 / n at n rows below the horizon: its second derivative moves a tap by d² / n² of z."""
    g = floor()
    none, first, second = (counted(g, BILATERAL[order]) for order in ("none", "first", "second"))
    planar = counted(g, PLANAR)
    # Whole footprints at any distance, where 1 / z is extrapolated.
    assert planar[1:] == pytest.approx(16, abs=1e-9)
    assert (none <= first + 1e-9).all()
    assert (first[1:] <= second[1:] + 1e-9).all()
    # Without derivatives one row is left; the slope gains the full footprint from ten rows on, its change from six on.
    assert none[1:7] == pytest.approx(4, abs=1e-9)
    assert (first[12:] > 15.8).all()
    assert (second[6:] > 15.5).all()
    assert first[4] < second[4] - 1
