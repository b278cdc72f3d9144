"""The march of one pixel, step by step, with everything that it meets on the way.

The search goes through the same functions as that of a frame, one sample after the other instead of in one kernel:
nothing is computed a second time in another manner.
"""

import math
import numbers
from dataclasses import replace
from typing import Any

import drjit as dr

from gtao.errors import ConfigError
from gtao.gbuffer import GBuffer

from .estimate import check_frame, check_frame_index
from .inspect_states import number, pair, states_of, vector
from .inspect_types import InspectedSample, InspectedSlice, SliceInspection
from .occlusion import JOBS

__all__ = ["check_pixel", "inspect_slices"]


def inspect_slices(g: GBuffer, method: Any, x: int, y: int, *, frame_index: int = 0) -> SliceInspection:
    """Slices and samples of the pixel in column ``x`` and row ``y``, and what the method makes of them.

    Args:
        g: the frame.
        method: a :class:`gtao.GTAO`, :class:`gtao.HBAO` or :class:`gtao.VisibilityBitmask`.
        x, y: column and row, from 0; the pixel must show a surface.
        frame_index: position in the temporal noise sequence, at least 0.

    Raises:
        ConfigError: ``method`` has no slices, ``g`` is no frame, the pixel lies off the frame or shows the background,
            ``frame_index`` is negative, or the method does not fit the frame.
    """
    if type(method) not in JOBS:
        choices = ", ".join(f"gtao.{kind.__name__}" for kind in JOBS)
        raise ConfigError(f"method must be one of {choices}, got {type(method).__name__}")
    check_frame(g)
    check_frame_index(frame_index)
    check_pixel(g, x, y)
    with dr.suspend_grad():
        job = JOBS[type(method)](g, method, frame_index).row(y)
        march, states = job.march(), states_of(job.accumulator)
        slices, azimuth = [], march.first_azimuth()
        for i in range(method.n_slices):
            dr.eval(azimuth)
            slices.append(_slice(march, states, i, azimuth, x))
            azimuth = march.next_azimuth(*azimuth)
        pixel = y * g.shape[1] + x
        return SliceInspection(
            x=int(x),
            y=int(y),
            view_z=float(g.view_z.array[pixel]),
            position_v=vector(march.pixel.P, x),
            normal_v=vector((g.normal_v.array[3 * pixel + k] for k in range(3)), x),
            zenith=vector(march.pixel.V, x),
            visibility=math.fsum(s.contribution for s in slices) / len(slices),
            slices=tuple(slices),
            method=method,
            frame_index=int(frame_index),
        )


def check_pixel(g: GBuffer, x: Any, y: Any) -> None:
    """(x, y) is a pixel of ``g`` that shows a surface.

    Raises:
        ConfigError: it is not.
    """
    height, width = g.shape
    for name, value, n in (("x", x, width), ("y", y, height)):
        if isinstance(value, bool) or not isinstance(value, numbers.Integral) or not 0 <= value < n:
            raise ConfigError(f"{name} must be an integer from 0 to {n - 1}, got {value!r}")
    if not g.mask.array[int(y) * width + int(x)]:
        raise ConfigError(f"pixel ({x}, {y}) shows the background; choose one that shows a surface")


def _slice(march: Any, states: Any, i: int, azimuth: Any, lane: int) -> InspectedSlice:
    """Slice ``i`` of the pixels of a row, of which the one in ``lane`` is reported."""
    T, accumulator = march.types, states.accumulator
    # As in the march of a frame, numbers of slices and steps are no constants: one kernel serves all.
    sl = march.slice(dr.opaque(T.UInt, i), *azimuth)
    # What a side too short for its first sample finds is discarded.
    searched = [bool(number(inside, lane)) for inside in sl.inside]
    state, samples = accumulator.begin(sl), []
    for step in range(march.k.n_steps):
        j = dr.opaque(T.Float, step)
        for side, sample in enumerate(march.sampler.read(sl, [(0, j), (1, j)])):
            after = accumulator.add(state, side, sample, sl)
            did = states.after(state, after, side, sample, sl)
            dr.eval(after, did, sample.D, sample.d2, sample.c, sample.x, sample.y, sample.z)
            if searched[side]:
                samples.append(_sample(march, side, step, sample, states.sample(did, lane), lane))
            state = after
    contribution = accumulator.finish(state, sl)[0]
    winners = [w for side in (0, 1) for w in states.winners([s for s in samples if s.wins and s.side == side])]
    c, s = pair(sl.azimuth, lane)
    return InspectedSlice(
        index=i,
        azimuth=math.atan2(s, c),
        direction=pair(sl.direction, lane),
        normal=pair((sl.nV, sl.nT), lane),
        tangent=pair(sl.start, lane),
        reach=pair((side.reach for side in sl.sides), lane),
        contribution=number(contribution, lane),
        samples=tuple(replace(sample, wins=any(sample is w for w in winners)) for sample in samples),
        **states.slice(state, sl, lane),
    )


def _sample(march: Any, side: int, step: int, sample: Any, did: dict[str, Any], lane: int) -> InspectedSample:
    D, P = vector(sample.D, lane), vector(march.pixel.P, lane)
    return InspectedSample(
        side=side,
        step=step,
        x=number(sample.x, lane),
        y=number(sample.y, lane),
        view_z=number(sample.z, lane),
        position_v=(P[0] + D[0], P[1] + D[1], P[2] + D[2]),
        distance=math.sqrt(number(sample.d2, lane)),
        cosine=number(sample.c, lane),
        **did,
    )
