"""Scenes from every source, and one clear line for every bad one."""

import numpy as np
import pytest

from gtao import SceneError, render

import mitsuba as mi  # isort: skip

import _scenes as S

XML = """<scene version="3.0.0">
  <sensor type="perspective">
    <float name="fov" value="50"/>
    <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="20"/></film>
  </sensor>
  <shape type="sphere"/>
</scene>"""


@pytest.fixture
def xml(tmp_path):
    def write(text=XML, name="scene.xml"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


def test_from_a_file_a_dict_a_name_and_a_scene(xml):
    path = xml()
    from_path, from_text = render.load_scene(path), render.load_scene(str(path))
    from_dict = render.load_scene(S.stairs(8))
    from_name = render.load_scene("stairs")
    for scene in (from_path, from_text, from_dict, from_name):
        assert isinstance(scene, mi.Scene)
        assert render.gbuffer(scene).mask.numpy().any()
    assert render.load_scene(from_dict) is from_dict


def test_every_embedded_name_loads():
    for name in render.scenes.names("analytic"):
        assert render.load_scene(name, resolution=8).sensors()


@pytest.mark.parametrize(("resolution", "shape"), [(None, (20, 40)), (80, (40, 80)), ((30, 50), (50, 30)), (1, (1, 1))])
def test_resolution(xml, resolution, shape):
    scene = render.load_scene(xml(), resolution=resolution)
    g = render.gbuffer(scene)
    assert g.shape == shape
    # The horizontal field of view stays.
    assert 2 * np.degrees(np.arctan(0.5 * g.camera.width / g.camera.fx)) == pytest.approx(50, rel=1e-5)
    if min(shape) > 1:
        valid = g.mask.numpy()
        radius = np.linalg.norm(g.position_v.numpy()[valid] - [0, 0, -4], axis=-1)
        np.testing.assert_allclose(radius, 1, atol=1e-5)


def test_resolution_of_a_cropped_film_is_that_of_the_window():
    d = S.plane(S.perspective((0, 0, 3), (0, 0, 0), up=(0, 1, 0), size=(60, 40)))
    d["sensor"]["film"].update(crop_offset_x=30, crop_offset_y=20, crop_width=30, crop_height=20)
    small, large = (render.gbuffer(render.load_scene(d, resolution=r)) for r in (None, (60, 40)))
    assert (small.shape, large.shape) == ((20, 30), (40, 60))
    corner = [g.position_v.numpy()[-1, -1] for g in (small, large)]
    pixel = 3 / small.camera.fx
    assert np.abs(corner[0] - corner[1]).max() < pixel


def test_resolution_of_an_embedded_scene():
    assert render.gbuffer(render.load_scene("stairs", resolution=24)).shape == (24, 24)
    assert render.gbuffer(render.load_scene("stairs", resolution=(24, 16))).shape == (16, 24)


@pytest.mark.parametrize("resolution", [0, -3, (4, 0), (4, 4, 4), 2.5, "big"])
def test_bad_resolution(resolution):
    with pytest.raises(SceneError, match="resolution must be"):
        render.load_scene(S.stairs(8), resolution=resolution)


def test_a_loaded_scene_keeps_its_resolution():
    with pytest.raises(SceneError, match="resolution cannot change a loaded scene"):
        render.load_scene(render.load_scene(S.stairs(8)), resolution=16)


BROKEN = {
    "not closed": ("<scene version='3.0.0'><shape type='sphere'></scene>", "mismatch"),
    "empty": ("", "No document element"),
    "unknown plugin": ("<scene version='3.0.0'><shape type='spherical'/></scene>", 'Plugin "spherical" not found'),
    "missing mesh": (
        "<scene version='3.0.0'><shape type='ply'><string name='filename' value='no.ply'/></shape></scene>",
        "file not found",
    ),
    "unknown property": (
        "<scene version='3.0.0'><shape type='sphere'><float name='size' value='1'/></shape></scene>",
        "unreferenced property",
    ),
    "parameter": (
        "<scene version='3.0.0'><shape type='sphere'><float name='radius' value='$r'/></shape></scene>",
        r"undefined parameter: \$r",
    ),
    "not a scene": ("<bsdf version='3.0.0' type='diffuse'/>", "describes a BSDF, not a scene"),
}


@pytest.mark.parametrize(("text", "reason"), BROKEN.values(), ids=BROKEN.keys())
def test_broken_files_say_why_in_one_line(xml, text, reason):
    path = xml(text, "broken.xml")
    with pytest.raises(SceneError, match=reason) as error:
        render.load_scene(path)
    message = str(error.value)
    assert "broken.xml" in message
    assert "\n" not in message
    assert ".cpp" not in message


def test_sources_that_are_no_scene(tmp_path):
    with pytest.raises(SceneError, match=r"no scene file .*missing\.xml"):
        render.load_scene(tmp_path / "missing.xml")
    with pytest.raises(SceneError, match=r"no scene file missing\.xml"):
        render.load_scene("missing.xml")
    with pytest.raises(SceneError, match=r"is a directory; give the scene's \.xml file"):
        render.load_scene(tmp_path)
    with pytest.raises(SceneError, match=r"no embedded scene is called 'stares'; .* one of: .*stairs"):
        render.load_scene("stares")
    with pytest.raises(SceneError, match="scene dictionary describes a Shape, not a scene"):
        render.load_scene({"type": "sphere"})
    with pytest.raises(SceneError, match=r"cannot load scene dictionary: .*unreferenced property"):
        render.load_scene({"type": "scene", "a": {"type": "sphere", "foo": 1}})
    with pytest.raises(SceneError, match="got list"):
        render.load_scene([])
