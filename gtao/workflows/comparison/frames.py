"""Frames with ray-traced truth: rendered from scenes, or read from files."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gtao import io, render
from gtao.errors import ConfigError, SceneError
from gtao.gbuffer import GBuffer
from gtao.workflows.views import open_scene, scene_names

from .settings import CompareConfig

__all__ = ["Frame", "default_radius", "frames", "origin", "reach", "sources"]


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


def sources(given: Sequence[str]) -> dict[str, str]:
    """Name -> source of every scene; folders stand for the scenes and EXR files in them, and */scene.xml below.

    Raises:
        SceneError: a folder holds none, or a source is given twice.
    """
    found: list[str] = []
    for source in given:
        folder = Path(source)
        if source in render.scenes.names() or not folder.is_dir():
            found.append(source)
            continue
        inside = sorted(str(path) for pattern in ("*.xml", "*/scene.xml", "*.exr") for path in folder.glob(pattern))
        if not inside:
            raise SceneError(f"folder {source} holds no .xml scene and no .exr frame")
        found += inside
    return scene_names(found or render.scenes.names("procedural"))


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
    scene, n_sensors = open_scene(source, config.resolution)
    for sensor in range(n_sensors if config.all_sensors else 1):
        label = name if n_sensors == 1 or not config.all_sensors else f"{name}, camera {sensor}"
        yield _render(scene, sensor, label, source, config, progress)


def default_radius(g: GBuffer) -> float:
    """A tenth of the frame's height at the median depth, to two digits."""
    z = g.view_z.numpy()[g.mask.numpy()]
    height = g.shape[0] / g.camera.fy
    radius = 0.1 * height * (1.0 if g.camera.is_orthographic else float(np.median(z)))
    digits = 1 - math.floor(math.log10(radius))
    return round(radius, digits)


def reach(source: str, g: GBuffer, given: float | None) -> float:
    """Radius for a frame: the given one, the embedded scene's own, or :func:`default_radius`."""
    if given is not None:
        return given
    return render.scenes.get(source).radius if source in render.scenes.names() else default_radius(g)


def origin(scene: Any, sensor: int, source: str) -> dict[str, Any]:
    """What a record says of a view: where its scene comes from, with hashes of that and of what the camera sees."""
    view = render.fingerprint(scene, sensor)
    embedded = source in render.scenes.names()
    entry = {"path": f"embedded:{source}", "sha256": view} if embedded else io.file_entry(source)
    return entry | {"view": view}


def _render(scene: Any, sensor: int, name: str, source: str, config: CompareConfig, progress: Any) -> Frame:
    g = render.gbuffer(scene, sensor, albedo=False)
    mask = g.mask.numpy()
    if not mask.any():
        raise SceneError(f"no pixel of scene {source} shows a surface; point its camera at one")
    radius = reach(source, g, config.radius)
    guard_px = math.ceil(config.guard * max(g.shape))
    wide = render.gbuffer(scene, sensor, albedo=False, guard_px=guard_px) if guard_px else None
    truth = render.visibility(
        scene, g, radius, config.spp, config.seed, sensor=sensor, bent_normal=False, progress=progress
    )
    return Frame(
        name=name,
        source=origin(scene, sensor, source),
        g=g,
        wide=wide,
        guard_px=guard_px,
        truth=truth.mean.numpy(),
        variance=truth.variance.numpy(),
        mask=mask,
        radius=radius,
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
