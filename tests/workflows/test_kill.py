"""A job that is killed goes on where it stopped."""

import kill_animate
import kill_refit
import pytest


@pytest.mark.slow
def test_killed_runs_leave_whole_files_and_the_next_one_ends_as_if_nothing_had_been(capsys):
    kill_refit.run(3, seed=3, scenes=["pile", "stairs", "cloth"], resolution=16, spp=32)
    assert "identical apart from time stamps" in capsys.readouterr().out


@pytest.mark.slow
def test_a_killed_animation_ends_with_the_same_frames(capsys):
    kill_animate.run(4, seed=1, n_frames=5, resolution=32)
    assert "identical apart from time stamps" in capsys.readouterr().out
