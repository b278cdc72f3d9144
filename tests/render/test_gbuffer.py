"""G-buffers against the scene itself."""

import numpy as np
import pytest

import gtao
from gtao import ConfigError, SceneError, render

import mitsuba as mi  # isort: skip

import _scenes as S

# World positions of a few units, in float32, through two transforms.
POSITION_TOLERANCE = 1e-5


def _interactions(scene, sensor=0):
    """Mitsuba's own hits at the pixel centres, one ray at a time per pixel: (valid, p, n, sh_n, direction)."""
    sensor = scene.sensors()[sensor]
    width, height = (int(v) for v in sensor.film().crop_size())
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    ray, _ = sensor.sample_ray(0.0, 0.5, mi.Point2f(x.ravel(), y.ravel()), mi.Point2f(0.5))
    si = scene.ray_intersect(ray)
    shape = (height, width, 3)
    arrays = (
        np.broadcast_to(v.numpy().T, (width * height, 3)).reshape(shape) for v in (si.p, si.n, si.sh_frame.n, ray.d)
    )
    return si.is_valid().numpy().reshape(shape[:2]), *arrays


def _faceted_ball(sensor):
    """A coarse sphere with smooth vertex normals: the two kinds of normal differ by degrees."""
    vertices, faces = S.sphere_grid(12, 18)
    return S.scene(sensor, ball=S.mesh(vertices, faces, normals=vertices))


SCENES = {
    "box": lambda: S.closed_box(S.perspective((0.5, 0.3, -0.2), (-1, -0.8, 0.3), fov=70.0, size=(31, 23))),
    "ball": lambda: _faceted_ball(S.perspective((0, -4, 1), (0, 0, 0), size=(30, 20), near=1.5)),
    "inside a ball": lambda: S.scene(
        S.perspective((0, 0.2, 0.1), (1, 0, 0), fov=90.0, near=0.1), ball={"type": "sphere", "bsdf": S.matte()}
    ),
    "orthographic": lambda: _faceted_ball(
        {
            "type": "orthographic",
            "near_clip": 0.7,
            "to_world": S.look_at((0, -4, 1), (0, 0, 0)) @ S.transform().scale([1.5, 1.5, 1.2]),
            "film": S.film(30, 20),
        }
    ),
}


@pytest.mark.parametrize("make", SCENES.values(), ids=SCENES.keys())
@pytest.mark.parametrize("normals", ["shading", "geometric"])
def test_positions_and_normals_are_those_of_the_scene(make, normals):
    scene = render.load_scene(make())
    g = render.gbuffer(scene, normals=normals)
    _, view_to_world = render.camera_from_sensor(scene.sensors()[0])
    valid, p, n_geo, n_sh, direction = _interactions(scene)

    np.testing.assert_array_equal(g.mask.numpy(), valid)
    assert np.all(np.isinf(g.view_z.numpy()[~valid]))
    np.testing.assert_array_equal(g.view_to_world, view_to_world)
    position_w = g.position_v.numpy() @ view_to_world[:3, :3].T + view_to_world[:3, 3]
    assert np.abs(position_w - p)[valid].max() < POSITION_TOLERANCE

    n_w = g.normal_v.numpy() @ view_to_world[:3, :3].T
    n = n_sh if normals == "shading" else n_geo
    n = np.where((n * direction).sum(-1, keepdims=True) > 0, -n, n)
    assert np.abs(n_w - n)[valid].max() < POSITION_TOLERANCE
    assert np.all((n_w * direction).sum(-1)[valid] <= POSITION_TOLERANCE)
    assert np.abs(np.linalg.norm(n_w, axis=-1) - 1)[valid].max() < POSITION_TOLERANCE


def test_the_two_kinds_of_normal_differ_on_a_coarse_mesh():
    scene = render.load_scene(SCENES["ball"]())
    shading = render.gbuffer(scene, normals="shading")
    geometric = render.gbuffer(scene, normals="geometric")
    cosine = (shading.normal_v.numpy() * geometric.normal_v.numpy()).sum(-1)[shading.mask.numpy()]
    assert np.degrees(np.arccos(cosine.min())) > 5


def test_view_z_is_along_the_optical_axis_whatever_the_near_plane():
    for near in (0.01, 1.0, 2.9):
        wall = S.rectangle(S.transform().rotate([1, 0, 0], 90) @ S.transform().scale([50, 50, 1]))
        d = S.scene(S.perspective((0, -3, 0), (0, 0, 0), fov=80.0, near=near), wall=wall)
        g = render.gbuffer(render.load_scene(d))
        np.testing.assert_allclose(g.view_z.numpy(), 3.0, rtol=1e-6)


def test_view_z_keeps_its_digits_far_from_the_origin():
    offset = np.array([3e4, -2e4, 1e4])
    wall = S.rectangle(
        S.transform().translate(list(offset)) @ S.transform().rotate([1, 0, 0], 90) @ S.transform().scale([50, 50, 1])
    )
    d = S.scene(S.perspective(offset - np.array([0, 3, 0]), offset, fov=80.0), wall=wall)
    g = render.gbuffer(render.load_scene(d))
    # The hit points themselves are only known to 3e4 * 2^-24 in such coordinates.
    np.testing.assert_allclose(g.view_z.numpy(), 3.0, atol=4e-3)


def test_a_vertex_without_a_normal_gets_the_face_normal():
    vertices = [[-1, -1, 0], [1, -1, 0], [0, 1, 0]]
    d = S.scene(
        S.perspective((0, 0, 4), (0, 0, 0), up=(0, 1, 0)), triangle=S.mesh(vertices, [[0, 1, 2]], np.zeros((3, 3)))
    )
    g = render.gbuffer(render.load_scene(d))
    assert g.mask.numpy().any()
    np.testing.assert_allclose(g.normal_v.numpy()[g.mask.numpy()], [[0, 0, 1]] * g.mask.numpy().sum(), atol=1e-6)


def _albedo_of(bsdf, **shape):
    d = S.scene(S.perspective((0, 0, 4), (0, 0, 0), up=(0, 1, 0)), plate={"type": "rectangle", "bsdf": bsdf, **shape})
    g = render.gbuffer(render.load_scene(d))
    return g.albedo.numpy(), g.mask.numpy()


def _rgb(*value):
    return {"type": "rgb", "value": list(value)}


COLOUR = (0.1, 0.5, 0.9)


@pytest.mark.parametrize(
    ("bsdf", "expected"),
    [
        ({"type": "diffuse", "reflectance": _rgb(*COLOUR)}, COLOUR),
        ({"type": "twosided", "b": {"type": "diffuse", "reflectance": _rgb(*COLOUR)}}, COLOUR),
        ({"type": "principled", "base_color": _rgb(*COLOUR)}, COLOUR),
        ({"type": "plastic", "diffuse_reflectance": _rgb(*COLOUR)}, COLOUR),
        ({"type": "conductor"}, (0, 0, 0)),
        ({"type": "roughconductor"}, (0, 0, 0)),
        ({"type": "dielectric"}, (0, 0, 0)),
    ],
    ids=lambda v: v["type"] if isinstance(v, dict) else "",
)
def test_albedo_is_the_diffuse_reflectance(bsdf, expected):
    albedo, mask = _albedo_of(bsdf)
    np.testing.assert_allclose(albedo[mask], np.broadcast_to(expected, albedo[mask].shape), atol=1e-6)
    assert np.all(albedo[~mask] == 0)


def test_albedo_of_the_back_of_a_two_sided_sheet():
    turned = S.transform().rotate([0, 1, 0], 180)
    albedo, mask = _albedo_of(
        {"type": "twosided", "b": {"type": "diffuse", "reflectance": _rgb(*COLOUR)}}, to_world=turned
    )
    np.testing.assert_allclose(albedo[mask], np.broadcast_to(COLOUR, albedo[mask].shape), atol=1e-6)


def test_albedo_follows_a_texture():
    checks = {"type": "checkerboard", "color0": _rgb(0.2, 0.3, 0.4), "color1": _rgb(0.8, 0.7, 0.6)}
    albedo, mask = _albedo_of({"type": "diffuse", "reflectance": checks})
    assert {tuple(np.round(c.astype(float), 4)) for c in albedo[mask]} == {(0.2, 0.3, 0.4), (0.8, 0.7, 0.6)}


def test_every_sensor_has_its_own_buffer():
    d = S.plane(S.perspective((0, 0, 3), (0, 0, 0), up=(0, 1, 0)))
    d["second"] = S.perspective((0, 0, 5), (0, 0, 0), up=(0, 1, 0), size=(20, 10))
    scene = render.load_scene(d)
    assert render.gbuffer(scene, 0).view_z.numpy().max() == pytest.approx(3)
    second = render.gbuffer(scene, 1)
    assert second.shape == (10, 20)
    assert second.view_z.numpy().max() == pytest.approx(5)
    own = mi.load_dict(S.perspective((0, 0, 7), (0, 0, 0), up=(0, 1, 0)))
    assert render.gbuffer(scene, own).view_z.numpy().max() == pytest.approx(7)


def test_bad_requests():
    scene = render.load_scene(S.cornell(8))
    with pytest.raises(ConfigError, match="normals must be one of shading, geometric, got 'smooth'"):
        render.gbuffer(scene, normals="smooth")
    with pytest.raises(SceneError, match="there is no sensor 1: the scene has one sensor, number 0"):
        render.gbuffer(scene, 1)
    with pytest.raises(SceneError, match="there is no sensor -1"):
        render.gbuffer(scene, -1)
    with pytest.raises(SceneError, match="sensor must be an index"):
        render.gbuffer(scene, "main")
    with pytest.raises(SceneError, match=r"expected a mitsuba\.Scene"):
        render.gbuffer({"type": "scene"})
    with pytest.raises(SceneError, match="no sensor; add one"):
        render.gbuffer(render.load_scene({"type": "scene", "s": {"type": "sphere"}}))
    assert render.gbuffer(scene, albedo=False).albedo is None
    assert isinstance(render.gbuffer(scene), gtao.GBuffer)
