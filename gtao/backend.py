"""Which Dr.Jit backend is used, and the array types that belong to an array.

Importing this module settles which LLVM library Dr.Jit will open and then imports Dr.Jit. :func:`require` is called
by every public function that makes arrays: with no usable backend Dr.Jit would end the process (SIGFPE or an abort
inside LLVM) instead of raising.
"""

import contextlib
import os
import sys
from dataclasses import dataclass
from functools import cache
from types import SimpleNamespace
from typing import Any

from . import _llvm
from .errors import BackendError

_CHOICE = _llvm.choose()
_DRJIT_CAME_FIRST = "drjit" in sys.modules


@contextlib.contextmanager
def _silent_stderr():
    """Dr.Jit writes a notice to file descriptor 2 when LLVM is missing; our own error says it better."""
    try:
        saved = os.dup(2)
    except OSError:
        yield
        return
    try:
        with open(os.devnull, "wb") as null:
            os.dup2(null.fileno(), 2)
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)


def _import_drjit():
    if _DRJIT_CAME_FIRST or not sys.platform.startswith("linux"):
        import drjit
    elif _CHOICE.library is not None:
        os.environ[_llvm.LIBRARY_VARIABLE] = _CHOICE.library.path
        import drjit
    else:
        # A path that does not exist keeps Dr.Jit from falling back to a library that would abort.
        before = os.environ.get(_llvm.LIBRARY_VARIABLE)
        os.environ[_llvm.LIBRARY_VARIABLE] = "/nonexistent/libLLVM.so"
        with _silent_stderr():
            import drjit

            drjit.has_backend(drjit.JitBackend.LLVM)
        if before is None:
            del os.environ[_llvm.LIBRARY_VARIABLE]
        else:
            os.environ[_llvm.LIBRARY_VARIABLE] = before
    return drjit


try:
    dr = _import_drjit()
except ImportError as error:
    if "libatomic" not in str(error):
        raise
    raise BackendError("Dr.Jit needs libatomic.so.1, which is missing; run: apt-get install libatomic1") from None

ADVICE = "pip install 'gtao[llvm]'"


@dataclass(frozen=True)
class BackendReport:
    """What :func:`report` found. ``backend`` is "cuda", "llvm" or None."""

    backend: str | None
    reason: str
    llvm_library: str | None
    llvm_version: tuple[int, ...] | None
    found: tuple[_llvm.Library, ...]
    cuda: bool
    advice: str | None


def _llvm_version() -> tuple[int, ...] | None:
    version = getattr(dr.detail, "llvm_version", lambda: None)()
    return tuple(version) if version and version[0] > 0 else None


@cache
def report() -> BackendReport:
    """Which backend gtao uses in this process, why, and the one command that would help if there is none."""
    cuda = bool(dr.has_backend(dr.JitBackend.CUDA))
    llvm = bool(dr.has_backend(dr.JitBackend.LLVM))
    version = _llvm_version() if llvm else None
    too_old = version is not None and version[0] < _llvm.MINIMUM_MAJOR
    library = os.environ.get(_llvm.LIBRARY_VARIABLE) if llvm else None
    if _DRJIT_CAME_FIRST:
        reason = "Dr.Jit was imported before gtao and had chosen already"
    else:
        reason = _CHOICE.reason
    if too_old:
        assert version is not None
        reason = f"{reason}: it loaded LLVM {version[0]}, which aborts the process inside Dr.Jit 1.5"
    if cuda:
        backend, why = "cuda", "a CUDA device is present"
    elif llvm and not too_old:
        backend, why = "llvm", reason
    else:
        backend, why = None, reason
    advice = None
    if backend is None:
        if _CHOICE.found and _CHOICE.found[0].origin == "environment variable":
            advice = f"unset {_llvm.LIBRARY_VARIABLE} && {ADVICE}"
        else:
            advice = ADVICE
    return BackendReport(backend, why, library, version, _CHOICE.found, cuda, advice)


def require() -> str:
    """Name of the backend in use.

    Raises:
        BackendError: there is none; the message holds the command that helps.
    """
    state = report()
    if state.backend is None:
        hint = "import gtao before drjit and mitsuba, or run: " if _DRJIT_CAME_FIRST else "run: "
        raise BackendError(f"no usable Dr.Jit backend: {state.reason}; {hint}{state.advice}")
    return state.backend


def default_float() -> Any:
    """The single-precision, differentiable Dr.Jit float of the backend in use."""
    if require() == "cuda":
        from drjit.cuda.ad import Float
    else:
        from drjit.llvm.ad import Float
    return Float


@cache
def types_of(array_type: Any) -> SimpleNamespace:
    """Every array type that goes with ``array_type`` (a flat, nested or tensor Dr.Jit type).

    The namespace has ``Float, UInt, Int, Bool, Array2, Array3, Tensor, TensorBool``; the backend, the precision and
    whether gradients are tracked follow the argument.
    """
    Float = dr.leaf_t(array_type)
    return SimpleNamespace(
        Float=Float,
        UInt=dr.uint32_array_t(Float),
        Int=dr.int32_array_t(Float),
        Bool=dr.mask_t(Float),
        Array2=dr.replace_shape_t(Float, (2, -1)),
        Array3=dr.replace_shape_t(Float, (3, -1)),
        Tensor=dr.tensor_t(Float),
        TensorBool=dr.tensor_t(dr.mask_t(Float)),
    )
