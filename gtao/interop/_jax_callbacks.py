"""Functions on Dr.Jit arrays as operations of JAX: callbacks to the host, with a derivative in reverse mode."""

# An optional framework, which need not be there when types are checked.
# pyright: reportMissingImports=false

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import numpy as np
from jax import numpy as jnp
from jax.custom_derivatives import SymbolicZero
from jax.experimental.buffer_callback import buffer_callback

from gtao.errors import ShapeError

from ._calls import Call, owned

__all__ = ["Bound", "Shape", "evaluate"]

Shape = tuple[int, ...]


@dataclass(frozen=True)
class Bound:
    """A function with all arguments that are no arrays: equal ones share what JAX compiled."""

    function: Callable[..., Any]
    n_args: int
    fixed: tuple[tuple[Any, Any], ...]
    integers: tuple[Any, ...]
    floats: tuple[Any, ...]
    shapes: tuple[Shape, ...]
    several: bool

    def call(self, integers: Any, floats: Any, attached: Sequence[bool]) -> Call:
        known = dict(self.fixed) | {
            key: int(np.asarray(value)) for key, value in zip(self.integers, integers, strict=True)
        }

        def on_arrays(*arrays: Any) -> Any:
            filled = known | dict(zip(self.floats, arrays, strict=True))
            args = [filled.pop(i) for i in range(self.n_args)]
            return self.function(*args, **filled)

        return Call(on_arrays, [_to_drjit(array) for array in floats], attached)


@dataclass(frozen=True)
class _Values:
    """The results, on the host."""

    bound: Bound

    def __call__(self, integers: Any, floats: Any) -> tuple[np.ndarray, ...]:
        results = self.bound.call(integers, floats, [False] * len(floats)).results
        found = tuple(tuple(result.shape) for result in results)
        if found != self.bound.shapes:
            raise ShapeError(f"the function returned shapes {found} where {self.bound.shapes} were announced")
        return tuple(result.numpy() for result in results)


@dataclass(frozen=True)
class _Gradients:
    """Gradients of the arguments that are attached, on the host."""

    bound: Bound
    attached: tuple[bool, ...]

    def __call__(self, integers: Any, floats: Any, cotangents: Any) -> tuple[np.ndarray, ...]:
        call = self.bound.call(integers, floats, self.attached)
        gradients = call.pull([_to_drjit(array) for array in cotangents])
        return tuple(gradient.numpy() for gradient in gradients if gradient is not None)


@dataclass(frozen=True)
class _InPlace:
    """A task on the buffers of the host."""

    task: Callable[..., tuple[np.ndarray, ...]]

    def __call__(self, _: Any, out: Any, *arguments: Any) -> None:
        for buffer, values in zip(out, self.task(*arguments), strict=True):
            np.asarray(buffer)[...] = values


def _on_host(task: Any, types: Any, *arguments: Any) -> Any:
    if jax.default_backend() == "cpu":
        # The other callback has its arguments copied by the threads that run it, and hangs where they are all busy.
        return buffer_callback(_InPlace(task), types, vmap_method="sequential")(*arguments)
    return jax.pure_callback(task, types, *arguments, vmap_method="sequential")


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def evaluate(bound: Bound, integers: Any, floats: Any) -> Any:
    types = tuple(jax.ShapeDtypeStruct(shape, floats[0].dtype) for shape in bound.shapes)
    return _on_host(_Values(bound), types, integers, floats)


def _forward(bound: Bound, integers: Any, floats: Any) -> Any:
    integers, values = (tuple(argument.value for argument in arguments) for arguments in (integers, floats))
    # Residuals are arrays; a structure without any tells which ones are differentiated.
    marks = [() if argument.perturbed else None for argument in floats]
    return evaluate(bound, integers, values), (integers, values, marks)


def _backward(bound: Bound, residuals: Any, cotangents: Any) -> Any:
    integers, floats, marks = residuals
    attached = tuple(mark is not None for mark in marks)
    cotangents = [jnp.zeros(c.shape, c.dtype) if isinstance(c, SymbolicZero) else c for c in cotangents]
    types = tuple(jax.ShapeDtypeStruct(a.shape, a.dtype) for a, wanted in zip(floats, attached, strict=True) if wanted)
    found = iter(_on_host(_Gradients(bound, attached), types, integers, floats, cotangents))
    return None, tuple(next(found) if wanted else None for wanted in attached)


evaluate.defvjp(_forward, _backward, symbolic_zeros=True)


def _to_drjit(array: Any) -> Any:
    array = np.asarray(array)
    return owned(array, array.dtype == np.float64)
