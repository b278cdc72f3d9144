"""One call of a function on Dr.Jit arrays, kept for its derivatives."""

from collections.abc import Callable, Sequence
from typing import Any

import drjit as dr

from gtao import backend
from gtao.errors import ShapeError

__all__ = ["Call", "owned"]


def owned(value: Any, double: bool):
    """A Dr.Jit tensor of the values of an array; later changes of the array do not reach it.

    Args:
        value: anything that Dr.Jit reads.
        double: whether the tensor is of double precision.
    """
    Float = backend.default_float()
    Float = dr.float64_array_t(Float) if double else Float
    tensor = dr.tensor_t(Float)(value)
    # CPU arrays are aliased, and expressions that are not evaluated yet would see what is written to them.
    return dr.tensor_t(Float)(dr.opaque(tensor.array), tensor.shape)


class Call:
    """``function(*arguments)`` with the derivatives of its results.

    Args:
        function: takes Dr.Jit arrays, returns one or a list or tuple of them: tensors or flat floats.
        arguments: Dr.Jit tensors; one without dimensions reaches the function as a flat float of width 1, as options
            of a configuration must be.
        attached: whether the derivative with respect to each argument is wanted.

    Raises:
        ShapeError: the function returned something else.
    """

    def __init__(self, function: Callable[..., Any], arguments: Sequence[Any], attached: Sequence[bool]):
        self._shapes = [tuple(tensor.shape) for tensor in arguments]
        self._inputs = [tensor if tensor.shape else tensor.array for tensor in arguments]
        self._attached = list(attached)
        for array, wanted in zip(self._inputs, self._attached, strict=True):
            if wanted:
                dr.enable_grad(array)
        results = function(*self._inputs)
        self.several = isinstance(results, list | tuple)
        self._results = [_checked(result) for result in (results if self.several else (results,))]
        dr.eval(self._results)

    @property
    def results(self) -> list[Any]:
        """The results as tensors without gradients."""
        return [dr.detach(result) for result in self._results]

    def pull(self, gradients: Sequence[Any]) -> list[Any]:
        """Reverse mode: gradients of the attached arguments from those of the results, None for other arguments.

        Args:
            gradients: one tensor per result; None stands for 0.
        """
        seeded = []
        for result, gradient in zip(self._results, gradients, strict=True):
            if gradient is not None and dr.grad_enabled(result):
                dr.set_grad(result, gradient)
                seeded.append(result)
        dr.enqueue(dr.ADMode.Backward, seeded)
        # The graph stays: frameworks may ask again.
        dr.traverse(dr.ADMode.Backward, dr.ADFlag.ClearVertices)
        found = [dr.grad(array) if wanted else None for array, wanted in zip(self._inputs, self._attached, strict=True)]
        dr.eval(found)
        dr.clear_grad(self._inputs)
        return [None if g is None else _shaped(g, shape) for g, shape in zip(found, self._shapes, strict=True)]

    def push(self, tangents: Sequence[Any]) -> list[Any]:
        """Forward mode: tangents of the results from those of the attached arguments.

        Args:
            tangents: one tensor per argument, None for those that are not attached.
        """
        seeded = []
        for array, tangent in zip(self._inputs, tangents, strict=True):
            if tangent is not None:
                dr.set_grad(array, tangent if dr.is_tensor_v(array) else tangent.array)
                seeded.append(array)
        dr.enqueue(dr.ADMode.Forward, seeded)
        dr.traverse(dr.ADMode.Forward, dr.ADFlag.ClearVertices)
        found = [
            dr.grad(result) if dr.grad_enabled(result) else dr.zeros(type(result), result.shape)
            for result in self._results
        ]
        dr.eval(found)
        return found


def _checked(result: Any):
    if not (dr.is_array_v(result) and dr.is_float_v(result)):
        raise ShapeError(
            f"the function must return Dr.Jit tensors, got {type(result).__name__}; return for example its .visibility"
        )
    return result if dr.is_tensor_v(result) else dr.tensor_t(type(result))(result)


def _shaped(array: Any, shape: tuple[int, ...]):
    return array if dr.is_tensor_v(array) else dr.tensor_t(type(array))(array, shape)
