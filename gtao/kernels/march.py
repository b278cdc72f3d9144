"""The march that all slice methods share: every pixel, slices about it, depth samples along them, one fused launch.

What a method makes of the samples is an accumulator (:mod:`gtao.kernels.accumulators`), with three functions:
``begin(sl)`` gives the state of a slice, ``add(state, side, sample, sl)`` the state after one more sample of side 0
(toward -T) or 1 (toward +T), samples coming outward; ``finish(state, sl)`` the slice's value. One whose ``add`` is long
names the steps worth unrolling in ``max_unrolled``.

Slices run in a symbolic loop that carries the direction and turns it by a constant angle, steps are unrolled inside:
of the formulations measured this compiles fastest and runs within a few percent of hand-written vector code.
"""

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr

from . import hbao, horizon, noise, pyramid, reach, slices, steps, taps

__all__ = ["Pixel", "Sample", "Scalars", "Slice", "Switches", "march"]


@dataclass(frozen=True)
class Switches:
    """What specialises the kernel; everything else reaches it as an array and changes without recompiling."""

    width: int
    height: int
    orthographic: bool
    n_slices: int
    n_steps: int
    slice_measure: str
    slice_angles: tuple[float, ...] | None
    zenith: str
    fetch: str
    snap_to_texel: bool
    noise: str
    step_exponent: float
    step_law: str
    step_jitter: str
    border: str
    pyramid: pyramid.Table | None  # levels of the buffer that samples are read from
    unlimited: bool  # the radius is infinite
    clamp_px: bool
    pulled: bool  # the shaded point is moved toward the viewer

    @property
    def differentiable(self) -> bool:
        """Whether reverse mode is exact: a symbolic loop over a running maximum has no adjoint."""
        return steps.block_length(self.n_steps) == self.n_steps

    @property
    def leaves_frame(self) -> bool:
        """Whether a sample may lie off the frame, or off the part of it that the search was shortened to."""
        return self.border != "shorten" or self.step_law != "strata"


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
    min_step_px: Any
    max_radius_px: Any
    level_scale: Any  # of distances in pixels, see :func:`gtao.kernels.pyramid.level`
    pull: Any  # factor of the shaded point's depth
    frame_rotation: Any
    frame_offset: Any
    key: Any


@dataclass(frozen=True)
class Pixel:
    """The shaded point: texel coordinates, image-plane coordinates, position, unit vector to the viewer (zenith)."""

    x: Any
    y: Any
    X: Any
    Y: Any
    rcp_a2: Any  # 1 / (X² + Y² + 1)
    P: tuple[Any, Any, Any]
    p: Any  # distance from the eye; None in parallel projection
    V: tuple[Any, Any, Any]
    nV: Any


@dataclass(frozen=True)
class Slice:
    """One slice of a pixel: its number, the normal in it, the tangent plane's cosines, which sides have samples."""

    pixel: Pixel
    index: Any
    nV: Any
    nT: Any
    start: tuple[Any, Any]
    inside: tuple[Any, Any]
    offset: Any  # of its steps, in [0, 1)


@dataclass(frozen=True)
class Sample:
    """One depth sample: offset D from the shaded point, ⟨D, V⟩, its cosine, where it was read and what."""

    D: tuple[Any, Any, Any]
    d2: Any
    dV: Any
    c: Any  # NaN for the background, which is infinitely far: it compares false
    j: Any  # number of the step
    x: Any
    y: Any
    X: Any
    Y: Any
    z: Any


def march(view_z, field, normal, accumulator, k: Switches, s: Scalars, types):
    """The mean over slices of what ``accumulator`` makes of each, 1 on the background.

    Args:
        view_z: flat depth along the optical axis, inf on the background.
        field: the buffer that samples are read from: ``view_z`` too, a pyramid of it, or what
            :func:`gtao.kernels.fetch.affine_field` made for the fetches that interpolate.
        normal: three flat arrays, unit normals in the view frame.
        accumulator: see the module's text.
        k, s: switches and scalars.
        types: namespace of :func:`gtao.backend.types_of`.
    """
    Float, UInt = types.Float, types.UInt
    index = dr.arange(UInt, k.width * k.height)
    yi = index // k.width
    xi = index - yi * k.width
    surface = dr.isfinite(view_z)
    x, y = Float(xi), Float(yi)
    z = dr.select(surface, taps.centre_depth(view_z, x, y, k, types), 1)
    if k.pulled:
        z = z * s.pull
    pixel, n, facing = _pixel(x, y, z, normal, k, s, Float)
    P = pixel.P
    slice_frame = slices.frame(k.slice_measure, pixel.V, n, pixel.nV)
    rotation, offset = noise.pattern(k.noise, xi, yi, s.frame_rotation, s.frame_offset, s.key, Float)
    m = None if k.unlimited else reach.sphere_extent(k, s.radius, z, pixel.p)

    def sample(px, py, d, j):
        level = None if k.pyramid is None else pyramid.level(d, s.level_scale, k.pyramid, types)
        zs, px, py = taps.read(field, px, py, level, k, types)
        X, Y = dr.fma(px, s.ax, s.bx), dr.fma(py, s.ay, s.by)
        if k.orthographic:
            D = (X - P[0], Y - P[1], z - zs)
        else:
            D = (dr.fma(X, zs, -P[0]), dr.fma(Y, zs, -P[1]), z - zs)
        c, d2, dV = horizon.cosine(D, pixel.V)
        return Sample(D, d2, dV, c, j, px, py, X, Y, zs)

    def block(first, n, direction, sides, sl, state):
        """``n`` unrolled steps on both sides."""
        dx, dy = direction
        for j in (first + i for i in range(n)):
            xi = steps.jitter(k.step_jitter, sl.offset, j, k.n_steps)
            d0, d1 = (
                steps.distance(k.step_law, j, xi, k.n_steps, k.step_exponent, side.least, side.reach) for side in sides
            )
            state = accumulator.add(state, 0, sample(dr.fma(-dx, d0, x), dr.fma(-dy, d0, y), d0, j), sl)
            state = accumulator.add(state, 1, sample(dr.fma(dx, d1, x), dr.fma(dy, d1, y), d1, j), sl)
        return state

    def slice_value(i, c, q, off):
        """Slice ``i`` at azimuth (cos, sin) = (c, q)."""
        nT, ux, uy = slice_frame.normal_and_direction(c, q)
        start = slices.clamped_start(pixel.nV, nT)
        if facing is not None:
            # Slices do not contain the zenith, so that ⟨N, T⟩ does not say where they meet the tangent plane.
            rise = hbao.tangent(facing, hbao.left_of(ux, uy, pixel.X, pixel.Y), pixel.V)
            start = -rise, rise
        ux, uy = ux * s.fx, -uy * s.fy
        length2 = dr.fma(ux, ux, uy * uy)
        rcp = dr.rsqrt(length2)
        direction = ux * rcp, uy * rcp
        lengths = reach.reaches(k, s, slice_frame, m, (c, q), length2 * rcp, direction, x, y)
        sides = tuple(reach.Side.of(length, s.min_step_px, k.step_law) for length in lengths)
        sl = Slice(pixel, i, pixel.nV, nT, start, tuple(side.inside for side in sides), off)
        state = accumulator.begin(sl)
        n_block = steps.block_length(k.n_steps, getattr(accumulator, "max_unrolled", steps.MAX_UNROLLED))
        if n_block == k.n_steps:
            state = block(0, n_block, direction, sides, sl, state)
        else:

            def body(j, state):
                return j + n_block, block(Float(j), n_block, direction, sides, sl, state)

            _, state = dr.while_loop((UInt(0), state), lambda j, _: j < k.n_steps, body, label="steps")
        return accumulator.finish(state, sl)

    q, c = dr.sincos(rotation * (math.pi / k.n_slices))
    turn_c, turn_q = math.cos(math.pi / k.n_slices), math.sin(math.pi / k.n_slices)
    stagger = 0 if k.step_jitter == "pixel" or (k.noise == "none" and k.step_jitter == "slice") else noise.GOLDEN

    def body(i, total, c, q, off):
        if k.slice_angles is not None:
            q, c = dr.sincos((rotation + slices.listed(k.slice_angles, i, Float)) * math.pi)
        total = total + slice_value(i, c, q, off)
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


def _pixel(x, y, z, normal, k: Switches, s: Scalars, Float):
    """The shaded point; its normal, facing the zenith; and, if slices do not contain the zenith, facing the eye."""
    X, Y = dr.fma(x, s.ax, s.bx), dr.fma(y, s.ay, s.by)
    rcp_a2 = 1 / dr.fma(X, X, dr.fma(Y, Y, 1))
    axis = (Float(0), Float(0), Float(1))
    if k.orthographic:
        P, p, V = (X, Y, -z), None, axis
    else:
        P = (X * z, Y * z, -z)
        p2 = dr.fma(P[0], P[0], dr.fma(P[1], P[1], z * z))
        rcp_p = dr.rsqrt(p2)
        p, V = p2 * rcp_p, (-P[0] * rcp_p, -P[1] * rcp_p, z * rcp_p)
    n, nV = _bent(normal, V)
    facing = None
    if k.zenith == "optical_axis" and not k.orthographic:
        facing, V = n, axis
        n, nV = _bent(n, V)
    return Pixel(x, y, X, Y, rcp_a2, P, p, V, nV), n, facing


def _bent(n, V):
    """The normal, turned until it is seen edge-on if it faces away from V, and ⟨N, V⟩: closed forms need n_V > 0."""
    nV = dr.fma(n[0], V[0], dr.fma(n[1], V[1], n[2] * V[2]))
    facing = 1e-3
    bend = dr.select(nV < facing, facing - nV, 0)
    n = tuple(dr.fma(bend, v, c) for c, v in zip(n, V, strict=True))
    scale = dr.rsqrt(dr.fma(n[0], n[0], dr.fma(n[1], n[1], n[2] * n[2])))
    n = tuple(c * scale for c in n)
    return n, dr.fma(n[0], V[0], dr.fma(n[1], V[1], n[2] * V[2]))
