"""Whether all implementations compute the same image, before their times are compared."""

import numpy as np

from . import package, reference
from .rivals import twin
from .twins import convention, numpy_twin
from .work import Work, frame

__all__ = ["HEAD", "measure", "rows"]

HEAD = ("", "mean |difference|", "99.9 % of pixels", "largest", "largest inside")
#: Explains the table.
TEXT = """The NumPy twin follows the package's conventions, but in the comparison with the C++, which turns azimuths the
other way round in the image and holds samples at the border. Whole pixels differ where a sample lies on the edge of two
texels, and at the border of the C++, whose held samples may be the shaded point itself, which has no direction."""


def _margin(work):
    """Pixels from the border beyond which no search reaches it."""
    return int(work.max_radius_px) + 2


def _difference(a, b, work):
    difference = abs(a - b)
    margin = _margin(work)
    return {
        "mean": float(difference.mean()),
        "p999": float(np.quantile(difference, 0.999)),
        "largest": float(difference.max()),
        "largest_inside": float(difference[margin:-margin, margin:-margin].max()),
    }


def measure(size, counts, options):
    """Differences of all that can be had from the NumPy twin."""
    work = Work.of(size, counts)
    scene = frame(work)
    image = numpy_twin.build(scene, work)()
    found = {"package": _difference(package.image(scene.gbuffer(work), work.method()), image, work)}
    if numba_twin := twin("numba"):
        found["Numba twin"] = _difference(numba_twin.build(scene, work)(), image, work)
    if torch_twin := twin("torch"):
        found["PyTorch twin"] = _difference(torch_twin.Twin(scene, work).value(), image, work)
    try:
        cpp = reference.runs(reference.load(options.reference), scene, work)
    except reference.Unavailable:
        return found
    image = numpy_twin.build(scene, work, convention.REFERENCE)()
    return found | {name: _difference(run().reshape(image.shape), image, work) for name, run in cpp.items()}


def rows(found):
    return [(name, *(f"{value:.1e}" for value in difference.values())) for name, difference in found.items()]
