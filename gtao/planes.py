"""Images of several channels, kept as one flat array per channel until somebody wants them in one tensor.

Kernels compute channels in arrays of their own, and what is computed from an image reads them so. To bring nine of them
together is no small part of what an estimate costs (docs/howto/performance).
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from .backend import types_of

__all__ = ["PlanarImage", "Planes"]


@dataclass(frozen=True)
class Planes:
    """Flat arrays, one for each channel, of an image of ``shape`` (H, W)."""

    arrays: tuple[Any, ...]
    shape: tuple[int, int]

    @classmethod
    def of(cls, tensor: Any) -> "Planes":
        """The channels of an (H, W, C) tensor."""
        height, width, n = tensor.shape
        T = types_of(type(tensor))
        first = dr.arange(T.UInt, height * width) * n
        return cls(tuple(dr.gather(T.Float, tensor.array, first + k) for k in range(n)), (height, width))

    def tensor(self):
        """The (H, W, C) tensor."""
        T = types_of(type(self.arrays[0]))
        channels = dr.replace_shape_t(T.Float, (-1, -1))([*self.arrays])
        return T.Tensor(dr.ravel(channels), (*self.shape, len(self.arrays)))


class PlanarImage:
    """Field of a dataclass that takes an (H, W, C) tensor, :class:`Planes` or None, and is read as a tensor."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: Any, owner: type | None = None) -> Any:
        if instance is None:
            return None
        value = vars(instance)[self._name]
        if not isinstance(value, Planes):
            return value
        tensor = value.tensor()
        # Kept, but not with gradients, which whoever read it first may have suspended.
        if not any(getattr(array, "index_ad", 0) for array in value.arrays):
            vars(instance)[self._name] = tensor
        return tensor

    def __set__(self, instance: Any, value: Any) -> None:
        vars(instance)[self._name] = value

    def planes(self, instance: Any) -> Planes | None:
        """The channels; None where the field is."""
        value = vars(instance)[self._name]
        return value if value is None or isinstance(value, Planes) else Planes.of(value)
