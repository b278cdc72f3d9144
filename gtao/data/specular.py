"""Tables of specular occlusion: the type that carries them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from gtao.errors import ConfigError, ShapeError

__all__ = ["KINDS", "SHIPPED", "SpecularTable", "shipped"]

#: Kind -> number of coordinates and numbers of channels that its tables may have.
KINDS: Mapping[str, tuple[int, tuple[int, ...]]] = {
    "cone-cone": (3, (1,)),
    "cone-lobe": (3, (1,)),
    "brdf-3d": (3, (1, 2)),
    "brdf-4d": (4, (1, 2)),
    "brdf-5d": (5, (1, 2)),
    "environment-brdf": (2, (2,)),
}

#: Kinds of which a table comes with the package.
SHIPPED = ("cone-cone", "brdf-4d", "brdf-5d", "environment-brdf")

_FOLDER = Path(__file__).parent / "tables"


@dataclass(frozen=True, kw_only=True, eq=False)
class SpecularTable:
    """Specular occlusion, or what a surface reflects of a white dome, on a regular grid of the unit cube.

    Texels are aligned with the ends: texel i of n stands for the coordinate i / (n - 1). Between texels the table is
    linear in every coordinate.

    Attributes:
        kind: key of :data:`KINDS`.
        axes: name of the parametrisation that maps angles and roughness to the coordinates.
        values: (…, n_y, n_x, C) numbers, float32; x is the first coordinate. One channel: S itself. Two channels: the
            ratios A_V / A and B_V / B, or for "environment-brdf" A and B (docs/theory).
        settings: how it was made, plain values.
        source: record or command that the numbers come from.

    Raises:
        ConfigError: there is no such kind.
        ShapeError: the values have another number of coordinates or channels than the kind, or an axis of one texel.
    """

    kind: str
    axes: str
    values: Any
    settings: Mapping[str, Any] = field(default_factory=dict)
    source: str = ""

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ConfigError(f"unknown kind of table {self.kind!r}; choose one of {', '.join(KINDS)}")
        n_axes, channels = KINDS[self.kind]
        shape = tuple(self.values.shape)
        if len(shape) != n_axes + 1 or shape[-1] not in channels or min(shape[:-1]) < 2:
            either = " or ".join(map(str, channels))
            raise ShapeError(
                f"a table {self.kind!r} has {n_axes} axes of at least 2 texels and {either} channel(s),"
                f" got values of shape {shape}"
            )

    @property
    def size(self) -> tuple[int, ...]:
        """Texels along x, y, z …"""
        return tuple(self.values.shape[:-1])[::-1]

    @property
    def n_channels(self) -> int:
        return int(self.values.shape[-1])

    def __repr__(self) -> str:
        size = "x".join(map(str, self.size))
        return f"SpecularTable({self.kind!r}, {size}, {self.n_channels} channel(s), axes={self.axes!r})"


@cache
def shipped(kind: str) -> SpecularTable:
    """The table of a kind that comes with the package, on the axes with the least error (references/tables).

    Raises:
        ConfigError: there is none of that kind.
    """
    if kind not in SHIPPED:
        raise ConfigError(f"no table {kind!r} is shipped, only {', '.join(SHIPPED)}; bake one with gtao.tables.bake")
    # Only who looks tables up needs NumPy.
    from gtao.io.tables import read_table

    return read_table(_FOLDER / f"{kind}.npz")
