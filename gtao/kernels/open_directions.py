"""What the open directions of a pixel add up to: their mean direction and their spherical harmonics of band 2."""

import math
from dataclasses import dataclass, fields
from typing import Any

import drjit as dr

__all__ = ["Sums"]

#: Normalisation of the harmonics xy, yz and xz, of which x² - y² has the half, and of 3z² - 1.
_XY, _ZZ = math.sqrt(15 / math.pi) / 2, math.sqrt(5 / math.pi) / 4


@dataclass(frozen=True)
class Sums:
    """Sums, or means, of products of the components of unit directions in some frame; xx + yy is the rest to zz."""

    x: Any
    y: Any
    z: Any
    xy: Any
    yz: Any
    zz: Any
    xz: Any
    xx_yy: Any  # x² - y²

    @classmethod
    def of(cls, x, y, z):
        """Those of one direction."""
        return cls(x, y, z, x * y, y * z, z * z, x * z, dr.fma(x, x, -y * y))

    @classmethod
    def zero(cls, Float, width):
        return cls(*(dr.zeros(Float, width) for _ in fields(cls)))

    def __iter__(self):
        return iter(getattr(self, field.name) for field in fields(self))

    def in_view(self, share, frame):
        """The mean direction (x, y, z) and the five harmonics of band 2 in the view frame, m from -2 to 2.

        They are the means of ω and of the real spherical harmonics Y_2m(ω). Y_00 and Y_1m are multiples of the share
        and of the mean direction.

        Args:
            share: visibility. ``self`` are means over all directions, of equal shares of the weight, of which blocked
                ones count as 0.
            frame: three unit vectors in the view frame, the axes x, y and z of ``self``.
        """
        plane = share - self.zz
        xx, yy = 0.5 * (plane + self.xx_yy), 0.5 * (plane - self.xx_yy)
        rows = (xx, self.xy, self.xz), (self.xy, yy, self.yz), (self.xz, self.yz, self.zz)
        ex, ey, ez = zip(*frame, strict=True)
        mx, my, mz = (tuple(_dot(row, axis) for row in rows) for axis in (ex, ey, ez))
        return (
            *(_dot((self.x, self.y, self.z), axis) for axis in (ex, ey, ez)),
            _XY * _dot(ex, my),
            _XY * _dot(ey, mz),
            _ZZ * dr.fma(_dot(ez, mz), 3, -share),
            _XY * _dot(ex, mz),
            0.5 * _XY * (_dot(ex, mx) - _dot(ey, my)),
        )


def _dot(a, b):
    return dr.fma(a[0], b[0], dr.fma(a[1], b[1], a[2] * b[2]))
