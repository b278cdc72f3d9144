"""Interpolated texels of a table in shader code: a plane, a volume, or slabs of one that stand for further axes."""

import math

from gtao.data.specular import SpecularTable

from .statements import Writer

__all__ = ["AXES", "lookup_in_c", "sampled", "texture_kind"]

#: What the coordinates of a table are called.
AXES = "xyzwv"


def texture_kind(table: SpecularTable) -> str:
    """As :class:`Writer` calls it."""
    return f"texture {min(3, len(table.size))} {table.n_channels}"


def _between_centres(w: Writer, letter: str, n: int, length: int) -> str:
    """Where in a side of ``length`` texels a coordinate between the centres of its first n lies."""
    return f"{letter} * {w.number((n - 1) / length)} + {w.number(0.5 / length)}"


def sampled(w: Writer, table: SpecularTable) -> tuple[list[str], str]:
    """Statements, and the value of the texture at the coordinates x, y … in [0, 1].

    The texture's own filtering serves x, y and z. Along w and v the slabs of n_z slices before and behind are mixed;
    in them z stays between the centres of the first and the last slice, so that no slab shows in its neighbour.
    """
    size, depth, n = table.size, math.prod(table.size[2:]), table.n_channels
    sides = (size[0], size[1], depth)
    place = [_between_centres(w, letter, *of) for letter, *of in zip(AXES, size, sides, strict=False)]
    lines = [w.let(f"{letter}_texture", value) for letter, value in zip(AXES, place, strict=False)]
    if len(size) == 2:
        return lines, w.sample("table", n, "x_texture", "y_texture")
    for axis, letter in enumerate(AXES[3 : len(size)], 3):
        slab = w.number(math.prod(size[2:axis]) / depth)
        lines += [
            w.let(f"{letter}_place", f"{letter} * {w.number(size[axis] - 1)}"),
            w.let(f"{letter}_before", w.L.min(w.L.call("floor", f"{letter}_place"), w.number(size[axis] - 2))),
            w.let(f"{letter}_share", f"{letter}_place - {letter}_before"),
            w.let(f"{letter}_low", f"{letter}_before * {slab}"),
            w.let(f"{letter}_high", f"{letter}_low + {slab}"),
        ]

    def mixed(axis: int, slice_: str, name: str) -> str:
        if axis == 2:
            return w.sample("table", n, "x_texture", "y_texture", slice_)
        letter = AXES[axis]
        for end in ("low", "high"):
            lines.append(w.let(f"{name}_{end}", mixed(axis - 1, f"{slice_} + {letter}_{end}", f"{name}_{end}"), n))
        return f"{name}_low + ({name}_high - {name}_low) * {letter}_share"

    return lines, mixed(len(size) - 1, "z_texture", "texel")


def lookup_in_c(name: str, table: SpecularTable) -> list[str]:
    """A function ``name`` of the texels, the coordinates in [0, 1] and a channel; C has no textures."""
    n_axes = len(table.size)
    return f"""
static inline float {name}(const float *table, const float unit[{n_axes}], int channel)
{{
    static const int size[{n_axes}] = {{{", ".join(map(str, table.size))}}};
    float sum = 0.0f;
    for (int corner = 0; corner < {2**n_axes}; ++corner) {{
        float weight = 1.0f;
        int texel = 0;
        for (int axis = {n_axes - 1}; axis >= 0; --axis) {{
            const float place = unit[axis] * (float)(size[axis] - 1);
            const int before = place < (float)(size[axis] - 2) ? (int)place : size[axis] - 2;
            const float share = place - (float)before;
            const int behind = corner >> axis & 1;
            weight *= behind ? share : 1.0f - share;
            texel = texel * size[axis] + before + behind;
        }}
        sum += weight * table[texel * {table.n_channels} + channel];
    }}
    return sum;
}}""".split("\n")
