"""Overhead: a call of the public API on 64×64 pixels, plain and as a frozen function, wall time.

What is left without the time of the kernels is what tracing, looking up and launching cost the host.

python -m tests.bench.overhead [--quick]
"""

import statistics

import gtao

from .harness import package
from .harness.clock import interleave, seconds
from .harness.options import run_section
from .harness.table import milliseconds
from .harness.work import COUNTS, Work, frame

ROUNDS, ROUNDS_QUICK = 200, 60


def calls(g, work):
    """Name -> callable."""
    method = work.method()
    return {
        "estimate": package.estimate(g, method),
        "estimate, exact cut": package.estimate(
            g, gtao.GTAO(radius=work.radius, n_slices=work.n_slices, n_steps=work.n_steps)
        ),
        "estimate, new frame with checks": package.estimate_new_frame(g, method, validate=True),
        "estimate, new frame": package.estimate_new_frame(g, method, validate=False),
        "estimate, new frame, frozen": package.frozen_estimate(g, method),
        "estimate and gradients": package.gradient(g, method),
        "estimate and gradients, fused": package.fused(g, method),
        "estimate and gradients, frozen": package.frozen_gradient(g, method),
    }


def measure(options):
    entries = []
    for name in ("1x8", "9x3"):
        work = Work.of("64", COUNTS[name])
        runs = calls(frame(work).gbuffer(work), work)
        times = interleave(runs, "wall", ROUNDS_QUICK if options.quick else ROUNDS, options.budget_s)
        rows = {
            label: {
                "best_s": min(values),
                "median_s": statistics.median(values),
                "kernels_s": min(seconds(runs[label], "kernels") for _ in range(10)),
            }
            for label, values in times.items()
        }
        entries.append({"counts": name, "rows": rows})
    return {"entries": entries}


def tables(numbers):
    for entry in numbers["entries"]:
        rows = [
            (
                name,
                *(milliseconds(row[key]) for key in ("best_s", "median_s", "kernels_s")),
                milliseconds(row["best_s"] - row["kernels_s"]),
            )
            for name, row in entry["rows"].items()
        ]
        yield f"64×64, {entry['counts']}", ("", "best ms", "median ms", "kernels ms", "host ms"), rows


if __name__ == "__main__":
    run_section(measure, tables, __doc__)
