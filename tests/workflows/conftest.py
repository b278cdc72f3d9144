"""What several tests of animations compare with."""

import pytest
from animate_runs import config

from gtao import workflows


@pytest.fixture(scope="session")
def calm(tmp_path_factory):
    """A run that nothing disturbs."""
    folder = tmp_path_factory.mktemp("animate") / "out"
    return workflows.animate(config(exr=True), folder), folder
