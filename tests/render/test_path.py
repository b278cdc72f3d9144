"""Transport against the stock path tracer: one render against one per albedo."""

from _statistics import assert_no_excess, assert_same_mean

import _path
import _scenes as S
import numpy as np
import pytest

from gtao import render

ALBEDOS = (0.1, 0.3, 0.5, 0.7, 0.9)
SIZE, SPP, BATCHES = 40, 256, 16
SCENES = {"box": S.cornell, "stairs": S.stairs, "balls": S.balls}


def batches(t, rho, n_bounces):
    """(n_batches, N) light after up to ``n_bounces`` surfaces over the albedo: the sum of rho^(k-1) T_k."""
    walks = t.spp // t.n_batches
    return np.tensordot(rho ** np.arange(n_bounces), t.escaped[:, :n_bounces] / walks, axes=(0, 1))


@pytest.fixture(scope="module", params=SCENES)
def transported(request):
    scene = render.load_scene(SCENES[request.param](SIZE))
    return scene, render.transport(scene, n_bounces=4, spp=SPP, seed=5, n_batches=BATCHES)


@pytest.mark.parametrize("rho", ALBEDOS)
def test_four_bounces_at_every_albedo(transported, rho):
    scene, t = transported
    stock = _path.reflected(scene, rho, 4, SPP, BATCHES, seed=3).reshape(BATCHES, -1)[:, t.pixel]
    ours = batches(t, rho, 4)
    assert_same_mean(stock.mean(1), ours.mean(1))
    # Pixel by pixel, off the edges where a ray may meet either of two surfaces.
    inner = ~t.edge
    variance = (stock.var(0, ddof=1) + ours.var(0, ddof=1)) / BATCHES
    assert_no_excess((stock.mean(0) - ours.mean(0))[inner], variance[inner])


@pytest.mark.parametrize("n_bounces", [1, 2, 3])
def test_fewer_bounces(transported, n_bounces):
    scene, t = transported
    stock = _path.reflected(scene, 0.8, n_bounces, SPP, BATCHES, seed=4).reshape(BATCHES, -1)[:, t.pixel]
    assert_same_mean(stock.mean(1), batches(t, 0.8, n_bounces).mean(1))


def _coarse_ball():
    vertices, faces = S.sphere_grid(10, 14)
    return {"ball": S.mesh(vertices, faces, normals=vertices), "ground": S.cube([-5, -5, -2], [5, 5, -1])}


def _leaning_floor():
    """A flat floor whose normals lean by 40 degrees, towards a wall on one side."""
    corners = np.array([[-4, -4, 0], [4, -4, 0], [4, 4, 0], [-4, 4, 0]], float)
    lean = np.tile([np.sin(0.7), 0.0, np.cos(0.7)], (4, 1))
    floor = S.mesh(corners, [[0, 1, 2], [0, 2, 3]], normals=lean)
    return {"floor": floor, "wall": S.cube([1, -3, -1], [1.5, 3, 2]), "block": S.cube([-1, 0.5, -1], [0, 2, 0.6])}


@pytest.mark.parametrize("shapes", [_coarse_ball, _leaning_floor])
def test_smooth_normals(shapes):
    """The stock tracer's treatment of normals that are not those of the faces is ours, at every bounce."""
    scene = render.load_scene(S.scene(S.perspective((0, -4, 1), (0, 0, 0), size=(SIZE, SIZE)), **shapes()))
    t = render.transport(scene, n_bounces=3, spp=SPP, seed=1, n_batches=BATCHES)
    stock = _path.reflected(scene, 0.8, 3, SPP, BATCHES, seed=2).reshape(BATCHES, -1)[:, t.pixel]
    ours = batches(t, 0.8, 3)
    assert_same_mean(stock.mean(1), ours.mean(1))
    variance = (stock.var(0, ddof=1) + ours.var(0, ddof=1)) / BATCHES
    assert_no_excess(stock.mean(0) - ours.mean(0), variance)
