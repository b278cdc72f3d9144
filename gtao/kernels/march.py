"""The march that all slice methods share: every pixel, slices about it, depth samples along them, one fused launch.

What a method makes of the samples is an accumulator (:mod:`gtao.kernels.accumulators`), with three functions:
``begin(sl)`` gives the state of a slice, ``add(state, side, sample, sl)`` the state after one more sample of side 0
(toward -T) or 1 (toward +T), samples coming outward; ``finish(state, sl)`` the slice's values: its share of visibility,
with ``order`` 1 the two first moments of the visible directions, with ``order`` 2 two second ones as well. What a state
amounts to is ``ends(state, sl)``, the cosines (upper, lower) between which each side is blocked, or, where sectors are
closed, ``closed(state, sl)``, their masks. One whose ``add`` is long names the steps worth unrolling in
``max_unrolled``. One whose slice values only depend on the samples that attain extrema names their number per side in
``n_extrema`` and gives the extrema so far by ``extrema(state, side)``; such a march can be searched without gradients
and replayed with them
(:mod:`gtao.kernels.winners`).

Slices run in a symbolic loop that carries the direction and turns it by a constant angle, steps are unrolled inside:
of the formulations measured this compiles fastest and runs within a few percent of hand-written vector code.
"""

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr

from . import directions, fetch, hbao, noise, reach, slices, steps
from .loops import while_loop
from .march_types import Pixel, Scalars, Slice, Switches
from .sampler import Sampler
from .shaded_point import shaded_point
from .turns import half_turn
from .winners import Packing

__all__ = ["March", "added"]

# Steps whose depths are gathered one after the other: more do not fit the registers.
_TOGETHER = 4


@dataclass(frozen=True)
class March:
    """One frame, or some of its rows, ready to be marched.

    Attributes:
        sampler: what reads samples.
        k, s, types: switches, scalars and array types.
        n: number of pixels.
        surface: where there is something to shade.
        pixel: the shaded points.
        slice_frame: of :func:`gtao.kernels.slices.frame`.
        facing: the normal that faces the eye, if slices do not contain the zenith.
        extent: what :func:`gtao.kernels.reach.sphere_extent` returned, if there is a radius.
        rotation, offset: the noise of slices and steps.
    """

    sampler: Sampler
    k: Switches
    s: Scalars
    types: Any
    n: int
    surface: Any
    pixel: Pixel
    slice_frame: Any
    facing: Any
    extent: Any
    rotation: Any
    offset: Any

    @classmethod
    def of(cls, view_z, normal, field, k: Switches, s: Scalars, types, first_row=None) -> "March":
        """Set up the pixels.

        Args:
            view_z: depth of the pixels along the optical axis, inf on the background.
            normal: three flat arrays, unit normals of the pixels in the view frame.
            field: the buffer of the whole frame that samples are read from: its depth, a pyramid of it, or what
                :func:`gtao.kernels.fetch.affine_field` made for the fetches that interpolate.
            k, s: switches and scalars.
            types: namespace of :func:`gtao.backend.types_of`.
            first_row: number of the row of the first pixel; 0 by default.
        """
        Float, UInt = types.Float, types.UInt
        n = dr.width(view_z)
        index = dr.arange(UInt, n)
        if first_row is not None:
            index = index + first_row * k.width
        yi = index // k.width
        xi = index - yi * k.width
        surface = dr.isfinite(view_z)
        x, y = Float(xi), Float(yi)
        if k.fetch == "nearest_of_four":
            view_z = fetch.nearest_of_four(field, x, y, k.width, k.height, types)
        z = dr.select(surface, view_z, 1)
        if k.pulled:
            z = z * s.pull
        pixel, bent, facing = shaded_point(x, y, z, normal, k, s, Float)
        slice_frame = slices.frame(k.slice_measure, pixel.V, bent, pixel.nV)
        rotation, offset = noise.pattern(k.noise, xi, yi, s, Float)
        extent = None if k.unlimited else reach.sphere_extent(k, s.radius, z, pixel.p)
        return cls(
            Sampler(field, pixel, k, s, types),
            k,
            s,
            types,
            n,
            surface,
            pixel,
            slice_frame,
            facing,
            extent,
            rotation,
            offset,
        )

    def mean(self, accumulator):
        """The means over slices of what ``accumulator`` makes of each, in the view frame.

        The share of visibility, 1 on the background; with ``order`` 1 the three components of the mean direction, with
        ``order`` 2 five harmonics of band 2 as well (:func:`gtao.kernels.directions.in_view_frame`), 0 there.
        """

        def body(i, totals, c, q, off):
            return i + 1, added(totals, self._summands(accumulator, i, c, q, off)), *self.next_azimuth(c, q, off)

        return self.closed(self.loop(accumulator, body))

    def replay(self, accumulator, words, i, azimuth):
        """What slice ``i`` adds to :meth:`mean`, from its winning samples alone.

        Args:
            words: packed numbers of the winners, see :mod:`gtao.kernels.search`.
            azimuth: cosine, sine and step offset of the slice, see :meth:`first_azimuth`.
        """
        numbers = Packing(self.k.n_steps, accumulator.n_extrema).unpack(words)
        sl = self.slice(i, *azimuth)
        return self._share(self._directed(self._replayed(accumulator, sl, numbers), sl))

    def through(self, accumulator, i, azimuth):
        """What slice ``i`` adds to :meth:`mean`, from all its samples."""
        return self._share(self._summands(accumulator, i, *azimuth))

    def _summands(self, accumulator, i, c, q, off):
        """What slice ``i`` adds to the sums of :mod:`gtao.kernels.directions`."""
        sl = self.slice(i, c, q, off)
        return self._directed(self._value(accumulator, sl), sl)

    def tracked(self, tracked, i, c, q, off):
        """What slice ``i`` adds to the sums, and the packed numbers of its winning steps."""
        sl = self.slice(i, c, q, off)
        values, words = self._value(tracked, sl)
        return self._directed(values, sl), words

    def _directed(self, values, sl):
        return values if len(values) == 1 else directions.summands(values, *self.slice_frame.azimuth(*sl.azimuth))

    def _share(self, summands):
        """What a slice adds to the means, whose sums are 0 on the background."""
        return tuple(dr.select(self.surface, v, 0) for v in self._means(summands))

    def closed(self, totals):
        """The means from the sums over slices: visibility 1 and directions 0 on the background."""
        visibility, *others = self._means(totals)
        return dr.select(self.surface, visibility, 1), *(dr.select(self.surface, v, 0) for v in others)

    def _means(self, totals):
        return directions.in_view_frame(tuple(total * (1 / self.k.n_slices) for total in totals), self.pixel.V)

    def loop(self, accumulator, body):
        """The sums over slices that ``body(i, totals, c, q, off)`` adds up."""
        UInt, k = self.types.UInt, self.k
        zero = tuple(dr.zeros(self.types.Float, self.n) for _ in range(directions.n_sums(accumulator.order)))
        start = (UInt(0), zero, *self.first_azimuth())
        # Sums over slices: reverse mode may replay each on its own.
        _, totals, *_ = while_loop(start, lambda i, *_: i < k.n_slices, body, label="slices", max_iterations=-1)
        return totals

    def first_azimuth(self):
        """Cosine and sine of the first slice's azimuth and its step offset."""
        return *half_turn(self.rotation * (1 / self.k.n_slices)), self.offset

    def next_azimuth(self, c, q, off):
        """The same of the next slice."""
        k = self.k
        turn_c, turn_q = math.cos(math.pi / k.n_slices), math.sin(math.pi / k.n_slices)
        if not (k.step_jitter == "pixel" or (k.noise == "none" and k.step_jitter == "slice")):
            off = noise.frac(off + noise.GOLDEN)
        return dr.fma(c, turn_c, -q * turn_q), dr.fma(c, turn_q, q * turn_c), off

    def slice(self, i, c, q, off) -> Slice:
        """Slice ``i`` at azimuth (cos, sin) = (c, q), unless azimuths are listed."""
        k, s, pixel = self.k, self.s, self.pixel
        if k.slice_angles is not None:
            q, c = dr.sincos((self.rotation + slices.listed(k.slice_angles, i, self.types.Float)) * math.pi)
        nT, ux, uy = self.slice_frame.normal_and_direction(c, q)
        start = slices.clamped_start(pixel.nV, nT)
        if self.facing is not None:
            # Slices do not contain the zenith, so that ⟨N, T⟩ does not say where they meet the tangent plane.
            rise = hbao.tangent(self.facing, hbao.left_of(ux, uy, pixel.X, pixel.Y), pixel.V)
            start = -rise, rise
        direction, length = reach.direction(k, s, ux, uy)
        lengths = reach.reaches(k, s, self.slice_frame, self.extent, (c, q), length, direction, pixel.x, pixel.y)
        sides = tuple(reach.Side.of(length, s.min_step_px, k.step_law) for length in lengths)
        return Slice(pixel, i, (c, q), pixel.nV, nT, start, direction, sides, off)

    def _value(self, accumulator, sl: Slice):
        """What ``accumulator`` makes of all samples of a slice."""
        k, UInt, Float = self.k, self.types.UInt, self.types.Float
        n_block = steps.block_length(k.n_steps, getattr(accumulator, "max_unrolled", steps.MAX_UNROLLED))

        def block(first, state):
            for start in range(0, n_block, _TOGETHER):
                ahead = [(side, first + i) for i in range(start, min(start + _TOGETHER, n_block)) for side in (0, 1)]
                for (side, _), sample in zip(ahead, self.sampler.read(sl, ahead), strict=True):
                    state = accumulator.add(state, side, sample, sl)
            return state

        state = accumulator.begin(sl)
        if n_block == k.n_steps:
            state = block(0, state)
        else:

            def body(j, state):
                return j + n_block, block(Float(j), state)

            _, state = while_loop((UInt(0), state), lambda j, _: j < k.n_steps, body, label="steps")
        return accumulator.finish(state, sl)

    def _replayed(self, accumulator, sl: Slice, numbers):
        """What ``accumulator`` makes of the steps with these numbers."""
        state, places = accumulator.begin(sl), []
        for place, number in enumerate(numbers):
            found = number < self.k.n_steps
            places.append((place // accumulator.n_extrema, self.types.Float(dr.select(found, number, 0)), found))
        for (side, _, found), sample in zip(places, self.sampler.read(sl, places), strict=True):
            state = dr.select(found, accumulator.add(state, side, sample, sl), state)
        return accumulator.finish(state, sl)


def added(totals, summands):
    """Sums with one more slice."""
    return tuple(a + b for a, b in zip(totals, summands, strict=True))
