"""Scenes with closed forms: the estimate lies within the error that its discretisation allows, and converges.

How the brackets come about. A horizon is the highest sample on a side of a slice. Samples lie on the surface that the
fetch defines, so they never rise above it; and the sample that follows an edge lies at most one gap beyond it. With
linear steps the gap is the reach within the frame over the number of steps, which seen across a straight edge is at
most the frame's width over the number of steps, whatever the slice's azimuth. So the estimate lies between the closed
form and the closed form of the same scene with the edge moved away by one gap (plus what the fetch itself moves it).
"""

import numpy as np
import pytest
from analytic import _tables
from analytic._frames import occlusion
from oracles import closed_forms, fields, golden, slice_oracle

SLICES = 1e-3
"""The sum over 64 equispaced slices of a wall's horizon: error exp(-128 asinh(d/k)), at most 3e-4 for d >= k/15;
rounding of a float32 arc is far below."""

SQRT2 = np.sqrt(2.0)


def open_ends(k, d, half_length):
    """What an edge of height k at distance d hides less because it ends at ± half_length.

    (1/2π) ∫ sin² e dφ over the azimuths within d/L of parallel at both ends, where tan e <= (k/d) x at the angle x:
    (1/3π) (k/d)² (d/L)³.
    """
    return 1 / (3 * np.pi) * (k / d) ** 2 * (d / half_length) ** 3


def scene_value(inputs):
    kind = inputs["kind"]
    if kind == "trench":
        d1, d2, k = inputs["d1"], inputs["d2"], inputs["k"]
        return closed_forms.walls(d1, d2, k, k), closed_forms.walls_uniform(d1, d2, k, k)
    if kind == "wall":
        return closed_forms.walls(1, inputs["d"], 0, inputs["k"]), closed_forms.walls_uniform(
            1, inputs["d"], 0, inputs["k"]
        )
    if kind == "pit":
        return closed_forms.pit(inputs["R"], inputs["k"]), closed_forms.pit_uniform(inputs["R"], inputs["k"])
    return closed_forms.corner(inputs["d1"], inputs["k1"], inputs["d2"], inputs["k2"])


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.scene"))
def test_closed_forms_golden(inputs, outputs):
    assert scene_value(inputs) == pytest.approx((outputs["A_cos"], outputs["A_uniform"]), abs=golden.FLOAT64_TOLERANCE)


@pytest.mark.parametrize("n_steps", [64, 256])
@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
def test_trench(n_steps, weighting):
    """Walls on texel boundaries, read without interpolation: only the gap between samples moves the edge."""
    left, right, got = _tables.trench(n_steps, weighting=weighting)
    # The search begins one pixel out: a wall nearer than that is seen one pixel away.
    away = np.minimum(left, right) > 0.05
    left, right, got = left[away], right[away], got[away]
    form = closed_forms.walls if weighting == "cosine" else closed_forms.walls_uniform
    gap = 3.0 / n_steps
    slack = SLICES + open_ends(1.0, left, 10) + open_ends(1.5, right, 10)
    if weighting == "uniform":
        # Uniform weighting is first order in e: (1/2π) ∫ (k/d) x dx over both ends, for each wall.
        slack = SLICES + (1.0 * left + 1.5 * right) / (2 * np.pi * 10**2)
    assert (got >= form(left, right, 1.0, 1.5) - SLICES).all()
    assert (got <= form(left + gap, right + gap, 1.0, 1.5) + slack).all()


def test_trench_converges_with_the_first_order():
    """The edge is found within one gap: the error is proportional to the gap."""
    errors = _tables.trench_errors()
    assert (np.array(errors) > 0).all()
    assert _tables.orders(errors) == pytest.approx(np.ones(3), abs=0.2)


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
def test_pit(weighting):
    """A disc of texels has its edge within half a texel's diagonal of the circle."""
    radius, depth, n_px, n_steps = 1.0, 2.0, 61, 128
    pixel = 3.0 / n_px
    options = {"n_slices": 64, "noise": "none", "step_exponent": 1.0, "snap_to_texel": False}
    image = occlusion(
        fields.pit(radius, depth, n_px=n_px, pixel=pixel), n_steps=n_steps, weighting=weighting, **options
    )
    form = closed_forms.pit if weighting == "cosine" else closed_forms.pit_uniform
    gap = SQRT2 * 1.5 / n_steps
    low, high = form(radius - pixel / SQRT2, depth), form(radius + pixel / SQRT2 + gap, depth)
    centre = image[n_px // 2, n_px // 2]
    assert low <= centre <= high
    assert high - low < 0.08


def test_corner_of_two_walls():
    """Perpendicular walls of different heights and distances; their crossing covers all azimuths of both."""
    size, pixel = 120, 0.05
    d1, k1, d2, k2 = 1.025, 1.0, 1.525, 2.0
    x = (np.arange(size) + 0.5 - size / 2) * pixel
    X, Y = np.meshgrid(x, -x)
    px, py = 60, 59  # the pixel centre at (0.025, 0.025)
    h = np.maximum(np.where(X - X[py, px] > d1, k1, 0.0), np.where(Y - Y[py, px] > d2, k2, 0.0))
    normal = np.zeros((size, size, 3))
    normal[..., 2] = 1.0
    camera = {"width": size, "height": size, "view_height": size * pixel, "cx": size / 2, "cy": size / 2}
    field = fields.Field(10.0 - h, normal, camera, orthographic=True)
    n_steps = 256
    got = occlusion(field, n_slices=64, n_steps=n_steps, noise="none", step_exponent=1.0, snap_to_texel=False)[py, px]
    gap = size * pixel / n_steps
    # d is measured from the pixel centre; the walls begin on the texel boundary half a pixel before a centre.
    exact = closed_forms.corner(d1, k1, d2, k2)[0]
    high = closed_forms.corner(d1 + gap, k1, d2 + gap, k2)[0]
    assert exact - SLICES <= got <= high + SLICES + open_ends(k1, d1, 3) + open_ends(k2, d2, 3)


@pytest.mark.parametrize(("half_width", "depth"), [(0.8, 0.5), (0.8, 1.2)])
def test_groove(half_width, depth):
    """Tilted walls, linear fetch: within a cell (√2 pixels) of the rim the interpolated edge is rounded off."""
    n_px, length_px, n_steps = 40, 320, 160
    pixel = 2.0 / n_px
    field = fields.groove(half_width, depth, n_px=n_px, pixel=pixel, length_px=length_px)
    options = {"n_slices": 64, "noise": "none", "step_exponent": 1.0, "fetch": "linear"}
    got = occlusion(field, n_steps=n_steps, **options)[length_px // 2]
    x = np.abs(field.plane_coordinates()[0][0])
    inside = x < half_width - 2 * pixel
    x, got = x[inside], got[inside]

    def moved(by):
        slope = np.arctan2(depth, half_width)
        rim = np.arctan2(half_width + x + by, depth * (1.0 - x / half_width))
        return closed_forms.profile(-rim, np.pi, gamma=-slope)

    assert moved(0.0) == pytest.approx(closed_forms.groove(x, half_width, depth))
    slack = SLICES + open_ends(depth, half_width, length_px * pixel / 2)
    assert (got >= moved(-SQRT2 * pixel) - SLICES).all()
    assert (got <= moved(SQRT2 * pixel + 2.0 / n_steps) + slack).all()


def test_groove_bottom_is_the_infinite_wedge():
    half_width, depth = 0.8, 1.2
    opening = 2 * np.arctan2(half_width, depth)
    assert closed_forms.groove(0.0, half_width, depth) == pytest.approx(closed_forms.wedge(opening))
    assert closed_forms.wedge(np.pi / 2) == pytest.approx(0.5)


def rim_visibility(sphere_radius, depth, distance, rim):
    """Visibility of a point of a bowl, at ``distance`` from the axis, through a round opening of radius ``rim``."""
    centre = sphere_radius - depth
    z = centre - np.sqrt(sphere_radius**2 - distance**2)
    normal = np.array([-distance, 0.0, centre - z]) / sphere_radius

    def horizon(phi):
        # Distance to the circle along azimuth φ from the point (distance, 0).
        b = distance * np.cos(phi)
        return np.arctan2(-b + np.sqrt(b * b + rim**2 - distance**2), -z)

    return slice_oracle.hemisphere(normal, [0, 0, 1], horizon, n_azimuth=512, n_polar=32).cosine


def test_bowl_oracle_is_constant():
    """The bracket's own integral gives the closed form at every point of the bowl."""
    rim = np.sqrt(1 - 0.2**2)
    for distance in (0.0, 0.4, 0.8):
        assert rim_visibility(1.0, 0.8, distance, rim) == pytest.approx(closed_forms.bowl(1.0, 0.8), abs=1e-6)


@pytest.mark.parametrize("depth", [0.3, 0.8])
def test_bowl(depth):
    """Any point of a spherical bowl sees the same; the linear fetch blurs the rim over one cell."""
    n_px, n_steps = 48, 256
    pixel = 2.2 / n_px
    got = _tables.bowl(n_px, depth=depth, n_steps=n_steps)
    rim = np.sqrt(1 - (1 - depth) ** 2)
    blur, gap = SQRT2 * pixel, SQRT2 * 2.2 / n_steps
    reach = [rim_visibility(1.0, depth, 0.9 * rim * t, rim - blur) for t in np.linspace(0, 1, 5)]
    beyond = [rim_visibility(1.0, depth, 0.9 * rim * t, rim + blur + gap) for t in np.linspace(0, 1, 5)]
    assert got.min() >= min(reach) - SLICES
    assert got.max() <= max(beyond) + SLICES
    assert got.std() < 0.01


def test_bowl_converges_with_the_first_order_in_resolution():
    errors = _tables.bowl_errors()
    assert _tables.orders(errors) == pytest.approx(np.ones(2), abs=0.25)


@pytest.mark.parametrize("n_steps", [32, 128])
@pytest.mark.parametrize("centre", [(0.0, 0.0, 0.0), (0.3, -0.2, -0.4)])
def test_inside_of_a_sphere(n_steps, centre):
    """Perspective, oblique normals. What leaves the frame is open, so the frame's border is the horizon.

    The last sample lies half a step before the border, which is as if the image were narrower by one part in n_steps.
    The other side: linear interpolation of a concave surface over one pixel raises it by (pixel)²/8 R, far below
    SLICES. The corners of the frame are kinks of the horizon, which take more slices than a smooth one.
    """
    got = _tables.sphere(n_steps, centre=centre, n_slices=128)
    assert got.min() >= closed_forms.inside_sphere(1.0, centre, 1.0) - SLICES
    assert got.max() <= closed_forms.inside_sphere(1.0, centre, 1.0 - 1.0 / n_steps) + SLICES


def test_inside_of_a_sphere_converges_with_the_first_order():
    assert _tables.orders(_tables.sphere_errors()) == pytest.approx(np.ones(3), abs=0.25)


@pytest.mark.parametrize("reach", [0.3, 0.6])
def test_finite_radius_inside_a_sphere(reach):
    """Chords longer than the radius are open: 1 - (r/2R)², wherever the whole neighbourhood is in view.

    The horizon is the last sample within the radius. Samples are spaced by the extent of the search over n_steps; on
    this wall that is at most 2 r/n_steps along the chord.
    """
    n_steps, centre = 128, (0.1, 0.2, -0.3)
    field = fields.inside_sphere(1.0, centre, size=48, tan_half=1.5)
    P = field.positions()
    border = np.concatenate([P[0], P[-1], P[:, 0], P[:, -1]])
    in_view = np.linalg.norm(P[:, :, None] - border, axis=-1).min(axis=-1) > reach
    assert in_view.sum() > 100
    options = {"n_slices": 32, "fetch": "linear", "noise": "none", "step_exponent": 1.0}
    got = occlusion(field, n_steps=n_steps, radius=reach, **options)[in_view]
    low = closed_forms.inside_sphere_within(1.0, reach)
    high = closed_forms.inside_sphere_within(1.0, reach * (1 - 2 / n_steps))
    assert got.min() >= low - SLICES
    assert got.max() <= high + SLICES
