"""The frames of an animation with their ray-traced truth, one at a time."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gtao import render
from gtao.gbuffer import GBuffer
from gtao.workflows.truths import kept_truth

from .settings import AnimateConfig
from .sources import Source

__all__ = ["Frame", "frames"]

Step = Callable[[str], Callable[[int, int], None]]


@dataclass(frozen=True, eq=False)
class Frame:
    """What methods see of one frame, and what is true.

    Attributes:
        index: from 0.
        view: fingerprint of scene and camera.
        g: the frame.
        truth, variance: (H, W) ray-traced visibility and the variance of its mean.
        mask: (H, W) pixels that show a surface.
        motion: (H, W, 3) from the frame before.
        disoccluded: (H, W) pixels whose point was not visible in the frame before; None in the first.
        radius: reach of occluders in scene units.
    """

    index: int
    view: str
    g: GBuffer
    truth: np.ndarray
    variance: np.ndarray
    mask: np.ndarray
    motion: np.ndarray | None
    disoccluded: np.ndarray | None
    radius: float


def frames(
    source: Source, config: AnimateConfig, radius: float, views: list[str], cache: Path, tasks: Step
) -> Iterator[Frame]:
    """The frames that are still to be made.

    Args:
        source: the animation.
        config: settings.
        radius: reach of occluders in scene units.
        views: fingerprints of the frames that are there already.
        cache: directory of truths. All have the same random numbers: what stands still is traced once.
        tasks: makes the progress of a task.
    """
    if len(views) >= source.n_frames:
        return
    for frame in render.sequence(source.animation, range(len(views), source.n_frames)):
        view = render.fingerprint(frame.scene)
        truth, variance = kept_truth(
            frame.scene,
            0,
            frame.g,
            cache,
            fingerprint=view,
            radius=radius,
            spp=config.spp,
            seed=config.seed,
            progress=tasks("  truth"),
        )
        yield Frame(
            index=frame.index,
            view=view,
            g=frame.g,
            truth=truth,
            variance=variance,
            mask=frame.g.mask.numpy(),
            motion=None if frame.g.motion is None else frame.g.motion.numpy(),
            # Of the first frame, all is new, and nothing has been covered.
            disoccluded=frame.disoccluded.numpy() if frame.index else None,
            radius=radius,
        )
