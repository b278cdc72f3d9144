"""Directions of the previous view frame in this one."""

import drjit as dr

from gtao.kernels import sh

__all__ = ["turned_harmonics", "turned_vector"]


def turned_vector(v, rows):
    """R v.

    Args:
        v: x, y and z.
        rows: three rows of the rotation R.
    """
    return tuple(dr.fma(r[0], v[0], dr.fma(r[1], v[1], r[2] * v[2])) for r in rows)


def turned_harmonics(coefficients, rows):
    """Coefficients of bands 0 to 2 of the function that is turned by R; theory, eq. (182).

    Args:
        coefficients: nine numbers.
        rows: three rows of R.
    """
    m0, m1, (xx, xy, xz, yy, yz, zz) = sh.to_moments(coefficients)
    # Columns of R M, then R M Rᵀ.
    a, b, c = (turned_vector(column, rows) for column in ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
    turned = [turned_vector((a[i], b[i], c[i]), rows) for i in range(3)]
    m2 = (turned[0][0], turned[0][1], turned[0][2], turned[1][1], turned[1][2], turned[2][2])
    return sh.from_moments(m0, turned_vector(m1, rows), m2)
