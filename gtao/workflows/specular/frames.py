"""Views of scenes, with what rays and the depth buffer say of their glossy reflections under a white dome."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Protocol

import numpy as np

from gtao import render
from gtao.workflows.views import View, scene_views, value_of

from .methods import TRACED, Given, screen_estimates, traced_estimates

__all__ = ["RUNS", "GlossyFrame", "Settings", "Tasks", "glossy_frames"]

#: Task -> function that takes (done, total) of it.
Tasks = Callable[[str], Callable[[int, int], None]]

#: Seeds of a frame: two runs of rays for the truth of every roughness, two pairs for the visibility methods are given.
RUNS = 6
#: Batches of a run: its noise comes from the other run, not from them.
N_BATCHES = 2


class Settings(Protocol):
    """What the settings of every study of glossy reflections have."""

    @property
    def roughness(self) -> tuple[float, ...]: ...
    @property
    def f0(self) -> float: ...
    @property
    def radius(self) -> float | Mapping[str, float] | None: ...
    @property
    def resolution(self) -> int: ...
    @property
    def spp(self) -> int: ...
    @property
    def all_sensors(self) -> bool: ...
    @property
    def seed(self) -> int: ...


@dataclass(frozen=True, eq=False)
class GlossyFrame:
    """One view.

    Attributes:
        view: the view.
        truths: roughness -> two independent (H, W) ray-traced specular occlusions.
        given: source of visibility -> weighting -> estimate; two independent runs where it is traced, else one.
    """

    view: View
    truths: Mapping[float, tuple[np.ndarray, np.ndarray]]
    given: Mapping[str, tuple[Given, ...]]


def glossy_frames(name: str, source: str, config: Settings, tasks: Tasks) -> Iterator[GlossyFrame]:
    """The frames of one scene, one per camera.

    Raises:
        SceneError: the scene cannot be loaded, or shows no surface.
    """
    given = {"all_sensors": config.all_sensors, "radius": value_of(config.radius, name)}
    for view in scene_views(name, source, config.resolution, **given, albedo=False):
        yield _frame(view, config, tasks(f"  {view.name}: rays"))


def _frame(view: View, config: Settings, progress: Callable[[int, int], None]) -> GlossyFrame:
    half, total = config.spp // 2, 2 * len(config.roughness) + 2
    seeds = [(config.seed + run) % 2**32 for run in range(RUNS)]
    images: dict[float, list[np.ndarray]] = {value: [] for value in config.roughness}
    for done, (value, run) in enumerate(product(config.roughness, range(2))):
        progress(done, total)
        given = {"sensor": view.sensor, "n_batches": N_BATCHES}
        traced = render.specular(view.scene, view.g, value, config.f0, view.radius, half, seeds[run], **given)
        images[value].append(traced.occlusion.mean.numpy().astype(np.float64))
    rays = []
    for run in range(2):
        progress(total - 2 + run, total)
        rays.append(traced_estimates(view, half, seeds[2 + 2 * run : 4 + 2 * run]))
    progress(total, total)
    sources: dict[str, tuple[Given, ...]] = {TRACED: (rays[0], rays[1])}
    sources |= {kind: (estimates,) for kind, estimates in screen_estimates(view, config.seed).items()}
    return GlossyFrame(view, {value: (a, b) for value, (a, b) in images.items()}, sources)
