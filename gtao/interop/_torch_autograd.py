"""Functions on Dr.Jit arrays as functions that PyTorch's autograd differentiates."""

# An optional framework, which need not be there when types are checked; nor when documentation is built, where its
# types cannot be combined.
# pyright: reportMissingImports=false

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import drjit as dr

from gtao import backend
from gtao.errors import ConfigError, ShapeError

from ._calls import Call, owned

try:
    import torch
except ImportError as error:
    raise ImportError("gtao.interop.torch needs PyTorch, which is not here; pip install 'gtao[torch]'") from error

__all__ = ["torch", "wrap"]


def wrap(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function on Dr.Jit arrays as a function on PyTorch tensors.

    Tensors among its positional and keyword arguments reach ``function`` as Dr.Jit tensors that own their memory, those
    without dimensions as flat floats of width 1, which options of configurations and numbers of cameras accept. All
    are of one precision: double if a tensor with dimensions is, else single; so are the results. Other arguments pass
    unchanged.

    The results take part in autograd: in reverse mode, again and again on a retained graph; in forward mode, which
    evaluates ``function`` once more; not for gradients of gradients.

    Args:
        function: returns a Dr.Jit array or a list or tuple of them, and depends on nothing that changes.

    Returns:
        A function whose results, one tensor or a tuple as ``function`` has it, lie on the device of its arguments.

    Raises:
        ShapeError: when called: no argument is a tensor, one does not hold real numbers, they lie on several devices,
            or the result is not made of Dr.Jit arrays.
    """

    def wrapped(*args: Any, **kwargs: Any) -> Any:
        values: dict[Any, Any] = dict(enumerate(args)) | kwargs
        tensors = {key: value for key, value in values.items() if isinstance(value, torch.Tensor)}

        def on_arrays(*arrays: Any) -> Any:
            filled = values | dict(zip(tensors, arrays, strict=True))
            return function(*(filled[i] for i in range(len(args))), **{name: filled[name] for name in kwargs})

        unified = _unified(list(tensors.values()))
        deferred = _DeferredCall(on_arrays, unified)
        results = _Function.apply(deferred, *unified)
        return results if deferred.call.several else results[0]

    return wrapped


class _DeferredCall:
    """A call that autograd makes: inside of it tensors no longer tell whether they need gradients."""

    def __init__(self, function: Callable[..., Any], tensors: Sequence[torch.Tensor]):
        self.function, self.device = function, tensors[0].device
        self.attached = [torch.is_grad_enabled() and tensor.requires_grad for tensor in tensors]
        self.arrays: list[Any] = []
        self.call: Any = None

    def evaluate(self, tensors: Sequence[torch.Tensor]) -> tuple[torch.Tensor, ...]:
        self.arrays = [_to_drjit(tensor) for tensor in tensors]
        self.call = Call(self.function, self.arrays, self.attached)
        return self._to_torch(self.call.results)

    def pull(self, gradients: Sequence[torch.Tensor | None]) -> tuple[torch.Tensor | None, ...]:
        return self._to_torch(self.call.pull([_to_drjit(gradient) for gradient in gradients]))

    def push(self, tangents: Sequence[torch.Tensor | None]) -> tuple[torch.Tensor | None, ...]:
        call = Call(self.function, [dr.detach(a) for a in self.arrays], [tangent is not None for tangent in tangents])
        return self._to_torch(call.push([_to_drjit(tangent) for tangent in tangents]))

    def _to_torch(self, arrays: Sequence[Any]) -> Any:
        return tuple(None if array is None else _to_torch(array, self.device) for array in arrays)


class _Function(torch.autograd.Function):
    @staticmethod
    def forward(deferred: _DeferredCall, *tensors: torch.Tensor) -> Any:
        return deferred.evaluate(tensors)

    @staticmethod
    def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
        # Not saved the usual way, which refuses inputs that changed since: their values were copied.
        ctx.deferred, *ctx.inputs = inputs
        ctx.set_materialize_grads(False)

    @staticmethod
    def backward(ctx: Any, *gradients: torch.Tensor | None) -> Any:
        return None, *_Derivative.apply(ctx.deferred.pull, len(ctx.inputs), *ctx.inputs, *gradients)

    @staticmethod
    def jvp(ctx: Any, _: None, *tangents: torch.Tensor | None) -> Any:
        return _Derivative.apply(ctx.deferred.push, len(ctx.inputs), *ctx.inputs, *tangents)


class _Derivative(torch.autograd.Function):
    """What a rule makes of gradients or tangents.

    It depends on the inputs too: the next derivative would be wrong without an error that says so. Inside of a
    function of their own, tensors are plain ones under ``torch.func`` as well.
    """

    @staticmethod
    def forward(rule: Callable[..., Any], n_inputs: int, *tensors: torch.Tensor | None) -> Any:
        return rule(tensors[n_inputs:])

    @staticmethod
    def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
        pass

    @staticmethod
    def backward(ctx: Any, *gradients: Any) -> Any:
        raise ConfigError("functions on Dr.Jit arrays have no second derivatives; drop create_graph=True")

    @staticmethod
    def jvp(ctx: Any, *tangents: Any) -> Any:
        raise ConfigError("functions on Dr.Jit arrays have no second derivatives")


def _unified(tensors: Sequence[torch.Tensor]) -> list[torch.Tensor]:
    """The tensors on one device and in one precision; numbers follow images."""
    if not tensors:
        raise ShapeError("none of the arguments is a torch.Tensor; on other arrays call the function itself")
    for tensor in tensors:
        if tensor.dtype == torch.bool or tensor.dtype.is_complex or tensor.layout != torch.strided:
            raise ShapeError(f"tensors must be dense and hold real numbers, got {tensor.dtype}, {tensor.layout}")
    leading = [tensor for tensor in tensors if tensor.dim()] or tensors
    devices = {tensor.device for tensor in leading}
    if len(devices) > 1:
        raise ShapeError(f"tensors must lie on one device, got {', '.join(sorted(map(str, devices)))}")
    double = any(tensor.dtype == torch.float64 for tensor in leading)
    return [tensor.to(leading[0].device, torch.float64 if double else torch.float32) for tensor in tensors]


def _shares_memory(device: torch.device) -> bool:
    """Whether Dr.Jit can read the device's memory."""
    return device.type == "cuda" and device.index == 0 and backend.require() == "cuda"


def _to_drjit(tensor: Any) -> Any:
    if tensor is None:
        return None
    tensor, double = tensor.detach(), tensor.dtype == torch.float64
    if _shares_memory(tensor.device):
        tensor = tensor.contiguous()
        # Dr.Jit does not wait for PyTorch's stream.
        torch.cuda.current_stream(tensor.device).synchronize()
        return owned(tensor, double)
    return owned(tensor.cpu().numpy(), double)


def _to_torch(array: Any, device: torch.device) -> torch.Tensor:
    if _shares_memory(device):
        dr.sync_thread()
        return array.torch().clone()
    return torch.tensor(array.numpy(), device=device)
