"""Views of scenes, with what rays say of them before any light is known."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gtao import render
from gtao.errors import SceneError
from gtao.gbuffer import GBuffer
from gtao.workflows.comparison.frames import origin, reach, sources
from gtao.workflows.views import open_scene

from .methods import ORDER, TRACED, estimates, projected, traced_estimate
from .settings import CompareLightingConfig

__all__ = ["LightingFrame", "Tasks", "scene_sources", "views_of"]

#: Task -> function that takes (done, total) of it.
Tasks = Callable[[str], Callable[[int, int], None]]

#: Independent runs of rays: two for the truth, two for the visibility that methods are given.
RUNS = 4
#: Batches of a run: its noise comes from the other run, not from them.
N_BATCHES = 2


@dataclass(frozen=True, eq=False)
class LightingFrame:
    """One view.

    Attributes:
        name: scene and camera.
        source: where it comes from, with hashes.
        scene, sensor: for further rays.
        g: the frame, with albedo.
        mask: (H, W) pixels that show a surface.
        radius: reach of occluders in scene units.
        up: axis that points upward.
        truths: two independent (n_pixels, 25) ray-traced harmonics of visibility times cosine, of the masked pixels.
        harmonics: source of visibility -> method -> the same as the method has them: two independent runs, or one array
            twice where nothing is random.
    """

    name: str
    source: dict[str, Any]
    scene: Any
    sensor: int
    g: GBuffer
    mask: np.ndarray
    radius: float
    up: str
    truths: tuple[np.ndarray, np.ndarray]
    harmonics: Mapping[str, Mapping[str, tuple[np.ndarray, np.ndarray]]]


def scene_sources(config: CompareLightingConfig) -> dict[str, str]:
    """Name -> source of every scene.

    Raises:
        SceneError: a source is given twice, a folder holds no scene, or a source is an image, whose light is unknown.
    """
    found = sources(config.scenes)
    images = [source for source in found.values() if source.lower().endswith(".exr")]
    if images:
        raise SceneError(f"{images[0]} is an image; light is traced through scenes: give the scene that it shows")
    return found


def views_of(name: str, source: str, config: CompareLightingConfig, tasks: Tasks) -> Iterator[LightingFrame]:
    """The frames of one scene, one per camera.

    Raises:
        SceneError: the scene cannot be loaded, or shows no surface.
    """
    scene, n_sensors = open_scene(source, config.resolution)
    for sensor in range(n_sensors if config.all_sensors else 1):
        label = name if n_sensors == 1 or not config.all_sensors else f"{name}, camera {sensor}"
        yield _frame(scene, sensor, label, name, source, config, tasks)


def _frame(
    scene: Any, sensor: int, label: str, name: str, source: str, config: CompareLightingConfig, tasks: Tasks
) -> LightingFrame:
    g = render.gbuffer(scene, sensor)
    mask = g.mask.numpy()
    if not mask.any():
        raise SceneError(f"no pixel of scene {source} shows a surface; point its camera at one")
    radius = reach(source, g, config.radius_of(name))
    progress = tasks(f"  {label}: rays")
    progress(0, RUNS)
    runs = []
    for run in range(RUNS):
        spp, seed = config.spp // 2, (config.seed + run) % 2**32
        traced = render.directional(scene, g, radius, spp, seed, order=ORDER, sensor=sensor, n_batches=N_BATCHES)
        runs.append(traced)
        progress(run + 1, RUNS)
    harmonics: dict[str, dict[str, tuple[np.ndarray, np.ndarray]]] = {}
    a, b = (projected(g, {"": traced_estimate(g, run)}, config.names) for run in runs[2:])
    harmonics[TRACED] = {method: (a[method][mask], b[method][mask]) for method in a}
    for kind, given in estimates(g, radius, config.seed).items():
        once = {method: image[mask] for method, image in projected(g, given, config.names).items()}
        harmonics[kind] = {method: (image, image) for method, image in once.items()}
    embedded = source in render.scenes.names()
    return LightingFrame(
        name=label,
        source=origin(scene, sensor, source) | {"frame": label},
        scene=scene,
        sensor=sensor,
        g=g,
        mask=mask,
        radius=radius,
        up=config.up_of(name, "z" if embedded else "y"),
        truths=(runs[0].mean.numpy()[mask], runs[1].mean.numpy()[mask]),
        harmonics=harmonics,
    )
