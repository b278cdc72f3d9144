"""Frames of a scene in motion: what the camera sees, how it moved, and the truth, one frame at a time."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from gtao.errors import ConfigError
from gtao.gbuffer import GBuffer

from .chunks import Progress
from .gbuffer import frame_of
from .hemisphere import check_rays
from .loading import select_sensor
from .motion import trace_back
from .primary import check_normals, shoot
from .sampling import check_sampling
from .sensor import camera_from_sensor
from .sequence_animation import Animation
from .sequence_disocclusion import disoccluded
from .sequence_stage import State
from .truth import Visibility, visibility
from .variant import ensure_variant

__all__ = ["SequenceFrame", "sequence"]

#: Batches of the rays of one pixel, which the variance of the truth rests on.
N_BATCHES = 8


@dataclass(frozen=True, eq=False)
class SequenceFrame:
    """One frame of an animation.

    Attributes:
        index: its number in the animation.
        g: depth, normals, albedo, the camera's pose and three-channel motion from the frame before: exact, of the very
            point that each pixel shows; 0 in frame 0.
        truth: ray-traced visibility of the scene in this state, None without ``truth_spp``. Frames share their random
            numbers: between two frames of a scene in which nothing moves it does not change.
        moving: (H, W) tensor of bool: a surface of a shape that moves or deforms in the animation.
        disoccluded: (H, W) tensor of bool: what the pixel shows could not be seen in the frame before, because it was
            hidden, turned away or outside of the frame; everything in frame 0. Of the background, its direction counts.
        scene: the ``mitsuba.Scene`` in the state of this frame, until the next one is made: there is only one scene.
    """

    index: int
    g: GBuffer
    truth: Visibility | None
    moving: Any
    disoccluded: Any
    scene: Any

    def __repr__(self) -> str:
        height, width = self.g.shape
        return f"SequenceFrame({self.index}, {width}x{height}{', truth' if self.truth is not None else ''})"


def sequence(
    animation: Animation,
    frames: int | range | None = None,
    *,
    truth_spp: int = 0,
    radius: float | None = None,
    seed: int = 0,
    sensor: Any = 0,
    normals: str = "shading",
    progress: Progress | None = None,
) -> Iterator[SequenceFrame]:
    """Frames of an animation, each made when it is asked for; memory does not grow with their number.

    Motion belongs to the step from frame to frame of the animation: ``frames=range(k, n)`` begins with the very frame k
    that a sequence from 0 on reaches, with its motion since frame k - 1. That goes for cuts too: across one, motion
    leads to where the points would have been in the picture before.

    Args:
        animation: of :mod:`gtao.render.animations`, or :meth:`Animation.from_scene`.
        frames: how many frames from 0 on, or a range of their numbers in steps of 1; all by default.
        truth_spp: rays per pixel for the truth, a multiple of 8; 0 for none.
        radius: distance beyond which nothing occludes in the truth; the animation's by default.
        seed: of the truth's random numbers, the same in all frames; see :func:`gtao.render.visibility`.
        sensor: index of the sensor, or a ``mitsuba.Sensor`` of the scene, that the animation's camera path moves.
        normals: "shading" or "geometric"; as for :func:`gtao.render.gbuffer`.
        progress: called as ``progress(done, total)`` after every frame.

    Yields:
        :class:`SequenceFrame`, in order.

    Raises:
        ConfigError: there are no such frames, or a parameter is out of range; at once, not with the first frame.
        SceneError: the scene cannot be loaded, or has no such sensor or shape.
        ShapeError: a frame's matrix is not rigid, or a mesh changes its number of vertices.
        BackendError: there is no usable backend.
    """
    if not isinstance(animation, Animation):
        raise ConfigError(
            f"expected a gtao.render.Animation, got {type(animation).__name__}; gtao.render.animations.build(name) "
            "makes one"
        )
    ensure_variant()
    numbers = _numbers(animation, frames)
    check_normals(normals)
    reach = animation.radius if radius is None else radius
    if truth_spp:
        check_sampling(truth_spp, N_BATCHES, seed)
        check_rays(reach)
    chosen = select_sensor(animation.stage.scene, sensor)
    camera_from_sensor(chosen)

    def truth(scene: Any) -> Visibility:
        return visibility(scene, None, reach, truth_spp, seed, sensor=chosen, normals=normals, n_batches=N_BATCHES)

    return _frames(animation, numbers, chosen, normals, truth if truth_spp else None, progress)


def _numbers(animation: Animation, frames: int | range | None) -> range:
    total = animation.n_frames
    if frames is None:
        return range(total)
    if isinstance(frames, int) and not isinstance(frames, bool):
        frames = range(frames)
    if not isinstance(frames, range) or frames.step != 1:
        raise ConfigError(f"frames must be a number of frames or a range in steps of 1, got {frames!r}")
    if len(frames) == 0 or frames[0] < 0 or frames[-1] >= total:
        raise ConfigError(f"{animation.name} has frames 0 to {total - 1}, asked for {frames!r}")
    return frames


def _frames(
    animation: Animation, numbers: range, sensor: Any, normals: str, trace: Any, progress: Progress | None
) -> Iterator[SequenceFrame]:
    stage, truth, traced = animation.stage, None, None
    for done, index in enumerate(numbers, 1):
        now = animation.state(index)
        before: State = animation.state(index - 1) if index else now
        pose_before = stage.look(before, sensor)
        stage.put(now, sensor)
        hits = shoot(stage.scene, sensor, normals)
        points = trace_back(hits, stage, now, before, pose_before)
        shape = hits.camera.shape
        height, width = shape
        if index and not now.same(before):
            hidden = disoccluded(hits, points, stage, before, pose_before)
        else:
            hidden = dr.full(mi.Bool, index == 0, height * width)
        g = frame_of(stage.scene, hits, albedo=True)
        g = g.with_motion(mi.TensorXf(dr.ravel(points.motion), (height, width, 3)), validate=False)
        if trace is not None and not now.same(traced):
            truth, traced = trace(stage.scene), now
        yield SequenceFrame(index, g, truth, mi.TensorXb(points.moves, shape), mi.TensorXb(hidden, shape), stage.scene)
        if progress is not None:
            progress(done, len(numbers))
