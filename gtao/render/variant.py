"""Which Mitsuba variant the ground truth runs on."""

import contextlib

import drjit as dr
import mitsuba as mi

from gtao import backend
from gtao._llvm import MINIMUM_MAJOR
from gtao.errors import BackendError

__all__ = ["ensure_variant"]

CUDA_VARIANT = "cuda_ad_rgb"
LLVM_VARIANT = "llvm_ad_rgb"


def _llvm_usable() -> bool:
    report = backend.report()
    return report.llvm_version is not None and report.llvm_version[0] >= MINIMUM_MAJOR


def _cuda_traces() -> bool:
    """Whether a ray can be traced on the GPU: a driver may have CUDA and lack OptiX, which only a try tells."""
    with contextlib.suppress(Exception):
        mi.set_variant(CUDA_VARIANT)
        scene = mi.load_dict({"type": "scene", "shape": {"type": "sphere"}})
        ray = mi.Ray3f(mi.Point3f(0, 0, 3), mi.Vector3f(0, 0, -1))
        return bool(dr.all(scene.ray_test(ray)))
    return False


def ensure_variant() -> str:
    """Set a Mitsuba variant unless the user already has, and return its name.

    A GPU is used when both CUDA and OptiX work, the CPU through LLVM otherwise.

    Raises:
        BackendError: there is no usable backend, or the user chose a scalar variant, which has no arrays.
    """
    backend.require()
    variant = mi.variant()
    if variant is not None:
        if variant.startswith("scalar"):
            raise BackendError(
                f"the Mitsuba variant {variant} cannot trace arrays of rays; "
                f"call mitsuba.set_variant({LLVM_VARIANT!r}) or leave the choice to gtao"
            )
        return variant
    if dr.has_backend(dr.JitBackend.CUDA) and _cuda_traces():
        return CUDA_VARIANT
    if not _llvm_usable():
        raise BackendError(f"the GPU has no working OptiX and there is no usable LLVM; run: {backend.ADVICE}")
    mi.set_variant(LLVM_VARIANT)
    return LLVM_VARIANT
