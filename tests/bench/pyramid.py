"""Pyramid: 4K at a radius and at four times of it, from the depth buffer alone and from coarser copies of it.

python -m tests.bench.pyramid [--quick]
"""

import gtao

from .harness import package
from .harness.clock import compare
from .harness.options import run_section
from .harness.table import HEAD, ratio_rows
from .harness.work import COUNTS, Work, frame

FILTERS = ("weighted", "min", "max")
FACTOR = 4
EXACT, NEAR, FAR = "level 0", "radius", f"{FACTOR} radii"


def works(size, counts):
    """The usual radius, and one with everything that is measured in it larger."""
    near = Work.of(size, counts)
    return {
        NEAR: near,
        FAR: Work.of(size, counts, radius=FACTOR * near.radius, full=FACTOR * near.full, longest=FACTOR * near.longest),
    }


def measure(options):
    large, small = ("1080p", "540p") if options.quick else ("4K", "1080p")
    entries = []
    for name in ("1x8",) if options.quick else ("1x8", "3x3"):
        runs, errors = {}, {}
        for reach, work in works(large, COUNTS[name]).items():
            g = frame(work).gbuffer(work)
            runs[f"{EXACT}, {reach}"] = package.estimate(g, work.method())
            runs[f"{EXACT}, {reach}, new frame"] = package.estimate_new_frame(g, work.method())
            exact = package.image(g, work.method())
            for chosen in FILTERS:
                method = work.method(pyramid=gtao.DepthPyramid(filter=chosen))
                # Of its own, because a frame keeps one pyramid only.
                own = frame(work).gbuffer(work)
                runs[f"{chosen}, {reach}"] = package.estimate(own, method)
                runs[f"{chosen}, {reach}, new frame"] = package.estimate_new_frame(own, method)
                difference = package.image(own, method) - exact
                errors[f"{chosen}, {reach}"] = {
                    "mean": float(difference.mean()),
                    "mean_absolute": float(abs(difference).mean()),
                }
        work = Work.of(small, COUNTS[name])
        g = frame(work).gbuffer(work)
        runs[f"{EXACT}, {small}"] = package.estimate(g, work.method())
        runs[f"{FILTERS[0]}, {small}"] = package.estimate(g, work.method(pyramid=gtao.DepthPyramid(filter=FILTERS[0])))
        rows = compare(runs, f"{EXACT}, {NEAR}", options)
        pixel_ratio = Work.of(large, COUNTS[name]).n_pixels / work.n_pixels
        entries.append(
            {
                "size": large,
                "small": small,
                "pixel_ratio": pixel_ratio,
                "counts": name,
                "rows": rows,
                "errors": errors,
            }
        )
    return {"entries": entries}


def per_tap(entry, name):
    """Seconds per sample of one row."""
    size = entry["small"] if name.endswith(entry["small"]) else entry["size"]
    return entry["rows"][name]["best_s"] / Work.of(size, COUNTS[entry["counts"]]).n_taps


def tables(numbers):
    for entry in numbers["entries"]:
        title = f"{entry['size']}, {entry['counts']}"
        rows = ratio_rows(entry["rows"])
        yield title, HEAD, rows
        errors = [(name, f"{e['mean']:+.1e}", f"{e['mean_absolute']:.1e}") for name, e in entry["errors"].items()]
        yield f"{title}: difference from {EXACT}", ("", "mean", "mean absolute"), errors
        small = per_tap(entry, f"{EXACT}, {entry['small']}")
        values = {name: per_tap(entry, name) for name in entry["rows"]}
        relative = [(name, f"{1e9 * value:.2f}", f"{value / small:.2f}") for name, value in values.items()]
        yield f"{title}: ns per sample, and relative to {EXACT}, {entry['small']}", ("", "ns", "ratio"), relative


if __name__ == "__main__":
    run_section(measure, tables, __doc__)
