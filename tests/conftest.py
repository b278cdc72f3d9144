"""Shared fixtures. Importing gtao first settles the LLVM library before anything imports Dr.Jit or Mitsuba."""

import os
import sys
from pathlib import Path

import pytest

import gtao

import drjit as dr  # isort: skip  (after gtao, which chooses the LLVM library)

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="session", autouse=True)
def _backend():
    """Without a backend every test would end the process; stop with the command that helps instead."""
    try:
        gtao.backend.require()
    except gtao.BackendError as error:
        pytest.exit(str(error), returncode=1)
    if "PYTEST_XDIST_WORKER" in os.environ:
        # Workers share the cores. Not one thread each: Mitsuba would wait forever for a second one to read an EXR file.
        dr.set_thread_count(2)


@pytest.fixture(autouse=True)
def _cache_directory(tmp_path_factory, monkeypatch):
    """No test reads or fills the user's cache of transport images."""
    monkeypatch.setenv("GTAO_CACHE_DIR", str(tmp_path_factory.getbasetemp() / "gtao-cache"))


def pytest_collection_modifyitems(items):
    if gtao.backend.report().cuda:
        return
    skip = pytest.mark.skip(reason="no CUDA device")
    for item in items:
        if "cuda" in item.keywords:
            item.add_marker(skip)
