"""Estimates and gradients in Dr.Jit's debug mode, which reports every access outside of an array."""

import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).with_name("_debug_run.py")


def run(*arguments):
    return subprocess.run([sys.executable, SCRIPT, *arguments], capture_output=True, text=True, timeout=600)


def test_nothing_is_read_or_written_out_of_bounds():
    done = run()
    assert done.returncode == 0, done.stderr[-4000:]
    assert done.stderr == ""
    assert int(done.stdout) >= 15


def test_the_debug_mode_would_say_so():
    """The test above can fail."""
    done = run("--out-of-bounds")
    assert "out-of-bounds" in done.stderr
