"""What the package costs, from ``references/performance``."""

from . import pipeline
from .markdown import ms, table

PACKAGE, ESTIMATE, GRADIENT = "gtao", "estimate", "estimate and gradients"
FUSED = f"{GRADIENT}, fused"
CPP = ("C++, scalar loads", "C++, vector gathers")
RIVALS = {"Numba": "Numba", "NumPy": "NumPy, 16 rows at a time"}


def over(rows, name, others):
    """Ratio of the best time of a row to that of the fastest of others; a dash where none was measured."""
    known = [rows[other]["best_s"] for other in others if other in rows]
    return f"{rows[name]['best_s'] / min(known):.2f}" if known else "–"


def origin(record):
    device, versions = record["device"], record["versions"]
    commit = record["git"]["commit"][:10] if record["git"] else "an installed package"
    quick = " A quick run: small frames and few rounds." if record["config"]["quick"] else ""
    return (
        "From `references/performance/record.json`, which `make bench` writes. "
        f"Measured on {device['processor']} ({device['n_cpus']} processors, backend `{device['backend']}`) with Dr.Jit"
        f" {versions['drjit']} on LLVM {versions['llvm']}, NumPy {versions['numpy']}, Numba {versions['numba']} and"
        f" PyTorch {versions['torch']}, at commit `{commit}`, {record['created'][:10]}.{quick}"
    )


def goals(rows):
    body = []
    for goal in rows:
        wanted = f"{'≤' if goal['at_most'] else '≥'} {goal['limit']:g}"
        median = "" if goal["median"] is None else f"{goal['median']:.3g}"
        verdict = "yes" if goal["met"] else "**no**"
        body.append([goal["what"], goal["at"], wanted, f"{goal['best']:.3g}", median, verdict])
    return table(["", "at", "wanted", "best", "median", "reached"], body)


def forward(entries):
    body = []
    for entry in entries:
        rows = entry["rows"]
        rivals = [over(rows, name, [PACKAGE]) if name in rows else "–" for name in RIVALS.values()]
        body.append(
            [
                entry["size"],
                entry["counts"],
                ms(rows[PACKAGE]["best_s"]),
                f"{1e9 * rows[PACKAGE]['best_s'] / entry['taps']:.2f}",
                over(rows, PACKAGE, CPP),
                *(f"{value} ×" if value != "–" else value for value in rivals),
            ]
        )
    head = ["frame", "slices × steps", "ms", "ns per sample", "over C++", *(f"{name} is slower by" for name in RIVALS)]
    return table(head, body)


def agreement(found):
    body = []
    for counts, differences in found.items():
        for name, d in differences.items():
            body.append([counts, name, *(f"{d[key]:.1e}" for key in ("mean", "p999", "largest_inside"))])
    return table(["", "", "mean", "99.9 % of pixels", "largest inside"], body)


def gradient(numbers):
    body, theirs = [], f"PyTorch, {GRADIENT}"
    for entry in numbers["entries"]:
        rows = entry["rows"]
        for kind, name in ((GRADIENT, "`dr.backward`"), (FUSED, "`value_and_gradient`")):
            pytorch = f"{over(rows, theirs, [kind])} ×" if theirs in rows else "–"
            times = ms(rows[kind]["best_s"]), over(rows, kind, [ESTIMATE]), pytorch
            body.append([entry["size"], entry["counts"], name, *times])
    return table(["frame", "slices × steps", "by", "ms", "over the estimate", "PyTorch is slower by"], body)


def methods(entries):
    ratios = {name: [e["rows"][name]["ratio"]["median"] for e in entries] for name in entries[0]["rows"]}
    body = [[name, *(f"{value:.2f}" for value in row)] for name, row in sorted(ratios.items(), key=lambda r: r[1])]
    return table(["", *(f"{e['size']}, {e['counts']}" for e in entries)], body)


MISSING = "This record has no such part."


def directions(entries):
    names = [name for name in entries[0]["rows"] if name != "visibility"]
    body = []
    for e in entries:
        ratios = (f"{e['rows'][n]['ratio']['median']:.2f}" if n in e["rows"] else "–" for n in names)
        body.append([e["size"], e["counts"], e["method"], *ratios])
    return table(["frame", "slices × steps", "method", *names], body)


def soft(entries):
    body = [
        [e["size"], e["counts"], name, ms(row["best_s"]), f"{row['ratio']['median']:.2f}"]
        for e in entries
        for name, row in e["soft"].items()
    ]
    return table(["frame", "slices × steps", "", "ms", "over hard horizons"], body)


def arccosines(entries):
    body = []
    for entry in entries:
        for name, row in entry["arccosines"].items():
            if "error" in row:
                error = [f"{row['error'][key]:+.1e}" for key in ("mean", "mean_absolute", "largest")]
                body.append([entry["counts"], f"`{name}`", f"{row['ratio']['median']:.2f}", *error])
    return table(["", "", "time over exact", "mean error", "mean absolute error", "largest"], body)


def pyramid(entries):
    body = []
    for entry in entries:
        for name, row in entry["rows"].items():
            error = entry["errors"].get(name)
            cells = [f"{error['mean']:+.1e}", f"{error['mean_absolute']:.1e}"] if error else ["", ""]
            body.append([entry["counts"], name, ms(row["best_s"]), f"{row['ratio']['median']:.2f}", *cells])
    head = ["", "", "ms", "over level 0 at the radius", "mean difference", "mean absolute difference"]
    return table(head, body)


def small(numbers):
    body = []
    for entry in numbers["overhead"]["entries"]:
        for name, row in entry["rows"].items():
            host = ms(row["best_s"] - row["kernels_s"])
            body.append([entry["counts"], name, ms(row["best_s"]), ms(row["median_s"]), host])
    return table(["", "", "best, ms", "median, ms", "without kernels, ms"], body)


def startup(numbers):
    body = []
    for entry in numbers["entries"]:
        for state in ("cold", "warm"):
            row = entry[state]
            times = (ms(row[key]) for key in ("first_s", "second_s", "compile_s"))
            body.append([entry["counts"], entry["what"], state, *times])
    return table(["", "", "kernel cache", "first frame, ms", "second, ms", "of which compiling the first, ms"], body)


def memory(entries):
    body = [[e["what"], e["size"], e["counts"], f"{e['dr'] / 1e6:.0f}", f"{e['process'] / 1e6:.0f}"] for e in entries]
    return table(["", "frame", "slices × steps", "Dr.Jit, MB", "process, MB"], body)


def threads(entries):
    names = list(entries[0]["speedups"]) if entries else []
    body = [
        [name, *(f"{e['speedups'][name]:.2f}" if name in e["speedups"] else "–" for e in entries)] for name in names
    ]
    return table(["two threads, times as fast", *(e["counts"] for e in entries)], body)


def device(numbers):
    body = [
        [e["what"], e["counts"], *(ms(e[key]) for key in ("kernels_s", "plain_s", "frozen_s")), f"{e['share']:.1%}"]
        for e in numbers["entries"]
    ]
    return table(["", "slices × steps", "kernels, ms", "call, ms", "frozen call, ms", "share of bandwidth"], body)


def kernels(found):
    """What a device does, and how much of its memory's bandwidth that is."""
    return f"""\
Backend `{found["backend"]}`, {found["entries"][0]["pixels"] / 1e6:.2f} million pixels; the memory streams
{found["bandwidth"] / 1e9:.0f} GB/s on one thread, and the share is that of the time in which it could bring every
input and take every output once.

{device(found)}"""


def section(record, stages):
    """The page, from the record of the benchmarks and that of the stages of the pipeline."""
    n = record["numbers"]
    return f"""{origin(record)}

### Wanted and measured

{goals(n["goals"])}

### One estimate

{forward(n["forward"]["entries"])}

All of them compute the same image. Mean, quantile and largest |difference| of visibility from the NumPy twin, at 540p;
the largest away from the border, where the C++ holds samples:

{agreement(n["forward"]["agreement"])}

### Gradients

{gradient(n["gradient"])}

### Other methods

Time over that of the estimator with a linear falloff, at equal numbers of samples:

{methods(n["methods"]["entries"])}

Gradients by soft horizons, which go through all samples:

{soft(n["methods"]["entries"])}

Approximate arc cosines, with that estimator:

{arccosines(n["methods"]["entries"])}

### Directions

Time over that of the visibility alone, with nothing but the estimate and with the gradients of a loss:

{directions(n["directions"]["entries"]) if "directions" in n else MISSING}

### Pyramid

At {n["pyramid"]["entries"][0]["size"]}; the differences are those of visibility from level 0.

{pyramid(n["pyramid"]["entries"])}

### Pipeline

{pipeline.section(stages)}

### Small frames

64×64 pixels:

{small(n)}

A new process, of which importing the package takes {ms(n["startup"]["import_s"])} ms before:

{startup(n["startup"])}

### Memory

Peak beyond the inputs:

{memory(n["memory"]["entries"]) if "memory" in n else MISSING}

### Threads

{threads(n["threads"]["entries"])}

### Kernels alone

{kernels(n["device"]) if "device" in n else MISSING}
"""
