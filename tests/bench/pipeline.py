"""Pipeline: what every stage of the published pipeline costs, and a full-size frame that errs as little.

A still frame, seen again and again. Errors are root mean squares of the visibility, before it is limited to [0, 1],
from that of the same estimator at full size with many slices, offsets and frames: what half resolution, few samples and
filters cost, and nothing else.

python -m tests.bench.pipeline [--quick]
"""

from dataclasses import replace

import drjit as dr
import numpy as np

import gtao

from .harness.clock import compare, interleave
from .harness.options import run_section
from .harness.table import HEAD, milliseconds, ratio_rows
from .harness.work import COUNTS, Work, frame

FULL, WHOLE, ESTIMATE = "full size, one slice", "all stages", "occlusion"
#: Frames after which the pipeline has settled: twice the cycle of its noise.
SETTLED = 48
#: Slices of one full-size frame, unfiltered and through the pipeline's spatial filter.
SLICES = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
CYCLE, DENSE_SLICES = 24, 16
THREADS = 2


def limit(g, method):
    """What the estimator comes to: the mean over a cycle of many directions and offsets."""
    dense = replace(method, n_slices=DENSE_SLICES, noise="spatial_4x4_fine")
    images = (gtao.ambient_occlusion(g, dense, frame_index=k).visibility.numpy() for k in range(CYCLE))
    return np.mean([image.astype(np.float64) for image in images], axis=0)


def settled(pipeline, g):
    """The stages of the last of many still frames, and the history after it."""
    history = gtao.History()
    for _ in range(SETTLED):
        stages = pipeline.stages(g, history)
    return stages, history


def stage_runs(pipeline, g, stages, history):
    """Name -> callable, for each stage on what the one before it made, and for all of them."""
    small = stages.frame

    def visibility(make):
        return lambda: dr.eval(make().visibility)

    return {
        FULL: visibility(lambda: gtao.ambient_occlusion(g, pipeline.occlusion)),
        "downsample": lambda: gtao.downsample(g, pipeline.downsample),
        ESTIMATE: visibility(lambda: gtao.ambient_occlusion(small, pipeline.occlusion)),
        "spatial": visibility(lambda: gtao.denoise(stages.occlusion, small, pipeline.spatial)),
        "temporal": visibility(lambda: pipeline.temporal.step(stages.spatial, small, history)),
        "upsample": visibility(lambda: gtao.upsample(stages.temporal, small, g, pipeline.upsample)),
        WHOLE: visibility(lambda: pipeline.step(g, history)),
    }


def full_size_runs(pipeline, g, spatial, counts):
    """Slices -> callable that returns the visibility of one full-size frame."""

    def run(n):
        ao = gtao.ambient_occlusion(g, replace(pipeline.occlusion, n_slices=n))
        ao = ao if spatial is None else gtao.denoise(ao, g, spatial)
        dr.eval(ao.visibility)
        return ao.visibility

    return {n: lambda n=n: run(n) for n in counts}


def as_good(pipeline, g, spatial, wanted, error, whole, options):
    """The fewest slices of one full-size frame that errs by no more than ``wanted``, and its time."""
    runs = full_size_runs(pipeline, g, spatial, SLICES)
    errors = {n: error(run().numpy()) for n, run in runs.items()}
    enough = [n for n, e in errors.items() if e <= wanted]
    found = {"errors": {str(n): e for n, e in errors.items()}, "n_slices": enough[0] if enough else None}
    if enough:
        found["rows"] = compare({WHOLE: whole, "full size": runs[enough[0]]}, WHOLE, options)
    return found


def measure(options):
    size = "540p" if options.quick else "1080p"
    work = Work.of(size, COUNTS["1x8"])
    g = frame(work).gbuffer(work)
    mask = g.mask.numpy()
    pipeline = gtao.Pipeline.as_published(work.radius)
    stages, history = settled(pipeline, g)
    dense = limit(g, pipeline.occlusion)

    def error(image):
        return float(np.sqrt(np.mean(np.square(image - dense)[mask])))

    runs = stage_runs(pipeline, g, stages, history)
    rows = compare(runs, FULL, options)
    before = dr.thread_count()
    dr.set_thread_count(THREADS)
    walls = {name: min(times) for name, times in interleave(runs, "wall", options.rounds, options.budget_s).items()}
    dr.set_thread_count(before)
    kernels = {name: min(t) for name, t in interleave(runs, "kernels", options.rounds, options.budget_s).items()}
    reached = error(stages.upsampled.visibility.numpy())
    equal = {
        name: as_good(pipeline, g, spatial, reached, error, runs[WHOLE], options)
        for name, spatial in (("unfiltered", None), ("filtered", pipeline.spatial))
    }
    return {
        "size": size,
        "backend": gtao.backend.require(),
        "threads": THREADS,
        "rows": rows,
        "walls": walls,
        "kernels": kernels,
        "error": reached,
        "equal": equal,
    }


def tables(numbers):
    size = numbers["size"]
    yield f"{size}: stages", HEAD, ratio_rows(numbers["rows"])
    rows = [(n, milliseconds(numbers["walls"][n]), milliseconds(numbers["kernels"][n])) for n in numbers["rows"]]
    yield f"{size}: wall time on {numbers['threads']} threads, and kernels", ("ms", "wall", "kernels"), rows
    for name, found in numbers["equal"].items():
        title = f"{size}: error {numbers['error']:.4f} after {SETTLED} frames; one full-size frame, {name}"
        yield title, ("slices", "error"), [(n, f"{e:.4f}") for n, e in found["errors"].items()]
        if "rows" in found:
            yield f"as good from {found['n_slices']} slices on", HEAD, ratio_rows(found["rows"])


if __name__ == "__main__":
    run_section(measure, tables, __doc__)
