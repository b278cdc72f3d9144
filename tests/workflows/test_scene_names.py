"""What scenes are called in tables, plots and records."""

import pytest

from gtao.errors import SceneError
from gtao.workflows.views import scene_names


@pytest.mark.parametrize(
    ("sources", "names"),
    [
        (["pile", "stairs"], ["pile", "stairs"]),
        (["a/room.xml", "b/garden.xml"], ["room", "garden"]),
        (["a/room.xml", "b/room.xml", "c/room.xml"], ["room", "room (2)", "room (3)"]),
        (["bunny/scene.xml", "dragon/scene.xml"], ["bunny", "dragon"]),
        (["bunny.xml", "bunny/scene.xml"], ["bunny", "bunny (2)"]),
        # Embedded scenes keep their names, wherever they stand.
        (["a/pile.xml", "pile", "b/pile.xml"], ["pile (2)", "pile", "pile (3)"]),
        (["a/pile.xml", "stairs"], ["pile", "stairs"]),
    ],
)
def test_names_are_short_and_differ(sources, names):
    assert scene_names(sources) == dict(zip(names, sources, strict=True))


def test_a_scene_in_the_working_directory_has_its_name(tmp_path, monkeypatch):
    (tmp_path / "bunny").mkdir()
    monkeypatch.chdir(tmp_path / "bunny")
    assert scene_names(["scene.xml"]) == {"bunny": "scene.xml"}


def test_one_scene_given_twice(tmp_path):
    (tmp_path / "link.xml").symlink_to("room.xml")
    room, link = str(tmp_path / "room.xml"), str(tmp_path / "link.xml")
    for sources in (["pile", "stairs", "pile"], [room, room], [room, link], [room, f"{tmp_path}/./room.xml"]):
        with pytest.raises(SceneError, match="scenes given more than once: "):
            scene_names(sources)
