"""Gradient: an estimate with the gradients of a loss by depth and normals, over the estimate alone; PyTorch.

python -m tests.bench.gradient [--quick]
"""

import numpy as np

from .harness import package
from .harness.clock import compare
from .harness.options import run_section
from .harness.rivals import twin
from .harness.table import HEAD, ratio_rows
from .harness.work import Work, frame

ESTIMATE, GRADIENT, FUSED = "estimate", "estimate and gradients", "estimate and gradients, fused"
COUNTS = {"1x8": (1, 8), "1x32": (1, 32), "3x4": (3, 4), "9x3": (9, 3)}
#: What PyTorch is given: autograd keeps every sample's intermediate values, 300 bytes of them.
TORCH_QUICK, TORCH = (("540p", "1x8"),), (("1080p", "1x8"), ("540p", "3x4"))
#: Where gradients are compared: small, and rough enough that samples do not tie with the tangent plane.
CHECKED, RELIEF = (160, 90), 1e-3


def agreement(torch_twin):
    """Σ |difference| / Σ |gradient| between the package and PyTorch, for depth and for normals."""
    work = Work(*CHECKED, *COUNTS["1x8"])
    scene = frame(work, RELIEF)
    g = scene.gbuffer(work)
    _, *ours = (np.array(result) for result in package.gradient_step(g.view_z, g.normal_v, g.camera, work.method()))
    _, d_z, d_n = torch_twin.Twin(scene, work).value_and_gradient()
    # The package takes normals of any length, whose gradients have no part along them.
    along = (d_n * scene.normal_v).sum(axis=-1, keepdims=True)
    theirs = d_z, d_n - along * scene.normal_v
    return {
        name: float(abs(a - b).sum() / abs(b).sum())
        for name, a, b in zip(("depth", "normals"), ours, theirs, strict=True)
    }


def measure(options):
    size = "540p" if options.quick else "1080p"
    torch_twin = twin("torch") if options.on_host else None
    entries = []
    for name, counts in COUNTS.items():
        work = Work.of(size, counts)
        g, method = frame(work).gbuffer(work), work.method()
        runs = {
            ESTIMATE: package.estimate(g, method),
            GRADIENT: package.gradient(g, method),
            FUSED: package.fused(g, method),
        }
        entries.append({"size": size, "counts": name, "rows": compare(runs, ESTIMATE, options)})
    if torch_twin:
        for size, name in TORCH_QUICK if options.quick else TORCH:
            work = Work.of(size, COUNTS[name])
            scene = frame(work)
            g, method = scene.gbuffer(work), work.method()
            theirs = torch_twin.Twin(scene, work)
            runs = {
                GRADIENT: package.gradient(g, method),
                FUSED: package.fused(g, method),
                f"PyTorch, {ESTIMATE}": theirs.value,
                f"PyTorch, {GRADIENT}": theirs.value_and_gradient,
            }
            entries.append({"size": size, "counts": name, "rows": compare(runs, GRADIENT, options)})
    return {"agreement": agreement(torch_twin) if torch_twin else {}, "entries": entries}


def tables(numbers):
    if numbers["agreement"]:
        rows = [(name, f"{value:.1e}") for name, value in numbers["agreement"].items()]
        yield "gradients: Σ |difference from PyTorch| / Σ |gradient|", ("by", ""), rows
    else:
        print("no PyTorch to compare with")
    for entry in numbers["entries"]:
        yield f"{entry['size']}, {entry['counts']}", HEAD, ratio_rows(entry["rows"])


if __name__ == "__main__":
    run_section(measure, tables, __doc__)
