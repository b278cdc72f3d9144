"""Reading a depth buffer at fractional pixel coordinates.

Coordinates here count texel centres: x = 0 is the centre of column 0. "nearest" returns the texel under the point.
"linear" interpolates the quantity that is affine in the image on a plane (1/z in perspective, z in parallel
projection; theory, eq. (30)) and is therefore exact on planes; a cell of four texels that straddles a depth edge
(eq. (31)) falls back to its nearest texel, because interpolating there would hang a curtain over the silhouette.
"""

import drjit as dr

__all__ = ["EDGE_STEP", "affine_field", "linear", "nearest", "nearest_of_four", "texel", "texel_index"]

#: A step between neighbours that lies outside the slopes on its two sides by more than this many pixel footprints is
#: a depth edge. Inside them it is a surface, smooth or creased: where two planes meet between two texels, the step is
#: a mixture of their slopes.
EDGE_STEP = 2.0


# Above this many texels a flat index no longer fits the 24 bits of a float32.
_EXACT_TEXELS = 1 << 24


def texel_index(x, y, width, height, types, *, inside=False):
    """Flat index of integer coordinates given as floats; never a wild address, even where they are NaN or outside.

    Args:
        inside: whether the coordinates are known to lie in the frame.
    """
    UInt, Int = types.UInt, types.Int
    if width * height <= _EXACT_TEXELS:
        index = UInt(Int(dr.fma(y, width, x)))
    else:
        index = UInt(Int(y)) * width + UInt(Int(x))
    last = width * height - 1
    return index if inside else dr.select(index < last, index, last)


def texel(buffer, x, y, width, height, types, *, inside):
    """Texel of ``buffer`` at integer coordinates given as floats.

    Args:
        inside: whether the coordinates are known to lie in the frame; if not, any texel may be read for those that do
            not.
    """
    return dr.gather(types.Float, buffer, texel_index(x, y, width, height, types, inside=inside))


def nearest(buffer, x, y, width, height, types):
    """Texel of ``buffer`` nearest to (x, y), and that texel's coordinates as floats. The point must lie inside."""
    x, y = dr.round(x), dr.round(y)
    return texel(buffer, x, y, width, height, types, inside=False), x, y


def nearest_of_four(buffer, x, y, width, height, types):
    """Least of the four texels of ``buffer`` whose centres surround (x, y), each the nearest in the frame.

    A point on a texel's centre has that texel and its successors in x and y around it.
    """

    def inside(v, n):
        return dr.select(v > 0, dr.select(v < n - 1, v, n - 1), 0)

    x0, y0 = dr.floor(x), dr.floor(y)
    columns, rows = [inside(x0 + d, width) for d in (0, 1)], [inside(y0 + d, height) for d in (0, 1)]
    four = [dr.gather(types.Float, buffer, texel_index(tx, ty, width, height, types)) for ty in rows for tx in columns]
    least = four[0]
    for z in four[1:]:
        least = dr.select(z < least, z, least)
    return least


def affine_field(view_z, width, height, footprint, orthographic, types):
    """The buffer that :func:`linear` reads: 1/z or z per texel, the sign bit set where the cell straddles an edge.

    The cell of texel (x, y) has the corners (x, y) and (x+1, y+1); theory, eqs. (30) and (31).

    Args:
        view_z: flat depth, inf on the background.
        footprint: width of a pixel per unit of depth (perspective) or in scene units (orthographic).
    """
    Float, UInt, Int = types.Float, types.UInt, types.Int
    index = dr.arange(UInt, width * height)
    y = index // width
    x = index - y * width

    def at(dx, dy):
        i = Int(x) + dx
        j = Int(y) + dy
        i = dr.select(i < 0, 0, dr.select(i > width - 1, width - 1, i))
        j = dr.select(j < 0, 0, dr.select(j > height - 1, height - 1, j))
        z = dr.gather(Float, view_z, UInt(j * width + i))
        return (z if orthographic else 1 / z), z

    def continuous(before, a, b, after):
        """Whether the step from a to b continues the surface on its sides."""
        left, step, right = a[0] - before[0], b[0] - a[0], after[0] - b[0]
        low, high = dr.select(left < right, left, right), dr.select(left < right, right, left)
        # Along a line z changes by about z² times the change of 1/z.
        far = footprint if orthographic else footprint / dr.select(a[1] > b[1], a[1], b[1])
        tolerance = EDGE_STEP * far
        # Beside the background a slope is NaN, which compares false, so such a cell is an edge.
        return (step >= low - tolerance) & (step <= high + tolerance)

    rows = {(dx, dy): at(dx, dy) for dy in (0, 1) for dx in (-1, 0, 1, 2)}
    columns = {(dx, dy): at(dx, dy) for dx in (0, 1) for dy in (-1, 2)} | {
        (dx, dy): rows[dx, dy] for dx in (0, 1) for dy in (0, 1)
    }
    smooth = dr.full(types.Bool, True, width * height)
    for k in (0, 1):
        smooth &= continuous(*(rows[d, k] for d in (-1, 0, 1, 2)))
        smooth &= continuous(*(columns[k, d] for d in (-1, 0, 1, 2)))
    centre = rows[0, 0][0]
    # On the background centre is 0 (or inf), which keeps its sign too.
    return dr.select(smooth, centre, -centre)


def linear(field, x, y, width, height, orthographic, types):
    """view_z at (x, y) from the buffer that :func:`affine_field` made, and the point that it belongs to.

    That point is (x, y) itself, but the centre of the nearest texel where the cell straddles an edge.
    """
    Float = types.Float
    x0, y0 = dr.floor(x), dr.floor(y)
    x0 = dr.select(x0 < 0, 0, dr.select(x0 > width - 2, width - 2, x0))
    y0 = dr.select(y0 < 0, 0, dr.select(y0 > height - 2, height - 2, y0))
    u, v = x - x0, y - y0
    index = texel_index(x0, y0, width, height, types)
    f00 = dr.gather(Float, field, index)
    f10 = dr.gather(Float, field, index + 1)
    f01 = dr.gather(Float, field, index + width)
    f11 = dr.gather(Float, field, index + (width + 1))
    edge = dr.copysign(Float(1), dr.detach(f00)) < 0
    f00, f10, f01, f11 = abs(f00), abs(f10), abs(f01), abs(f11)
    top, bottom = dr.fma(u, f10 - f00, f00), dr.fma(u, f11 - f01, f01)
    right, low = u > 0.5, v > 0.5
    texel = dr.select(low, dr.select(right, f11, f01), dr.select(right, f10, f00))
    value = dr.select(edge, texel, dr.fma(v, bottom - top, top))
    x = dr.select(edge, dr.select(right, x0 + 1, x0), x)
    y = dr.select(edge, dr.select(low, y0 + 1, y0), y)
    return (value if orthographic else 1 / value), x, y
