"""Methods: what the other estimators cost, and what approximate arc cosines gain and err, at equal numbers of samples.

python -m tests.bench.methods [--quick]
"""

import gtao

from .harness import package
from .harness.clock import compare
from .harness.options import run_section
from .harness.table import HEAD, ratio_rows
from .harness.work import COUNTS, Work, frame

BASE = "linear falloff"
ARCCOSINES = ("two_term", "bit_trick")
SOFT, TEMPERATURE = "linear falloff, soft horizons", 0.02
GRADIENT = "estimate and gradients"


def methods(work):
    """Name -> configuration, all of the same samples but for the noise of the search's length."""
    common = {"radius": work.radius, "n_steps": work.n_steps, "max_radius_px": work.max_radius_px}
    sliced = common | {"n_slices": work.n_slices}
    falloff = {"falloff": gtao.LinearFalloff(start=work.full, end=work.radius)}
    return {
        BASE: work.method(),
        SOFT: work.method(soft_horizon=TEMPERATURE),
        "linear falloff, slices even about the view": gtao.GTAO(**sliced, **falloff),
        "exact cut": gtao.GTAO(**sliced),
        "exact cut, uniform": gtao.GTAO(**sliced, weighting="uniform"),
        "exact cut, linear fetch": gtao.GTAO(**sliced, fetch="linear"),
        "bitmask, solid": gtao.VisibilityBitmask(**sliced),
        "bitmask, by continuity": gtao.VisibilityBitmask(
            **sliced,
            thickness=gtao.ContinuityThickness(
                continuing=work.radius, isolated=0.1 * work.radius, gap=0.1 * work.radius
            ),
        ),
        "HBAO": gtao.HBAO(**common, n_directions=2 * work.n_slices),
    }


def approximate(work, g, options):
    """Time of every arc cosine relative to the exact one, and its error in visibility on this frame."""
    exact = package.image(g, work.method())
    configurations = {"exact": work.method()} | {name: work.method(arccosine=name) for name in ARCCOSINES}
    rows = compare({name: package.estimate(g, m) for name, m in configurations.items()}, "exact", options)
    for name in ARCCOSINES:
        difference = package.image(g, configurations[name]) - exact
        rows[name]["error"] = {
            "mean": float(difference.mean()),
            "mean_absolute": float(abs(difference).mean()),
            "largest": float(abs(difference).max()),
        }
    return rows


def soft_gradient(work, g, options):
    """Gradients through all samples of soft horizons, over those of the samples that win."""
    runs = {
        f"{GRADIENT}, {name}": package.gradient(g, work.method(soft_horizon=soft))
        for name, soft in (("hard", None), ("soft", TEMPERATURE))
    }
    return compare(runs, f"{GRADIENT}, hard", options)


def measure(options):
    size = "540p" if options.quick else "1080p"
    entries = []
    for name in ("1x8", "9x3"):
        work = Work.of(size, COUNTS[name])
        g = frame(work).gbuffer(work)
        rows = compare({label: package.estimate(g, m) for label, m in methods(work).items()}, BASE, options)
        entries.append(
            {
                "size": size,
                "counts": name,
                "rows": rows,
                "soft": soft_gradient(work, g, options),
                "arccosines": approximate(work, g, options),
            }
        )
    return {"entries": entries}


def tables(numbers):
    for entry in numbers["entries"]:
        title = f"{entry['size']}, {entry['counts']}"
        yield title, HEAD, ratio_rows(entry["rows"])
        yield f"{title}: soft horizons", HEAD, ratio_rows(entry["soft"])
        yield f"{title}: arc cosines", HEAD, ratio_rows(entry["arccosines"])
        errors = [
            (n, *(f"{v:+.1e}" for v in r["error"].values())) for n, r in entry["arccosines"].items() if "error" in r
        ]
        yield f"{title}: errors of visibility", ("", "mean", "mean absolute", "largest"), errors


if __name__ == "__main__":
    run_section(measure, tables, __doc__)
