"""One frame and what was kept of those before it, in one kernel."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from gtao.camera.pose import previous_from_view
from gtao.config import TemporalFilter
from gtao.gbuffer import GBuffer
from gtao.history import CHANNELS, Contents
from gtao.kernels import temporal as kernels
from gtao.kernels.filters import Grid, Image
from gtao.stages import staged

from .channels import Channels

__all__ = ["Accumulated", "accumulated", "first"]


@dataclass(frozen=True)
class Accumulated:
    """Channels of the result, its effective number of frames, 0 on the background and where it is not finite, and its
    mean deviation, if it is to be kept."""

    channels: Channels
    count: Any
    deviation: Any = None


@dataclass(frozen=True)
class _Past:
    """The history as a kernel reads it."""

    channels: dict[str, tuple[Image, ...]]
    view_z: Image
    count: Image
    deviation: Image | None
    normal: tuple[Image, ...] | None
    motion: tuple[Image, ...] | None

    @classmethod
    def of(cls, contents: Contents, T: Any) -> "_Past":
        def image(flat):
            flat = T.Float(flat)
            return Image(flat, flat)

        channels = {name: tuple(map(image, arrays)) for name, arrays in contents.channels.items()}
        normal, motion = (
            None if arrays is None else tuple(map(image, arrays)) for arrays in (contents.normal, contents.motion)
        )
        deviation = None if contents.deviation is None else image(contents.deviation)
        return cls(channels, image(contents.view_z), image(contents.count), deviation, normal, motion)


@dataclass(frozen=True)
class _Numbers:
    """Numbers of a filter and the rows of a rotation, as kernel inputs."""

    frames: Any
    moving_frames: Any
    moving_speed: Any
    disocclusion: Any
    covering: Any
    window: Any
    deviations: Any
    velocity_scale: Any
    crease: Any
    turn: tuple[tuple[Any, ...], ...] | None

    @classmethod
    def of(cls, values: tuple[Any, ...]) -> "_Numbers":
        numbers, turn = values[:9], values[9:]
        return cls(*numbers, turn=tuple(turn[i : i + 3] for i in (0, 3, 6)) if turn else None)


def first(channels: Channels, g: GBuffer) -> Accumulated:
    """A frame without a history."""
    return Accumulated(channels, _counted(g.types.Float(1), channels, g))


def accumulated(
    channels: Channels, before: Contents, motion: tuple[Any, ...] | None, g: GBuffer, f: TemporalFilter
) -> Accumulated:
    """Mix a frame with the history; theory, the temporal filter.

    Args:
        motion: x, y and change of depth, flat; None where nothing moves.
    """
    T, (height, width) = g.types, g.shape
    past, grid = _Past.of(before, T), Grid.of(width, height, T)
    sizes = [len(arrays) for arrays in channels.values()]
    # A history without normals has not looked at any: it was taken by another filter.
    looks = f.crease is not None and past.normal is not None
    normals = tuple(g.normal_arrays()) if looks else ()

    def stage(images, values):
        numbers, images = _Numbers.of(values), list(images)
        current = {name: tuple(images.pop(0) for _ in range(n)) for name, n in zip(channels, sizes, strict=True)}
        normal = [images.pop(0).own for _ in normals]
        view_z, *moved = images
        moved = [m.own for m in moved] or None
        mixed = _mixed(current, past, normal, view_z, moved, numbers, f, g.camera.is_orthographic, grid)
        flat = tuple(c for arrays in mixed.channels.values() for c in arrays)
        return *flat, mixed.count, *(() if mixed.deviation is None else (mixed.deviation,))

    flat = [c for arrays in channels.values() for c in arrays]
    # Neighbours are read.
    dr.eval(flat)
    numbers = (f.frames, f.moving_frames, f.moving_speed_px, f.disocclusion, f.covering)
    numbers += (f.clamp_window, f.deviation_window, f.velocity_scale_px, f.crease if looks else 0.0)
    numbers += _turn(before, g, channels, looks)
    flat = list(staged(stage, (*flat, *normals, g.view_z.array, *(motion or ())), numbers))
    result = {name: tuple(flat.pop(0) for _ in range(n)) for name, n in zip(channels, sizes, strict=True)}
    surface = g.mask.array
    for name, arrays in result.items():
        background = 1 if CHANNELS[name] == 1 else 0
        result[name] = tuple(dr.select(surface, c, background) for c in arrays)
    count, *deviation = flat
    return Accumulated(result, _counted(count, result, g), *deviation)


def _turn(before: Contents, g: GBuffer, channels: Channels, looks: bool) -> tuple[float, ...]:
    """Nine numbers of the rotation from the previous view frame to this one; none where no direction turns."""
    poses = before.view_to_world, g.view_to_world
    if None in poses or poses[0] == poses[1] or not (looks or any(CHANNELS[name] > 1 for name in channels)):
        return ()
    rows = previous_from_view(*poses)
    return tuple(rows[j][i] for i in range(3) for j in range(3))


def _counted(count: Any, channels: Channels, g: GBuffer) -> Any:
    good = g.mask.array
    for arrays in channels.values():
        for c in arrays:
            good = good & dr.isfinite(c)
    return dr.select(good, count, 0)


def _mixed(current, past, normal, view_z, moved, numbers, f, orthographic, grid):
    """:class:`Accumulated` of surfaces."""
    zero = grid.types.Float(0)
    change, moved = (zero, None) if moved is None else (moved[2], moved[:2])
    surface = kernels.predicted(view_z, change, f.derivatives == "first", orthographic, grid)
    crease = None
    if normal:
        # 1 - cos without cancellation.
        slope = 0.5 / dr.square(dr.sin(0.5 * numbers.crease))
        crease = kernels.Crease(normal, past.normal, numbers.turn, slope)
    depths = 1 / numbers.disocclusion, 1 / numbers.covering
    taps = kernels.history_taps(moved, surface, past.view_z, past.count, *depths, grid, crease)
    share, variance = kernels.steadiness(taps, past.count, grid)
    speed = zero if moved is None else kernels.speed(moved)
    weight = kernels.blend(variance, speed, 1 / numbers.frames, 1 / numbers.moving_frames, numbers.moving_speed)
    (visibility,) = current["visibility"]
    h = dr.fma(1 - share, visibility.own, kernels.mix(taps, past.channels["visibility"][0], grid))
    kept, deviation = h, None
    if f.clamp:
        widening, margin = numbers.window, zero
        if dr.is_array_v(f.deviation_window) or f.deviation_window > 0:
            before = zero if past.deviation is None else kernels.mix(taps, past.deviation, grid)
            deviation, margin = kernels.deviation(before, h, visibility.own), numbers.deviations * before
        if f.velocity_weighting:
            difference = kernels.motion_difference(moved, past.motion, grid)
            trust = kernels.velocity_weight(difference, numbers.velocity_scale)
            widening, margin = widening * trust, margin * trust
        kept = kernels.clamped(h, *kernels.low_passed_bounds(visibility, view_z, grid), widening, margin)
    result = {"visibility": (dr.fma(weight, visibility.own - kept, kept),)}
    # Directions move as far toward this frame as the clamp has moved the visibility.
    keep = (1 - weight) * (1 - kernels.moved_share(h, kept, visibility.own)) if f.clamp else 1 - weight
    for name, images in current.items():
        if name == "visibility":
            continue
        old = tuple(kernels.mix(taps, image, grid) for image in past.channels[name])
        if numbers.turn is not None and len(old) > 1:
            old = (kernels.turned_vector if len(old) == 3 else kernels.turned_harmonics)(old, numbers.turn)
        result[name] = tuple(dr.fma(keep, dr.fma(-share, c.own, o), c.own) for c, o in zip(images, old, strict=True))
    return Accumulated(result, kernels.effective_count(1 - share * (1 - weight), variance), deviation)
