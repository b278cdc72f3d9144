"""Memory: the peak beyond what the inputs take, by Dr.Jit's own count and by what the process holds.

Every measurement is a process of its own, warmed up on 64×64 pixels before its inputs are made.

python -m tests.bench.memory [--quick] [--reference DIR]
"""

import ctypes
import gc
import json
import subprocess
import sys
from pathlib import Path

import drjit as dr

import gtao

from .harness import package, reference
from .harness.options import CHILD, child, run_section
from .harness.rivals import twin
from .harness.twins import numpy_twin
from .harness.work import Work, frame

COUNTS = {"1x8": (1, 8), "1x32": (1, 32), "9x3": (9, 3)}
#: (what, size, counts); the second tuple adds what takes long or much.
CASES = (
    ("estimate", "1080p", "1x8"),
    ("estimate and gradients", "1080p", "1x8"),
    ("estimate and gradients", "1080p", "1x32"),
    ("estimate and gradients, fused", "1080p", "1x8"),
    ("estimate with a pyramid", "1080p", "1x8"),
    ("NumPy", "1080p", "1x8"),
    ("Numba", "1080p", "1x8"),
    ("C++", "1080p", "1x8"),
)
LONG = (
    ("estimate", "4K", "9x3"),
    ("estimate", "8K", "1x8"),
    ("estimate in bands", "8K", "1x8"),
    ("estimate and gradients", "8K", "1x8"),
    ("estimate and gradients, fused", "8K", "1x8"),
    ("PyTorch, estimate and gradients", "1080p", "1x8"),
)


def _build(what, work, scene, directory):
    """A callable of a frame and a work."""
    if what == "NumPy":
        return numpy_twin.build(scene, work)
    if what == "Numba":
        return twin("numba").build(scene, work)
    if what == "C++":
        return next(iter(reference.runs(reference.load(directory), scene, work).values()))
    if what.startswith("PyTorch"):
        return twin("torch").Twin(scene, work).value_and_gradient
    g = scene.gbuffer(work)
    dr.eval(g.view_z, g.normal_v, g.mask)
    method = work.method(pyramid=gtao.DepthPyramid() if what.endswith("pyramid") else None)
    kinds = {"gradients": package.gradient, "fused": package.fused, "bands": package.bands}
    return kinds.get(what.rpartition(" ")[2], package.estimate)(g, method)


def _resident(key):
    """A line of the kernel's account of this process, in bytes."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(f"{key}:"))


def _let_go():
    """Give memory back that is not in use, or what comes next would find it there and seem to need none."""
    gc.collect()
    dr.flush_malloc_cache()
    ctypes.CDLL(None).malloc_trim(0)


def report(what, size, counts, directory):
    """Print the peaks of one case in bytes."""
    dr.set_thread_count(1)
    small, work = Work.of("64", COUNTS[counts]), Work.of(size, COUNTS[counts])
    directory = Path(directory) if directory else None
    run = _build(what, small, frame(small), directory)
    run()
    scene = frame(work)
    _let_go()
    run = _build(what, work, scene, directory)
    backend = {"cuda": dr.JitBackend.CUDA, "llvm": dr.JitBackend.LLVM}[gtao.backend.require()]
    dr.sync_thread()
    _let_go()
    dr.detail.malloc_clear_statistics()
    held = dr.detail.malloc_watermark(backend)
    # Resets the peak that the kernel keeps.
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    resident = _resident("VmRSS")
    for _ in range(2):
        run()
        dr.sync_thread()
    peaks = {"dr": dr.detail.malloc_watermark(backend) - held, "process": _resident("VmHWM") - resident}
    print(json.dumps(peaks))


def measure(options):
    if not sys.platform.startswith("linux"):
        return {"entries": [], "notes": ["the peak of a process is read as Linux tells it"]}
    entries, notes = [], []
    for what, size, counts in CASES if options.quick else CASES + LONG:
        try:
            peaks = child("memory", what, size, counts, str(options.reference or ""))
        except subprocess.CalledProcessError as cause:
            notes.append(f"{what}, {size}: {(cause.stderr.splitlines() or ['ended without a word'])[-1]}")
            continue
        entries.append({"what": what, "size": size, "counts": counts, **peaks})
    return {"entries": entries, "notes": notes}


def tables(numbers):
    for note in numbers["notes"]:
        print(note)
    rows = [
        (f"{e['what']}, {e['size']}, {e['counts']}", f"{e['dr'] / 1e6:.0f}", f"{e['process'] / 1e6:.0f}")
        for e in numbers["entries"]
    ]
    yield "peak beyond the inputs, MB", ("", "Dr.Jit", "process"), rows


if __name__ == "__main__":
    if sys.argv[1:2] == [CHILD]:
        report(*sys.argv[2:])
    else:
        run_section(measure, tables, __doc__)
