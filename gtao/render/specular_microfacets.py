"""GGX microfacets that reflect to the viewer: rays by their visible normals or by a light, and what they count for."""

from collections.abc import Callable, Mapping
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .environment import light_density, radiance
from .hemisphere import Drawn, RayKind, image
from .specular_hemisphere import hemisphere_terms
from .specular_lobe import Lobe
from .specular_origins import Seen
from .specular_result import Pair, Terms
from .specular_sums import Reflection, controlled

__all__ = ["balanced", "light_direction", "microfacets"]


def microfacets(start: Seen, shape: tuple[int, int], f0: Any, light: Any = None) -> Reflection:
    """Reflection by microfacets of the width of each start point, under the white dome and under a light."""
    whole = np.zeros((2, 0))
    if len(start):
        whole = np.stack([term.numpy() for term in hemisphere_terms(start.wo.z, start.alpha)])

    def pairs(values: np.ndarray, lanes: slice) -> np.ndarray:
        open_, every = values.reshape(*values.shape[:2], -1, 2, values.shape[-1]).swapaxes(0, 1)
        visible = controlled(open_[:, :1], every[:, :1], whole[:, lanes])
        return np.concatenate([visible, open_[:, 1:], every[:, 1:]], 1)

    def results(found: Pair) -> Mapping[str, Any]:
        def part(which: Any) -> Pair:
            return Pair(found.mean[:, :, which], found.covariance[:, :, which])

        terms = Terms(
            visible=part(0),
            hemisphere=image(whole, start, shape),
            mask=image(np.ones(len(start)), start, shape) > 0,
            radiance=None if light is None else part(slice(1, 4)),
            unoccluded=None if light is None else part(slice(4, 7)),
        )
        return {**terms.estimates(f0), "terms": terms, "f0": f0}

    return Reflection(_rays(light), 1 if light is None else 7, pairs, results)


def _rays(light: Any) -> list[RayKind]:
    """Counted as (a, b), and of a light (a L, b L) of red, green and blue."""

    def by_normals(start: Seen, points: Callable[[int], Any]) -> Drawn:
        lobe = Lobe(start.wo, start.alpha)
        wi = lobe.sample(points(0))
        direction, weights = start.frame.to_world(wi), lobe.weights(wi)
        if light is None:
            return Drawn(direction, weights, weights)
        share = balanced(lobe.density(wi), light, direction)
        terms = (*weights, *_times(weights, share * radiance(light, direction)))
        return Drawn(direction, terms, terms)

    def by_light(start: Seen, points: Callable[[int], Any]) -> Drawn:
        direction = light_direction(light, points(1))
        lobe, wi = Lobe(start.wo, start.alpha), start.frame.to_local(direction)
        share = balanced(lobe.density(wi), light, direction)
        zero = dr.zeros(mi.Float)
        terms = (zero, zero, *_times(lobe.weights(wi), share * radiance(light, direction)))
        return Drawn(direction, terms, terms)

    return [by_normals] if light is None else [by_normals, by_light]


def balanced(density: Any, light: Any, direction: Any) -> Any:
    """Share of a density in its sum with the light's own, the weight of the balance heuristic."""
    total = density + light_density(light, direction)
    # Nothing can be drawn from a black map: its density is NaN.
    return dr.select(total > 0, density / total, 0)


def light_direction(light: Any, sample: Any) -> Any:
    """Unit direction in the world to a light far away, by its own density; any direction to a black one."""
    direction = light.sample_direction(dr.zeros(mi.Interaction3f), sample)[0].d
    return dr.select(dr.isfinite(direction.x), direction, mi.Vector3f(0, 0, 1))


def _times(weights: tuple[Any, Any], colour: Any) -> tuple:
    return tuple(weight * channel for channel in colour for weight in weights)
