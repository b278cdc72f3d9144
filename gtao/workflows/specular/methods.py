"""Methods of specular occlusion by name, and whose visibility and directions they are given."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from gtao import render
from gtao.config import (
    GTAO,
    ConeBRDF,
    ConeCone,
    ConeLobe,
    ConeTable,
    EdgeAwareFilter,
    Lagarde2014,
    Pipeline,
    VisibilityAsSpecular,
)
from gtao.data import specular as data
from gtao.estimators import ambient_occlusion, denoise, specular_occlusion
from gtao.gbuffer import GBuffer
from gtao.results import AmbientOcclusion
from gtao.tables import bake
from gtao.workflows.views import View

__all__ = [
    "DENSE",
    "EXACT",
    "GAME",
    "RECOMMENDED",
    "SPECULAR_METHODS",
    "TRACED",
    "Given",
    "method_of",
    "occlusion_of",
    "screen_estimates",
    "traced_estimates",
]

#: Where visibility and directions come from.
TRACED, DENSE, GAME = "ray-traced visibility", "dense slices", "few slices, filtered"
RECOMMENDED = "recommended pipeline"
#: Slices and steps per side.
DENSE_COUNTS, GAME_COUNTS = (32, 32), (3, 3)

#: Texels along each axis of tables that do not come with the package.
SIZE = 32

#: Weighting -> estimate.
Given = Mapping[str, AmbientOcclusion]


@dataclass(frozen=True)
class _Entry:
    """A method, the weighting of the estimate that it is given, and the kind of its table if it is not the default."""

    method: Any
    weighting: str = "cosine"
    table: str = ""


#: The method that sums up the BRDF over the cone.
EXACT = "cone-brdf"

#: u of the reflection cone that makes images look most alike, cones being those of uniform weighting:
#: fits/aperture/2026-11, "uniform".
REFIT_U = 2.4e-07

_SEED: dict[str, Any] = {"aperture": "seed"}
_ENTRIES = {
    EXACT: _Entry(ConeBRDF(**_SEED), "uniform"),
    "brdf-4d": _Entry(ConeTable(**_SEED), "uniform"),
    "brdf-4d-tilted": _Entry(ConeTable(aperture="tilted")),
    "brdf-4d-matched": _Entry(ConeTable(aperture="matched")),
    "brdf-4d-published": _Entry(ConeTable(**_SEED)),
    "brdf-5d": _Entry(ConeTable(**_SEED), "uniform", "brdf-5d"),
    "brdf-3d": _Entry(ConeTable(**_SEED), "uniform", "brdf-3d"),
    "cone-lobe": _Entry(ConeLobe(**_SEED), "uniform"),
    "cone-lobe-phong": _Entry(ConeLobe(distribution="phong", **_SEED), "uniform"),
    "cone-cone": _Entry(ConeCone(**_SEED), "uniform"),
    "cone-cone-published": _Entry(ConeCone(**_SEED)),
    "cone-cone-refit": _Entry(ConeCone(u=REFIT_U, **_SEED), "uniform"),
    "cone-cone-oat": _Entry(ConeCone(intersection="oat", **_SEED), "uniform"),
    "cone-cone-drobot": _Entry(ConeCone(reflection="drobot", **_SEED), "uniform"),
    "cone-cone-uludag": _Entry(ConeCone(reflection="uludag", **_SEED), "uniform"),
    "lagarde": _Entry(Lagarde2014()),
    "visibility": _Entry(VisibilityAsSpecular()),
    "unoccluded": _Entry(None),
}

#: Name -> method of :func:`gtao.specular_occlusion`; None stands for an occlusion of 1.
SPECULAR_METHODS: Mapping[str, Any] = {name: entry.method for name, entry in _ENTRIES.items()}


def method_of(name: str) -> Any:
    """The method of a name, with its table; None stands for an occlusion of 1."""
    entry = _ENTRIES[name]
    return replace(entry.method, table=_table(entry.table)) if entry.table else entry.method


@cache
def _table(kind: str) -> data.SpecularTable:
    """The one that comes with the package, or else a new one."""
    return data.shipped(kind) if kind in data.SHIPPED else bake(kind, SIZE)


def occlusion_of(name: str, g: GBuffer, given: Given, roughness: float, f0: float) -> np.ndarray:
    """(H, W) specular occlusion as a method has it."""
    method = method_of(name)
    if method is None:
        return np.ones(g.shape, np.float32)
    return specular_occlusion(given[_ENTRIES[name].weighting], g, roughness, f0, method).numpy()


def traced_estimates(view: View, spp: int, seeds: Sequence[int]) -> dict[str, AmbientOcclusion]:
    """Weighting -> ray-traced visibility and directions as if they had been estimated from the frame."""
    tensor = view.g.types.Tensor
    found = {}
    for weighting, seed in zip(("cosine", "uniform"), seeds, strict=True):
        given = {"sensor": view.sensor, "weighting": weighting, "n_batches": 2}
        traced = render.visibility(view.scene, view.g, view.radius, spp, seed, **given)
        found[weighting] = AmbientOcclusion(
            visibility=tensor(traced.mean.numpy()),
            mean_direction=tensor(traced.mean_direction.numpy()),
            normal_v=view.g.normal_v,
            config=GTAO(radius=view.radius, weighting=weighting, bent_normal=True),
        )
    return found


def screen_estimates(view: View, seed: int) -> dict[str, dict[str, AmbientOcclusion]]:
    """Source -> weighting -> estimate, of the sources that look at the depth buffer."""
    found = {}
    for source, (n_slices, n_steps) in ((DENSE, DENSE_COUNTS), (GAME, GAME_COUNTS)):
        options: dict[str, Any] = {"radius": view.radius, "n_slices": n_slices, "n_steps": n_steps, "seed": seed}
        found[source] = {}
        for weighting in ("cosine", "uniform"):
            ao = ambient_occlusion(view.g, GTAO(weighting=weighting, bent_normal=True, **options))
            found[source][weighting] = denoise(ao, view.g, EdgeAwareFilter(passes=2)) if source == GAME else ao
    if math.isfinite(view.radius):  # which that pipeline is made for
        pipeline = Pipeline.recommended(view.radius, bent_normal=True)
        found[RECOMMENDED] = {
            weighting: replace(pipeline, occlusion=replace(pipeline.occlusion, weighting=weighting)).step(view.g)
            for weighting in ("cosine", "uniform")
        }
    return found
