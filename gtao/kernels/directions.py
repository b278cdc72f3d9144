"""From moments in slices to mean directions and spherical harmonics in the view frame.

A slice's moments are about its zenith V and its tangent T(φ). The sums over slices are kept about V, in the frame that
the minimal rotation R takes to the view frame (T = R (cos φ, sin φ, 0), V = R (0, 0, 1); ROTFROMTO of ATVI-TR-19-01):
each pixel is rotated once.
"""

import drjit as dr

from .sh import from_moments

__all__ = ["in_view_frame", "n_sums", "summands"]


def n_sums(order):
    """How many numbers a slice adds to, and how many come out: as many as spherical harmonics of the order."""
    return (order + 1) ** 2


def summands(values, c, s):
    """What a slice with moments adds to the sums.

    Args:
        values: its share and moments; see :func:`gtao.kernels.visible_arc.visible_arc`.
        c, s: cosine and sine of its azimuth about V.
    """
    share, t0, t1, *second = values
    first = share, t0 * c, t0 * s, t1
    if not second:
        return first
    ss, sc = second
    x = ss * c
    xx = x * c
    return *first, xx, x * s, ss - xx, sc * c, sc * s


def in_view_frame(sums, V):
    """The share; (x, y, z) of the mean direction (theory, eq. (124)); and five harmonics of band 2 of the same density.

    Args:
        sums: of :func:`summands`.
        V: unit zenith of the slices.
    """
    share, *moments = sums
    if not moments:
        return (share,)
    X, Y, Z, *second = moments
    Vx, Vy, Vz = V
    rcp = 1 / (1 + Vz)
    kx, ky = Vx * rcp, Vy * rcp
    d = dr.fma(Vx, X, Vy * Y)
    first = dr.fma(-kx, d, dr.fma(Z, Vx, X)), dr.fma(-ky, d, dr.fma(Z, Vy, Y)), dr.fma(Z, Vz, -d)
    if not second:
        return share, *first
    rows = (dr.fma(-kx, Vx, 1), -kx * Vy, Vx), (-ky * Vx, dr.fma(-ky, Vy, 1), Vy), (-Vx, -Vy, Vz)
    return share, *first, *from_moments(share, first, _turned(share, second, rows))[4:]


def _turned(share, second, rows):
    """R M Rᵀ of the second moments M, whose trace is the share: xx, xy, xz, yy, yz, zz."""
    xx, xy, yy, xz, yz = second
    columns = (xx, xy, xz), (xy, yy, yz), (xz, yz, share - xx - yy)
    turned = [[_dot(row, column) for column in columns] for row in rows[:2]]
    Mxx, Mxy, Mxz = (_dot(turned[0], row) for row in rows)
    Myy, Myz = (_dot(turned[1], row) for row in rows[1:])
    return Mxx, Mxy, Mxz, Myy, Myz, share - Mxx - Myy


def _dot(a, b):
    return dr.fma(a[0], b[0], dr.fma(a[1], b[1], a[2] * b[2]))
