"""Views of scenes, with what rays say of them before any light is known."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from gtao import render
from gtao.workflows.views import View, scene_views

from .methods import ORDER, TRACED, estimates, projected, traced_estimate
from .settings import CompareLightingConfig

__all__ = ["LightingFrame", "Tasks", "frames_of"]

#: Task -> function that takes (done, total) of it.
Tasks = Callable[[str], Callable[[int, int], None]]

#: Independent runs of rays: two for the truth, two for the visibility that methods are given.
RUNS = 4
#: Batches of a run: its noise comes from the other run, not from them.
N_BATCHES = 2


@dataclass(frozen=True, eq=False)
class LightingFrame:
    """One view under no light yet.

    Attributes:
        view: the view, its frame with albedo.
        up: axis that points upward.
        truths: two independent (n_pixels, 25) ray-traced harmonics of visibility times cosine, of the masked pixels.
        harmonics: source of visibility -> method -> the same as the method has them: two independent runs, or one array
            twice where nothing is random.
    """

    view: View
    up: str
    truths: tuple[np.ndarray, np.ndarray]
    harmonics: Mapping[str, Mapping[str, tuple[np.ndarray, np.ndarray]]]


def frames_of(name: str, source: str, config: CompareLightingConfig, tasks: Tasks) -> Iterator[LightingFrame]:
    """The frames of one scene, one per camera.

    Raises:
        SceneError: the scene cannot be loaded, or shows no surface.
    """
    up = config.up_of(name, "z" if source in render.scenes.names() else "y")
    given = {"all_sensors": config.all_sensors, "radius": config.radius_of(name)}
    for view in scene_views(name, source, config.resolution, **given):
        yield _frame(view, up, config, tasks)


def _frame(view: View, up: str, config: CompareLightingConfig, tasks: Tasks) -> LightingFrame:
    g, mask = view.g, view.mask
    progress = tasks(f"  {view.name}: rays")
    progress(0, RUNS)
    runs = []
    for run in range(RUNS):
        spp, seed, given = config.spp // 2, (config.seed + run) % 2**32, {"order": ORDER, "n_batches": N_BATCHES}
        runs.append(render.directional(view.scene, g, view.radius, spp, seed, sensor=view.sensor, **given))
        progress(run + 1, RUNS)
    harmonics: dict[str, dict[str, tuple[np.ndarray, np.ndarray]]] = {}
    a, b = (projected(g, {"": traced_estimate(g, run)}, config.names) for run in runs[2:])
    harmonics[TRACED] = {method: (a[method][mask], b[method][mask]) for method in a}
    for kind, given in estimates(g, view.radius, config.seed).items():
        once = {method: image[mask] for method, image in projected(g, given, config.names).items()}
        harmonics[kind] = {method: (image, image) for method, image in once.items()}
    truths = (runs[0].mean.numpy()[mask], runs[1].mean.numpy()[mask])
    return LightingFrame(view=view, up=up, truths=truths, harmonics=harmonics)
