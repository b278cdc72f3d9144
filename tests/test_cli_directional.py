"""The command line's directions: channels, packed files and their measured error, shader code, ray-traced truth."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

import gtao
from gtao import cli, io, workflows

AXES = ("X", "Y", "Z")
BENT = {f"bent.{axis}" for axis in AXES}
MEAN = {f"mean_direction.{axis}" for axis in AXES}
SH = {f"visibility_sh.{i:02d}" for i in range(9)}
#: Settings that make the estimator cheap, and the same settings as it takes them.
SMALL = ["--set", "radius=0.5", "--set", "n_slices=2"]
OPTIONS = {"radius": 0.5, "n_slices": 2}


@pytest.fixture
def command(monkeypatch, capfd):
    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["gtao", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        out, err = capfd.readouterr()
        return SimpleNamespace(code=stop.value.code, out=out, err=err)

    return run


@pytest.fixture(scope="module")
def frame(tmp_path_factory):
    path = tmp_path_factory.mktemp("frame") / "frame.exr"
    workflows.render_scene("stairs", path, resolution=24, spp=16)
    return path


def channels_of(path):
    return io.read_channels(path)[0]


class TestChannels:
    def test_bent_normals(self, command, frame, tmp_path):
        outcome = command("occlusion", frame, "-o", tmp_path / "a.exr", *SMALL, "--set", "bent_normal=true")
        assert (outcome.code, outcome.err) == (0, "")
        channels = channels_of(tmp_path / "a.exr")
        assert {"visibility.mean", *BENT, *MEAN} <= set(channels)
        assert not SH & set(channels)
        ao = gtao.ambient_occlusion(gtao.GBuffer.from_exr(frame), gtao.GTAO(**OPTIONS, bent_normal=True))
        for i, axis in enumerate(AXES):
            assert np.array_equal(channels[f"bent.{axis}"], ao.bent_normal.numpy()[..., i])
            assert np.array_equal(channels[f"mean_direction.{axis}"], ao.mean_direction.numpy()[..., i])

    def test_spherical_harmonics(self, command, frame, tmp_path):
        settings = [*SMALL, "--set", "directional=true", "--set", "weighting=uniform"]
        assert command("occlusion", frame, "-o", tmp_path / "a.exr", *settings).code == 0
        config = gtao.GTAO(**OPTIONS, directional=True, weighting="uniform")
        ao = gtao.ambient_occlusion(gtao.GBuffer.from_exr(frame), config)
        read = io.read_directions(tmp_path / "a.exr")
        assert np.array_equal(read.visibility_sh, ao.visibility_sh.numpy())
        assert np.array_equal(read.mean_direction, ao.mean_direction.numpy())
        assert np.array_equal(read.bent_normal, ao.bent_normal.numpy())
        assert read.weighting == "uniform"
        # Beside them the frame is as it was.
        assert np.array_equal(gtao.GBuffer.from_exr(tmp_path / "a.exr").normal_v.numpy(), frame_normals(frame))

    def test_the_average_horizon_has_a_direction_only(self, command, frame, tmp_path):
        settings = [*SMALL, "--set", "bent_normal=average_horizon"]
        assert command("occlusion", frame, "-o", tmp_path / "a.exr", *settings).code == 0
        assert set(channels_of(tmp_path / "a.exr")) & (BENT | MEAN) == BENT

    def test_none_unless_asked(self, command, frame, tmp_path):
        assert command("occlusion", frame, "-o", tmp_path / "a.exr", *SMALL).code == 0
        channels, metadata = io.read_channels(tmp_path / "a.exr")
        assert not (BENT | MEAN | SH) & set(channels)
        assert "directions" not in metadata["manifest"]

    @pytest.mark.parametrize(
        ("setting", "words"),
        [
            ("bent_normal=1", "bent_normal must be True, False or 'average_horizon', got '1'"),
            ("directional=yes", "directional must be true or false, got 'yes'"),
        ],
    )
    def test_bad_setting(self, command, frame, tmp_path, setting, words):
        outcome = command("occlusion", frame, "-o", tmp_path / "a.exr", "--set", setting)
        assert outcome.code == 2
        assert words in outcome.err
        assert list(tmp_path.iterdir()) == []


def frame_normals(frame):
    return gtao.GBuffer.from_exr(frame).normal_v.numpy()


class TestPacking:
    def test_files_and_their_errors(self, command, frame, tmp_path):
        packs = [word for name in io.PACKINGS for word in ("--pack", name)]
        settings = [*SMALL, "--set", "directional=true"]
        outcome = command("occlusion", frame, "-o", tmp_path / "a.exr", *settings, *packs)
        assert (outcome.code, outcome.err) == (0, "")
        ao = gtao.ambient_occlusion(gtao.GBuffer.from_exr(frame), gtao.GTAO(**OPTIONS, directional=True))
        lines = outcome.out.splitlines()
        assert lines[0] == f"wrote {tmp_path / 'a.exr'}"
        for i, name in enumerate(io.PACKINGS):
            path = tmp_path / f"a.{name}{io.packed_suffix(name)}"
            assert lines[1 + 2 * i] == f"wrote {path}"
            assert lines[2 + 2 * i] == f"  {io.packing_errors(ao, name)}"
            assert np.array_equal(io.read_packed(path).visibility, io.unpack(io.pack(ao, name), name).visibility)
        assert "of the pixels clamped" in lines[2]  # two slices overshoot here and there
        with Image.open(tmp_path / "a.rgba8.png") as image:
            assert np.array_equal(np.asarray(image), io.pack(ao, "rgba8"))
        manifest = io.read_channels(tmp_path / "a.sh16.exr")[1]["manifest"]
        assert manifest["input"]["sha256"] == io.sha256_file(frame)

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (["--pack", "rgba8"], "packing rgba8 stores bent_normal; add --set bent_normal=true"),
            (
                ["--pack", "sh16", "--set", "bent_normal=true"],
                "packing sh16 stores visibility_sh; add --set directional",
            ),
            (["--pack", "zh16", "--set", "bent_normal=average_horizon"], "packing zh16 stores mean_direction; add"),
            (["--pack", "bc5"], "packing must be one of rgba8, octahedral8"),
            (["--pack", "rgba8", "--method", "hbao"], "HBAO gives no directions to pack as rgba8; use another method"),
        ],
    )
    def test_refused_before_any_work(self, command, frame, tmp_path, monkeypatch, options, words):
        monkeypatch.setattr(io, "read_gbuffer", lambda *_, **__: pytest.fail("an image was read"))
        outcome = command("occlusion", frame, "-o", tmp_path / "a.exr", *options)
        assert (outcome.code, outcome.out) == (2, "")
        assert outcome.err.startswith(f"gtao: {words}")
        assert outcome.err.count("\n") == 1
        assert list(tmp_path.iterdir()) == []

    def test_a_place_that_cannot_be_written(self, command, frame, tmp_path, monkeypatch):
        monkeypatch.setattr(io, "read_gbuffer", lambda *_, **__: pytest.fail("an image was read"))
        (tmp_path / "a.rgba8.png").mkdir()
        settings = ["--set", "bent_normal=true", "--pack", "rgba8"]
        outcome = command("occlusion", frame, "-o", tmp_path / "a.exr", *settings)
        assert outcome.code == 2
        assert "a.rgba8.png: it is a folder" in outcome.err

    def test_the_average_horizon_packs_its_direction(self, command, frame, tmp_path):
        settings = [*SMALL, "--set", "bent_normal=average_horizon", "--pack", "octahedral12"]
        outcome = command("occlusion", frame, "-o", tmp_path / "a.exr", *settings)
        assert outcome.code == 0
        assert "octahedral12: angle mean" in outcome.out


@pytest.mark.parametrize("name", ["rgba8", "moments8"])
@pytest.mark.parametrize("language", ["hlsl", "glsl", "wgsl", "c"])
def test_export_packing(command, name, language):
    outcome = command("export-packing", name, "--language", language, "--weighting", "uniform")
    assert (outcome.code, outcome.err) == (0, "")
    assert outcome.out == io.packing_code(name, language, "uniform")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["bc5"], "packing must be one of rgba8"),
        (["rgba8", "--language", "cobol"], "language must be one of hlsl, glsl, wgsl, c, got 'cobol'"),
        (["rgba8", "--weighting", "heavy"], "weighting must be 'cosine' or 'uniform', got 'heavy'"),
        ([], "Missing argument 'PACKING'"),
    ],
)
def test_export_packing_refuses(command, arguments, words):
    outcome = command("export-packing", *arguments)
    assert (outcome.code, outcome.out) == (2, "")
    assert words in outcome.err


def test_ray_traced_harmonics(command, frame, tmp_path):
    outcome = command("render", "stairs", "-o", tmp_path / "a.exr", "--resolution", 24, "--spp", 16, "--directional")
    assert outcome.code == 0
    plain, traced = channels_of(frame), channels_of(tmp_path / "a.exr")
    assert set(traced) - set(plain) == MEAN | SH
    # The same rays; sums of coefficients in single precision, and variances of numbers below 1.
    for name in plain:
        finite = np.isfinite(plain[name])
        assert np.array_equal(np.isfinite(traced[name]), finite)
        assert np.abs(traced[name][finite] - plain[name][finite]).max() < 1e-6, name
    read = io.read_directions(tmp_path / "a.exr")
    surface = np.isfinite(plain["Z"])
    assert read.visibility_sh[surface, 0] == pytest.approx(np.sqrt(np.pi) / 2 * read.visibility[surface], abs=1e-6)
    assert read.weighting == "cosine"
    assert io.packing_errors(read, "sh16").n > 0.5 * surface.sum()
