"""The views that tuning compares with: frames with ray-traced truth, traced once and kept."""

import gc
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gtao import fit, io, render
from gtao.errors import ConfigError, SceneError
from gtao.gbuffer import GBuffer

from .truths import kept_truth
from .tuning_settings import TuneConfig
from .views import default_radius, open_scene

__all__ = ["View", "collect_views"]

Report = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class View:
    """One problem and where it comes from, with a hash."""

    problem: fit.Problem
    source: dict[str, Any]


def collect_views(sources: dict[str, str], config: TuneConfig, cache: Path, progress: Report | None) -> list[View]:
    """All cameras of all scenes at all radii; frames of EXR files at the radius of their truth.

    Args:
        sources: source of each scene by name, see :func:`gtao.workflows.views.scene_names`.
        config: settings.
        cache: directory of traced views; what is there is not traced again.
        progress: called as ``progress(task, done, total)``.

    Raises:
        SceneError: a scene cannot be loaded, or shows no surface.
        ImageError: a file cannot be read, or holds no truth.
        ConfigError: the truth of a file has no reach that lengths could be measured in.
    """
    views: list[View] = []
    for i, (name, source) in enumerate(sources.items()):
        if progress:
            progress("scenes", i, len(sources))
        if source.lower().endswith(".exr"):
            views.append(_of_file(name, Path(source)))
        else:
            views += _of_scene(name, source, config, cache, progress)
        gc.collect()
    if progress:
        progress("scenes", len(sources), len(sources))
    return views


def _problem(name: str, scene: str, g: GBuffer, truth: np.ndarray, variance: np.ndarray, radius: float) -> fit.Problem:
    return fit.Problem(name=name, scene=scene, g=g, truth=truth, variance=variance, radius=radius)


def _of_file(name: str, path: Path) -> View:
    g = io.read_gbuffer(path)
    truth, variance, radius = io.read_truth(path)
    if math.isinf(radius):
        raise ConfigError(f"the truth in {path} has no finite reach; render it with a --max-distance")
    return View(_problem(name, name, g, truth, variance, radius), io.file_entry(path) | {"scene": name})


def _of_scene(name: str, source: str, config: TuneConfig, cache: Path, progress: Report | None) -> Iterator[View]:
    scene, n_sensors = open_scene(source, config.resolution)
    embedded = source in render.scenes.names()
    for sensor in range(n_sensors if config.all_sensors else 1):
        g = render.gbuffer(scene, sensor, albedo=False)
        if not g.mask.numpy().any():
            raise SceneError(f"no pixel of scene {source} shows a surface; point its camera at one")
        base = config.radius or (render.scenes.get(source).radius if embedded else default_radius(g))
        fingerprint = render.fingerprint(scene, sensor)
        origin = {"path": f"embedded:{source}", "sha256": fingerprint} if embedded else io.file_entry(source)
        for factor in config.radii:
            radius = factor * base
            label = f"{name}, camera {sensor}" if n_sensors > 1 and config.all_sensors else name
            label += f", {factor:g} r" if len(config.radii) > 1 else ""

            def step(done: int, total: int, task: str = f"  {label}") -> None:
                if progress:
                    progress(task, done, total)

            given = {"radius": radius, "spp": config.spp, "seed": config.seed}
            truth, variance = kept_truth(scene, sensor, g, cache, fingerprint=fingerprint, **given, progress=step)
            problem = _problem(label, name, g, truth, variance, radius)
            yield View(problem, origin | {"scene": name, "view": fingerprint, "frame": label, "radius": radius})
