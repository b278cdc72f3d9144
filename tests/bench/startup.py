"""Startup: the first frame of a new process, with an empty kernel cache and with a warm one, and what compiling costs.

Every measurement is a process of its own with a kernel cache of its own.

python -m tests.bench.startup [--quick]
"""

import json
import statistics
import subprocess
import sys
import tempfile
import time

import drjit as dr

from .harness import package
from .harness.options import CHILD, child, run_section
from .harness.table import milliseconds
from .harness.work import Work, frame

COUNTS = {"1x8": (1, 8), "9x3": (9, 3), "16x16": (16, 16)}
REPEATS, REPEATS_QUICK = 5, 2


def report(name, what):
    """Print what the first two frames of this process take, after all imports."""
    dr.set_thread_count(1)
    work = Work.of("64", COUNTS[name])
    scene, method = frame(work), work.method()
    make = {"estimate": package.estimate, "gradients": package.gradient}[what]
    times = []
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        for _ in range(2):
            start = time.perf_counter()
            make(scene.gbuffer(work), method)()
            dr.sync_thread()
            times.append(time.perf_counter() - start)
        kernels = [k for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]
    compiled = [k for k in kernels if not k["cache_hit"]]
    print(
        json.dumps(
            {
                "first_s": times[0],
                "second_s": times[1],
                "compile_s": 1e-3 * sum(k["backend_time"] for k in compiled),
                "compiled": len(compiled),
                "from_disk": sum(bool(k["cache_disk"]) for k in kernels),
            }
        )
    )


def imports():
    """Seconds that importing the package takes in a new process."""
    code = "import time; start = time.perf_counter(); import gtao; print(time.perf_counter() - start)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return float(done.stdout)


def measure(options):
    entries, repeats = [], range(REPEATS_QUICK if options.quick else REPEATS)
    for name in ("1x8",) if options.quick else COUNTS:
        for what in ("estimate", "gradients"):
            runs = {"cold": [], "warm": []}
            for _ in repeats:
                with tempfile.TemporaryDirectory() as cache:
                    for state in runs.values():
                        state.append(child("startup", name, what, environment={"DRJIT_CACHE_DIR": cache}))
            entry = {"counts": name, "what": what}
            for state, results in runs.items():
                entry[state] = {key: min(r[key] for r in results) for key in results[0]}
                entry[state]["first_median_s"] = statistics.median(r["first_s"] for r in results)
            entries.append(entry)
    return {"entries": entries, "import_s": min(imports() for _ in repeats)}


def tables(numbers):
    rows = []
    for entry in numbers["entries"]:
        for state in ("cold", "warm"):
            row = entry[state]
            times = ("first_s", "first_median_s", "second_s", "compile_s")
            rows.append(
                (
                    f"{entry['what']}, {entry['counts']}, {state} cache",
                    *(milliseconds(row[key]) for key in times),
                    row["compiled"],
                    row["from_disk"],
                )
            )
    head = ("ms", "first frame", "median", "second", "compiling", "kernels compiled", "from disk")
    yield f"a new process, 64×64; importing gtao took {milliseconds(numbers['import_s'])} ms before", head, rows


if __name__ == "__main__":
    if sys.argv[1:2] == [CHILD]:
        report(*sys.argv[2:])
    else:
        run_section(measure, tables, __doc__)
