"""Geometric normals from a depth buffer."""

import drjit as dr

__all__ = ["from_depth"]


def from_depth(view_z, position, width, height, orthographic, types):
    """Unit normals that face the camera, from the better one-sided difference per axis (theory, eq. (32)).

    Of the differences to the two neighbours along an axis the one is taken whose next neighbour it predicts best
    (1/z is affine along a line on a plane, z in parallel projection): this keeps to one side of a depth edge even
    right beside it. Right times up faces the camera whatever the depths: ⟨tx × ty, P⟩ is the product of three depths
    and of the triple product of image axes and eye ray, which is negative.

    Args:
        view_z: flat depth, inf on the background.
        position: function of (x, y, z), texel coordinates as unsigned integers and depth, to an Array3.

    Returns:
        Array3 of normals; (0, 0, 1) on the background and where no neighbour is a surface.
    """
    Float, UInt, Int, A3 = types.Float, types.UInt, types.Int, types.Array3
    index = dr.arange(UInt, width * height)
    y = index // width
    x = index - y * width
    P = position(x, y, view_z)

    def neighbour(dx, dy):
        i, j = Int(x) + dx, Int(y) + dy
        inside = (i >= 0) & (i < width) & (j >= 0) & (j < height)
        z = dr.gather(Float, view_z, UInt(j * width + i), inside)
        inside &= dr.isfinite(z)
        z = dr.select(inside, z, 1)
        return position(UInt(i), UInt(j), z), (z if orthographic else 1 / z), inside

    centre = view_z if orthographic else 1 / view_z

    def derivative(dx, dy):
        """Tangent along +(dx, dy) and how badly it predicts; the miss is inf where there is no neighbour."""
        candidates = []
        for sign in (1, -1):
            P1, f1, ok1 = neighbour(sign * dx, sign * dy)
            _, f2, ok2 = neighbour(2 * sign * dx, 2 * sign * dy)
            # Without a second neighbour the slope itself stands in, which ranks this side behind a smooth one.
            miss = dr.select(ok2, abs(centre - 2 * f1 + f2), abs(centre - f1))
            candidates.append((sign * (P1 - P), dr.select(ok1, miss, dr.inf), ok1))
        (t1, m1, ok1), (t0, m0, ok0) = candidates
        return dr.select(m1 <= m0, t1, t0), ok1 | ok0

    tx, okx = derivative(1, 0)
    ty, oky = derivative(0, -1)
    n = dr.cross(tx, ty)
    length2 = dr.squared_norm(n)
    ok = dr.isfinite(view_z) & okx & oky & (length2 > 0)
    n = n * dr.rsqrt(dr.select(ok, length2, 1))
    return dr.select(ok, n, A3(0, 0, 1))
