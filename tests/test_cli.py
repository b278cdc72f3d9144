"""The command line: what it does when all is well, and the one line that it says when not."""

import json
import math
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

import gtao
from gtao import _llvm, cli, io, workflows

SPP = 16

SCENE = """<scene version="3.0.0">
  <shape type="sphere"/>
  <sensor type="perspective">
    <float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, {target}" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="12"/></film>
  </sensor>
</scene>
"""


#: A floor whose vertex normals lean, with a ball on it: shading and geometric normals are not the same here.
LEANING_FLOOR = """
v -3 0 -3\nv 3 0 -3\nv 3 0 3\nv -3 0 3
vn 0.4 0.9 0\nvn 0 0.9 0.4\nvn -0.4 0.9 0\nvn 0 0.9 -0.4
f 1//1 3//3 2//2\nf 1//1 4//4 3//3
"""
CAMERA = """
  <sensor type="perspective">
    <float name="fov" value="60"/>
    <transform name="to_world"><lookat origin="{origin}" target="0, 0.5, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/></film>
  </sensor>"""
TWO_VIEWS = f"""<scene version="3.0.0">
  <shape type="obj"><string name="filename" value="floor.obj"/></shape>
  <shape type="sphere"><point name="center" value="0, 0.7, 0"/></shape>
  {CAMERA.format(origin="0, 2, 5")}
  {CAMERA.format(origin="3, 1, 2")}
</scene>
"""


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str


@pytest.fixture
def command(monkeypatch, capfd):
    """Run ``gtao`` with arguments inside this process; ``capfd`` also sees what C code prints."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["gtao", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        return Outcome(stop.value.code, *capfd.readouterr())

    return run


def contents(folder):
    return {path.relative_to(folder): path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


@pytest.fixture
def refuses(command, tmp_path, monkeypatch):
    """Run ``gtao`` in the temporary folder: exit 2, one line with these words, not a file touched."""

    def run(*arguments, words=()):
        monkeypatch.chdir(tmp_path)
        before = contents(tmp_path)
        outcome = command(*arguments)
        assert outcome.code == 2
        assert outcome.out == ""
        lines = outcome.err.splitlines()
        assert len(lines) == 1
        assert lines[0].startswith("gtao: ")
        for word in words:
            assert word in lines[0]
        assert contents(tmp_path) == before

    return run


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    """A rendered G-buffer, and the same without something that it needs."""
    folder = tmp_path_factory.mktemp("frames")
    workflows.render_scene("stairs", folder / "whole.exr", resolution=24, spp=SPP)
    channels, metadata = io.read_channels(folder / "whole.exr")
    z = channels["Z"]
    normals = {name: channels[name] for name in ("N.X", "N.Y", "N.Z")}
    manifest = metadata["manifest"]
    header = {"gtao": json.dumps(manifest)}
    nan = {**normals, "N.Y": np.where(np.indices(z.shape)[0] == 3, np.float32(np.nan), normals["N.Y"])}
    write(folder / "no_normals.exr", {"Z": z}, header)
    write(folder / "no_depth.exr", normals, header)
    write(folder / "no_camera.exr", {"Z": z, **normals}, {})
    write(folder / "nan_normals.exr", {"Z": z, **nan}, header)
    write(folder / "nan_depth.exr", {"Z": np.where(z == z[3, 3], np.float32(np.nan), z), **normals}, header)
    write(folder / "long_normals.exr", {"Z": z, **{name: 2 * n for name, n in normals.items()}}, header)
    write(folder / "negative_depth.exr", {"Z": -z, **normals}, header)
    whole = (folder / "whole.exr").read_bytes()
    (folder / "cut.exr").write_bytes(whole[: 2 * len(whole) // 3])
    (folder / "flipped.exr").write_bytes(whole[:-200] + bytes(255 - b for b in whole[-200:]))
    (folder / "text.exr").write_text("no image")
    (folder / "camera.json").write_text(json.dumps(manifest["camera"]))
    (folder / "wide.json").write_text(json.dumps(gtao.PerspectiveCamera(30, 24, 1.0).to_dict()))
    return folder


def write(path, channels, attributes):
    """An EXR as anybody may write one; the binding changes the dicts that it is given."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **attributes}
    OpenEXR.File(header, {name: np.ascontiguousarray(plane) for name, plane in channels.items()}).write(str(path))


@pytest.fixture
def here(frames, tmp_path):
    """The frames, in the temporary folder."""
    for path in frames.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    return tmp_path


SCENES = {
    "missing.xml": (None, "no scene file missing.xml"),
    "broken.xml": ("<scene version='3.0.0'><shape type=", "cannot load scene broken.xml"),
    "empty.xml": ("", "cannot load scene empty.xml"),
    "plugin.xml": ("<scene version='3.0.0'><shape type='spheer'/></scene>", 'Plugin "spheer" not found'),
    "bsdf.xml": ("<bsdf version='3.0.0' type='diffuse'/>", "describes a BSDF, not a scene"),
    "blind.xml": ("<scene version='3.0.0'><shape type='sphere'/></scene>", "has no sensor"),
    "lens.xml": (
        SCENE.format(target=0).replace(
            '"perspective">',
            '"thinlens"><float name="aperture_radius" value="0.1"/><float name="focus_distance" value="4"/>',
        ),
        "ThinLensCamera have no G-buffer",
    ),
    "away.xml": (SCENE.format(target=9), "no pixel of scene away.xml shows a surface"),
    "stares": (None, "no embedded scene is called 'stares'"),
    ".": (None, "is a directory"),
}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("verb", ["render", "refit"])
def test_bad_scene(refuses, tmp_path, verb, name):
    text, words = SCENES[name]
    if text is not None:
        (tmp_path / name).write_text(text)
    refuses(verb, name, "-o", "new/result.exr", "--spp", SPP, words=[words])


def test_bad_scene_leaves_an_earlier_result_alone(refuses, tmp_path):
    (tmp_path / "old").mkdir()
    for name in ("old/record.json", "old/coefficients.json", "old.exr"):
        (tmp_path / name).write_text("earlier")
    refuses("refit", "missing.xml", "-o", "old", words=["no scene file"])
    refuses("render", "missing.xml", "-o", "old.exr", words=["no scene file"])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--sensor", "7"], "there is no sensor 7: the scene has sensors 0 to 1"),
        (["--sensor", "-1"], "there is no sensor -1"),
        (["--normals", "smooth"], "normals must be one of shading, geometric, got 'smooth'"),
        (["--spp", "9"], "spp must be a multiple of n_batches (8), got 9"),
        (["--spp", "0"], "--spp"),
        (["--spp", "many"], "--spp"),
        (["--resolution", "0"], "--resolution"),
        (["--resolution", "1000000"], "--resolution"),
        (["--max-distance", "-1"], "must be positive or inf, got -1"),
        (["--max-distance", "nan"], "must be positive or inf, got nan"),
        (["--max-distance", "far"], "'far' is not a number"),
        (["--bounces", "-1"], "--bounces"),
        (["--seed", "-1"], "--seed"),
    ],
)
def test_bad_option_of_render(refuses, options, words):
    refuses("render", "stairs", "-o", "new/out.exr", "--resolution", 16, "--spp", SPP, *options, words=[words])


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("no_normals.exr", "has no normals"),
        ("no_depth.exr", "has no depth channel; it has N.X, N.Y, N.Z"),
        ("no_camera.exr", "does not say which camera made it"),
        ("nan_normals.exr", "normals N of nan_normals.exr are not finite at 24 surface pixels"),
        ("nan_depth.exr", "view_z is NaN"),
        ("long_normals.exr", "does not hold unit normals"),
        ("negative_depth.exr", "view_z must be positive"),
        ("cut.exr", "cannot read cut.exr: damaged or cut short"),
        ("flipped.exr", "cannot read flipped.exr: damaged or cut short"),
        ("text.exr", "it is not an OpenEXR image"),
        ("missing.exr", "there is no such file"),
        (".", "it is not a regular file"),
    ],
)
def test_bad_image(refuses, here, name, words):
    refuses("occlusion", name, "-o", "new/out.exr", words=[words])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--set", "radius=-1"], "radius must be positive, got -1.0"),
        (["--set", "radius=nan"], "radius must be positive, got nan"),
        (["--set", "radius=wide"], "radius must be a number, got 'wide'"),
        (["--set", "radius"], "an option is written key=value, got 'radius'"),
        (["--set", "raduis=1"], "there is no option 'raduis'; choose from radius, radius_multiplier"),
        (["--set", "n_slices=0"], "n_slices must be an integer from 1 to 1024, got 0"),
        (["--set", "n_slices=2.5"], "n_slices must be a whole number, got '2.5'"),
        (["--set", "snap_to_texel=1"], "snap_to_texel must be true or false, got '1'"),
        (["--set", "noise=pink"], "noise must be one of"),
        (["--set", "falloff.start=1"], "LinearFalloff also needs end"),
        (["--set", "seed=-1"], "seed must be an integer"),
        (["--method", "gatao"], "method must be one of gtao, published, hbao"),
        (["--frame", "-1"], "--frame"),
        (["--layer", "left"], "has no layer 'left'"),
        (["--fov-y", "180"], "fov_y must be in (0, pi) radians"),
        (["--fov-y", "nan"], "fov_y must be"),
        (["--camera", "wide.json"], "the camera is 30x24, but the frame of whole.exr is 24x24"),
        (["--camera", "camera.json", "--fov-y", "40"], "give a camera file or a field of view, not both"),
        (["--camera", "missing.json"], "cannot read camera missing.json"),
        (["--camera", "whole.exr"], "camera whole.exr is not JSON"),
    ],
)
def test_bad_option_of_occlusion(refuses, here, options, words):
    refuses("occlusion", "whole.exr", "-o", "new/out.exr", *options, words=[words])


@pytest.mark.parametrize(
    "text",
    [
        "[]",
        "{}",
        '{"type": ["perspective"], "width": 24, "height": 24, "fov_y": 1}',
        '{"type": "perspective"}',
        '{"type": "perspective", "width": "wide", "height": 24, "fov_y": 1}',
        '{"type": "perspective", "width": NaN, "height": 24, "fov_y": 1}',
        '{"type": "perspective", "width": Infinity, "height": 24, "fov_y": 1}',
        '{"type": "perspective", "width": 24, "height": 24, "fov_y": "wide"}',
        '{"type": "perspective", "width": 24, "height": 24, "fov_y": 1, "lens": 50}',
        '{"type": "perspective", "width": 24, "height": 24, "fov_y": 1, "to_view": "up"}',
        '{"type": "orthographic", "width": 24, "height": 24, "view_height": null}',
    ],
)
def test_bad_camera_file(refuses, here, text):
    (here / "bad.json").write_text(text)
    # Without a camera of its own the file needs this one; its normals then need the matrix.
    refuses("occlusion", "no_camera.exr", "-o", "out.exr", "--camera", "bad.json")


@pytest.mark.parametrize(
    ("output", "words"),
    [
        ("text.exr/below/out.exr", "a parent of it is a file, not a folder"),
        ("/dev/null/out.exr", "a parent of it is a file, not a folder"),
        ("null.exr", "it is a device or a pipe"),
        ("folder.exr", "it is a folder"),
    ],
)
@pytest.mark.parametrize("verb", [["render", "stairs"], ["occlusion", "whole.exr"]], ids=lambda verb: verb[0])
def test_unwritable_image_is_told_before_any_work(refuses, here, monkeypatch, verb, output, words):
    (here / "folder.exr").mkdir()
    (here / "null.exr").symlink_to("/dev/null")
    monkeypatch.setattr(gtao.render, "load_scene", lambda *_, **__: pytest.fail("a scene was loaded"))
    monkeypatch.setattr(io, "read_gbuffer", lambda *_, **__: pytest.fail("an image was read"))
    refuses(*verb, "-o", output, words=[words])


@pytest.mark.parametrize(
    ("output", "words"),
    [
        ("text.exr", "a parent of it is a file, not a folder"),
        ("text.exr/below", "a parent of it is a file, not a folder"),
        ("/dev/null/out", "a parent of it is a file, not a folder"),
        ("taken", "cannot write taken/record.json: it is a folder"),
    ],
)
def test_unwritable_folder_is_told_before_any_work(refuses, here, monkeypatch, output, words):
    monkeypatch.setattr(gtao.render, "load_scene", lambda *_, **__: pytest.fail("a scene was loaded"))
    (here / "taken" / "record.json").mkdir(parents=True)
    refuses("refit", "stairs", "--quick", "-o", output, words=[words])


def test_unwritable_cache_is_told_before_any_work(refuses, here, monkeypatch):
    monkeypatch.setattr(gtao.render, "load_scene", lambda *_, **__: pytest.fail("a scene was loaded"))
    refuses("refit", "stairs", "--quick", "-o", "out", "--cache", "text.exr", words=["cannot write text.exr/"])


def test_output_on_top_of_the_input(refuses, here):
    (here / "link.exr").symlink_to("whole.exr")
    for output in ("whole.exr", "./whole.exr", "link.exr"):
        refuses("occlusion", "whole.exr", "-o", output, words=["is the input; choose another name"])


def test_links_in_a_circle(refuses, here):
    (here / "a.exr").symlink_to("b.exr")
    (here / "b.exr").symlink_to("a.exr")
    refuses("occlusion", "a.exr", "-o", "out.exr", words=["cannot read a.exr"])
    refuses("occlusion", "whole.exr", "-o", "a.exr", words=["cannot write", "a.exr"])
    refuses("render", "a.exr", "-o", "out.exr", words=["a.exr"])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--bounces", "1"], "bounces must be 2, 3, 4, … or inf, got '1'"),
        (["--bounces", "2.5"], "bounces must be 2, 3, 4, … or inf, got '2.5'"),
        (["--bounces", "few"], "bounces must be 2, 3, 4, … or inf, got 'few'"),
        (["--bounces", "25"], "bounces is 25, but paths are traced through 24 only"),
        (["--form", "quartic"], "unknown form 'quartic'; choose one of linear_cubic"),
        (["--form", "sphere"], "form 'sphere' has no coefficients to fit"),
        (["--constraint", "convex"], "unknown constraint 'convex'; choose from zero_at_zero"),
        (["--procedure", "three-step"], "unknown procedure 'three-step'; choose one of joint, two-step"),
        (["--procedure", "two-step", "--form", "four_parameter"], "'two-step' fits 'linear_cubic' only"),
        (["--procedure", "two-step", "--constraint", "monotone"], "'two-step' cannot hold monotone"),
        (["--weighting", "heavy"], "unknown weighting 'heavy'; choose one of scene, pixel, uniform"),
        (["--regressor", "eye"], "regressor must be 'ray' or 'screen', got 'eye'"),
        (["--bootstrap", "1"], "n_bootstrap must be 0 (none) or at least 2, got 1"),
        (["--spp", "20"], "spp must be a multiple of 8, got 20"),
        (["--spp", "8"], "--spp"),
        (["--resolution", "4"], "--resolution"),
        (["--seed", "-1"], "--seed"),
        (["pile"], "scenes given more than once: pile"),
        (["--also-embedded"], "scenes given more than once: pile"),
    ],
)
def test_bad_option_of_refit_is_told_before_anything_is_traced(refuses, monkeypatch, options, words):
    monkeypatch.setattr(gtao.render, "load_scene", lambda *_, **__: pytest.fail("a scene was loaded"))
    refuses("refit", "pile", "-o", "out", "--quick", *options, words=[words])


def test_one_file_spelled_twice(refuses, tmp_path):
    (tmp_path / "ball.xml").write_text(SCENE.format(target=0))
    refuses("refit", "ball.xml", "./ball.xml", "-o", "out", words=["scenes given more than once: ball.xml, ./ball.xml"])


def test_scenes_that_determine_no_coefficients(refuses, tmp_path):
    # A lone ball sees the whole sky from everywhere.
    (tmp_path / "ball.xml").write_text(SCENE.format(target=0))
    refuses("refit", "ball.xml", "-o", "out", "--quick", words=["the data do not determine the coefficients"])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "no coefficient file at c.json"),
        ("{", "c.json"),
        ("{}", "not multi-bounce coefficients"),
        ('{"kind": "gtao.multibounce", "schema": 99}', "schema 99"),
    ],
)
def test_bad_coefficients(refuses, tmp_path, text, words):
    if text is not None:
        (tmp_path / "c.json").write_text(text)
    refuses("export", "c.json", words=[words])


def test_unknown_language(refuses, tmp_path):
    io.write_fit(tmp_path / "c.json", gtao.JIMENEZ2016)
    refuses("export", "c.json", "--language", "cobol", words=["'cobol'", "hlsl"])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["occlude"], "No such command 'occlude'"),
        (["--colour"], "No such option: --colour"),
        (["render"], "Missing argument"),
        (["render", "stairs"], "Missing option '-o'"),
        (["render", "stairs", "-o"], "Option '-o' requires an argument"),
        (["render", "stairs", "pile", "-o", "x.exr"], "unexpected extra argument"),
        (["occlusion", "-o", "x.exr"], "Missing argument 'IN.exr'"),
        (["export"], "Missing argument"),
        (["refit", "--fast"], "No such option: --fast"),
        (["scenes", "all"], "unexpected extra argument"),
    ],
)
def test_bad_usage(refuses, arguments, words):
    refuses(*arguments, words=[words])


def test_interrupted(command, tmp_path, monkeypatch):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(workflows, "refit", interrupt)
    outcome = command("refit", "-o", tmp_path / "out")
    assert (outcome.code, outcome.out, outcome.err) == (130, "", "")


def start(*arguments, **variables):
    """``python -m gtao`` in a process of its own, where the user's choice of LLVM does not count."""
    keep = {k: v for k, v in os.environ.items() if k not in (_llvm.LIBRARY_VARIABLE, _llvm.SEARCH_PATH_VARIABLE)}
    process = [sys.executable, "-W", "error", "-m", "gtao", *map(str, arguments)]
    done = subprocess.run(process, capture_output=True, text=True, env=keep | variables, check=False)
    return Outcome(done.returncode, done.stdout, done.stderr)


def test_a_process_of_its_own(tmp_path):
    outcome = start("render", tmp_path / "missing.xml", "-o", tmp_path / "out.exr")
    assert outcome == Outcome(2, "", f"gtao: no scene file {tmp_path / 'missing.xml'}\n")
    assert list(tmp_path.iterdir()) == []


def test_without_a_backend(tmp_path):
    doctor = start("doctor", "--json", GTAO_LLVM_SEARCH_PATH="")
    state = json.loads(doctor.out)
    if state["cuda"]:
        pytest.skip("there is a GPU, which needs no LLVM")
    assert (doctor.code, doctor.err, state["backend"]) == (2, "", None)
    assert state["found"] == []
    text = start("doctor", GTAO_LLVM_SEARCH_PATH="")
    assert (text.code, text.err) == (2, "")
    assert "no backend: no LLVM library is installed" in text.out
    assert f"run: {state['advice']}" in text.out
    outcome = start("render", "stairs", "-o", tmp_path / "out.exr", GTAO_LLVM_SEARCH_PATH="")
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err.count("\n") == 1
    assert state["advice"] in outcome.err
    assert list(tmp_path.iterdir()) == []


def test_doctor(command):
    report = gtao.backend.report()
    outcome = command("doctor", "--json")
    state = json.loads(outcome.out)
    assert (outcome.code, outcome.err) == (0, "")
    assert (state["backend"], state["cuda"], state["advice"]) == (report.backend, report.cuda, None)
    assert [library["path"] for library in state["found"]] == [library.path for library in report.found]
    text = command("doctor")
    assert (text.code, text.err) == (0, "")
    for word in (gtao.__version__, f"backend: {report.backend}", *(library.path for library in report.found)):
        assert word in text.out


def test_help_and_version(command):
    assert command("--version").out == f"gtao {gtao.__version__}\n"
    for arguments in ([], ["--help"]):
        outcome = command(*arguments)
        assert (outcome.code, outcome.err) == (0, "")
        for verb in ("doctor", "refit", "compare", "occlusion", "render", "export", "scenes", "methods"):
            assert verb in outcome.out


def test_methods(command):
    outcome = command("methods")
    assert (outcome.code, outcome.err) == (0, "")
    listed = [line.split("  ")[0] for line in outcome.out.splitlines()]
    assert listed == list(gtao.config.NAMED)


def test_compare(command, tmp_path):
    words = ["--method", "gtao", "--method", "hbao", "--resolution", 16, "--spp", 16, "--radius", 0.5]
    outcome = command("compare", "trench", "-o", tmp_path / "out", *words)
    assert outcome.code == 0
    assert outcome.out.splitlines()[0] == "mean RMSE against ray-traced truth, 1 frame"
    assert outcome.out.splitlines()[-1] == f"report: {tmp_path / 'out' / 'report.html'}"
    record = io.read_record(tmp_path / "out" / "record.json")
    assert record["config"]["methods"] == ["gtao", "hbao"]
    assert record["config"]["radius"] == 0.5
    assert (tmp_path / "out" / "report.html").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nowhere"], "no embedded scene is called 'nowhere'"),
        (["trench", "trench"], "scenes given more than once: trench"),
        (["trench", "--method", "gtaoo"], "method must be one of gtao"),
        (["trench", "--radius", "nan"], "must be positive or inf"),
        (["trench", "--spp", "20"], "spp must be a multiple of 8"),
        (["trench", "--resolution", "8"], "Invalid value for '--resolution'"),
        (["empty"], "holds no .xml scene and no .exr frame"),
    ],
)
def test_bad_option_of_compare(command, tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    outcome = command("compare", *words, "-o", tmp_path / "out")
    assert outcome.code == 2
    assert message in outcome.err
    assert len(outcome.err.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_scenes(command):
    outcome = command("scenes")
    assert (outcome.code, outcome.err) == (0, "")
    assert tuple(line.split()[0] for line in outcome.out.splitlines()) == gtao.render.scenes.names()


@pytest.mark.parametrize("language", ["hlsl", "glsl", "wgsl", "c"])
def test_export(command, tmp_path, language):
    io.write_fit(tmp_path / "c.json", gtao.JIMENEZ2016)
    outcome = command("export", tmp_path / "c.json", "--language", language)
    assert (outcome.code, outcome.err) == (0, "")
    assert outcome.out == io.shader_code(gtao.JIMENEZ2016, language)
    assert "2.0404" in outcome.out


def test_export_as_json(command, tmp_path):
    io.write_fit(tmp_path / "c.json", gtao.JIMENEZ2016)
    outcome = command("export", tmp_path / "c.json", "--language", "json")
    assert (outcome.code, outcome.err) == (0, "")
    assert io.fit_from_dict(json.loads(outcome.out)) == gtao.JIMENEZ2016


@pytest.fixture
def configured(command, monkeypatch, tmp_path):
    """What reaches the workflow from ``gtao refit`` with these options: configuration, output and cache."""

    def run(*options):
        got = []

        def refuse(config, output, *, cache, progress):
            got.extend([config, output, cache])
            progress("scenes", 1, 2)
            raise gtao.FitError("enough")

        monkeypatch.setattr(workflows, "refit", refuse)
        monkeypatch.chdir(tmp_path)
        assert command("refit", *options) == Outcome(2, "", "gtao: enough\n")
        return got

    return run


def test_refit_without_options_uses_the_defaults(configured):
    assert configured() == [workflows.RefitConfig(), Path("refit"), None]


def test_options_of_refit_arrive(configured):
    config, output, cache = configured(
        *("a.xml", "pile", "-o", "out", "--cache", "stored", "--also-embedded", "--all-sensors", "--resolution", 40),
        *("--spp", 80, "--bounces", "inf", "--form", "four_parameter", "--constraint", "monotone"),
        *("--constraint", "energy", "--weighting", "uniform", "--regressor", "screen", "--seed", 3, "--bootstrap", 7),
    )
    assert (output, cache) == (Path("out"), Path("stored"))
    assert config == workflows.RefitConfig(
        scenes=("a.xml", "pile"),
        also_embedded=True,
        all_sensors=True,
        resolution=40,
        spp=80,
        seed=3,
        regressor="screen",
        fit=gtao.fit.FitSettings(
            bounces=math.inf,
            form="four_parameter",
            constraints=("monotone", "energy"),
            weighting="uniform",
            n_bootstrap=7,
            seed=3,
        ),
    )


def test_a_quick_refit_is_small_where_nothing_else_is_said(configured):
    config, *_ = configured("--quick", "--spp", 128, "--procedure", "two-step", "--constraint", "none")
    assert (config.resolution, config.spp) == (32, 128)
    assert config.fit == gtao.fit.FitSettings(n_bootstrap=200, procedure="two-step", constraints=())


def test_refit(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # Drawing takes most of a small run's time and is no part of this.
    monkeypatch.setattr(gtao.plot, "refit_figures", lambda *_: {})
    monkeypatch.setattr(gtao.plot, "refit_report", lambda *_, **__: "page")
    outcome = command("refit", "pile", "stairs", "cloth", "--resolution", 16, "--spp", 32, "--bootstrap", 20)
    assert outcome.code == 0
    fit = io.read_fit("refit/coefficients.json")
    for name, value in zip(fit.names, fit.coefficients, strict=True):
        assert f"{name:7} {value:9.4f}" in outcome.out
    assert outcome.out.endswith("report: refit/report.html\n")
    for task in ("scenes", "pile", "fit"):
        assert task in outcome.err
    io.read_record("refit/record.json")


def read(path):
    channels, metadata = io.read_channels(path)
    return channels, metadata["manifest"]


def test_render(command, tmp_path):
    (tmp_path / "floor.obj").write_text(LEANING_FLOOR)
    (tmp_path / "ball.xml").write_text(TWO_VIEWS)
    source, path = tmp_path / "ball.xml", tmp_path / "new" / "ball.exr"
    options = ["--resolution", 24, "--spp", SPP, "--bounces", 3, "--max-distance", 2, "--seed", 5, "--sensor", 1]
    outcome = command("render", source, "-o", path, *options, "--normals", "geometric", "--layers", 2)
    assert outcome.code == 0
    assert outcome.out == f"wrote {path}\n"
    assert "100%" in outcome.err
    assert [p.name for p in path.parent.iterdir()] == ["ball.exr"]

    channels, manifest = read(path)
    axes = [f"{layer}.{axis}" for layer in ("N", "bent") for axis in "XYZ"]
    albedo = ["albedo.R", "albedo.G", "albedo.B"]
    truth = ["visibility.mean", "visibility.var", "visibility.count"]
    behind = ["ZBack", "layers.01.Z", "layers.01.ZBack"]
    assert sorted(channels) == sorted(
        ["Z", *behind, *axes, *albedo, *truth, "transport.01", "transport.02", "transport.03"]
    )
    assert {plane.dtype for plane in channels.values()} == {np.dtype(np.float32)}

    scene = gtao.render.load_scene(source, resolution=24)
    g = gtao.render.gbuffer(scene, 1, normals="geometric")
    expected = gtao.render.visibility(scene, g, 2.0, SPP, 5, sensor=1)
    transport = gtao.render.transport(scene, g, 3, SPP, 5, sensor=1, normals="geometric")
    mask = g.mask.numpy()
    assert mask.any()
    assert not mask.all()
    assert np.array_equal(channels["Z"], g.view_z.numpy())
    layers = gtao.render.layers(scene, g, 2, sensor=1)
    assert np.array_equal(channels["ZBack"], layers.back.numpy()[0])
    assert np.array_equal(channels["layers.01.Z"], layers.front.numpy()[1])
    assert np.array_equal(channels["layers.01.ZBack"], layers.back.numpy()[1])
    assert np.array_equal(gtao.GBuffer.from_exr(path).layers.back.numpy(), layers.back.numpy())
    assert command("occlusion", path, "-o", tmp_path / "ao.exr", "--set", "radius=0.5").code == 0
    assert np.array_equal(gtao.GBuffer.from_exr(tmp_path / "ao.exr").layers.back.numpy(), layers.back.numpy())
    assert np.array_equal(channels["N.Y"], g.normal_v.numpy()[..., 1])
    assert np.array_equal(channels["albedo.G"], g.albedo.numpy()[..., 1])
    assert np.array_equal(channels["visibility.mean"], expected.mean.numpy())
    assert np.array_equal(channels["visibility.var"], expected.variance.numpy())
    assert np.array_equal(channels["visibility.count"], np.where(mask, SPP, 0))
    assert np.array_equal(channels["bent.X"], expected.bent_normal.numpy()[..., 0])
    for i in range(3):
        assert np.array_equal(channels[f"transport.{i + 1:02d}"], transport.T[i])

    assert gtao.camera_from_dict(manifest["camera"]).to_dict() == g.camera.to_dict()
    assert manifest["made_by"] == f"gtao {gtao.__version__} render"
    assert manifest["config"] == {
        "source": "ball.xml",
        "sensor": 1,
        "normals": "geometric",
        "spp": SPP,
        "max_distance": 2.0,
        "n_bounces": 3,
        "n_layers": 2,
        "directional": False,
        "seed": 5,
        "fingerprint": gtao.render.fingerprint(scene, 1),
    }


def test_render_a_file_at_its_own_size(command, tmp_path):
    (tmp_path / "ball.xml").write_text(SCENE.format(target=0))
    outcome = command("render", tmp_path / "ball.xml", "-o", tmp_path / "ball.exr", "--spp", SPP)
    assert outcome.code == 0
    channels, manifest = read(tmp_path / "ball.exr")
    assert channels["Z"].shape == (12, 16)
    assert np.isinf(channels["Z"][0, 0])
    # The ball is 3 in front of the camera, a little more off its axis.
    assert channels["Z"][6, 8] == pytest.approx(3, abs=0.02)
    assert str(tmp_path) not in json.dumps(manifest)


def visibility_of(path):
    return read(path)[0]["visibility.mean"]


def test_occlusion(command, here):
    options = {"radius": 0.7, "n_slices": 3, "noise": "white", "seed": 9, "snap_to_texel": False, "max_radius_px": None}
    words = [word for key, value in options.items() for word in ("--set", f"{key}={value}")]
    outcome = command("occlusion", here / "whole.exr", "-o", here / "ao.exr", "--frame", 2, *words)
    assert outcome == Outcome(0, f"wrote {here / 'ao.exr'}\n", "")
    channels, manifest = read(here / "ao.exr")
    before, _ = read(here / "whole.exr")
    for name in ("Z", "N.X", "N.Y", "N.Z", "albedo.R", "albedo.G", "albedo.B"):
        assert np.array_equal(channels.pop(name), before[name])
    g = gtao.GBuffer.from_exr(here / "whole.exr")
    ao = gtao.ambient_occlusion(g, gtao.GTAO(**options), frame_index=2)
    assert np.array_equal(channels.pop("visibility.mean"), ao.visibility.numpy())
    assert channels == {}
    assert manifest["config"].pop("frame_index") == 2
    assert gtao.method_from_dict(manifest["config"]) == gtao.Pipeline(occlusion=ao.config, clamp=False)
    assert manifest["input"] == {"name": "whole.exr", "sha256": io.sha256_file(here / "whole.exr")}


def test_what_occlusion_wrote_can_be_read_again(command, here):
    command("occlusion", here / "whole.exr", "-o", here / "first.exr")
    command("occlusion", here / "first.exr", "-o", here / "second.exr")
    first, second = read(here / "first.exr")[0], read(here / "second.exr")[0]
    assert first.keys() == second.keys()
    for name, plane in first.items():
        assert np.array_equal(plane, second[name])


def test_published_method(command, here):
    outcome = command("occlusion", here / "whole.exr", "-o", here / "ao.exr", "--method", "published")
    assert outcome.code == 0
    g = gtao.GBuffer.from_exr(here / "whole.exr")
    expected = gtao.ambient_occlusion(g, gtao.GTAO.as_published()).visibility.numpy()
    assert np.array_equal(visibility_of(here / "ao.exr"), expected)
    assert not np.array_equal(expected, gtao.ambient_occlusion(g).visibility.numpy())


def test_falloff(command, here):
    words = ["--set", "radius=1", "--set", "falloff.start=0.25", "--set", "falloff.end=1"]
    assert command("occlusion", here / "whole.exr", "-o", here / "ao.exr", *words).code == 0
    g = gtao.GBuffer.from_exr(here / "whole.exr")
    config = gtao.GTAO(radius=1.0, falloff=gtao.LinearFalloff(start=0.25, end=1.0))
    assert np.array_equal(visibility_of(here / "ao.exr"), gtao.ambient_occlusion(g, config).visibility.numpy())


def test_derived_normals_and_a_field_of_view_for_a_foreign_image(command, here):
    z = read(here / "whole.exr")[0]["Z"]
    write(here / "foreign.exr", {"View.Depth.Z": z}, {})
    options = ["--derive-normals", "--fov-y", 50]
    outcome = command("occlusion", here / "foreign.exr", "-o", here / "ao.exr", *options)
    assert outcome.code == 0
    camera = gtao.PerspectiveCamera(24, 24, math.radians(50))
    g = gtao.GBuffer(z, None, camera)
    assert np.array_equal(visibility_of(here / "ao.exr"), gtao.ambient_occlusion(g).visibility.numpy())
    assert read(here / "ao.exr")[1]["camera"] == camera.to_dict()


def test_a_camera_file_with_the_matrix_for_normals_in_world_space(command, here):
    channels, manifest = read(here / "whole.exr")
    turn = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    normal_v = np.stack([channels[f"N.{axis}"] for axis in "XYZ"], -1)
    normal_w = (normal_v @ turn).astype(np.float32)
    write(here / "w.exr", {"Z": channels["Z"], **{f"N.{a}": normal_w[..., i] for i, a in enumerate("XYZ")}}, {})
    (here / "pose.json").write_text(json.dumps({**manifest["camera"], "to_view": turn.tolist()}))
    assert command("occlusion", here / "w.exr", "-o", here / "ao.exr", "--camera", here / "pose.json").code == 0
    assert command("occlusion", here / "whole.exr", "-o", here / "own.exr").code == 0
    # The matrix only exchanges axes, so that not a bit of a normal changes.
    assert np.array_equal(visibility_of(here / "ao.exr"), visibility_of(here / "own.exr"))


def test_a_foreign_image_with_normals_in_the_view_frame(command, refuses, here):
    refuses("occlusion", "no_camera.exr", "-o", "ao.exr", "--camera", "camera.json", words=["view or world space"])
    options = ["--camera", "camera.json", "--normal-frame", "view"]
    assert command("occlusion", "no_camera.exr", "-o", "ao.exr", *options).code == 0
    assert command("occlusion", "whole.exr", "-o", "own.exr").code == 0
    assert np.array_equal(visibility_of("ao.exr"), visibility_of("own.exr"))


def test_a_layer_is_chosen(command, here):
    channels, manifest = read(here / "whole.exr")
    layers = {}
    for name, scale in (("near", 1), ("far", 3)):
        layers |= {f"{name}.Z": channels["Z"] * np.float32(scale)}
        layers |= {f"{name}.N.{axis}": channels[f"N.{axis}"] for axis in "XYZ"}
    write(here / "layers.exr", layers, {"gtao": json.dumps(manifest)})
    outcome = command("occlusion", here / "layers.exr", "-o", here / "ao.exr", "--layer", "far")
    assert outcome.code == 0
    assert np.array_equal(read(here / "ao.exr")[0]["Z"], channels["Z"] * np.float32(3))


def test_an_image_with_another_suffix_is_refused(command, tmp_path):
    run = command("render", "stairs", "-o", tmp_path / "out.png")
    assert run.code == 2
    assert "ends in .exr" in run.err
    assert not (tmp_path / "out.png").exists()


def test_export_takes_the_record_too(command):
    folder = Path(__file__).parents[1] / "fits" / "multibounce" / "2026-11"
    from_record, from_coefficients = (
        command("export", folder / name, "--language", "json") for name in ("record.json", "coefficients.json")
    )
    assert from_record.code == 0
    numbers = [json.loads(run.out)["coefficients"] for run in (from_record, from_coefficients)]
    assert numbers[0] == numbers[1]
