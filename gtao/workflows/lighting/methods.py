"""Methods of irradiance by name, and whose visibility and directions they are given."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gtao.config import (
    GTAO,
    BentNormalIrradiance,
    ClippedCone,
    ConeSH,
    EdgeAwareFilter,
    MomentZH,
    OcclusionTimesIrradiance,
    SliceMoments,
    TripleProduct,
)
from gtao.estimators import ambient_occlusion, denoise, irradiance
from gtao.gbuffer import GBuffer
from gtao.results import AmbientOcclusion

__all__ = [
    "DENSE",
    "GAME",
    "IRRADIANCE_METHODS",
    "ORDERS",
    "OURS",
    "TRACED",
    "TWINS",
    "estimates",
    "order_of",
    "projected",
    "traced_estimate",
]

#: Highest band of the light that any method takes, and the number of its coefficients.
ORDER = 4
N = (ORDER + 1) ** 2

#: Highest bands of the methods.
ORDERS = (2, ORDER)

#: Where visibility and directions come from.
TRACED, DENSE, GAME = "ray-traced visibility", "dense slices", "few slices, filtered"
#: Slices and steps per side.
DENSE_COUNTS, GAME_COUNTS = (32, 32), (3, 3)

#: What a method is given instead of the estimate's own directions or visibility.
AVERAGE_HORIZON, OPEN = "average_horizon", "open"


@dataclass(frozen=True)
class _Entry:
    method: Any
    given: str = ""


_ENTRIES = {
    "slice-moments": _Entry(SliceMoments()),
    "slice-moments-4": _Entry(SliceMoments(order=ORDER)),
    "moment-zh": _Entry(MomentZH()),
    "moment-zh-4": _Entry(MomentZH(order=4)),
    "cone-seed": _Entry(ConeSH()),
    "cone-matched": _Entry(ConeSH(aperture="matched")),
    "cone-matched-4": _Entry(ConeSH(aperture="matched", order=4)),
    "clipped-cone-seed": _Entry(ClippedCone(aperture="seed")),
    "clipped-cone": _Entry(ClippedCone()),
    "clipped-cone-4": _Entry(ClippedCone(order=4)),
    "triple-product": _Entry(TripleProduct()),
    "triple-product-4": _Entry(TripleProduct(order=4)),
    "bent-normal": _Entry(BentNormalIrradiance(order=4)),
    "bent-normal-average-horizon": _Entry(BentNormalIrradiance(order=4), AVERAGE_HORIZON),
    "occlusion": _Entry(OcclusionTimesIrradiance(order=4)),
    "unoccluded": _Entry(OcclusionTimesIrradiance(order=4), OPEN),
}

#: Name -> method of :func:`gtao.irradiance`. "bent-normal-average-horizon" is given the directions of
#: ``GTAO(bent_normal="average_horizon")``, "unoccluded" a visibility of 1.
IRRADIANCE_METHODS: Mapping[str, Any] = {name: entry.method for name, entry in _ENTRIES.items()}


#: The methods that take their harmonics from the slices.
OURS = tuple(name for name, method in IRRADIANCE_METHODS.items() if isinstance(method, SliceMoments))

#: Method with bands 3 and 4 -> the plain one, which it is under light without them. The triple product has no twin:
#: what it multiplies is cut to its order, and the product depends on that in every band.
TWINS: Mapping[str, str] = {
    name: plain
    for name, method in IRRADIANCE_METHODS.items()
    for plain, other in IRRADIANCE_METHODS.items()
    if name != plain and not isinstance(method, TripleProduct) and other == replace(method, order=2)
}


def order_of(name: str) -> int:
    """Highest band of the light that a method takes."""
    return getattr(IRRADIANCE_METHODS[name], "order", 2)


def traced_estimate(g: GBuffer, traced: Any) -> AmbientOcclusion:
    """A :class:`gtao.render.DirectionalVisibility` as if it had been estimated from the frame."""
    tensor = g.types.Tensor
    return AmbientOcclusion(
        visibility=tensor(traced.visibility.numpy()),
        mean_direction=tensor(traced.mean_direction.numpy()),
        visibility_sh=tensor(np.ascontiguousarray(traced.mean.numpy()[..., :9])),
        normal_v=g.normal_v,
    )


def estimates(g: GBuffer, radius: float, seed: int) -> dict[str, dict[str, AmbientOcclusion]]:
    """Source -> what is given -> estimate, of the sources that look at the depth buffer."""
    found = {}
    for source, (n_slices, n_steps) in ((DENSE, DENSE_COUNTS), (GAME, GAME_COUNTS)):
        options: dict[str, Any] = {"radius": radius, "n_slices": n_slices, "n_steps": n_steps, "seed": seed}
        kinds = {
            "": ambient_occlusion(g, GTAO(directional=True, **options)),
            AVERAGE_HORIZON: ambient_occlusion(g, GTAO(bent_normal=AVERAGE_HORIZON, **options)),
        }
        if source == GAME:
            kinds = {kind: denoise(ao, g, EdgeAwareFilter(passes=2)) for kind, ao in kinds.items()}
        found[source] = kinds
    return found


def projected(g: GBuffer, given: Mapping[str, AmbientOcclusion], names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Method -> (H, W, 25) harmonics of visibility times cosine as the method has them.

    Irradiance is linear in the light: these are the irradiances under each harmonic, and those under any light are
    their sums. Methods whose directions are missing are left out.
    """
    images = {}
    for name in names:
        entry = _ENTRIES[name]
        ao = _opened(given[""]) if entry.given == OPEN else given.get(entry.given)
        if ao is not None:
            images[name] = irradiance(np.eye(N), g, ao, entry.method).numpy()
    return images


def _opened(ao: AmbientOcclusion) -> AmbientOcclusion:
    return AmbientOcclusion(visibility=type(ao.visibility)(np.ones(ao.visibility.shape, np.float32)))
