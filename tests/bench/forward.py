"""Forward: one estimate beside hand-written C++, Numba and NumPy on the same work, one thread.

python -m tests.bench.forward [--quick] [--reference DIR]
"""

from .harness import agreement, package, rivals
from .harness.clock import compare
from .harness.options import run_section
from .harness.table import HEAD, ratio_rows
from .harness.work import COUNTS, Work, frame

#: What ratios are relative to: hand-written code where there is some.
PACKAGE, BASE = "gtao", "C++, scalar loads"


def measure(options):
    sizes = ("540p",) if options.quick else ("540p", "1080p", "4K")
    notes, entries = set(), []
    for size in sizes:
        for name, counts in COUNTS.items():
            if options.quick and name == "16x16":
                continue
            work = Work.of(size, counts)
            scene = frame(work)
            g, method = scene.gbuffer(work), work.method()
            runs = {
                PACKAGE: package.estimate(g, method),
                f"{PACKAGE}, new frame": package.estimate_new_frame(g, method),
                **rivals.forward(scene, work, options, notes),
            }
            rows = compare(runs, BASE if BASE in runs else PACKAGE, options)
            entries.append({"size": size, "counts": name, "taps": work.n_taps, "rows": rows})
    equal = {name: agreement.measure("540p", COUNTS[name], options) for name in ("1x8", "9x3") if options.on_host}
    return {"agreement": equal, "entries": entries, "notes": sorted(notes)}


def tables(numbers):
    for note in numbers["notes"]:
        print(note)
    if numbers["agreement"]:
        print(f"\n{agreement.TEXT}")
    for counts, found in numbers["agreement"].items():
        yield f"agreement at 540p, {counts}: difference from the NumPy twin", agreement.HEAD, agreement.rows(found)
    for entry in numbers["entries"]:
        per_tap = 1e9 * entry["rows"][PACKAGE]["best_s"] / entry["taps"]
        title = f"{entry['size']}, {entry['counts']}, {entry['taps'] / 1e6:.0f} M samples, {per_tap:.2f} ns each"
        yield title, HEAD, ratio_rows(entry["rows"])


if __name__ == "__main__":
    run_section(measure, tables, __doc__)
