"""The choice of the LLVM library, tried in processes of their own: a wrong one ends the process."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from gtao import _llvm

PROBE = """
import json
import gtao
report = gtao.backend.report()
result = {"backend": report.backend, "version": report.llvm_version, "reason": report.reason, "advice": report.advice}
try:
    import numpy as np
    camera = gtao.OrthographicCamera(4, 4, 1.0)
    g = gtao.GBuffer(np.ones((4, 4), np.float32), None, camera)
    result["visibility"] = float(gtao.ambient_occlusion(g).visibility.numpy().mean())
except gtao.BackendError as error:
    result["error"] = str(error)
print(json.dumps(result))
"""


def run(code, **variables):
    environment = {k: v for k, v in os.environ.items() if k not in (_llvm.LIBRARY_VARIABLE, _llvm.SEARCH_PATH_VARIABLE)}
    environment |= {k: str(v) for k, v in variables.items()}
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False)


def probe(**variables):
    process = run(PROBE, **variables)
    assert process.returncode == 0, process.stderr
    assert process.stderr == ""
    return json.loads(process.stdout)


def system_library(major):
    for library in _llvm._system_libraries():
        if library.major == major:
            return library
    pytest.skip(f"no system library of LLVM {major} on this machine")


def directory_with_only(library, tmp_path):
    name = Path(library.path).name
    (tmp_path / name).symlink_to(os.path.realpath(library.path))
    return tmp_path


def assert_no_gpu_or_error(result, *words):
    if result["backend"] == "cuda":
        return
    assert result["backend"] is None
    for word in (*words, "pip install 'gtao[llvm]'"):
        assert word in result["error"]


def test_no_library_is_an_error_in_words_and_not_a_dead_process():
    assert_no_gpu_or_error(probe(GTAO_LLVM_SEARCH_PATH=""), "no LLVM library is installed")


@pytest.mark.parametrize("major", [14, 15])
def test_a_library_that_would_abort_is_never_loaded(major, tmp_path):
    directory = directory_with_only(system_library(major), tmp_path)
    result = probe(GTAO_LLVM_SEARCH_PATH=directory)
    assert result["version"] is None or result["version"][0] >= _llvm.MINIMUM_MAJOR
    assert_no_gpu_or_error(result, f"only LLVM {major} is installed")


def test_llvm_19_of_the_system_works(tmp_path):
    directory = directory_with_only(system_library(19), tmp_path)
    result = probe(GTAO_LLVM_SEARCH_PATH=directory)
    if result["backend"] != "cuda":
        assert result["version"][0] == 19
    assert result["visibility"] == 1


def test_the_library_of_the_wheel_works():
    (library,) = _llvm._wheel_library()
    result = probe(DRJIT_LIBLLVM_PATH=library.path)
    if result["backend"] != "cuda":
        assert result["version"][0] == library.major
    assert result["visibility"] == 1


def test_the_users_library_is_not_silently_replaced():
    result = probe(DRJIT_LIBLLVM_PATH="/nonexistent/libLLVM.so.19.1")
    assert_no_gpu_or_error(result, "DRJIT_LIBLLVM_PATH names /nonexistent/libLLVM.so.19.1, which is missing", "unset")


def test_the_users_old_library_is_refused():
    library = system_library(15)
    assert_no_gpu_or_error(probe(DRJIT_LIBLLVM_PATH=library.path), "which is LLVM 15")


def test_drjit_imported_first_with_an_old_library_is_an_error_in_words():
    library = system_library(15)
    process = run("import drjit\ndrjit.has_backend(drjit.JitBackend.LLVM)\n" + PROBE, DRJIT_LIBLLVM_PATH=library.path)
    assert process.returncode == 0, process.stderr
    assert_no_gpu_or_error(json.loads(process.stdout), "imported before gtao", "LLVM 15", "import gtao before drjit")


def test_the_users_environment_is_left_as_it_was_when_nothing_is_usable():
    process = run("import gtao, os; print(os.environ.get('DRJIT_LIBLLVM_PATH'))", GTAO_LLVM_SEARCH_PATH="")
    assert process.stdout.strip() == "None"


@pytest.mark.parametrize(
    ("name", "major"),
    [
        ("libLLVM-15.so.1", 15),
        ("libLLVM-14.0.6.so.1", 14),
        ("libLLVM.so.19.1", 19),
        ("libLLVM-19.so", 19),
        ("libLLVM.so.23.1", 23),
        ("libLLVM.so", 0),
        ("libLLVMSupport.so.19", 0),
    ],
)
def test_major_version_from_a_file_name(name, major):
    assert _llvm.major_from_name(f"/somewhere/{name}") == major


def library_files(directory, *names):
    directory.mkdir()
    for name in names:
        (directory / name).write_bytes(b"")
    return directory


def test_the_newest_usable_system_library_wins_over_older_ones(tmp_path):
    first = library_files(tmp_path / "a", "libLLVM-15.so.1", "libLLVM.so.19.1")
    second = library_files(tmp_path / "b", "libLLVM.so.22.1", "libLLVMSupport.so.99")
    choice = _llvm.choose({_llvm.SEARCH_PATH_VARIABLE: f"{first}{os.pathsep}{second}"})
    assert choice.library is not None
    assert choice.library.major == 22
    assert sorted(library.major for library in choice.found) == [15, 19, 22]


def test_the_wheel_serves_where_the_system_has_nothing_usable(monkeypatch):
    monkeypatch.setattr(_llvm, "_system_libraries", lambda: [_llvm.Library("/usr/lib/libLLVM-15.so.1", 15, "system")])
    choice = _llvm.choose({})
    assert choice.library is not None
    assert choice.library.origin == "wheel"


def test_a_usable_system_library_is_preferred_to_the_wheel(monkeypatch):
    system = _llvm.Library("/usr/lib/libLLVM.so.19.1", 19, "system")
    monkeypatch.setattr(_llvm, "_system_libraries", lambda: [system])
    assert _llvm.choose({}).library == system


def test_a_library_can_be_asked_for_its_version(tmp_path):
    (library,) = _llvm._wheel_library()
    assert _llvm.major_from_probe(library.path) == library.major
    garbage = tmp_path / "libgarbage.so"
    garbage.write_bytes(b"not a library")
    assert _llvm.major_from_probe(garbage) == 0
