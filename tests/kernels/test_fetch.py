"""Depth fetches: exact on planes, no curtains over silhouettes, nothing out of bounds."""

import numpy as np
import pytest
from oracles import fields

import drjit as dr  # isort: skip

from gtao.kernels import fetch


def linear_with_point(precision, field, x, y):
    """view_z of the linear fetch at texel coordinates (centre of column 0 is 0), and where it belongs: (3, n)."""
    height, width = field.view_z.shape
    view_z = precision.Float(field.view_z.ravel().astype(precision.name))
    footprint = 1 / min(field.scale)
    buffer = fetch.affine_field(view_z, width, height, footprint, field.orthographic, precision.types)
    dr.eval(buffer)
    got = fetch.linear(
        buffer, precision.lanes(x), precision.lanes(y), width, height, field.orthographic, precision.types
    )
    return np.stack([np.array(v, dtype=np.float64) for v in got])


def linear_at(precision, field, x, y):
    """view_z of the linear fetch on a surface without edges, where each point is its own."""
    z, px, py = linear_with_point(precision, field, x, y)
    assert px == pytest.approx(x, abs=precision.tolerance)
    assert py == pytest.approx(y, abs=precision.tolerance)
    return z


def random_coordinates(width, height, n=400, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(-0.499, width - 0.501, n), rng.uniform(-0.499, height - 0.501, n)


def plane_above(slope, size=12):
    """Orthographic plane."""
    return fields.from_above(lambda x, y: (slope[0] * x + slope[1] * y, slope[0] + 0 * x, slope[1] + 0 * x), size=size)


@pytest.mark.parametrize("tilt", [0, 30, 60, 80])
def test_linear_is_exact_on_perspective_planes(precision, tilt):
    """1/z is affine in the image, also in the half pixel outside of the outermost texel centres."""
    field = fields.tilted_plane(np.radians(tilt), 0.7, (0.5, -0.4), size=12)
    x, y = random_coordinates(12, 12)
    c = field.camera
    # view_z along any ray of the plane: invert from three texels.
    q = 1 / field.view_z
    want = 1 / (q[0, 0] + x * (q[0, 1] - q[0, 0]) + y * (q[1, 0] - q[0, 0]))
    assert linear_at(precision, field, x, y) == pytest.approx(want, rel=precision.tolerance)
    P = np.stack([(x + 0.5 - c["cx"]) / c["fx"] * want, -(y + 0.5 - c["cy"]) / c["fy"] * want, -want], axis=-1)
    height = (P - field.positions()[0, 0]) @ field.normal_v[0, 0]
    assert height == pytest.approx(0.0, abs=1e-9)


def test_linear_is_exact_on_orthographic_planes(precision):
    field = plane_above((0.6, -1.1))
    x, y = random_coordinates(12, 12)
    X, Y = (x + 0.5 - 6) / 6, -(y + 0.5 - 6) / 6
    want = 5 - (0.6 * X - 1.1 * Y)
    assert linear_at(precision, field, x, y) == pytest.approx(want, rel=precision.tolerance)


@pytest.mark.parametrize("orthographic", [False, True], ids=["perspective", "orthographic"])
def test_linear_hangs_no_curtain_over_a_depth_edge(precision, orthographic):
    """Across a step a point becomes the nearest texel, elsewhere it stays in place; no depth lies in between."""
    field = fields.walls(0.2, 0.3, 2.0, 1.5, n_px=12, pixel=0.1, length_px=12)
    if not orthographic:
        camera = {"width": 12, "height": 12, "fx": 40.0, "fy": 40.0, "cx": 6.0, "cy": 6.0}
        field = fields.Field(field.view_z, field.normal_v, camera, orthographic=False)
    x, y = random_coordinates(12, 12)
    column, row = np.round(x).astype(int), np.round(y).astype(int)
    want = field.view_z[row, column]
    assert len(np.unique(want)) == 3
    z, px, py = linear_with_point(precision, field, x, y)
    assert z == pytest.approx(want, rel=precision.tolerance)
    cell = np.clip(np.floor(x).astype(int), 0, 10)
    edge = field.view_z[0, cell] != field.view_z[0, cell + 1]
    assert 0 < edge.sum() < len(edge)
    assert np.array_equal(px[edge], column[edge])
    assert np.array_equal(py[edge], row[edge])
    assert px[~edge] == pytest.approx(x[~edge], abs=precision.tolerance)
    assert py[~edge] == pytest.approx(y[~edge], abs=precision.tolerance)


def test_linear_falls_back_beside_the_background(precision):
    field = plane_above((0.1, 0.2))
    view_z = field.view_z.copy()
    view_z[:5, 6:] = np.inf
    holed = fields.Field(view_z, field.normal_v, field.camera, orthographic=True)
    x, y = random_coordinates(12, 12)
    got, _, _ = linear_with_point(precision, holed, x, y)
    x0, y0 = np.clip(np.floor(x).astype(int), 0, 10), np.clip(np.floor(y).astype(int), 0, 10)
    touches = np.isinf([view_z[y0, x0], view_z[y0, x0 + 1], view_z[y0 + 1, x0], view_z[y0 + 1, x0 + 1]]).any(axis=0)
    nearest = view_z[np.round(y).astype(int), np.round(x).astype(int)]
    assert touches.any()
    assert np.array_equal(np.isinf(got), np.isinf(np.where(touches, nearest, 0.0)))
    finite = touches & np.isfinite(nearest)
    assert got[finite] == pytest.approx(nearest[finite], rel=precision.tolerance)


@pytest.mark.parametrize("amplitude", [0.1, 0.3])
def test_linear_on_a_smooth_surface_is_second_order(precision, amplitude):
    """Halving the pixel quarters the interpolation error of a smooth height field."""
    height = fields.waves(amplitude, 3.0)
    errors = []
    for size in (32, 64):
        field = fields.from_above(height, size=size)
        rng = np.random.default_rng(1)
        x, y = rng.uniform(2, size - 3, 2000), rng.uniform(2, size - 3, 2000)
        X, Y = (x + 0.5 - size / 2) / (size / 2), -(y + 0.5 - size / 2) / (size / 2)
        errors.append(np.abs(linear_at(precision, field, x, y) - (5 - height(X, Y)[0])).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)


def test_nearest_reads_the_texel_under_the_point(precision):
    rng = np.random.default_rng(3)
    width, height = 7, 5
    buffer = rng.uniform(1, 2, (height, width))
    x, y = random_coordinates(width, height)
    z, tx, ty = fetch.nearest(
        precision.Float(buffer.ravel().astype(precision.name)),
        precision.lanes(x),
        precision.lanes(y),
        width,
        height,
        precision.types,
    )
    column, row = np.round(x).astype(int), np.round(y).astype(int)
    assert np.array(z) == pytest.approx(buffer[row, column], rel=precision.tolerance)
    assert np.array_equal(np.array(tx), column)
    assert np.array_equal(np.array(ty), row)


def test_a_texel_that_is_known_to_lie_inside(precision):
    buffer = precision.lanes(np.arange(15))
    x, y = precision.lanes([0, 4, 4, 1]), precision.lanes([0, 0, 2, 1])
    for inside in (False, True):
        assert list(np.array(fetch.texel(buffer, x, y, 5, 3, precision.types, inside=inside))) == [0, 4, 14, 6]


def test_a_coordinate_that_is_nan_reads_a_texel_and_no_wild_address(precision):
    buffer = precision.lanes([1.0, 2.0, 3.0, 4.0])
    nowhere = precision.lanes([np.nan, np.inf, -1e30, 1e30])
    z, *_ = fetch.nearest(buffer, nowhere, nowhere, 2, 2, precision.types)
    assert set(np.array(z)) <= {1.0, 2.0, 3.0, 4.0}
    field = fetch.affine_field(buffer, 2, 2, 0.1, True, precision.types)
    z, *_ = fetch.linear(field, nowhere, nowhere, 2, 2, True, precision.types)
    assert len(np.array(z)) == 4


def test_texels_beyond_the_integers_of_float32_are_still_told_apart():
    """4097 x 4097 texels: a flat index above 2^24 is even in float32."""
    from gtao import backend

    types = backend.types_of(backend.default_float())
    side = 4097
    column = dr.arange(types.UInt, side * side) % side
    z, *_ = fetch.nearest(
        types.Float(column), types.Float([side - 1.0, side - 2.0]), types.Float([side - 1.0] * 2), side, side, types
    )
    assert list(np.array(z)) == [side - 1, side - 2]
