"""Run a script in a process of its own: what it reads or kills must not take the tests with it."""

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

PROLOGUE = """
import json, os, resource, signal, sys, time
sys.path[:0] = [{root!r}, {here!r}]
resource.setrlimit(resource.RLIMIT_AS, ({limit}, {limit}))
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
import gtao
"""


def run(script, *arguments, limit_gib=4):
    """The JSON that ``script`` prints last; its stderr must stay empty. A crash or a timeout fails the test."""
    limit = limit_gib << 30
    code = PROLOGUE.format(root=str(ROOT), here=str(Path(__file__).parent), limit=limit) + script
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, f"exit {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}"
    assert done.stderr == ""
    lines = done.stdout.splitlines()
    assert len(lines) == 1, done.stdout[-2000:]
    return json.loads(lines[0])
