"""The GTAO kernel: visibility of every pixel of a depth buffer, in one fused launch.

Slices run in a symbolic loop that carries the direction and turns it by a constant angle, steps are unrolled inside:
of the formulations measured this compiles fastest and runs within a few percent of hand-written vector code.
"""

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr

from . import arcs, fetch, horizon, noise, slices

__all__ = ["MAX_UNROLLED_STEPS", "Scalars", "Switches", "visibility"]

# Beyond this many steps per side the step loop becomes symbolic too, in blocks of at most this many.
MAX_UNROLLED_STEPS = 32


# Samples that rise less than this above the tangent plane, in radians, do not close the gap below a far occluder:
# rounding and the steps of a depth buffer put samples of a flat surface there. An arc of this height at the tangent
# plane holds RELIEF² / 2 of the cosine-weighted hemisphere.
RELIEF = 0.05


@dataclass(frozen=True)
class Switches:
    """What specialises the kernel; everything else reaches it as an array and changes without recompiling."""

    width: int
    height: int
    orthographic: bool
    n_slices: int
    n_steps: int
    weighting: str
    slice_measure: str
    fetch: str
    snap_to_texel: bool
    noise: str
    step_exponent: float
    unlimited: bool  # the radius is infinite
    falloff: bool
    clamp_px: bool

    @property
    def differentiable(self) -> bool:
        """Whether reverse mode is exact: a symbolic loop over a running maximum has no adjoint."""
        return _block(self.n_steps) == self.n_steps


@dataclass(frozen=True)
class Scalars:
    """Kernel inputs of width one, opaque to the compiler."""

    ax: Any  # image-plane coordinate of texel column i: ax i + bx
    bx: Any
    ay: Any
    by: Any
    fx: Any
    fy: Any
    radius: Any
    falloff_scale: Any
    falloff_offset: Any
    max_radius_px: Any
    frame_rotation: Any
    frame_offset: Any
    key: Any


def _power(t, exponent):
    if exponent == 1:
        return t
    if exponent == 2:
        return t * t
    return t**exponent


def _block(n_steps):
    """Largest divisor of the step count that is worth unrolling."""
    return max(k for k in range(1, min(n_steps, MAX_UNROLLED_STEPS) + 1) if n_steps % k == 0)


def visibility(view_z, field, normal, k: Switches, s: Scalars, types):
    """Visibility per pixel, 1 on the background.

    Args:
        view_z: flat depth along the optical axis, inf on the background.
        field: what :func:`gtao.kernels.fetch.affine_field` made, read only by the "linear" fetch.
        normal: three flat arrays, unit normals in the view frame.
        k, s: switches and scalars.
        types: namespace of :func:`gtao.backend.types_of`.

    Returns:
        Flat array: the mean over slices of |n_p| â (cosine) or of half the clamped solid angle over π (uniform);
        theory, eq. (10), the blocked arc of a finite radius as in eq. (28). With few slices single pixels exceed 1:
        the slices of an unoccluded tilted surface average to 1, each alone does not (eq. (17)).
    """
    Float, UInt = types.Float, types.UInt
    index = dr.arange(UInt, k.width * k.height)
    yi = index // k.width
    xi = index - yi * k.width
    x, y = Float(xi), Float(yi)

    surface = dr.isfinite(view_z)
    z = dr.select(surface, view_z, 1)
    X0, Y0 = dr.fma(x, s.ax, s.bx), dr.fma(y, s.ay, s.by)
    rcp_a2 = 1 / dr.fma(X0, X0, dr.fma(Y0, Y0, 1))
    if k.orthographic:
        P = (X0, Y0, -z)
        V = (Float(0), Float(0), Float(1))
        p = None
    else:
        P = (X0 * z, Y0 * z, -z)
        p2 = dr.fma(P[0], P[0], dr.fma(P[1], P[1], z * z))
        rcp_p = dr.rsqrt(p2)
        V = (-P[0] * rcp_p, -P[1] * rcp_p, z * rcp_p)
        p = p2 * rcp_p

    # A shading normal that faces away is bent until it is seen edge-on: the closed forms need n_V >= 0.
    nV = dr.fma(normal[0], V[0], dr.fma(normal[1], V[1], normal[2] * V[2]))
    facing = 1e-3
    bend = dr.select(nV < facing, facing - nV, 0)
    n = tuple(dr.fma(bend, v, c) for c, v in zip(normal, V, strict=True))
    scale = dr.rsqrt(dr.fma(n[0], n[0], dr.fma(n[1], n[1], n[2] * n[2])))
    n = tuple(c * scale for c in n)
    nV = dr.fma(n[0], V[0], dr.fma(n[1], V[1], n[2] * V[2]))

    slice_frame = slices.frame(k.slice_measure, V, n, nV)
    rotation, offset = noise.pattern(k.noise, xi, yi, s.frame_rotation, s.frame_offset, s.key, Float)
    m = None if k.unlimited else _sphere_extent(k, s.radius, z, p)

    cut = not (k.unlimited or k.falloff)

    def sample(px, py, side, best):
        """What the sample at (px, py) makes of the horizon ``best`` of one side."""
        if k.fetch == "linear":
            zs, px, py = fetch.linear(field, px, py, k.width, k.height, k.orthographic, types)
        else:
            zs, tx, ty = fetch.nearest(view_z, px, py, k.width, k.height, types)
            if k.snap_to_texel:
                px, py = tx, ty
        X, Y = dr.fma(px, s.ax, s.bx), dr.fma(py, s.ay, s.by)
        if k.orthographic:
            D = (X - P[0], Y - P[1], z - zs)
        else:
            D = (dr.fma(X, zs, -P[0]), dr.fma(Y, zs, -P[1]), z - zs)
        c, d2, dV = horizon.cosine(D, V)
        # Background samples are infinitely far: their cosine is NaN, which compares false.
        if cut:
            upper, lower = best
            dX, dY = (px - x) * s.ax, (py - y) * s.ay
            apart2 = horizon.apart_squared(dX, dY, X0, Y0, rcp_a2, X, Y, k.orthographic)
            c, end = horizon.cut_at_sphere(c, d2, dV, apart2, p, s.radius, k.orthographic)
            rises = (c > side.counts) & (end < lower)
            return dr.select(c > upper, c, upper), dr.select(rises, end, lower)
        if k.falloff:
            c = horizon.attenuate(c, side.start, d2, s.falloff_scale, s.falloff_offset)
        return (dr.select(c > best[0], c, best[0]),)

    def block(first, n, off, direction, sides, horizons):
        """``n`` unrolled steps on both sides, spaced as in theory, eq. (24)."""
        (dx, dy), (side0, side1), (h0, h1) = direction, sides, horizons
        for j in range(n):
            t = _power((off + (first + j)) * (1 / k.n_steps), k.step_exponent)
            d0, d1 = dr.fma(t, side0.span, side0.base), dr.fma(t, side1.span, side1.base)
            h0 = sample(dr.fma(-dx, d0, x), dr.fma(-dy, d0, y), side0, h0)
            h1 = sample(dr.fma(dx, d1, x), dr.fma(dy, d1, y), side1, h1)
        return h0, h1

    def slice_value(c, q, off):
        """One slice at azimuth (cos, sin) = (c, q)."""
        nT, ux, uy = slice_frame.normal_and_direction(c, q)
        ux, uy = ux * s.fx, -uy * s.fy
        length2 = dr.fma(ux, ux, uy * uy)
        rcp = dr.rsqrt(length2)
        dx, dy = ux * rcp, uy * rcp
        reach = _reaches(k, s, slice_frame, m, c, q, length2 * rcp, dx, dy, x, y)
        start = slices.clamped_start(nV, nT)
        counts = slices.clamped_start(nV, nT, RELIEF) if cut else start
        sides = tuple(_Side.of(*of_side) for of_side in zip(reach, start, counts, strict=True))
        horizons = tuple((side.start, Float(1)) if cut else (side.start,) for side in sides)
        n_block = _block(k.n_steps)
        if n_block == k.n_steps:
            horizons = block(0, n_block, off, (dx, dy), sides, horizons)
        else:

            def body(j, *horizons):
                return j + n_block, *block(Float(j), n_block, off, (dx, dy), sides, horizons)

            _, *horizons = dr.while_loop((UInt(0), *horizons), lambda j, *_: j < k.n_steps, body, label="steps")
        (c0, *end0), (c1, *end1) = (side.seen(h) for side, h in zip(sides, horizons, strict=True))
        value = _arc(k, nV, nT, c0, c1)
        if cut:
            # Below the blocked arc the slice is open again, down to the tangent plane.
            value = value + _arc(k, nV, nT, *start) - _arc(k, nV, nT, end0[0], end1[0])
        return value

    q, c = dr.sincos(rotation * (math.pi / k.n_slices))
    turn_c, turn_q = math.cos(math.pi / k.n_slices), math.sin(math.pi / k.n_slices)
    stagger = 0 if k.noise == "none" else noise.GOLDEN

    def body(i, total, c, q, off):
        total = total + slice_value(c, q, off)
        off = noise.frac(off + stagger) if stagger else off
        return i + 1, total, dr.fma(c, turn_c, -q * turn_q), dr.fma(c, turn_q, q * turn_c), off

    _, total, *_ = dr.while_loop(
        (UInt(0), dr.zeros(Float, k.width * k.height), c, q, offset),
        lambda i, *_: i < k.n_slices,
        body,
        label="slices",
        # A sum over slices: reverse mode may replay each on its own.
        max_iterations=-1,
    )
    return dr.select(surface, total * (1 / k.n_slices), 1)


@dataclass(frozen=True)
class _Side:
    """One side of a slice: where its samples lie and what its horizon starts from."""

    base: Any
    span: Any
    start: Any
    counts: Any
    inside: Any

    @classmethod
    def of(cls, reach, start, counts):
        # A side whose next texel is off the frame has no sample: its steps stay on the pixel and are discarded.
        inside = reach >= 1
        one = type(reach)(1)
        return cls(dr.select(inside, one, 0), dr.select(inside, reach - 1, 0), start, counts, inside)

    def seen(self, horizon):
        """The horizon, and the lower end of the blocked arc if there is one, both within the hemisphere."""
        upper, *lower = horizon
        upper = dr.select(self.inside, upper, self.start)
        if not lower:
            return (upper,)
        open_below = self.inside & (upper > self.start) & (lower[0] > self.start) & (lower[0] < upper)
        return upper, dr.select(open_below, lower[0], self.start)


def _arc(k: Switches, nV, nT, c0, c1):
    return 0.5 * arcs.uniform_arc(c0, c1) if k.weighting == "uniform" else arcs.cosine_arc(nV, nT, c0, c1)


def _sphere_extent(k: Switches, radius, z, p):
    """Tangent of the angle under which the sphere of the search radius is seen, or its published stand-in."""
    if k.orthographic:
        return radius
    if k.slice_measure == "screen":
        return radius / z
    outside = dr.fma(p, p, -radius * radius)
    # 1e6 stands for "the eye is inside the sphere"; the frame's border limits the search then.
    return dr.select(outside > 0, radius * dr.rsqrt(dr.select(outside > 0, outside, 1)), 1e6)


def _reaches(k: Switches, s: Scalars, slice_frame, m, c, q, length, dx, dy, x, y):
    """Lengths of the search to -T and +T in pixels (ℓ of theory, eq. (24)): the sphere's extent, within the frame."""
    # Texel centres lie at integers, and a sample is the texel it rounds to: stay a little inside the outermost half.
    margin = 0.499
    rcp_x, rcp_y = 1 / dr.select(abs(dx) > 1e-9, abs(dx), 1e-9), 1 / dr.select(abs(dy) > 1e-9, abs(dy), 1e-9)
    far_x, far_y = (k.width - 1 + margin) - x, (k.height - 1 + margin) - y
    near_x, near_y = x + margin, y + margin
    right, down = dx > 0, dy > 0
    bx, by = dr.select(right, far_x, near_x) * rcp_x, dr.select(down, far_y, near_y) * rcp_y
    reach1 = dr.select(bx < by, bx, by)
    bx, by = dr.select(right, near_x, far_x) * rcp_x, dr.select(down, near_y, far_y) * rcp_y
    reach0 = dr.select(bx < by, bx, by)
    if not k.unlimited:
        e0, e1 = slice_frame.extents(m, c, q)
        e0, e1 = e0 * length, e1 * length
        # A radius below one pixel still looks at the next texel: the distance cut or the falloff decides.
        e0, e1 = dr.select(e0 > 1, e0, 1), dr.select(e1 > 1, e1, 1)
        reach0, reach1 = dr.select(e0 < reach0, e0, reach0), dr.select(e1 < reach1, e1, reach1)
    if k.clamp_px:
        limit = s.max_radius_px
        reach0, reach1 = dr.select(reach0 < limit, reach0, limit), dr.select(reach1 < limit, reach1, limit)
    return reach0, reach1
