"""What the stages of the published pipeline cost, from ``references/performance/pipeline``."""

from .markdown import ms, table

WHOLE, FULL = "all stages", "full size, one slice"
#: In the order of the work; a record sorts its names.
ROWS = (FULL, "downsample", "occlusion", "spatial", "temporal", "upsample", WHOLE)


def section(record):
    """Every stage on one thread and on several, and full-size frames that err as little."""
    numbers, device = record["numbers"]["pipeline"], record["device"]
    rows = numbers["rows"]
    stages = [
        [name, ms(rows[name]["best_s"]), f"{rows[name]['ratio']['median']:.2f}", ms(numbers["walls"][name])]
        for name in ROWS
    ]
    equal = []
    for name, found in numbers["equal"].items():
        enough, times = found["n_slices"], found.get("rows")
        time = f"{times['full size']['ratio']['median']:.1f}" if times else "–"
        equal.append([name, str(enough or "–"), f"{found['errors'][str(enough)]:.4f}" if enough else "–", time])
    head = ["", "ms", "over full size, one slice", f"wall on {numbers['threads']} threads, ms"]
    return f"""\
The published pipeline at {numbers["size"]}, stage by stage, from `references/performance/pipeline/record.json`
(`python -m tests.bench pipeline`), on {device["processor"]}:

{table(head, stages)}

The kernels of all stages take {ms(numbers["kernels"][WHOLE])} ms on the backend `{numbers["backend"]}`; the slides give
0.5 ms on a PlayStation 4.

A still frame seen again and again: the pipeline settles {numbers["error"]:.4f} (root mean square) from what its
estimator comes to at full size with many samples. One full-size frame errs no more from so many slices on, and costs
so many times as much as all stages of the pipeline:

{table(["one full-size frame", "slices", "error", "time over the pipeline's"], equal)}"""
