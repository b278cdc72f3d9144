"""Closed forms of the analytic scenes against quadrature from the definition, and against the scenes themselves."""

import math

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from gtao import ConfigError, render
from gtao.render import scenes

N_GRID = 400
#: A blocked region whose border crosses every row and every column of the grid at most twice touches at most 4 N of
#: the N² cells, and a cell is wrong by at most a half.
QUADRATURE = 2 / N_GRID

#: (scene, parameters): the defaults and another set.
CASES = [
    ("open_plane", {}),
    ("open_plane", {"tilt": 1.0}),
    ("closed_box", {}),
    ("v_groove", {}),
    ("v_groove", {"angle": 0.7}),
    ("wall", {}),
    ("wall", {"d": 0.5, "k": 2.0}),
    ("trench", {}),
    ("trench", {"d1": 0.4, "d2": 2.0, "k": 3.0}),
    ("pit", {}),
    ("pit", {"radius": 0.5, "k": 0.8}),
    ("bowl", {}),
    ("bowl", {"opening": 0.7}),
    ("corner", {}),
]


def hemisphere(normal):
    """Directions on a regular grid whose density is the cosine to ``normal`` (Malley), as (N², 3)."""
    u, v = (np.arange(N_GRID) + 0.5) / N_GRID, 2 * np.pi * (np.arange(N_GRID) + 0.5) / N_GRID
    sine, azimuth = (a.ravel() for a in np.meshgrid(np.sqrt(u), v, indexing="ij"))
    normal = np.asarray(normal, float)
    tangent = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    tangent /= np.linalg.norm(tangent)
    local = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.sqrt(1 - sine**2)], -1)
    return local @ np.stack([tangent, np.cross(normal, tangent), normal])


def height_at(p, w, axis, plane):
    """Height of the ray where it crosses a plane across ``axis``; inf where it never does."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (plane - p[axis]) / w[:, axis]
        return np.where(t > 1e-9, p[2] + t * w[:, 2], np.inf)


def wall_open(p, w, d=1.0, k=1.0):
    return (w[:, 2] > 0) & (height_at(p, w, 0, d) > k) & (height_at(p, w, 0, d + 1) > k)


def trench_open(p, w, d1=1.0, d2=0.5, k=1.0):
    return (w[:, 2] > 0) & (height_at(p, w, 0, -d1) > k) & (height_at(p, w, 0, d2) > k)


def pit_open(p, w, radius=1.0, k=1.0):
    a, b = np.sum(w[:, :2] ** 2, axis=-1), w[:, :2] @ p[:2]
    t = (-b + np.sqrt(np.maximum(b * b - a * (p[:2] @ p[:2] - radius**2), 0))) / a
    return (w[:, 2] > 0) & (p[2] + t * w[:, 2] > k)


def bowl_open(p, w, opening=0.25):
    return (p - 2 * (w @ p)[:, None] * w)[:, 2] > 1 - 2 * opening


def groove_open(p, w, angle=math.pi / 2):
    other = (-math.copysign(math.cos(angle / 2), -p[0]), 0, math.sin(angle / 2))
    return w @ other > 0


def corner_open(p, w):
    return np.all(w > 0, axis=-1)


UP, X = (0, 0, 1), (1, 0, 0)


@pytest.mark.parametrize(
    ("name", "is_open", "parameters", "points"),
    [
        ("wall", wall_open, {}, [((0, 0, 0), UP), ((0.9, 5, 0), UP), ((-6, 0, 0), UP), ((4, 0, 0), UP)]),
        ("wall", wall_open, {"d": 2.0, "k": 0.5}, [((0, 0, 0), UP), ((2, 1, 0.3), (-1, 0, 0))]),
        ("trench", trench_open, {}, [((0, 0, 0), UP), ((-0.8, 0, 0), UP), ((0.5, 0, 0.3), (-1, 0, 0))]),
        ("trench", trench_open, {"d1": 0.4, "d2": 2.0, "k": 3.0}, [((1, 0, 0), UP), ((-0.4, 0, 2.5), X)]),
        ("pit", pit_open, {}, [((0, 0, 0), UP), ((0.3, 0.6, 0), UP), ((-1, 0, 0.1), X), ((-1, 0, 0.7), X)]),
        ("pit", pit_open, {"radius": 2.0, "k": 0.5}, [((0, 0, 0), UP), ((1.9, 0, 0), UP), ((-2, 0, 0.2), X)]),
        ("bowl", bowl_open, {}, [((0, 0, -1), UP), ((-1, 0, 0), X), ((-0.8, 0, 0.45), (0.8716, 0, -0.4903))]),
        ("bowl", bowl_open, {"opening": 0.7}, [((0, 0, -1), UP), ((0.6, 0, -0.8), (-0.6, 0, 0.8))]),
        ("v_groove", groove_open, {"angle": 0.8}, [((-math.sin(0.4), 0, math.cos(0.4)), None)]),
        ("v_groove", groove_open, {}, [((-3, 1, 3), None), ((-0.1, 1, 0.1), None)]),
        ("corner", corner_open, {}, [((1, 2, 0), UP), ((0, 0.1, 3), X), ((5, 0, 0.2), (0, 1, 0))]),
    ],
)
def test_closed_form_is_the_integral(name, is_open, parameters, points):
    expected = scenes.get(name).expected_visibility
    for point, normal in points:
        p = np.array(point, float)
        if normal is None:
            half = parameters.get("angle", math.pi / 2) / 2
            normal = (math.cos(half), 0, math.sin(half))
        if name == "bowl":
            p, normal = p / np.linalg.norm(p), -p / np.linalg.norm(p)
        share = is_open(p, hemisphere(normal), **parameters).mean()
        assert expected(p[None], **parameters)[0] == pytest.approx(share, abs=QUADRATURE), (point, normal)


def test_tops_and_brims_are_open():
    for name, point in (("wall", (1.5, 0, 1)), ("trench", (-3, 2, 1)), ("pit", (1.3, 0, 1)), ("bowl", (1.1, 0, 0.5))):
        assert scenes.get(name).expected_visibility(np.array([point], float))[0] == 1, name


def first_hits(scene, sensor, size):
    """Points, triangle normals and normals that face the camera behind the pixel centres, each (n, 3)."""
    x, y = ((a.ravel() + 0.5) / size for a in np.meshgrid(np.arange(size), np.arange(size)))
    ray, _ = sensor.sample_ray(0.0, 0.5, mi.Point2f(x, y), mi.Point2f(0.5))
    si = scene.ray_intersect(ray)
    seen = np.array(si.is_valid())
    facing = dr.select(dr.dot(si.n, ray.d) > 0, -si.n, si.n)
    return (np.array(v).T[seen] for v in (si.p, si.n, facing))


@pytest.mark.parametrize(("name", "parameters"), CASES)
def test_scene_has_its_closed_form(name, parameters):
    """Rays against the scene itself, in a stratified pattern that is jittered for each point."""
    n = 16
    scene = mi.load_dict(scenes.build(name, width=24, height=24, **parameters))
    rng = np.random.default_rng(20)
    for sensor in scene.sensors():
        position, n_geo, facing = first_hits(scene, sensor, 24)
        cells = np.stack(np.meshgrid(np.arange(n), np.arange(n)), -1).reshape(1, -1, 2)
        u = ((cells + rng.random((len(position), n * n, 2))) / n).reshape(-1, 2)
        local = mi.warp.square_to_cosine_hemisphere(mi.Point2f(u[:, 0], u[:, 1]))
        start = dr.zeros(mi.SurfaceInteraction3f)
        start.p, start.n, around = (mi.Vector3f(*np.repeat(v, n * n, axis=0).T) for v in (position, n_geo, facing))
        blocked = np.array(scene.ray_test(start.spawn_ray(mi.Frame3f(around).to_world(local))))
        measured = 1 - blocked.reshape(len(position), -1).mean(axis=1)
        error = measured - scenes.get(name).expected_visibility(position.astype(float), **parameters)
        # The border of the sky cuts at most 4 n of the n² strata, each of which then has a deviation of at most
        # 1/2: together 1 / n^(3/2) for a point. Points are independent; the largest of 576 stays below 6 of them.
        deviation = n**-1.5
        assert np.abs(error).max() < 6 * deviation
        assert abs(error.mean()) < 4 * deviation / math.sqrt(len(error))


@pytest.mark.parametrize("name", [name for name in scenes.names("analytic") if scenes.get(name).uniform])
def test_transport_of_uniform_scenes(name):
    """Walks in the scene leave it with the same probability at every step."""
    expected = scenes.uniform_transport(scenes.get(name).expected_visibility(np.zeros((1, 3)))[0], 6)
    scene = render.load_scene(name, resolution=(24, 24))
    for sensor in range(len(scene.sensors())):
        result = render.transport(scene, n_bounces=6, spp=256, sensor=sensor, n_batches=16)
        shares = result.escaped.mean(axis=2) / (result.spp / result.n_batches)
        error = shares.std(axis=0, ddof=1) / math.sqrt(result.n_batches)
        # Faces that end at FAR, offsets of rays and facets of circles change T_k by about 1e-4.
        np.testing.assert_array_less(np.abs(shares.mean(axis=0) - expected), 5 * error + 3e-4)


def test_uniform_transport():
    T = scenes.uniform_transport(0.25, 30)
    assert T[:3] == pytest.approx([0.25, 0.1875, 0.140625])
    assert T.sum() == pytest.approx(1 - 0.75**30)
    assert scenes.uniform_transport(1.0, 3).tolist() == [1, 0, 0]
    assert scenes.uniform_transport(0.0, 2).tolist() == [0, 0]
    for bad in ((1.5, 3), (0.5, 0)):
        with pytest.raises(ConfigError, match="need 0 <= visibility <= 1"):
            scenes.uniform_transport(*bad)
