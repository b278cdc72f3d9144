"""Frames with ray-traced truth: rendered from scenes, or read from files."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gtao import io, render
from gtao.errors import ConfigError
from gtao.gbuffer import GBuffer
from gtao.workflows.views import View, scene_views

from .settings import CompareConfig

__all__ = ["Frame", "frames"]


@dataclass(frozen=True, eq=False)
class Frame:
    """One view: what methods see, and what is true.

    Attributes:
        name: scene and camera.
        source: where it comes from, with a hash.
        g: the frame.
        wide: the same frame with a guard band of ``guard_px`` pixels on every side, or None.
        truth, variance: (H, W) ray-traced visibility and the variance of its mean.
        mask: (H, W) pixels that show a surface.
        radius: reach of occluders in scene units.
    """

    name: str
    source: dict[str, Any]
    g: GBuffer
    wide: GBuffer | None
    guard_px: int
    truth: np.ndarray
    variance: np.ndarray
    mask: np.ndarray
    radius: float

    def inner(self, image: np.ndarray) -> np.ndarray:
        """The part of an image of the wide frame that belongs to the frame."""
        n = self.guard_px
        return image[n : image.shape[0] - n, n : image.shape[1] - n]


def frames(name: str, source: str, config: CompareConfig, progress: Any) -> Iterator[Frame]:
    """The frames of one source: one per camera, or one per file.

    Raises:
        SceneError: the scene cannot be loaded, or shows no surface.
        ImageError: the file cannot be read, or holds no ray-traced visibility.
        ConfigError: the settings name another radius than the truth of the file has.
    """
    if source.lower().endswith(".exr"):
        yield _from_exr(name, Path(source), config)
        return
    given = {"all_sensors": config.all_sensors, "radius": config.radius}
    for view in scene_views(name, source, config.resolution, **given, albedo=False):
        yield _render(view, config, progress)


def _render(view: View, config: CompareConfig, progress: Any) -> Frame:
    guard_px = math.ceil(config.guard * max(view.g.shape))
    wide = render.gbuffer(view.scene, view.sensor, albedo=False, guard_px=guard_px) if guard_px else None
    truth = render.visibility(
        view.scene, view.g, view.radius, config.spp, config.seed, sensor=view.sensor, bent_normal=False,
        progress=progress,
    )  # fmt: skip
    return Frame(
        name=view.name,
        source=view.source,
        g=view.g,
        wide=wide,
        guard_px=guard_px,
        truth=truth.mean.numpy(),
        variance=truth.variance.numpy(),
        mask=view.mask,
        radius=view.radius,
    )


def _from_exr(name: str, path: Path, config: CompareConfig) -> Frame:
    g = io.read_gbuffer(path)
    truth, variance, radius = io.read_truth(path)
    if config.radius is not None and not math.isclose(config.radius, radius, rel_tol=1e-6):
        raise ConfigError(
            f"the truth in {path} was traced with occluders up to {radius:g} away, not {config.radius:g};"
            " leave the radius out, or render the truth anew with that max-distance"
        )
    return Frame(
        name=name,
        source=io.file_entry(path),
        g=g,
        wide=None,
        guard_px=0,
        truth=truth,
        variance=variance,
        mask=g.mask.numpy(),
        radius=radius,
    )
