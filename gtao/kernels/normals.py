"""Geometric normals from a depth buffer."""

import drjit as dr

__all__ = ["from_depth", "unit"]


def from_depth(own, tapped, position, width, height, orthographic, types):
    """Unit normals that face the camera, from the better one-sided difference per axis (theory, eq. (32)).

    Of the differences to the two neighbours along an axis the one is taken whose next neighbour it predicts best
    (1/z is affine along a line on a plane, z in parallel projection): this keeps to one side of a depth edge even
    right beside it. Right times up faces the camera whatever the depths: ⟨tx × ty, P⟩ is the product of three depths
    and of the triple product of image axes and eye ray, which is negative.

    Args:
        own, tapped: flat depth, inf on the background: for the pixels themselves, and for what is gathered from. With
            gradients they are two variables, because every change from adding to a gradient to scattering into it would
            launch a kernel.
        position: function of (x, y, z), texel coordinates as unsigned integers and depth, to an Array3.

    Returns:
        Array3 of normals; (0, 0, 1) on the background and where no neighbour is a surface.
    """
    Float, UInt, Int, A3 = types.Float, types.UInt, types.Int, types.Array3
    index = dr.arange(UInt, width * height)
    y = index // width
    x = index - y * width
    # Which side is better has no derivative: it is found without, and the adjoint then touches one neighbour per axis.
    still = dr.detach(own)
    surface = dr.isfinite(still)
    centre = still if orthographic else 1 / still
    P = position(x, y, dr.select(surface, own, 1))

    def neighbour(dx, dy):
        """Index of a neighbour, and whether it is in the frame."""
        i, j = Int(x) + dx, Int(y) + dy
        return UInt(j * width + i), (i >= 0) & (i < width) & (j >= 0) & (j < height)

    def affine(dx, dy):
        i, inside = neighbour(dx, dy)
        z = dr.gather(Float, still, i, inside)
        inside &= dr.isfinite(z)
        z = dr.select(inside, z, 1)
        return (z if orthographic else 1 / z), inside

    def miss(dx, dy):
        """How badly the neighbour predicts its next one, inf if there is no neighbour."""
        (f1, ok1), (f2, ok2) = affine(dx, dy), affine(2 * dx, 2 * dy)
        # Without a second neighbour the slope itself stands in, which ranks this side behind a smooth one.
        return dr.select(ok1, dr.select(ok2, abs(centre - 2 * f1 + f2), abs(centre - f1)), dr.inf)

    def tangent(dx, dy):
        """Unit vector along +(dx, dy), from the better side, and whether there is one."""
        forth, back = miss(dx, dy), miss(-dx, -dy)
        ok = (forth < dr.inf) | (back < dr.inf)
        sign = dr.select(forth <= back, Int(1), Int(-1))
        i, _ = neighbour(sign * dx, sign * dy)
        z = dr.select(ok, dr.gather(Float, tapped, i, ok), 1)
        t = Float(sign) * (position(Int(x) + sign * dx, Int(y) + sign * dy, z) - P)
        # The square of a product of two such differences may overflow.
        length2 = dr.squared_norm(t)
        return t * dr.rsqrt(dr.select(length2 > 0, length2, 1)), ok

    tx, okx = tangent(1, 0)
    ty, oky = tangent(0, -1)
    n = dr.cross(tx, ty)
    length2 = dr.squared_norm(n)
    ok = surface & okx & oky & (dr.detach(length2) > 0)
    return dr.select(ok, n / dr.sqrt(dr.select(ok, length2, 1)), A3(0, 0, 1))


def unit(n, surface, rounding):
    """Normals at length 1, (0, 0, 1) on the background.

    Those that differ from length 1 by ``rounding`` at most keep their bits, so that a file that is read and written
    again does not drift; their derivative is that of the others.
    """
    length = dr.norm(n)
    exact = 1 / dr.select(surface, length, 1)
    scale = dr.select(abs(length - 1) > rounding, exact, 1)
    scale = dr.replace_grad(scale, exact) if dr.grad_enabled(n) else scale
    return dr.select(surface, n * scale, type(n)(0, 0, 1))
