"""gtao bake: files, what is said of their errors, and one line where something is wrong."""

import json
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import gtao
from gtao import cli, io


@pytest.fixture
def command(monkeypatch, capfd, tmp_path):
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["gtao", "bake", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        out, err = capfd.readouterr()
        return SimpleNamespace(code=stop.value.code, out=out, err=err)

    return run


def test_a_volume_texture_with_code_and_report(command, tmp_path):
    outcome = command(
        *("cone-lobe", "-o", "t.dds", "--size", 8, "--encoding", "unorm8", "--code", "hlsl", "--code", "c"),
        *("--distribution", "phong", "--report", "t.report.json", "--places", 500, "--seed", 3),
    )
    assert outcome.code == 0
    assert outcome.out.count("wrote ") == 5
    table = io.read_table(tmp_path / "t.dds")
    baked = gtao.tables.bake("cone-lobe", 8, distribution="phong")
    assert table.size == (8, 8, 8)
    assert np.abs(table.values - baked.values).max() <= 0.5 / 255 + 1e-6
    assert (tmp_path / "t.hlsl").read_text() == io.table_code(baked, "hlsl")
    assert (tmp_path / "t.c").exists()
    record = io.read_record(tmp_path / "t.report.json")
    found = gtao.tables.errors(table, 500, 3)
    assert record["numbers"] == found.to_dict()
    assert f"RMS {found['S'].rms:.5f}" in outcome.out
    assert {entry["path"] for entry in record["outputs"]} == {"t.dds", "t.dds.json", "t.hlsl", "t.c"}
    again = record["command"]
    assert again[:3] == ["gtao", "bake", "cone-lobe"]
    assert again[again.index("--size") + 1] == "8,8,8"
    assert again[again.index("--distribution") + 1] == "phong"
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.name != "t.report.json"}
    assert command(*again[2:]).code == 0
    assert io.read_record(tmp_path / "t.report.json")["numbers"] == record["numbers"]
    assert {name: (tmp_path / name).read_bytes() for name in before} == before


def test_axes_that_begin_at_a_mirror_take_materials_too(command, tmp_path):
    bsdf = json.dumps({"type": "roughconductor", "distribution": "ggx", "material": "none"})
    outcome = command("brdf-3d", "-o", "t.npz", "--size", "4,4,3", "--axes", "linear", "--bsdf", bsdf)
    assert outcome.code == 0
    values = io.read_table(tmp_path / "t.npz").values
    assert np.isfinite(values).all()
    # Of the narrowest lobe a cone about the normal is a step.
    assert values[0, 0, -1, 0] > 0.99
    assert values[0, -1, 1, 0] < 0.01


def test_what_is_wrong_is_said_before_anything_is_baked(command, monkeypatch):
    monkeypatch.setattr(gtao.tables, "bake", lambda *_, **__: pytest.fail("baked"))
    for arguments, words in (
        (("--encoding", "foo"), "encoding must be one of"),
        (("--encoding", "unorm8", "-o", "a.exr"), "hold the encodings"),
        (("--encoding", "bc4", "--size", "6", "-o", "a.dds"), "multiples of 4"),
        (("--code", "rust"), "rust"),
        (("--report", "a.npz", "-o", "a.npz"), "written twice"),
        (("--report", "a.dds.json", "-o", "a.dds"), "written twice"),
    ):
        given = arguments if "-o" in arguments else (*arguments, "-o", "a.npy")
        outcome = command("cone-cone", *given)
        assert outcome.code == 2
        assert words in outcome.err


def test_a_size_for_every_axis(command, tmp_path):
    assert command("brdf-4d", "-o", "t.npy", "--size", "4,5,3,2", "--axes", "linear", "--places", 200).code == 0
    assert io.read_table(tmp_path / "t.npy").values.shape == (2, 3, 5, 4, 2)
    assert json.loads((tmp_path / "t.npy.json").read_text())["axes"] == "linear"


def test_a_bsdf_of_mitsuba(command, tmp_path):
    """A perfect conductor is GGX at F0 = 1, but for its shadowing, which is not correlated, and single precision."""
    bsdf = {"type": "roughconductor", "distribution": "ggx", "material": "none"}
    outcome = command("brdf-3d", "-o", "t.npz", "--size", "6,6,3", "--bsdf", json.dumps(bsdf))
    assert outcome.code == 0
    assert "RMS" not in outcome.out
    table = io.read_table(tmp_path / "t.npz")
    assert table.values.shape == (3, 6, 6, 1)
    ratios = gtao.tables.bake("brdf-3d", (6, 6, 3)).values
    # F = 1 is A + B, and S between the two ratios.
    low, high = ratios.min(axis=-1), ratios.max(axis=-1)
    outside = np.maximum(low - table.values[..., 0], table.values[..., 0] - high)
    # Of the roughest surfaces shadowing decides what is left.
    assert outside[:2].max() < 0.03
    assert outside.max() > outside[:2].max()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("nope", "-o", "a.npy"), "unknown kind of table 'nope'"),
        (("cone-cone", "-o", "a.npy", "--axes", "x"), "no axes 'x'"),
        (("cone-cone", "-o", "a.npy", "--size", "8,x"), "neither a number"),
        (("cone-cone", "-o", "a.npy", "--size", "1"), "2 to 4096"),
        (("cone-cone", "-o", "a.npy", "--size", "8,8"), "3 axes"),
        (("brdf-5d", "-o", "a.npy", "--size", "4096"), "take fewer per axis"),
        (("cone-cone", "-o", "a.png", "--size", "4"), "a.png"),
        (("cone-cone", "-o", "a.dds", "--size", "6", "--encoding", "bc4"), "multiples of 4"),
        (("cone-cone", "-o", "a.npy", "--size", "4", "--code", "rust"), "rust"),
        (("cone-cone", "-o", "a.npy", "--size", "4", "--bsdf", "diffuse"), "not made of BRDFs"),
        (("brdf-3d", "-o", "a.npy", "--size", "4", "--bsdf", "nothing"), "does not load"),
        (("brdf-3d", "-o", "a.npy", "--size", "4", "--bsdf", "{'type': 1}"), "is no JSON"),
        (("brdf-3d", "-o", "a.npy", "--bsdf", "roughplastic", "--report", "r.json"), "leave out the report"),
    ],
)
def test_one_line_says_what_is_wrong(command, tmp_path, arguments, words):
    outcome = command(*arguments)
    assert outcome.code == 2
    (line,) = outcome.err.strip().splitlines()
    assert words in line
    assert not list(tmp_path.iterdir())
