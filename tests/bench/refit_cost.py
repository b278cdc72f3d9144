"""Wall time and peak memory of ``gtao refit``: cold, and again with other fit options on the cached transport images.

Every run is a process of its own, from start to exit, with the defaults of the command and the options given after
``--``. Nothing but the standard library is imported here: a child's peak memory is at least what its parent held when
it was started. Run as

    python tests/bench/refit_cost.py [-- OPTION of gtao refit …]
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

#: What is run: a name, and the options beyond those of the first run.
RUNS = (
    ("empty cache", ()),
    ("same again", ()),
    ("--constraint none", ("--constraint", "none")),
    ("--bounces inf", ("--bounces", "inf")),
    ("--form four_parameter", ("--form", "four_parameter")),
)


def measure(command):
    """``(seconds, seconds on all CPUs, peak resident bytes)`` of one process."""
    start = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.monotonic() - start
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"{' '.join(command)} ended with {process.returncode}")
    return seconds, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024


def main():
    options = [option for option in sys.argv[1:] if option != "--"]
    print(f"{os.cpu_count()} CPUs, load {os.getloadavg()[0]:.2f}")
    print(f"{'gtao refit ' + ' '.join(options):<32} {'wall':>8} {'CPU':>8} {'peak':>9}")
    with tempfile.TemporaryDirectory() as folder:
        places = ["-o", str(Path(folder, "result")), "--cache", str(Path(folder, "cache"))]
        for name, more in RUNS:
            command = [sys.executable, "-m", "gtao", "refit", *options, *more, *places]
            wall, cpu, peak = measure(command)
            print(f"{name:<32} {wall:>6.1f} s {cpu:>6.1f} s {peak / 2**20:>5.0f} MiB", flush=True)


if __name__ == "__main__":
    main()
