"""Making tables: quadrature at every texel."""

from collections.abc import Callable, Sequence

import numpy as np

from gtao.data.specular import KINDS, SpecularTable
from gtao.errors import ConfigError, ShapeError
from gtao.kernels.table_axes import ARGUMENTS, AXES, DEFAULT_AXES

from .lanes import lanes, numbers
from .values import value_of

__all__ = ["bake"]

#: Texels whose values are computed at a time.
CHUNK = 1 << 14


def bake(
    kind: str,
    size: int | Sequence[int] = 32,
    axes: str | None = None,
    *,
    progress: Callable[[str, int, int], None] | None = None,
) -> SpecularTable:
    """A table of specular occlusion, by quadrature in double precision: the same bits from the same arguments.

    Args:
        kind: key of :data:`gtao.data.specular.KINDS`.
        size: texels along every coordinate, or one number per coordinate, x first.
        axes: parametrisation, a name in :data:`gtao.kernels.table_axes.AXES`; default: the one with the least error.
        progress: called with (task, done, total) in texels.

    Raises:
        ConfigError: there is no such kind, or it has no such axes.
        ShapeError: the size does not fit the kind.
    """
    if kind not in ARGUMENTS:
        raise ConfigError(f"unknown kind of table {kind!r}; choose one of {', '.join(ARGUMENTS)}")
    axes = DEFAULT_AXES[kind] if axes is None else axes
    if (kind, axes) not in AXES:
        known = ", ".join(name for of, name in AXES if of == kind)
        raise ConfigError(f"a table {kind!r} has no axes {axes!r}; choose one of {known}")
    shape = _shape(kind, size)
    mapping, value = AXES[kind, axes], value_of(kind)
    n = int(np.prod(shape))
    parts = []
    for start in range(0, n, CHUNK):
        # The last index is that of x, the first coordinate.
        index = np.unravel_index(np.arange(start, min(start + CHUNK, n)), shape)
        unit = [i / (m - 1) for i, m in zip(index[::-1], shape[::-1], strict=True)]
        arguments = mapping.from_unit(*lanes(*unit))
        scale = numbers(mapping.scale(*arguments), like=unit[0])
        parts.append(value(*(numbers(a, like=unit[0]) for a in arguments)) / scale[:, None])
        if progress is not None:
            progress(f"{kind} {axes}", start + len(parts[-1]), n)
    values = np.concatenate(parts).reshape(*shape, -1)
    return SpecularTable(kind=kind, axes=axes, values=values.astype(np.float32), source="gtao.tables.bake")


def _shape(kind: str, size: int | Sequence[int]) -> tuple[int, ...]:
    """Of the values without their channels: x is the last."""
    n_axes = KINDS[kind][0]
    sizes = (size,) * n_axes if isinstance(size, int) else tuple(size)
    if len(sizes) != n_axes or not all(isinstance(n, int) and n >= 2 for n in sizes):
        raise ShapeError(f"a table {kind!r} has {n_axes} axes of at least 2 texels, got {size}")
    return sizes[::-1]
