"""Both precisions of the backend in use, with the tolerance that golden values are held to."""

from types import SimpleNamespace

import pytest

from gtao import backend

import drjit as dr  # isort: skip  (after gtao, which chooses the LLVM library)

from oracles import golden


@pytest.fixture(params=["float64", "float32"])
def precision(request):
    """``name``, ``types`` (array types), ``Float``, ``tolerance`` and ``lanes(values) -> Float``."""
    Float = backend.default_float()
    if request.param == "float64":
        Float = dr.float64_array_t(Float)
    return SimpleNamespace(
        name=request.param,
        types=backend.types_of(Float),
        Float=Float,
        tolerance=golden.FLOAT64_TOLERANCE if request.param == "float64" else golden.FLOAT32_TOLERANCE,
        lanes=lambda values: Float([float(v) for v in values]),
    )
