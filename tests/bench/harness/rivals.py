"""What the package is compared with on the CPU: hand-written C++ where there is some, and our twins."""

import importlib
import importlib.util

from . import reference
from .twins import numpy_twin

__all__ = ["forward", "twin"]

#: A Numba or NumPy twin takes ten times as long: where a frame has more samples, only compiled rivals run.
SLOW_TAPS = 60e6


def twin(name):
    """The module of a twin whose framework may be missing, or None."""
    if importlib.util.find_spec(name) is None:
        return None
    return importlib.import_module(f".twins.{name}_twin", __package__)


def forward(frame, work, options, notes, threads=1):
    """Name -> callable that returns an image; what is missing is noted in words.

    Args:
        options: :class:`.options.Options`.
        notes: a set of sentences, added to.
        threads: of those that can use several.
    """
    if not options.on_host:
        notes.add("times of kernels are compared with nothing: the other implementations run on the CPU")
        return {}
    runs = {}
    try:
        runs |= reference.runs(reference.load(options.reference), frame, work, threads)
    except reference.Unavailable as cause:
        notes.add(str(cause))
    if work.n_taps > SLOW_TAPS:
        return runs
    numba_twin = twin("numba")
    if numba_twin is None:
        notes.add("Numba is missing: pip install 'gtao[bench]'")
    else:
        runs["Numba"] = numba_twin.build(frame, work, threads=threads)
    if threads == 1:
        runs["NumPy, 16 rows at a time"] = numpy_twin.build(frame, work)
    return runs
