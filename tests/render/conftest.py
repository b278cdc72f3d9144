"""The variant is chosen before any test module builds a scene."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="session", autouse=True)
def _variant(_backend):
    from gtao.render.variant import ensure_variant

    ensure_variant()
