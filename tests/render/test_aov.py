"""G-buffers from the stock ``aov`` integrator: its conventions undone, its jitter bounded."""

import numpy as np
import pytest

from gtao import ImageError, SceneError, ShapeError, render

import mitsuba as mi  # isort: skip

import _scenes as S

NEAR = 1.5
PATH = {"type": "path", "max_depth": 2}
ALL = "dd.y:depth,nn:sh_normal,pos:position,al:albedo"


def slanted_wall(kind="perspective", near=NEAR):
    """A wall that slants away behind which there is nothing; (scene, its plane n·p = d in world space)."""
    origin, target = (0.3, -4.0, 0.5), (0.0, 0.0, 0.2)
    if kind == "perspective":
        sensor = S.perspective(origin, target, fov=70.0, near=near, size=(40, 30))
    else:
        to_world = S.look_at(origin, target) @ S.transform().scale([2.5, 2.5, 1])
        sensor = {"type": "orthographic", "near_clip": near, "to_world": to_world, "film": S.film(40, 30)}
    turn = S.transform().rotate([0, 0, 1], 35) @ S.transform().rotate([1, 0, 0], 90)
    d = S.scene(sensor, wall=S.rectangle(turn @ S.transform().scale([1.5, 1.2, 1]), reflectance=[0.2, 0.4, 0.8]))
    normal = np.array(turn.matrix)[:3, 2]
    return render.load_scene(d), normal


def rendered(scene, aovs, nested=True):
    """The film after a render with one sample per pixel."""
    integrator = {"type": "aov", "aovs": aovs}
    if nested:
        integrator["img"] = PATH
    mi.render(scene, integrator=mi.load_dict(integrator), spp=1, seed=3)
    return scene.sensors()[0].film()


def corner_bounds(camera, view_to_world, normal_w, from_depth):
    """Smallest and largest view_z that a jittered ray of each pixel can give for the plane through the origin.

    Ray lengths are turned into depths with the direction of the pixel's centre, as the image does not know better.
    """
    x, y = np.meshgrid(np.arange(camera.width + 1.0), np.arange(camera.height + 1.0))
    n = normal_w @ view_to_world[:3, :3]
    offset = -normal_w @ view_to_world[:3, 3]
    if camera.is_orthographic:
        P = np.stack([(x - camera.cx) / camera.fx, (camera.cy - y) / camera.fy, np.zeros_like(x)], -1)
        z = -(offset - P @ n) / n[2]
        return _extremes(z)
    d = np.stack([(x - camera.cx) / camera.fx, (camera.cy - y) / camera.fy, -np.ones_like(x)], -1)
    z = offset / (d @ n)
    if not from_depth:
        return _extremes(z)
    t = (z - camera.near) * np.linalg.norm(d, axis=-1)
    xc, yc = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    centre = np.stack([(xc - camera.cx) / camera.fx, (camera.cy - yc) / camera.fy, -np.ones_like(xc)], -1)
    return (camera.near + bound / np.linalg.norm(centre, axis=-1) for bound in _extremes(t))


def _extremes(corners):
    four = np.stack([corners[:-1, :-1], corners[1:, :-1], corners[:-1, 1:], corners[1:, 1:]])
    return four.min(0), four.max(0)


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
@pytest.mark.parametrize(
    ("aovs", "from_depth"),
    [("dd.y:depth,nn:sh_normal", True), ("nn:sh_normal,pos:position", False), (ALL, False)],
    ids=["depth", "position", "all"],
)
def test_agrees_with_the_unfiltered_buffer_within_a_pixel(kind, aovs, from_depth):
    scene, normal = slanted_wall(kind)
    sensor = scene.sensors()[0]
    exact = render.gbuffer(scene)
    g = render.gbuffer_from_aov(rendered(scene, aovs), sensor)
    assert g.view_to_world == exact.view_to_world
    both = g.mask.numpy() & exact.mask.numpy()
    # A jittered ray may miss the wall where the centre's meets it, along the outline only.
    outline = _outline(exact.mask.numpy())
    assert np.all(outline[g.mask.numpy() != exact.mask.numpy()])
    assert both.sum() > 200

    camera, view_to_world = render.camera_from_sensor(sensor)
    low, high = corner_bounds(camera, view_to_world, normal, from_depth)
    z, slack = g.view_z.numpy(), 1e-5 * exact.view_z.numpy()
    assert np.all((z >= low - slack)[both])
    assert np.all((z <= high + slack)[both])
    # The bounds are a pixel's slope wide and no more: the near plane alone would be ten times that.
    assert np.median((high - low)[both]) < NEAR / 10
    np.testing.assert_allclose(g.normal_v.numpy()[both], exact.normal_v.numpy()[both], atol=1e-5)


def _outline(mask):
    padded = np.pad(mask, 1)
    neighbours = np.stack([padded[i : i + mask.shape[0], j : j + mask.shape[1]] for i in range(3) for j in range(3)])
    return neighbours.any(0) & ~neighbours.all(0)


def test_normals_face_the_viewer_from_either_side():
    for origin in ((0, 0, 0.3), (0, 0, 3)):
        d = S.scene(S.perspective(origin, (0.1, 0, 0.6 if origin[2] < 1 else 0)), ball={"type": "sphere"})
        scene = render.load_scene(d)
        g = render.gbuffer_from_aov(rendered(scene, "dd.y:depth,nn:sh_normal"), scene.sensors()[0])
        exact = render.gbuffer(scene)
        both = g.mask.numpy() & exact.mask.numpy() & ~_outline(exact.mask.numpy())
        cosine = (g.normal_v.numpy() * exact.normal_v.numpy()).sum(-1)[both]
        # One pixel turns the normal of this ball by a few degrees.
        assert cosine.min() > np.cos(np.radians(10))


@pytest.mark.parametrize("nested", [True, False])
def test_channels_are_found_by_name_in_any_order(nested):
    scene, _ = slanted_wall()
    sensor = scene.sensors()[0]
    first = render.gbuffer_from_aov(rendered(scene, ALL), sensor)
    shuffled = render.gbuffer_from_aov(
        rendered(scene, "al:albedo,pos:position,dd.y:depth,nn:sh_normal", nested), sensor
    )
    for name in ("view_z", "normal_v", "albedo"):
        np.testing.assert_array_equal(getattr(first, name).numpy(), getattr(shuffled, name).numpy())
    np.testing.assert_allclose(
        first.albedo.numpy()[first.mask.numpy()], [[0.2, 0.4, 0.8]] * first.mask.numpy().sum(), atol=1e-6
    )


def test_own_names_and_images_on_disk(tmp_path):
    scene, _ = slanted_wall()
    sensor = scene.sensors()[0]
    film = rendered(scene, "a:depth,b:geo_normal,c:sh_normal,d:position")
    g = render.gbuffer_from_aov(film, sensor, normal="c", position="d")
    bitmap = film.bitmap()
    np.testing.assert_array_equal(
        render.gbuffer_from_aov(bitmap, sensor, depth="a", normal="b", position="d").view_z.numpy(), g.view_z.numpy()
    )
    path = tmp_path / "frame.exr"
    bitmap.write(str(path))
    for source in (path, str(path)):
        stored = render.gbuffer_from_aov(source, sensor, normal="c", position="d")
        np.testing.assert_array_equal(stored.view_z.numpy(), g.view_z.numpy())
        np.testing.assert_array_equal(stored.normal_v.numpy(), g.normal_v.numpy())


def test_missing_and_ambiguous_outputs():
    scene, _ = slanted_wall()
    sensor = scene.sensors()[0]
    with pytest.raises(ImageError, match=r"no normal \(XYZ\) output for it; it has: dd"):
        render.gbuffer_from_aov(rendered(scene, "dd:depth"), sensor)
    with pytest.raises(ImageError, match=r"no depth \(T\) output for it; it has: .*nn"):
        render.gbuffer_from_aov(rendered(scene, "nn:sh_normal"), sensor)
    film = rendered(scene, "near:depth,far:depth,nn:sh_normal")
    with pytest.raises(ImageError, match="several outputs for depth: near, far; pass depth="):
        render.gbuffer_from_aov(film, sensor)
    with pytest.raises(ImageError, match=r"no depth .* called 'middle'"):
        render.gbuffer_from_aov(film, sensor, depth="middle")
    assert render.gbuffer_from_aov(film, sensor, depth="far").mask.numpy().any()
    mi.render(scene, integrator=mi.load_dict(PATH), spp=1)
    with pytest.raises(ImageError, match="it has: nothing but colour"):
        render.gbuffer_from_aov(sensor.film(), sensor)


def test_bad_images(tmp_path):
    scene, _ = slanted_wall()
    sensor = scene.sensors()[0]
    with pytest.raises(ImageError, match=r"cannot read .*nothing\.exr"):
        render.gbuffer_from_aov(tmp_path / "nothing.exr", sensor)
    broken = tmp_path / "broken.exr"
    broken.write_bytes(b"not an image")
    with pytest.raises(ImageError, match=r"cannot read .*broken\.exr") as error:
        render.gbuffer_from_aov(broken, sensor)
    assert "\n" not in str(error.value)
    with pytest.raises(ImageError, match=r"must be a mitsuba\.Bitmap, a mitsuba\.Film or a path, got TensorXf"):
        render.gbuffer_from_aov(mi.render(scene, integrator=mi.load_dict(PATH), spp=1), sensor)
    other = mi.load_dict(S.perspective((0, -4, 0), (0, 0, 0), size=(8, 8)))
    with pytest.raises(ShapeError, match="the image is 40x30 pixels, the sensor 8x8"):
        render.gbuffer_from_aov(rendered(scene, ALL), other)
    with pytest.raises(SceneError, match=r"expected a mitsuba\.Sensor"):
        render.gbuffer_from_aov(rendered(scene, ALL), 0)
