"""Views of scenes, with what rays and the depth buffer say of their glossy reflections under a white dome."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gtao import render
from gtao.workflows.views import View, scene_views

from .methods import TRACED, Given, screen_estimates, traced_estimates

__all__ = ["RUNS", "GlossyFrame", "Tasks", "glossy_frames"]

#: Task -> function that takes (done, total) of it.
Tasks = Callable[[str], Callable[[int, int], None]]

#: Seeds of a frame: two runs of rays for the truth of every roughness, two pairs for the visibility methods are given.
RUNS = 6
#: Batches of a run: its noise comes from the other run, not from them.
N_BATCHES = 2


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


def glossy_frames(
    name: str,
    source: str,
    *,
    resolution: int | None,
    all_sensors: bool,
    radius: float | None,
    roughness: Sequence[float],
    f0: float,
    spp: int,
    seed: int,
    tasks: Tasks,
) -> Iterator[GlossyFrame]:
    """The frames of one scene, one per camera.

    Raises:
        SceneError: the scene cannot be loaded, or shows no surface.
    """
    for view in scene_views(name, source, resolution, all_sensors=all_sensors, radius=radius, albedo=False):
        progress = tasks(f"  {view.name}: rays")
        total, done = 2 * len(roughness) + 2, 0
        truths = {}
        for value in roughness:
            pair = []
            for run in range(2):
                progress(done, total)
                traced = render.specular(
                    view.scene, view.g, value, f0, view.radius, spp // 2, (seed + run) % 2**32, sensor=view.sensor,
                    n_batches=N_BATCHES,
                )  # fmt: skip
                pair.append(traced.occlusion.mean.numpy().astype(np.float64))
                done += 1
            truths[value] = (pair[0], pair[1])
        rays = []
        for run in range(2):
            progress(done, total)
            rays.append(traced_estimates(view, spp // 2, seed + 2 + 2 * run))
            done += 1
        progress(done, total)
        given: dict[str, tuple[Given, ...]] = {TRACED: (rays[0], rays[1])}
        given |= {kind: (estimates,) for kind, estimates in screen_estimates(view, seed).items()}
        yield GlossyFrame(view, truths, given)
