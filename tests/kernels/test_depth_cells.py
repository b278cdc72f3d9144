"""Cells of a depth buffer, and the pyramid of bounds on them, against the reconstruction's definition."""

import numpy as np
import pytest
from kernels.test_ray_path import FIELDS, scene
from oracles import fields, reconstruction

from gtao.kernels import depth_bounds
from gtao.kernels.depth_cells import DepthCells, basis


def points(field, n=500, seed=0):
    """Texel coordinates anywhere in the frame."""
    height, width = field.view_z.shape
    rng = np.random.default_rng(seed)
    return rng.uniform(-0.499, width - 0.501, n), rng.uniform(-0.499, height - 0.501, n)


@pytest.mark.parametrize("fetch", ["linear", "nearest"])
@pytest.mark.parametrize("name", FIELDS)
def test_the_surface_is_the_reconstruction(precision, name, fetch):
    field = FIELDS[name]()
    _, cells, _ = scene(field, precision, fetch, 1.0)
    surface = reconstruction.Surface.of(field, fetch)
    assert fetch == "nearest" or name == "blocks" or 0 <= surface.edge.mean() < 0.5
    x, y = points(field)
    w0 = 0.1
    got, px, py = (np.array(v) for v in cells.at(precision.lanes(x), precision.lanes(y), precision.lanes([w0])))
    want = surface.at(x, y)
    assert np.array_equal(np.isfinite(got), np.isfinite(want))
    finite = np.isfinite(want)
    assert got[finite] == pytest.approx(want[finite] - w0, abs=precision.tolerance * np.abs(want[finite]).max())
    edge = surface.is_edge(x, y)
    column, row = surface.texel(x, y)
    assert px == pytest.approx(np.where(edge, column, x), abs=1e-5)
    assert py == pytest.approx(np.where(edge, row, y), abs=1e-5)


@pytest.mark.parametrize("fetch", ["linear", "nearest"])
@pytest.mark.parametrize("name", FIELDS)
def test_no_point_of_the_surface_is_above_its_bound(precision, name, fetch):
    """At every level; and somewhere in each node the bound is reached, at a corner of a cell."""
    field = FIELDS[name]()
    _, cells, _ = scene(field, precision, fetch, 1.0)
    bounds = depth_bounds.pyramid(cells)
    surface = reconstruction.Surface.of(field, fetch)
    height, width = field.view_z.shape
    fine = np.linspace(0, 1, 9)
    lattice_x, lattice_y = (np.unique(np.add.outer(np.arange(-1, n), fine).ravel()) for n in (width, height))
    x, y = np.meshgrid(
        lattice_x[(lattice_x >= -0.5) & (lattice_x <= width - 0.5)],
        lattice_y[(lattice_y >= -0.5) & (lattice_y <= height - 0.5)],
    )
    # A lattice point on the border of texels or cells belongs to all of them: look at every side of it.
    side_x, side_y = np.array([[-1], [-1], [1], [1]]) * 1e-9, np.array([[-1], [1], [-1], [1]]) * 1e-9
    x = np.clip(x.ravel() + side_x, -0.5, width - 0.5).ravel()
    y = np.clip(y.ravel() + side_y, -0.5, height - 0.5).ravel()
    w = surface.at(x, y)
    i, j = np.clip(np.floor(x), 0, width - 2).astype(int), np.clip(np.floor(y), 0, height - 2).astype(int)
    scale = np.abs(w[np.isfinite(w)]).max()
    T = precision.types
    assert 2**bounds.depth >= max(width, height) - 1
    for level in range(bounds.depth + 1):
        got = np.array(bounds.at(T.Int(i.astype(np.int32)), T.Int(j.astype(np.int32)), T.UInt(level)))
        assert (got >= w - precision.tolerance * scale).all()
        nodes = (j >> level) * (width >> level) * 4 + (i >> level)
        for node in np.unique(nodes):
            inside = nodes == node
            if np.isfinite(got[inside][0]):
                assert got[inside].max() == pytest.approx(w[inside].max(), abs=2e-6 * scale)


@pytest.mark.parametrize("shape", [(1, 1), (1, 6), (5, 1), (2, 2), (3, 7)])
def test_bounds_of_small_frames(precision, shape):
    height, width = shape
    view_z = np.random.default_rng(0).uniform(1, 2, shape)
    buffer = precision.Float((1 / view_z).ravel().astype(precision.name))
    cells = DepthCells.of(buffer, width, height, False, True, precision.types)
    bounds = depth_bounds.pyramid(cells)
    T = precision.types
    root = np.array(bounds.at(T.Int([0, 99, -1]), T.Int([0, 99, -1]), T.UInt(bounds.depth)))
    assert root == pytest.approx(np.full(3, (1 / view_z).max()), rel=precision.tolerance)


def test_a_basis_is_orthonormal_and_right_handed(precision):
    rng = np.random.default_rng(0)
    n = rng.normal(size=(300, 3))
    n[:4] = [[0, 0, 1], [0, 0, -1], [1, 0, 0], [1e-4, -1e-4, -1]]
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    got = basis(tuple(precision.lanes(c) for c in n.T))
    b1, b2 = (np.stack([np.broadcast_to(np.array(c), 300) for c in b], axis=1) for b in got)
    frame = np.stack([b1, b2, n], axis=1)
    assert frame @ frame.transpose(0, 2, 1) == pytest.approx(
        np.broadcast_to(np.eye(3), (300, 3, 3)), abs=precision.tolerance
    )
    assert np.linalg.det(frame) == pytest.approx(np.ones(300), abs=precision.tolerance)


def test_single_texels_are_read_where_there_are_no_cells(precision):
    """One row: both corners of a cell above one another are the same texel."""
    buffer = precision.lanes([0.5, 0.25, 1.0])
    cells = DepthCells.of(buffer, 3, 1, False, True, precision.types)
    cell = cells.read(precision.lanes([0, 1, 2, -1]), precision.lanes([0, 0, 0, -1]), 0)
    want = [[0.5, 0.25, 0.25, 0.5], [0.25, 1.0, 1.0, 0.25]]
    for corner, expected in zip(cell.corners, (*want, *want), strict=True):
        assert np.array(corner) == pytest.approx(expected)


def test_fields_have_edges_and_cells_without(precision):
    """What the tests above rest on: the fields hold both kinds of cells."""
    for name, low, high in (("waves", 0.0, 0.0), ("steps", 0.1, 0.6), ("steps and holes", 0.1, 0.6)):
        edge = reconstruction.Surface.of(FIELDS[name](), "linear").edge
        assert low <= edge.mean() <= high
    assert isinstance(FIELDS["steps"](), fields.Field)
