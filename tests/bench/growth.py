"""Growth: cost against pixels and against samples, of an estimate, of one with gradients, and of the C++.

python -m tests.bench.growth [--quick] [--reference DIR]
"""

from dataclasses import replace

from .harness import package, reference
from .harness.clock import compare
from .harness.options import run_section
from .harness.work import Work, frame

ESTIMATE, GRADIENT, CPP = "estimate", "estimate and gradients", "C++, scalar loads"
FUSED = f"{GRADIENT}, fused"
#: Sixteenths of the sides of 4K.
SIDES = (1, 2, 4, 8, 16)
SIDES_QUICK = (1, 2, 4)
BY_PIXELS = ((1, 8), (9, 3))
BY_TAPS = ((1, 1), (1, 2), (1, 4), (1, 8), (1, 16), (1, 32), (3, 3), (9, 3), (16, 4), (16, 16))
BY_TAPS_QUICK = ((1, 1), (1, 4), (1, 16), (1, 32))


def point(work, options):
    scene = frame(work)
    g, method = scene.gbuffer(work), work.method()
    runs = {
        ESTIMATE: package.estimate(g, method),
        GRADIENT: package.gradient(g, method),
        FUSED: package.fused(g, method),
    }
    if options.on_host:
        try:
            cpp = reference.runs(reference.load(options.reference), scene, work)
            runs[CPP] = cpp[CPP]
        except reference.Unavailable:
            pass
    return {
        "pixels": work.n_pixels,
        "taps_per_pixel": work.n_taps // work.n_pixels,
        "n_slices": work.n_slices,
        "n_steps": work.n_steps,
        "rows": compare(runs, ESTIMATE, options),
    }


def measure(options):
    # Many points, of which the trend counts.
    options = replace(options, budget_s=options.budget_s / 4)
    size = "540p" if options.quick else "1080p"
    counts = BY_PIXELS[:1] if options.quick else BY_PIXELS
    sides = SIDES_QUICK if options.quick else SIDES
    return {
        "pixels": [point(Work(240 * side, 135 * side, *c), options) for c in counts for side in sides],
        "size": size,
        "taps": [point(Work.of(size, c), options) for c in (BY_TAPS_QUICK if options.quick else BY_TAPS)],
    }


def tables(numbers):
    for by, title in (("pixels", "cost per pixel, ns"), ("taps", f"cost per pixel at {numbers['size']}, ns")):
        names = list(numbers[by][0]["rows"])
        rows = [
            (
                f"{p['n_slices']}x{p['n_steps']}, {p['pixels'] / 1e6:.2f} M pixels",
                *(f"{1e9 * p['rows'][name]['best_s'] / p['pixels']:.1f}" for name in names),
            )
            for p in numbers[by]
        ]
        yield title, ("", *names), rows


if __name__ == "__main__":
    run_section(measure, tables, __doc__)
