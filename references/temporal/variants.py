"""The pipelines that are compared: the published one, each of its stages switched off or exchanged, and its limits."""

from dataclasses import replace
from typing import get_args

import numpy as np

import gtao
from gtao.config.slices import Noise

PUBLISHED = "published"
#: Frames after which the slides' tables have been gone through.
CYCLE = 24
#: Directions that sixteen pixels and six frames are said to make.
DIRECTIONS = 96
#: Patterns without directions enough: none at all, and the slides' formula as it was printed.
LEFT_OUT = ("none", "spatial_4x4_unbracketed")


def published(radius):
    return gtao.Pipeline.as_published(radius=radius)


def stages(radius):
    """Name -> pipeline: the published one, and with one stage switched off or exchanged."""
    whole = published(radius)
    spread = replace(whole.occlusion, noise="spatial_4x4_spread")
    return {
        PUBLISHED: whole,
        "96 directions": replace(whole, occlusion=spread),
        "no spatial filter": replace(whole, spatial=None),
        "no temporal filter": replace(whole, temporal=None),
        "full resolution": replace(whole, downsample=None, upsample=None),
        "no clamp": replace(whole, temporal=replace(whole.temporal, clamp=False)),
        "spatial filter without derivatives": replace(whole, spatial=gtao.SpatialFilter(derivatives="none")),
        "plane-aware filter": replace(whole, spatial=gtao.PlaneAwareFilter()),
        "bilinear upsampling": replace(whole, upsample=gtao.BilinearUpsample()),
        "plane-aware upsampling": replace(whole, upsample=gtao.PlaneAwareUpsample()),
        "plane-aware filter and upsampling": replace(
            whole, spatial=gtao.PlaneAwareFilter(), upsample=gtao.PlaneAwareUpsample()
        ),
    }


def singles(radius):
    """Name -> pipeline that takes 96 directions in every frame, which it forgets."""
    whole = published(radius)
    many = replace(whole, occlusion=replace(whole.occlusion, n_slices=DIRECTIONS), temporal=None)
    return {
        "half resolution": replace(many, spatial=None),
        "half resolution, filtered": many,
        "full resolution": replace(many, spatial=None, downsample=None, upsample=None),
    }


def patterns(radius, clamp):
    """Noise pattern -> the published pipeline with it, with or without the clamp."""
    whole = published(radius)
    whole = replace(whole, temporal=replace(whole.temporal, clamp=clamp))
    names = [name for name in get_args(Noise) if name not in LEFT_OUT]
    return {name: replace(whole, occlusion=replace(whole.occlusion, noise=name)) for name in names}


def clamps(radius):
    """Name -> pipeline: what keeps ghosts out, switched off in turn."""
    whole = published(radius)

    def clamped(**changes):
        return replace(whole, temporal=replace(whole.temporal, **changes))

    return {
        "no temporal filter": replace(whole, temporal=None),
        "no clamp": clamped(clamp=False),
        "clamp, closed window": clamped(clamp_window=0.0),
        "clamp, open window": clamped(velocity_weighting=False),
        PUBLISHED: whole,
        "window of small speeds": clamped(velocity_scale_px=0.25),
        "no clamp, no depth test": clamped(clamp=False, disocclusion=1e6),
        "no spatial filter": replace(whole, spatial=None),
    }


def windows(radius, widths):
    """Width of the clamp's window -> pipeline, the window open everywhere."""
    whole = published(radius)
    return {
        f"{width:g}": replace(whole, temporal=replace(whole.temporal, velocity_weighting=False, clamp_window=width))
        for width in widths
    }


def without_past(pipeline, n_slices):
    """The pipeline whose frames stand alone and have directions enough: what a filter in time is to converge to."""
    occlusion = replace(pipeline.occlusion, n_slices=n_slices, step_jitter="pixel")
    return replace(pipeline, occlusion=occlusion, temporal=None)


def mean_of(pipeline, g, frames):
    """Mean of the results of some frames, each on its own; (H, W)."""
    return np.mean([pipeline.step(g, frame_index=i).visibility.numpy().astype(float) for i in frames], axis=0)


def limits(pipeline, g):
    """What unfiltered estimates of a pipeline's resolution are the mean of, (H, W) each.

    "limit": 96 directions at the offsets that the pattern has in a cycle. "jittered": offsets that are even in [0, 1).
    "all samples": 128 samples per direction, which eight are to stand for.
    """
    bare = replace(pipeline, spatial=None, temporal=None)
    many = without_past(bare, DIRECTIONS)
    jittered = replace(many, occlusion=replace(many.occlusion, noise="white", step_jitter="slice"))
    dense = replace(many, occlusion=replace(many.occlusion, noise="none", n_steps=128))
    return {
        "limit": mean_of(many, g, range(CYCLE)),
        "jittered": mean_of(jittered, g, range(16)),
        "all samples": mean_of(dense, g, range(1)),
    }
