"""Integrals over a cone cut by the tangent plane, in closed form.

What of the cone is above the tangent plane is bounded by an arc of the rim and one of the tangent plane. A homogeneous
polynomial h of degree d has, by the divergence theorem, the integral (∫ Δh dω - ∮ ∂h/∂ν ds) / (d (d + 1)) over it, and
on the arcs everything is a polynomial in the cosine of one azimuth: a closed form in every band (theory, eq. (119); the
irradiance tensors of Arvo 1995 are its first bands).

The frame has z along the normal and the axis b = (sin β, 0, cos β) in the half plane x > 0, y = 0. The region is
symmetric about that plane: harmonics of negative degree are 0.
"""

import math
from typing import Any

import drjit as dr

from .cones import rim, solid_angle
from .sh import norm2, polar

__all__ = ["local"]


def local(c, cb, sb, order) -> dict[tuple[int, int], Any]:
    """{(l, m): coefficient} of cone × cosine, 0 <= m <= l <= order, in the frame of the integrals.

    Derivatives are those of the area: the integrand on the rim times how fast the rim moves.
    """
    attached = any(map(dr.grad_enabled, (c, cb, sb)))
    with dr.suspend_grad():
        t, p, r = rim(c, cb, sb)
        moving = _Rim(c, cb, sb, t, r, order)
        integrals = _integrals(moving, p, solid_angle(c, cb, sb), order)
        values = {}
        for band, m in _names(order):
            values[band, m] = _combined(band, m, lambda a, m=m: integrals[a + 1, m])
        if not attached:
            return values
        by_c, by_beta = {}, {}
        for band, m in _names(order):
            by_c[band, m] = -_combined(band, m, lambda a, m=m: moving.mean(moving.h[a + 1, m]))
            by_beta[band, m] = -moving.s * _combined(band, m, lambda a, m=m: moving.mean([0, *moving.h[a + 1, m]]))
        cb0, sb0 = cb * 1, sb * 1
    turned = cb0 * sb - sb0 * cb
    return {name: dr.replace_grad(v, by_c[name] * c + by_beta[name] * turned) for name, v in values.items()}


def _names(order):
    return [(band, m) for band in range(order + 1) for m in range(band + 1)]


def _combined(band, m, integral):
    """∫ z Y_lm of ``integral``(a), a number for z^(a+1) Re (x + iy)^m."""
    factor = math.sqrt(norm2(band, m) / math.pi)
    total = 0
    for a, coefficient in enumerate(polar(band, m)):
        if coefficient:
            total = dr.fma(integral(a), factor * float(coefficient), total)
    return total


class _Rim:
    """The rim u(τ) = cos α b + sin α (cos τ e1 + sin τ e2), e2 = y: polynomials in cos τ, as lists of coefficients.

    Attributes:
        h: {(a, m): z^a Re (x + iy)^m on the rim}.
        s: sin α.
    """

    def __init__(self, c, cb, sb, t, r, order):
        s2 = (1 - c) * (1 + c)
        self.s = s = dr.sqrt(dr.select(s2 > 0, s2, 0))
        self._x, self._z = [c * sb, -s * cb], [c * cb, s * sb]
        # Derivatives by α, which are the components of the outward normal ν.
        self._x_out, self._z_out = [-s * sb, -c * cb], [-s * cb, c * sb]
        self._yy, self._yy_out = [s2, 0, -s2], [s * c, 0, -s * c]
        half = -c * cb
        scale = 1 / dr.sqrt(dr.fma(half, half, r * r))
        self._means = self._of_powers(t, r * scale, half * scale, 2 * order + 2)
        self._powers_of_z = [[1]]
        for _ in range(order + 1):
            self._powers_of_z.append(_times(self._powers_of_z[-1], self._z))
        # (x + iy)^m = real + i y other
        self._real, self._other = [[1], self._x], [[0], [1]]
        for _ in range(2, order + 1):
            real, other = self._real[-1], self._other[-1]
            self._real.append(_minus(_times(self._x, real), _times(self._yy, other)))
            self._other.append(_plus(real, _times(self._x, other)))
        self.h = {
            (a, m): _times(self._powers_of_z[a], self._real[m]) for m in range(order + 1) for a in range(order + 2 - m)
        }

    @staticmethod
    def _of_powers(t, sine, cosine, n):
        """∫ cos^k τ dτ from -t to t for k = 0 … n."""
        found, power = [2 * t, 2 * sine], sine
        for k in range(2, n + 1):
            power = power * cosine
            found.append(dr.fma(found[k - 2], (k - 1) / k, power * (2 / k)))
        return found

    def mean(self, polynomial):
        """∫ of a polynomial in cos τ over the rim."""
        total = 0
        for coefficient, integral in zip(polynomial, self._means, strict=False):
            total = dr.fma(coefficient, integral, total)
        return total

    def flux(self, a, m):
        """∮ ∂h/∂ν ds of h = z^a Re (x + iy)^m."""
        total = [0]
        if a:
            total = [a * v for v in _times(_times(self._powers_of_z[a - 1], self._z_out), self._real[m])]
        if m:
            turn = _minus(_times(self._real[m - 1], self._x_out), _times(self._other[m - 1], self._yy_out))
            total = _plus(total, [m * v for v in _times(self._powers_of_z[a], turn)])
        return self.s * self.mean(total)


def _integrals(moving, p, omega, order):
    """{(a, m): ∫ z^a Re (x + iy)^m dω} of the region, m <= order, a <= order + 1 - m."""
    sine, cosine = dr.sincos(p)
    # On the tangent plane only ∂z/∂ν = -1 is left; sin mp by the recurrence of Chebyshev.
    sines = [0, sine]
    while len(sines) <= order:
        sines.append(2 * cosine * sines[-1] - sines[-2])
    found = {(0, 0): omega}
    for m in range(order + 1):
        for a in range(order + 2 - m):
            d = a + m
            if d == 0:
                continue
            total = -moving.flux(a, m)
            if a == 1:
                total = total + (2 * sines[m] / m if m else 2 * p)
            if a >= 2:
                total = dr.fma(found[a - 2, m], a * (a - 1), total)
            found[a, m] = total * (1 / (d * (d + 1)))
    return found


def _times(p, q):
    result = [0] * (len(p) + len(q) - 1)
    for i, u in enumerate(p):
        for k, v in enumerate(q):
            result[i + k] = _fma(u, v, result[i + k])
    return result


def _fma(a, b, c):
    """a b + c, where any may be a plain 0 or 1."""
    if any(isinstance(v, int) and v == 0 for v in (a, b)):
        return c
    return a * b if isinstance(c, int) and c == 0 else a * b + c


def _plus(p, q):
    longer, shorter = (p, q) if len(p) >= len(q) else (q, p)
    return [v + shorter[k] if k < len(shorter) else v for k, v in enumerate(longer)]


def _minus(p, q):
    return _plus(p, [-v for v in q])
