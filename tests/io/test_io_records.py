"""Records: complete, portable, never edited, equal up to time stamps; and what they say about their origin."""

import hashlib
import json
import math
import subprocess
import sys

import _child
import numpy as np
import pytest

import gtao
from gtao.errors import RecordError
from gtao.io import (
    file_entry,
    git_state,
    number,
    portable,
    provenance,
    read_record,
    sha256_file,
    versions,
    without_timestamps,
    write_record,
)


def record(**changes):
    content = {
        "kind": "refit",
        **provenance(["gtao", "refit"], 7, gtao.GTAO(radius=2.0).to_dict()),
        "inputs": [{"path": "scene.xml", "bytes": 3, "sha256": "0" * 64}],
        "outputs": [],
        "numbers": {"a1": number(2.0404, 0.12, (1.8, 2.3)), "n_scenes": 10, "rows": [number(1.0)]},
    }
    return {key: value for key, value in {**content, **changes}.items() if value is not ...}


class TestRoundTrip:
    def test_what_is_written_is_read(self, tmp_path):
        write_record(tmp_path / "r.json", record(numbers={"x": number(np.float64(0.1), np.float32(0.5))}))
        back = read_record(tmp_path / "r.json")
        assert back["schema"] == 1
        assert back["numbers"] == {"x": {"value": 0.1, "standard_error": 0.5}}
        assert back["config"]["radius"] == 2.0
        assert back["seed"] == 7

    def test_infinities_are_words(self, tmp_path):
        write_record(tmp_path / "r.json", record(config={"radius": math.inf}))
        assert read_record(tmp_path / "r.json")["config"]["radius"] == "inf"

    def test_further_keys_are_kept(self, tmp_path):
        write_record(tmp_path / "r.json", record(notes=["lost one scene"]))
        assert read_record(tmp_path / "r.json")["notes"] == ["lost one scene"]

    def test_a_configuration_object(self, tmp_path):
        config = provenance("gtao", None, gtao.GTAO())["config"]
        write_record(tmp_path / "r.json", record(config=config, seed=None))
        assert read_record(tmp_path / "r.json")["config"]["type"] == "GTAO"

    def test_no_overwriting_by_accident(self, tmp_path):
        path = tmp_path / "r.json"
        write_record(path, record())
        before = path.read_bytes()
        with pytest.raises(RecordError, match="exists and records are not overwritten; choose another"):
            write_record(path, record(seed=8))
        assert path.read_bytes() == before
        write_record(path, record(seed=8), overwrite=True)
        assert read_record(path)["seed"] == 8

    def test_unwritable(self, tmp_path):
        (tmp_path / "file").write_text("")
        with pytest.raises(RecordError, match="cannot write"):
            write_record(tmp_path / "file" / "r.json", record())


WRONG = [
    ({"numbers": {"x": math.nan}}, r"record\.numbers\.x is NaN"),
    ({"numbers": {"x": {"value": 1.0}}}, r"numbers\.x has a value but no standard_error; give one, or null"),
    ({"numbers": {"x": [{"value": 1.0}]}}, r"numbers\.x\[0\] has a value"),
    ({"seed": ...}, "record has no 'seed'; it must be an integer or null"),
    ({"seed": "7"}, "record 'seed' must be an integer or null, got str"),
    ({"seed": True}, "record 'seed' must be an integer or null, got bool"),
    ({"inputs": {"a": 1}}, "record 'inputs' must be a list, got dict"),
    ({"inputs": [{"path": "a"}]}, r"record inputs\[0\] must be an object with a sha256"),
    ({"outputs": [{"sha256": "xyz"}]}, r"record outputs\[0\] must be an object with a sha256"),
    ({"kind": ...}, "record has no 'kind'"),
    ({"schema": 2}, "record has schema 2, this gtao knows up to 1; upgrade gtao"),
    ({"schema": 0}, "record has schema 0, this gtao knows 1"),
]


@pytest.mark.parametrize(("changes", "message"), WRONG)
def test_incomplete_records_are_not_written(tmp_path, changes, message):
    with pytest.raises(RecordError, match=message):
        write_record(tmp_path / "r.json", record(**changes))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("changes", "message"), WRONG[1:])
def test_nor_read(tmp_path, changes, message):
    write_record(tmp_path / "good.json", record())
    content = json.loads((tmp_path / "good.json").read_text()) | changes
    content = {key: value for key, value in content.items() if value is not ...}
    (tmp_path / "bad.json").write_text(json.dumps(content))
    with pytest.raises(RecordError, match=message) as caught:
        read_record(tmp_path / "bad.json")
    assert str(caught.value).startswith(f"{tmp_path / 'bad.json'}: ")


@pytest.mark.parametrize("content", ["[]", "3", '"record"'])
def test_something_else(tmp_path, content):
    (tmp_path / "r.json").write_text(content)
    with pytest.raises(RecordError, match="a record is a JSON object, got"):
        read_record(tmp_path / "r.json")


@pytest.mark.parametrize(
    "changes",
    [
        {"inputs": [{"path": "/home/me/scene.xml", "sha256": "0" * 64}]},
        {"config": {"scene": "/home/me/scene.xml"}},
        {"notes": ["file:///home/me/scene.xml"]},
    ],
)
def test_paths_of_the_machine_stay_out(tmp_path, changes):
    with pytest.raises(RecordError, match=r"is a path of this machine \(.*\); use portable\(\) on it"):
        write_record(tmp_path / "r.json", record(**changes))


def test_time_stamps_are_all_that_differs_between_two_runs():
    first = record(created="2020-01-01T00:00:00+00:00", timing={"fit_s": 1.0}, stages=[{"elapsed_s": 1, "n": 2}])
    second = record(created="2021-01-01T00:00:00+00:00", timing={"fit_s": 2.0}, stages=[{"elapsed_s": 3, "n": 2}])
    assert first != second
    assert without_timestamps(first) == without_timestamps(second)
    assert without_timestamps(first)["stages"] == [{"n": 2}]
    assert without_timestamps(first) != without_timestamps(record(seed=8))
    assert "created" in first


class TestProvenance:
    def test_versions_agree_with_the_packages(self):
        found = versions()
        assert found["gtao"] == gtao.__version__
        assert found["numpy"] == np.__version__
        assert found["python"] == ".".join(map(str, sys.version_info[:3]))
        assert {"mitsuba", "drjit", "scipy", "OpenEXR"} <= set(found)

    def test_nothing_heavy_is_loaded(self):
        script = """
from gtao.io import provenance
provenance(["gtao"], 0, {})
print(json.dumps([name for name in ("mitsuba", "scipy", "matplotlib") if name in sys.modules]))
"""
        assert _child.run(script) == []

    def test_device_is_the_backend_in_use(self):
        state = gtao.backend.report()
        made = provenance(["gtao"], 0, {})
        assert made["device"]["backend"] == state.backend
        if state.llvm_version:
            assert made["versions"]["llvm"] == ".".join(map(str, state.llvm_version))

    def test_command_is_portable(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        command = [
            "/usr/bin/gtao",
            "refit",
            f"{tmp_path}/scenes/a.xml",
            "/elsewhere/b.xml",
            "--out=/elsewhere/c",
            "-o",
            "out",
            "../d.xml",
        ]
        assert provenance(command, 0, {})["command"] == [
            "gtao",
            "refit",
            "scenes/a.xml",
            "b.xml",
            "--out=c",
            "-o",
            "out",
            "../d.xml",
        ]

    def test_portable(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        assert portable("a/b.xml") == "a/b.xml"
        assert portable("../b.xml") == "b.xml"
        assert portable(tmp_path / "x" / "b.xml", base=tmp_path / "x") == "b.xml"
        assert portable("/b.xml") == "b.xml"

    def test_files(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        (tmp_path / "a.bin").write_bytes(b"abc" * 100_000)
        digest = hashlib.sha256(b"abc" * 100_000).hexdigest()
        assert sha256_file("a.bin") == digest
        assert file_entry("a.bin") == {"path": "a.bin", "bytes": 300_000, "sha256": digest}
        with pytest.raises(RecordError, match="cannot read missing: no such file"):
            file_entry("missing")


class TestGit:
    def git(self, folder, *arguments):
        identity = ["-c", "user.name=a", "-c", "user.email=a@b.c"]
        return subprocess.run(
            ["git", "-C", folder, *identity, *arguments], check=True, capture_output=True, text=True
        ).stdout.strip()

    @pytest.fixture
    def repository(self, tmp_path, monkeypatch):
        """A repository whose top holds the package, as far as :func:`git_state` can see."""
        package = tmp_path / "top" / "gtao" / "io"
        package.mkdir(parents=True)
        (package / "origin.py").write_text("")
        monkeypatch.setattr("gtao.io.origin.__file__", str(package / "origin.py"))
        monkeypatch.setenv("GIT_CONFIG_GLOBAL", "/dev/null")
        return tmp_path / "top"

    def test_commit_and_dirt(self, repository):
        self.git(repository, "init", "-q")
        self.git(repository, "add", ".")
        self.git(repository, "commit", "-qm", "first")
        commit = self.git(repository, "rev-parse", "HEAD")
        assert git_state() == {"commit": commit, "dirty": False}
        (repository / "untracked").write_text("")
        assert git_state() == {"commit": commit, "dirty": False}
        (repository / "gtao" / "io" / "origin.py").write_text("changed")
        assert git_state() == {"commit": commit, "dirty": True}

    def test_no_repository(self, repository):
        assert git_state() is None

    def test_no_commit_yet(self, repository):
        self.git(repository, "init", "-q")
        assert git_state() is None

    def test_somebody_elses_repository(self, repository):
        self.git(repository.parent, "init", "-q")
        self.git(repository.parent, "commit", "-qm", "first", "--allow-empty")
        assert git_state() is None

    def test_no_git(self, repository, monkeypatch):
        monkeypatch.setenv("PATH", "")
        assert git_state() is None
