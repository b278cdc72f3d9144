"""What ``gtao animate`` is asked for: settings, sources that move, methods with options."""

import itertools
import json
import math
from pathlib import Path

import numpy as np
import pytest
from animate_runs import PIPELINE, SCENE, config

import gtao
from gtao import io, render, workflows
from gtao.workflows.animation.methods import PIPELINES, methods_of
from gtao.workflows.animation.sources import read_path, source_of
from gtao.workflows.options import changed_pipeline, pipeline_from_options


class TestSources:
    def test_more_frames_than_an_animation_has(self):
        source = source_of(config("orbit", frames=200))
        assert source.n_frames == source.animation.n_frames == 200
        assert source_of(config("orbit", frames=None)).n_frames == render.animations.get("orbit").n_frames

    def test_a_cut_lies_at_half_of_the_frames(self):
        for frames, cut in ((None, render.animations.get("cut").cut), (16, 8), (5, 2), (100, 50)):
            source = source_of(config("cut", frames=frames))
            poses = [source.animation.state(i).camera for i in range(source.n_frames)]
            assert [i for i in range(1, source.n_frames) if (poses[i] != poses[i - 1]).any()] == [cut] == [source.cut]
        with pytest.raises(gtao.ConfigError, match="at least 2 frames, got 1"):
            source_of(config("cut", frames=1))

    def test_movers_go_by_number_where_no_shape_has_the_id(self, tmp_path):
        path = tmp_path / "path.json"
        path.write_text(json.dumps({"movers": {"0": [np.eye(4).tolist()] * 2}}))
        named = tmp_path / "named.xml"
        named.write_text(SCENE.replace('type="rectangle"', 'type="rectangle" id="0"'))
        plain = tmp_path / "plain.xml"
        plain.write_text(SCENE)
        kinds = []
        for scene in (plain, named):
            animation = source_of(config(str(scene), frames=None, path=str(path))).animation
            kinds += [mover.shape.class_name() for mover in animation.stage.moved.values()]
        assert kinds == ["Sphere", "Rectangle"]

    @pytest.mark.parametrize(
        ("content", "words"),
        [
            ({"camera": 3, "movers": {"ball": 2}}, r"different lengths: camera has 3, mover 'ball' has 2; .*--frames"),
            ({"cut": 1}, r"no list of matrices .*; give --frames"),
            ({"movers": {"bull": 2}}, r"path .*\.json: there is no shape 'bull'"),
        ],
    )
    def test_a_path_that_does_not_fit_is_told_in_words_of_the_command(self, tmp_path, content, words):
        lists = {"camera": lambda n: [np.eye(4).tolist()] * n, "cut": lambda n: n}
        lists["movers"] = lambda ways: {name: lists["camera"](n) for name, n in ways.items()}
        (tmp_path / "path.json").write_text(json.dumps({key: lists[key](value) for key, value in content.items()}))
        (tmp_path / "scene.xml").write_text(SCENE)
        with pytest.raises(gtao.ConfigError, match=words) as error:
            source_of(config(str(tmp_path / "scene.xml"), frames=None, path=str(tmp_path / "path.json")))
        assert "n_frames" not in str(error.value)

    def test_a_camera_goes_around_what_it_looks_at(self):
        source = source_of(config("trench", orbit=90.0, frames=9))
        poses = [np.array(frame.g.view_to_world) for frame in render.sequence(source.animation)]
        origin = render.view_to_world(render.load_scene("trench", resolution=32))
        assert poses[0] == pytest.approx(origin, abs=1e-5)
        turns = [a[:3, :3].T @ b[:3, :3] for a, b in itertools.pairwise(poses)]
        angles = [math.acos((np.trace(turn) - 1) / 2) for turn in turns]
        assert angles == pytest.approx([math.radians(10)] * 8, abs=1e-5)
        # The point in the middle stays in the middle, as far away as it was.
        z = float(np.median(render.gbuffer(render.load_scene("trench", resolution=32)).view_z.numpy()))
        middle = [pose[:3, 3] - z * pose[:3, 2] for pose in poses]
        assert np.ptp(middle, axis=0) == pytest.approx(np.zeros(3), abs=1e-4)

    def test_a_file_moves_a_scene(self, tmp_path):
        scene = tmp_path / "ball.xml"
        scene.write_text(SCENE)
        moves = [np.eye(4) for _ in range(3)]
        for i, move in enumerate(moves):
            move[0, 3] = 0.5 * i
        path = tmp_path / "path.json"
        path.write_text(json.dumps({"movers": {"ball": [m.tolist() for m in moves]}, "cut": 2}))
        source = source_of(config(str(scene), frames=None, path=str(path)))
        assert (source.n_frames, source.cut) == (3, 2)
        assert list(source.origin) == ["path", "bytes", "sha256", "moved_by"]
        shown = list(render.sequence(source.animation))
        assert [bool(frame.moving.numpy().any()) for frame in shown] == [True] * 3
        centres = [np.argwhere(frame.moving.numpy())[:, 1].mean() for frame in shown]
        assert centres[0] < centres[1] < centres[2]

    @pytest.mark.parametrize(
        ("content", "words"),
        [
            ("no json", "is not a path.*; mend the file"),
            ("[]", "must hold an object with camera, movers or cut"),
            ("{}", "must hold an object"),
            ('{"cameras": []}', "must hold an object"),
            ('{"camera": 3}', "camera must be a list"),
            ('{"movers": {"a": 3}}', "every mover must be a list"),
            ('{"cut": "x"}', "cut must be the number of a frame"),
            ('{"camera": []}', "has an empty list"),
        ],
    )
    def test_a_wrong_path_is_told(self, tmp_path, content, words):
        path = tmp_path / "path.json"
        path.write_text(content)
        with pytest.raises(gtao.ConfigError, match=words):
            read_path(path)


class TestMethods:
    def test_options_of_all_and_of_each(self):
        given = methods_of([f"{PIPELINE},temporal.frames=12", "gtao,n_slices=3"], ["n_steps=5"], 0.7)
        assert [m.name for m in given] == [f"{PIPELINE},temporal.frames=12", "gtao,n_slices=3"]
        assert [m.file for m in given] == ["published-pipeline-temporal.frames-12", "gtao-n-slices-3"]
        first, second = (m.pipeline for m in given)
        assert first.temporal.frames == 12
        assert first.occlusion.n_steps == second.occlusion.n_steps == 5
        assert second.occlusion.n_slices == 3
        assert first.occlusion.radius == second.occlusion.radius == 0.7
        assert given[0].forgetful.temporal is None
        assert given[0].forgetful.spatial == first.spatial
        assert given[1].forgetful is None

    def test_a_radius_among_the_options_makes_the_whole_preset(self):
        for name, make in PIPELINES.items():
            (given,) = methods_of([f"{name},radius=0.2"], [], 0.7)
            assert given.pipeline == make(0.2)

    def test_a_file_describes_a_method(self, tmp_path):
        pipeline = gtao.Pipeline.as_published(0.3)
        (tmp_path / "mine.json").write_text(io.pretty_json(pipeline.to_dict()))
        (tmp_path / "bare.json").write_text(io.pretty_json(gtao.GTAO().to_dict()))
        text = f"{tmp_path / 'mine.json'},temporal.clamp=false"
        mine, bare = methods_of([text, str(tmp_path / "bare.json")], [], 0.7)
        assert mine.name == "mine,temporal.clamp=false"
        assert mine.pipeline.occlusion.radius == 0.3
        assert not mine.pipeline.temporal.clamp
        assert bare.pipeline.occlusion == gtao.GTAO()

    def test_files_have_names_of_their_own(self, tmp_path):
        (tmp_path / "truth.json").write_text(io.pretty_json(gtao.GTAO().to_dict()))
        given = methods_of([str(tmp_path / "truth.json"), "gtao,n_slices=1", "gtao,n-slices=1"[:4] + ",n_slices=1 "],
                           [], 1.0)  # fmt: skip
        assert [m.file for m in given] == ["truth-2", "gtao-n-slices-1", "gtao-n-slices-1-2"]

    @pytest.mark.parametrize(
        "content", [{"kind": "animation", "seed": 1}, {"type": "TemporalFilter"}, [1], {"type": []}]
    )
    def test_a_file_that_describes_none_is_told(self, tmp_path, content):
        (tmp_path / "record.json").write_text(json.dumps(content))
        with pytest.raises(gtao.ConfigError, match=r"record\.json: it describes none; such a file") as error:
            methods_of([str(tmp_path / "record.json")], [], 1.0)
        assert len(str(error.value)) < 400

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("magic", "method must be one of published-pipeline, recommended-temporal, gtao, "),
            ("gtao,slices=3", "there is no option 'slices'"),
            ("gtao,n_slices", "an option is written key=value"),
            ("missing.json", "cannot take a method from missing.json"),
            ("published-pipeline,temporal.frames=5", "temporal.moving_frames must not exceed frames"),
            ("gtao,falloff.start=2", "falloff: LinearFalloff also needs end"),
            ("recommended,radius=inf", "method recommended,radius=inf: "),
            (f"{PIPELINE},temporal.frames=0", "frames must be at least 1"),
        ],
    )
    def test_wrong_methods_are_told(self, text, words):
        with pytest.raises(gtao.ConfigError, match=words):
            methods_of([text], [], 1.0)


def test_stages_are_options():
    pipeline = pipeline_from_options("gtao", ["downsample.factor=4", "upsample.type=PlaneAwareUpsample",
                                              "temporal.frames=16", "spatial.passes=2"], 1.0)  # fmt: skip
    assert pipeline.downsample == gtao.Downsample(factor=4)
    assert pipeline.upsample == gtao.PlaneAwareUpsample()
    assert pipeline.temporal == gtao.TemporalFilter(frames=16)
    assert pipeline.spatial == gtao.EdgeAwareFilter(passes=2)
    assert changed_pipeline(pipeline, ["temporal=none", "spatial=none"]).temporal is None


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"methods": ()}, "no method"),
        ({"methods": ("gtao", "gtao")}, "more than once"),
        ({"frames": 0}, "frames must be at least 1"),
        ({"radius": -1.0}, "radius must be positive"),
        ({"radius": math.nan}, "radius must be positive"),
        ({"resolution": 8}, "at least 16"),
        ({"spp": 8}, "spp must be a multiple of 8, 16 at least"),
        ({"spp": 20}, "spp must be a multiple of 8"),
        ({"video": "avi"}, "video must be one of auto, mp4, gif"),
        ({"error_limit": 0.0}, "error_limit must lie in"),
        ({"seed": -1}, "seed must lie in"),
        ({"orbit": 90.0, "path": "a.json"}, "not both"),
        ({"orbit": 1e5}, "orbit must be"),
        ({"up": "w"}, "up must be one of"),
        ({"up": "x"}, "up is the axis of an orbit: give --orbit"),
    ],
)
def test_wrong_settings_are_told(options, words):
    with pytest.raises(gtao.ConfigError, match=words):
        workflows.AnimateConfig(**options)


def test_a_path_says_how_many_frames_there_are():
    options = {"quick": True, "animation": "trench"}
    assert workflows.AnimateConfig.from_options(**options).frames == 16
    assert workflows.AnimateConfig.from_options(**options, path="a.json").frames is None
    assert workflows.AnimateConfig.from_options(**options, path="a.json", frames=3).frames == 3


def test_an_example_of_the_documentation_exists():
    """The page of the command names animations, which are those that there are."""
    text = (Path(__file__).parents[2] / "docs" / "howto" / "animate.md").read_text()
    for name in render.animations.names():
        assert f"`{name}`" in text
