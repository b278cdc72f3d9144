"""Dr.Jit tensors from whatever the caller has, and windows of them."""

from typing import Any

import drjit as dr

from . import backend
from .errors import ShapeError

__all__ = ["one_number", "scalar", "to_tensor", "vectors", "window"]


def to_tensor(value: Any, name: str, shape: tuple[int, ...], *, like: Any = None, copy: bool = True):
    """A Dr.Jit tensor of ``shape`` that owns its memory, from anything with an array protocol; gradients stay.

    Args:
        like: type of the tensor; by default as precise as ``value``.
        copy: also copy Dr.Jit tensors, whose memory may be NumPy's.
    """
    backend.require()
    if not (hasattr(value, "__dlpack__") or hasattr(value, "__array_interface__")):
        raise ShapeError(f"{name} must be an array (NumPy, PyTorch, JAX, Dr.Jit tensor), got {type(value).__name__}")
    if dr.is_tensor_v(value) and dr.is_float_v(value):
        tensor = value
    elif dr.flag(dr.JitFlag.FreezingScope):
        # Dr.Jit would end the process.
        raise ShapeError(
            f"inside dr.freeze {name} must be a Dr.Jit tensor, got {type(value).__name__}; convert it outside"
        )
    else:
        kind = str(getattr(value, "dtype", ""))
        if not any(word in kind.lower() for word in ("float", "int", "f32", "f64", "f16", ">f", "<f")):
            raise ShapeError(f"{name} must hold real numbers, got dtype {kind or 'unknown'}")
        if ">" in kind and hasattr(value, "astype"):
            value = value.astype(value.dtype.newbyteorder("="))
        double = "float64" in kind.lower()
        Float = dr.float64_array_t(backend.default_float()) if double else backend.default_float()
        try:
            tensor = dr.tensor_t(Float)(value)
        except (TypeError, RuntimeError) as error:
            raise ShapeError(f"{name} cannot be read as an array: {error}") from None
    # Types that track gradients cost nothing without any, and others would lose those of what they are combined with.
    kind = dr.diff_array_t(type(tensor)) if like is None else like
    tensor = tensor if type(tensor) is kind else kind(tensor)
    if tuple(tensor.shape) != shape:
        raise ShapeError(f"{name} must have shape {shape}, got {tuple(tensor.shape)}")
    if tensor is value and not copy:
        dr.eval(tensor)
        return tensor
    return type(tensor)(_owned(tensor.array), shape)


def _owned(array):
    if array.state is dr.VarState.Unevaluated:
        dr.eval(array)
        return array
    # A NumPy array is aliased, not copied, and its alignment would become part of the kernel.
    own = dr.opaque(dr.detach(array))
    # The caller's own variable of the graph: a backward pass would consume the edge to another.
    return dr.replace_grad(own, array) if dr.grad_enabled(array) else own


def one_number(value: Any) -> Any:
    """The number that ``value`` is, or holds as its only element; Dr.Jit arrays of one stay. None of anything else."""
    shape = tuple(map(int, getattr(value, "shape", ())))
    if shape not in ((), (1,)) or isinstance(value, bool):
        return None
    if isinstance(value, int | float) or dr.is_array_v(value):
        return value
    item = value.item() if hasattr(value, "item") else None
    return item if isinstance(item, int | float) and not isinstance(item, bool) else None


def scalar(value: Any, Float: Any):
    """Kernel input of width one from a Python number or a Dr.Jit float, whose gradient stays.

    A literal would be baked into the kernel, and every new value compile it again.
    """
    return dr.opaque(Float(value)) if dr.is_array_v(value) else dr.opaque(Float, float(value))


def vectors(flat: Any, T: Any):
    """The Array3 of three numbers per pixel that lie side by side in an array.

    Not ``dr.unravel``: in reverse mode, what one reader of the array adds to its gradient would overwrite what another
    one has added.

    Args:
        T: array types; see :func:`gtao.backend.types_of`.
    """
    first = dr.arange(T.UInt, dr.width(flat) // 3) * 3
    return T.Array3(*(dr.gather(T.Float, flat, first + axis) for axis in range(3)))


def window(tensor: Any, x0: int, y0: int, width: int, height: int, *, axis: int = 0):
    """The pixels of a window of an image whose rows are numbered along ``axis`` and columns along the next one.

    Raises:
        ShapeError: the window has no pixels or reaches beyond the image.
    """
    h, w = tensor.shape[axis : axis + 2]
    if not (0 <= x0 < x0 + width <= w and 0 <= y0 < y0 + height <= h):
        raise ShapeError(
            f"a window of {width}x{height} pixels at ({x0}, {y0}) does not lie within an image of {w}x{h};"
            " beyond the frame nothing is known"
        )
    return tensor[(slice(None),) * axis + (slice(y0, y0 + height), slice(x0, x0 + width))]
