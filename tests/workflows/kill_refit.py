"""Kill ``gtao refit`` with SIGKILL at random moments, start it again, and compare the end with an undisturbed run.

Every other kill aims at a moment of the whole run, spread over it from its start to its end; those between aim at a
moment when a random one of the files has just been written. Every fourth run begins with an empty cache, the others go
on from what the one before has left. Half of them replace a complete earlier result with another option, whose record
must never pass for one of the new files. Run as

    python tests/workflows/kill_refit.py [--kills 10] [--seed 0] [--scenes pile stairs …] [--resolution 64] [--spp 128]
"""

import argparse
import contextlib
import json
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image

from gtao import io

PACKAGE = Path(io.__file__).parents[1]
#: A record appears last; its report, which shows it, has no hash.
UNHASHED = {"record.json", "report.html"}
TIME = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\+00:00")
#: A run with all its scenes in the cache takes seconds; only one that hangs reaches this.
TIMEOUT = 300


class Runs:
    """``gtao refit`` in a folder of its own, with a copy of the package, which nobody edits or commits meanwhile."""

    def __init__(self, folder, scenes, resolution, spp):
        self.folder = folder
        shutil.copytree(PACKAGE, folder / "gtao", ignore=shutil.ignore_patterns("__pycache__"))
        size = ["--resolution", resolution, "--spp", spp, "--bootstrap", 50]
        self.command = [sys.executable, "-m", "gtao", "refit", *scenes, *map(str, size)]

    def start(self, output, cache, *options):
        return subprocess.Popen(
            [*self.command, "-o", output, "--cache", cache, *options],
            cwd=self.folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
        )

    def finish(self, output, cache, *options):
        """Run to the end; seconds that it took."""
        start = time.monotonic()
        process = self.start(output, cache, *options)
        _, errors = process.communicate(timeout=TIMEOUT)
        assert process.returncode == 0, errors.decode()
        return time.monotonic() - start


def stamps(folder):
    """Which file lies under each name: a rename into place changes the number."""
    found = {}
    for path in folder.glob("[!.]*") if folder.exists() else ():
        # The process that is watched removes files too.
        with contextlib.suppress(FileNotFoundError):
            found[path.name] = path.stat().st_ino
    return found


def wait_until_written(process, output, n_files):
    """Until ``n_files`` names have a new file, or the process ends."""
    before = stamps(output)
    while process.poll() is None:
        now = stamps(output)
        if sum(before.get(name) != number for name, number in now.items()) >= n_files:
            return
        time.sleep(0.002)


def kill_after(process, delay):
    """Kill the process unless it ends before; whether it was killed."""
    try:
        process.wait(delay)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
    process.communicate()
    return process.returncode == -signal.SIGKILL


def n_entries(cache):
    return len(list(cache.glob("[!.]*.npz"))) if cache.exists() else 0


def check(output):
    """No file under a final name is cut short, and a record, if there is one, is of the files beside it."""
    for path in output.glob("[!.]*") if output.exists() else ():
        if path.suffix == ".png":
            with Image.open(path) as image:
                image.load()
        elif path.suffix == ".json":
            json.loads(path.read_text())
        elif path.suffix == ".html":
            assert path.read_text().rstrip().endswith("</html>"), path
        else:
            assert path.read_text().rstrip().endswith("}"), path
    record = output / "record.json"
    if not record.exists():
        return "no record"
    for entry in io.read_record(record)["outputs"]:
        assert io.sha256_file(output / entry["path"]) == entry["sha256"], entry["path"]
    return "record and all its files"


def compare(one, other):
    """Both results are the same apart from time stamps, and nothing else lies beside them."""
    names = sorted(path.name for path in one.iterdir())
    assert sorted(path.name for path in other.iterdir()) == names
    for name in sorted(set(names) - UNHASHED):
        assert (one / name).read_bytes() == (other / name).read_bytes(), name
    records = [io.read_record(folder / "record.json") for folder in (one, other)]
    assert io.without_timestamps(records[0]) == io.without_timestamps(records[1])
    pages = [(folder / "report.html").read_text() for folder in (one, other)]
    assert TIME.sub("", pages[0]) == TIME.sub("", pages[1])
    return len(names)


def run(n_kills, seed, scenes, resolution, spp, say=print):
    """The whole test; raises AssertionError where it fails."""
    chance = random.Random(seed)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        runs = Runs(folder, scenes, resolution, spp)
        calm, earlier = folder / "calm", folder / "earlier"
        cold = runs.finish(calm, folder / "calm-cache")
        warm = runs.finish(earlier, folder / "calm-cache", "--constraint", "none")
        n_files = len(stamps(calm))
        say(f"undisturbed: {n_files} files after {cold:.1f} s, {warm:.1f} s with a full cache")
        output, cache = folder / "killed", folder / "cache"
        done = 0
        for kill in range(n_kills):
            if kill % 4 == 0:
                shutil.rmtree(cache, ignore_errors=True)
            if kill and kill % 4 < 2:
                shutil.rmtree(output, ignore_errors=True)
                shutil.copytree(earlier, output)
            process = runs.start(output, cache)
            if kill % 2:
                n = chance.randrange(1, n_files)
                wait_until_written(process, output, n)
                delay, where = chance.uniform(0, 0.1), f"file {n} of {n_files}"
            else:
                share = (kill // 2 + chance.random()) / (n_kills - n_kills // 2)
                delay, where = share * (warm if kill % 4 else cold), "the start"
            killed = kill_after(process, delay)
            done += killed
            state = f"{n_entries(cache)} of {len(scenes)} scenes cached, {check(output)}"
            say(f"{kill + 1:2}  {delay:5.2f} s after {where}: {'killed' if killed else 'came too late'}; {state}")
        runs.finish(output, cache)
        check(output)
        n_same = compare(calm, output)
        left = [path.name for path in cache.iterdir() if path.name.startswith(".")]
        assert left == [], left
        say(f"{done} kills; the end: {n_same} files identical apart from time stamps")
        assert done > 0


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--scenes", nargs="+", default=["pile", "stairs", "cloth", "city"])
    parser.add_argument("--resolution", type=int, default=64)
    parser.add_argument("--spp", type=int, default=128)
    options = parser.parse_args()
    run(options.kills, options.seed, options.scenes, options.resolution, options.spp)


if __name__ == "__main__":
    main()
