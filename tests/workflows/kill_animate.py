"""Kill ``gtao animate`` with SIGKILL again and again, start it again, and compare the end with an undisturbed run.

Every kill comes a moment after a frame has begun to appear, so that it hits pictures, states and the steps between
them; the last ones come while videos and reports are written. Run as

    python tests/workflows/kill_animate.py [--kills 8] [--seed 0] [--frames 6] [--resolution 64]
"""

import argparse
import random
import sys
import tempfile
import time
from pathlib import Path

import kill_refit

from gtao import io

METHODS = ("published-pipeline", "gtao,n_slices=1")


class Runs(kill_refit.Runs):
    """``gtao animate`` in a folder of its own, with a copy of the package."""

    def __init__(self, folder, n_frames, resolution):
        super().__init__(folder, [], resolution, 16)
        words = ["passing_object", "--frames", n_frames, "--resolution", resolution, "--spp", 16, "--video", "gif"]
        words += [word for name in METHODS for word in ("--method", name)]
        self.command = [sys.executable, "-m", "gtao", "animate", *map(str, words)]


def frames_of(output):
    """Numbers of the frames whose truth has been written."""
    return {int(path.stem[-5:]) for path in (output / "frames").glob("truth_*.png")}


def wait_for_frame(process, output, n):
    """Until a frame beyond the ``n`` first has appeared, or the process ends."""
    while process.poll() is None and len(frames_of(output)) <= n:
        time.sleep(0.002)


def compare(one, other):
    """The same files with the same bytes, but for times in record and report."""
    paths = sorted(p.relative_to(one) for p in one.rglob("*") if p.is_file())
    assert sorted(p.relative_to(other) for p in other.rglob("*") if p.is_file()) == paths
    for path in paths:
        if path.name not in kill_refit.UNHASHED:
            assert (one / path).read_bytes() == (other / path).read_bytes(), path
    records = [io.without_timestamps(io.read_record(folder / "record.json")) for folder in (one, other)]
    assert records[0] == records[1]
    pages = [kill_refit.TIME.sub("", (folder / "report.html").read_text()) for folder in (one, other)]
    assert pages[0] == pages[1]
    return len(paths)


def run(n_kills, seed, n_frames, resolution, say=print):
    """The whole test; raises AssertionError where it fails."""
    chance = random.Random(seed)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        (folder / "package").mkdir()
        runs = Runs(folder / "package", n_frames, resolution)
        # Of the same name, which records hold.
        calm, output = folder / "calm" / "out", folder / "killed" / "out"
        seconds = runs.finish(calm, folder / "calm-cache")
        say(f"undisturbed: {seconds:.1f} s")
        done = 0
        for kill in range(n_kills):
            before = frames_of(output)
            process = runs.start(output, folder / "cache")
            if len(before) < n_frames:
                wait_for_frame(process, output, len(before))
                # The last frame is followed by videos and report.
                delay = chance.uniform(0, 0.3 if len(before) + 1 < n_frames else 1.5)
            else:
                delay = chance.uniform(0, seconds)
            killed = kill_refit.kill_after(process, delay)
            done += killed
            now = frames_of(output)
            assert not (killed and (output / "record.json").exists() and len(now) < n_frames)
            say(f"{kill + 1:2}  {delay:4.2f} s after frame {max(now, default=0)}: {'killed' if killed else 'too late'}")
        runs.finish(output, folder / "cache")
        say(f"{done} kills; the end: {compare(calm, output)} files identical apart from time stamps")
        assert done > 0


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    for name, value in (("kills", 8), ("seed", 0), ("frames", 6), ("resolution", 64)):
        parser.add_argument(f"--{name}", type=int, default=value)
    options = parser.parse_args()
    run(options.kills, options.seed, options.frames, options.resolution)


if __name__ == "__main__":
    main()
