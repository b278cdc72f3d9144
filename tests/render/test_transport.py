"""Transport images against counting, closed forms and their own variance."""

import math

import numpy as np
import pytest

from gtao import ConfigError, GBuffer, SceneError, render
from gtao.render import chunks

import drjit as dr  # isort: skip

from _statistics import assert_mean_is, assert_no_excess

import _scenes as S


def groove_view():
    return S.perspective((0, 0, 1), (0, 0, 0), up=(0, 1, 0), fov=30.0, size=(24, 24))


def load(scene):
    return render.load_scene(scene)


def uniform(visibility, n_bounces):
    """T_k of a surface that sees the same share of the sky everywhere."""
    return visibility * (1 - visibility) ** np.arange(n_bounces)


def assert_uniform(t, visibility, n_bounces, allowance):
    expected = uniform(visibility, n_bounces)
    images = t.T.reshape(n_bounces, -1)[:, t.pixel].astype(np.float64)
    for k in range(n_bounces):
        assert_mean_is(images[k], expected[k], allowance=allowance)


def test_every_walk_is_counted_once():
    t = render.transport(load(S.stairs(32)), n_bounces=3, spp=64, seed=3)
    assert t.escaped.shape == (8, 3, len(t.pixel))
    assert t.remaining.shape == (8, len(t.pixel))
    assert t.escaped.dtype == t.remaining.dtype == np.uint16
    np.testing.assert_array_equal(t.escaped.sum(1) + t.remaining, 8)
    np.testing.assert_allclose(t.T.sum(0) + t.remainder, 1, atol=1e-6)
    assert t.remaining.any()
    assert (np.diff(t.pixel.astype(int)) > 0).all()


@pytest.mark.parametrize("share", [0.05, 0.2, 0.5])
def test_spherical_bowl(share):
    """A sphere without a cap of area share s sees s of the sky everywhere: T_k = s (1 - s)^(k-1)."""
    vertices, faces = S.sphere_grid(200, 400, theta_min=math.acos(1 - 2 * share))
    d = S.scene(S.perspective((0, 0, -0.1), (0.3, 0.2, -1), fov=60.0, size=(24, 24)), bowl=S.mesh(vertices, faces))
    t = render.transport(load(d), n_bounces=6, spp=512, seed=1)
    # Facets 0.016 across lie 0.016² / 8 inside the sphere and are that much smaller, relatively.
    assert_uniform(t, share, 6, allowance=1e-4)


@pytest.mark.parametrize("degrees", [60, 120])
def test_groove(degrees):
    """Half planes see (1 - cos α)/2 of the sky at every point, so light in a groove is as in a bowl."""
    alpha = math.radians(degrees)
    t = render.transport(load(S.groove(alpha, groove_view())), n_bounces=6, spp=512, seed=2)
    # The ends of the half planes, x / (2 L) for walks that stay within x < 5 of the seam nearly always.
    assert_uniform(t, (1 - math.cos(alpha)) / 2, 6, allowance=3e-4)


def test_closed_box_keeps_everything():
    d = S.closed_box(S.perspective((0.5, 0.3, -0.2), (-1, -0.8, 0.3), fov=70.0))
    t = render.transport(load(d), n_bounces=5, spp=16)
    assert not t.escaped.any()
    assert np.all(t.remaining == 2)
    assert np.all(t.remainder == 1)


def test_plane_loses_everything_at_once():
    t = render.transport(load(S.plane(groove_view())), n_bounces=5, spp=16)
    assert np.all(t.visibility == 1)
    assert not t.remaining.any()


def test_background():
    d = S.scene(S.perspective((0, 0, 4), (0, 0, 0), up=(0, 1, 0)), ball={"type": "sphere"})
    scene = load(d)
    t = render.transport(scene, n_bounces=3, spp=16)
    background = ~render.gbuffer(scene).mask.numpy()
    assert background.any()
    assert np.array_equal(np.sort(t.pixel), np.flatnonzero(~background))
    assert np.all(t.T[0][background] == 1)
    assert np.all(t.T[1:, background] == 0)
    assert np.all(t.remainder[background] == 0)
    assert np.all(t.variance[:, background] == 0)


def test_an_empty_view():
    scene = load(S.scene(S.perspective((0, 0, 4), (0, 0, 8), up=(0, 1, 0)), ball={"type": "sphere"}))
    t = render.transport(scene, n_bounces=3, spp=16)
    assert t.escaped.shape == (8, 3, 0)
    assert np.all(t.visibility == 1)


def test_materials_and_lamps_do_not_matter():
    """Black, mirror, one-sided and emitting surfaces are all the same to the walk."""
    scene = load(S.stairs(24))
    plain = render.transport(scene, n_bounces=3, spp=32)
    d = S.stairs(24)
    del d["dome"]
    d["step0"]["bsdf"] = {"type": "conductor"}
    d["step1"]["bsdf"] = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
    d["step2"]["bsdf"] = {"type": "dielectric"}
    d["step3"]["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": 5.0}}
    mixed = render.transport(load(d), n_bounces=3, spp=32)
    np.testing.assert_array_equal(plain.escaped, mixed.escaped)


def test_first_bounce_is_the_visibility_of_the_same_seed():
    scene = load(S.balls(32))
    t = render.transport(scene, n_bounces=2, spp=64, seed=4)
    v = render.visibility(scene, spp=64, seed=4)
    np.testing.assert_array_equal(t.visibility, v.mean.numpy())
    np.testing.assert_allclose(t.variance[0], v.variance.numpy(), atol=1e-8)


def test_normals_of_the_buffer_count():
    scene = load(S.balls(32))
    flat = render.transport(scene, n_bounces=2, spp=16, normals="geometric")
    same = render.transport(scene, render.gbuffer(scene), n_bounces=2, spp=16, normals="shading")
    own = render.transport(scene, n_bounces=2, spp=16)
    # Normals through the view frame and back differ in the last digit, which may turn a grazing ray.
    assert np.mean(same.escaped != own.escaped) < 1e-3
    g = render.gbuffer(scene)
    n = g.normal_v.numpy().copy()
    n[..., 0], n[..., 2] = 0.8 * n[..., 0] - 0.6 * n[..., 2], 0.6 * n[..., 0] + 0.8 * n[..., 2]
    turned = GBuffer(g.view_z, n, g.camera)
    assert render.transport(scene, turned, n_bounces=2, spp=16).visibility.mean() < own.visibility.mean() - 0.01
    assert flat.visibility.mean() == pytest.approx(own.visibility.mean(), abs=0.01)


def test_variance_and_independence_of_batches():
    """Squared differences between seeds, and between halves of the batches, are what the variance says."""
    scene = load(S.stairs(32))
    a, b = (render.transport(scene, n_bounces=3, spp=64, seed=s) for s in (1, 2))
    off = a.T.astype(np.float64) - b.T
    for k in range(3):
        assert_no_excess(off[k].flat[a.pixel], (a.variance + b.variance)[k].flat[a.pixel].astype(np.float64))
    halves = a.escaped.astype(np.float64).reshape(2, 4, 3, -1) / 8
    difference = halves[0].mean(0) - halves[1].mean(0)
    variance = (halves[0].var(0, ddof=1) + halves[1].var(0, ddof=1)) / 4
    for k in range(3):
        assert_no_excess(difference[k], variance[k])


def test_same_seed_same_bits_however_the_work_is_cut(monkeypatch):
    scene = load(S.balls(32))
    first = render.transport(scene, n_bounces=4, spp=32, seed=9)
    threads = dr.thread_count()
    monkeypatch.setattr(chunks, "PATHS_PER_CHUNK", 1000)
    steps = []
    try:
        dr.set_thread_count(1)
        second = render.transport(scene, n_bounces=4, spp=32, seed=9, progress=lambda *s: steps.append(s))
    finally:
        dr.set_thread_count(threads)
    for name in ("escaped", "remaining", "pixel", "edge"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))
    assert steps == [(i, len(steps)) for i in range(1, len(steps) + 1)]
    assert len(steps) > 8
    other = render.transport(scene, n_bounces=4, spp=32, seed=10)
    assert not np.array_equal(first.escaped, other.escaped)


def test_fewer_bounces_are_the_first_of_many():
    scene = load(S.balls(24))
    many, few = (render.transport(scene, n_bounces=k, spp=32, seed=1) for k in (6, 2))
    np.testing.assert_array_equal(many.escaped[:, :2], few.escaped)
    np.testing.assert_array_equal(many.escaped[:, 2:].sum(1) + many.remaining, few.remaining)


def test_another_seed_depth_or_count_compiles_nothing():
    scene = load(S.stairs(16))
    render.transport(scene, n_bounces=3, spp=16, seed=0)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history()
        render.transport(scene, n_bounces=5, spp=32, seed=77)
        history = [k for k in dr.kernel_history() if "cache_hit" in k]
    assert history
    assert all(k["cache_hit"] for k in history)


def test_edges_are_jumps_of_depth_and_not_creases():
    # A post before a wall, seen straight on: its outline is an edge, the seam of wall and floor is not.
    d = S.scene(
        S.perspective((0, -6, 1), (0, 0, 1), size=(40, 40)),
        floor=S.cube([-9, -9, -1], [9, 9, 0]),
        wall=S.cube([-9, 1, -1], [9, 2, 9]),
        post=S.cube([-0.3, -1.2, -1], [0.3, -0.6, 1.3]),
    )
    t = render.transport(load(d), n_bounces=1, spp=16)
    edge = np.zeros((40, 40), bool)
    edge.flat[t.pixel] = t.edge
    assert edge.any(1).argmax() > 5, "top of the wall"
    row = np.flatnonzero(edge[18])
    assert len(row) == 4, "two pixels at either side of the post"
    assert row[1] - row[0] == row[3] - row[2] == 1
    assert not edge[:, :8].any(), "the crease between wall and floor"


def test_edges_against_the_background():
    scene = load(S.scene(S.perspective((0, 0, 4), (0, 0, 0), up=(0, 1, 0)), ball={"type": "sphere"}))
    t = render.transport(scene, n_bounces=1, spp=16)
    edge = np.zeros((32, 32), bool)
    edge.flat[t.pixel] = t.edge
    mask = render.gbuffer(scene).mask.numpy()
    padded = np.pad(mask, 1, constant_values=True)
    open_side = ~(padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:])
    np.testing.assert_array_equal(edge, mask & open_side)


def test_many_walks_per_batch_need_wider_counters():
    t = render.transport(
        load(S.plane(S.perspective((0, 0, 3), (0, 0, 0), up=(0, 1, 0), size=(1, 1)))), n_bounces=1, spp=1 << 20
    )
    assert t.escaped.dtype == np.uint32
    assert np.all(t.escaped == 1 << 17)


def test_bad_requests():
    scene = load(S.plane(groove_view()))
    with pytest.raises(ConfigError, match="n_bounces must be a positive integer, got 0"):
        render.transport(scene, n_bounces=0)
    with pytest.raises(ConfigError, match="spp must be a multiple of n_batches"):
        render.transport(scene, spp=100)
    with pytest.raises(ConfigError, match="normals must be one of"):
        render.transport(scene, normals="none")
    with pytest.raises(SceneError, match="there is no sensor 3"):
        render.transport(scene, sensor=3)
    t = render.transport(scene, n_bounces=2, spp=16)
    assert repr(t) == "Transport(24x24, 2 bounces, 16 walks per pixel)"
    assert t._repr_png_().startswith(b"\x89PNG")
