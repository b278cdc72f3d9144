"""Tables of specular occlusion at the pixels of a frame."""

from typing import Any
from weakref import WeakKeyDictionary

import drjit as dr

from gtao.data.specular import SpecularTable
from gtao.errors import ConfigError, ShapeError
from gtao.kernels.table_axes import AXES, table_axes
from gtao.kernels.table_lookup import lookup
from gtao.tensors import to_tensor

__all__ = ["look_up"]

#: Texels as Dr.Jit arrays, by table and by their type.
_UPLOADED: WeakKeyDictionary[SpecularTable, dict[Any, Any]] = WeakKeyDictionary()


def look_up(table: SpecularTable, T: Any, *arguments: Any) -> list[Any]:
    """The channels of a table at angles and microfacet widths: (alpha_v, beta, alpha, theta_o, chi).

    Raises:
        ConfigError: nobody knows the table's axes.
        ShapeError: its values are not finite numbers, or no Dr.Jit tensor inside ``dr.freeze``.
    """
    if (table.kind, table.axes) not in AXES:
        known = ", ".join(repr(name) for kind, name in AXES if kind == table.kind)
        raise ConfigError(f"axes {table.axes!r} of a table {table.kind!r} are not known; there are {known}")
    axes = table_axes(table.kind, table.axes)
    values = _texels(table, T)
    scale = axes.scale(*arguments)
    return [scale * s for s in lookup(values, table.size, table.n_channels, axes.to_unit(*arguments))]


def _texels(table: SpecularTable, T: Any) -> Any:
    """The flat values: a Dr.Jit tensor's own, which may carry a gradient, others uploaded once."""
    name, shape = f"the values of the table {table.kind!r}", tuple(map(int, table.values.shape))
    if dr.is_tensor_v(table.values) or dr.flag(dr.JitFlag.FreezingScope):
        return to_tensor(table.values, name, shape, like=T.Tensor, copy=False).array
    uploads = _UPLOADED.setdefault(table, {})
    if T.Tensor not in uploads:
        texels = to_tensor(table.values, name, shape, like=T.Tensor).array
        if not dr.all(dr.isfinite(texels)):
            raise ShapeError(f"{name} must be finite")
        uploads[T.Tensor] = texels
    return uploads[T.Tensor]
