"""Threads: wall time on two threads against one; it says something only where nothing else runs.

python -m tests.bench.threads [--quick] [--reference DIR]
"""

import os

import drjit as dr

from .harness import package, rivals
from .harness.clock import interleave, summary
from .harness.options import run_section
from .harness.table import HEAD, ratio_rows
from .harness.work import COUNTS, Work, frame

PACKAGE = "gtao"


def on_threads(run, n):
    def several():
        dr.set_thread_count(n)
        run()
        dr.sync_thread()

    return several


def measure(options):
    if not options.on_host:
        return {"entries": [], "notes": ["the kernels run on a GPU"]}
    if (os.cpu_count() or 1) < 2:
        return {"entries": [], "notes": ["this machine has one processor"]}
    entries, notes = [], set()
    for name in ("1x8",) if options.quick else ("1x8", "9x3"):
        work = Work.of("540p" if options.quick else "1080p", COUNTS[name])
        scene = frame(work)
        g, method = scene.gbuffer(work), work.method()
        own = {PACKAGE: package.estimate(g, method), f"{PACKAGE}, gradient": package.gradient(g, method)}
        runs = {}
        for n in (1, 2):
            others = rivals.forward(scene, work, options, notes, threads=n)
            for label, run in (own | others).items():
                if not label.startswith("NumPy"):
                    runs[f"{label}, {n} thread{'s' * (n > 1)}"] = on_threads(run, n)
        times = interleave(runs, "wall", options.rounds, options.budget_s)
        speedups = {
            label.removesuffix(", 1 thread"): min(values) / min(times[label.replace("1 thread", "2 threads")])
            for label, values in times.items()
            if label.endswith(", 1 thread")
        }
        rows = summary(times, f"{PACKAGE}, 1 thread")
        entries.append({"counts": name, "rows": rows, "speedups": speedups})
    return {"entries": entries, "notes": sorted(notes), "load": os.getloadavg()[0]}


def tables(numbers):
    for note in numbers["notes"]:
        print(note)
    for entry in numbers["entries"]:
        yield f"{entry['counts']}, wall time, load {numbers['load']:.1f}", HEAD, ratio_rows(entry["rows"])
        rows = [(name, f"{value:.2f}") for name, value in entry["speedups"].items()]
        yield f"{entry['counts']}: times as fast on two threads", ("", ""), rows


if __name__ == "__main__":
    run_section(measure, tables, __doc__)
