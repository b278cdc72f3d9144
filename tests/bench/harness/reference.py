"""Hand-written C++ of the same estimator, which a directory outside of this repository may hold.

The directory's ``common.py`` offers ``make_params(width, height, n_slices, n_steps, radius, falloff, fov_deg,
max_frac)`` and ``cpp(name, view_z, normal, params, threads)``, which builds the sources beside it and returns a
callable; its frame has y down and z forward.
"""

import importlib.util
import math

import numpy as np

__all__ = ["SOURCES", "Unavailable", "load", "runs"]

#: Callable -> what it is called in tables. Which of the two ways to fetch is faster depends on the processor.
VARIANTS = {
    "C++, scalar loads": "gtao_avx512_extract",
    "C++, vector gathers": "gtao_avx512_tiles_nr0",
}
SOURCES = ("common.py", "gtao_ref.cpp")


class Unavailable(Exception):
    """There is nothing to compare with; the text says why."""


def load(directory):
    """The module of a directory, its sources compiled.

    Raises:
        Unavailable: no directory, no module, or no compiler that takes the sources.
    """
    if directory is None:
        raise Unavailable("no hand-written C++ to compare with; name its directory with --reference")
    path = directory / SOURCES[0]
    if not path.is_file():
        raise Unavailable(f"no hand-written C++ to compare with: {path} is missing")
    spec = importlib.util.spec_from_file_location("gtao_bench_reference", path)
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
        module.lib()
    # A compiler that is missing, fails, or knows no AVX-512 is no reason to measure nothing else.
    except Exception as cause:
        raise Unavailable(f"the hand-written C++ in {directory} cannot be used: {cause}") from None
    return module


def runs(module, frame, work, threads=1):
    """Name -> callable that returns the image, as wide as ``frame``."""
    params = module.make_params(
        work.width,
        work.height,
        work.n_slices,
        work.n_steps,
        radius=work.radius,
        falloff=1 - work.full / work.radius,
        fov_deg=math.degrees(work.fov_y),
        max_frac=work.longest,
    )
    normal = np.ascontiguousarray(np.moveaxis(frame.normal_v, -1, 0) * np.array([1, -1, -1], np.float32)[:, None, None])
    return {name: module.cpp(function, frame.view_z, normal, params, threads) for name, function in VARIANTS.items()}
