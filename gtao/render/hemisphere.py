"""Integrals over the hemisphere above every pixel's surface, by rays in independent batches."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from gtao.errors import ConfigError

from .chunks import Progress, chunks
from .primary import PrimaryHits
from .sampling import batch_key, point, stream_key
from .walk import Origins, cosine_direction, spawn, uniform_direction

__all__ = [
    "DIRECTIONS",
    "Drawn",
    "RayKind",
    "batches",
    "bent",
    "check_rays",
    "image",
    "mean_over_batches",
    "normals_v",
    "open_sums",
    "ray_sums",
]

#: How directions are drawn for each weighting of the hemisphere.
DIRECTIONS = {"cosine": cosine_direction, "uniform": uniform_direction}


def check_rays(max_distance: float, weighting: str = "cosine") -> None:
    """Raise ConfigError unless rays have a length and the hemisphere is weighted in one of the two ways."""
    if weighting not in DIRECTIONS:
        raise ConfigError(f"weighting must be 'cosine' or 'uniform', got {weighting!r}")
    if not max_distance > 0:
        raise ConfigError(f"max_distance must be positive (inf for no limit), got {max_distance}")


#: ``estimate(origins, key, n_rays)`` is one batch's (n_values, n) estimate at some of the start points.
BatchEstimate = Callable[[Origins, int, int], np.ndarray]


def batches(
    start: Origins, spp: int, n_batches: int, seed: int, estimate: BatchEstimate, progress: Progress | None = None
) -> Iterator[tuple[int, slice, np.ndarray]]:
    """Number of the batch, lanes and what is estimated of them, all batches of the same lanes in turn."""
    for chunk in chunks(len(start), n_batches, spp // n_batches, progress):
        part = start.part(chunk.start, chunk.stop)
        values = estimate(part, batch_key(seed, chunk.batch), spp // n_batches)
        yield chunk.batch, slice(chunk.start, chunk.stop), values


def mean_over_batches(
    start: Origins,
    n_values: int,
    spp: int,
    n_batches: int,
    seed: int,
    estimate: BatchEstimate,
    progress: Progress | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Mean over independent batches and the variance of that mean, (n_values, N) float64 each."""
    # Running mean and sum of squared deviations: memory does not grow with the batches, and nothing cancels.
    mean, squares = np.zeros((2, n_values, len(start)))
    for batch, lanes, values in batches(start, spp, n_batches, seed, estimate, progress):
        off = values - mean[:, lanes]
        mean[:, lanes] += off / (batch + 1)
        squares[:, lanes] += off * (values - mean[:, lanes])
    return mean, squares / (n_batches * (n_batches - 1))


def open_sums(
    scene: Any,
    start: Origins,
    key: int,
    n_samples: int,
    max_distance: float,
    draws: Sequence[Callable[[Any, Any], Any]],
    values: Callable[[Any, Any], tuple],
) -> np.ndarray:
    """Sums of ``values(direction, normal)`` over the rays that nothing blocks, one row per component: (k, N) float64.

    A sample is one ray for each of ``draws(normal, point)``, the k-th from the k-th pattern of points of the key.
    """

    def kind(pattern: int, draw: Callable[[Any, Any], Any]) -> RayKind:
        def drawn(part: Origins, points: Callable[[int], Any]) -> Drawn:
            direction = draw(part.normal, points(pattern))
            return Drawn(direction, values(direction, part.normal))

        return drawn

    kinds = [kind(pattern, draw) for pattern, draw in enumerate(draws)]
    return ray_sums(scene, start, key, n_samples, max_distance, kinds)


@dataclass
class Drawn:
    """A direction in the world, what it adds to the sums if nothing blocks it, and what it adds even so."""

    direction: Any
    if_open: tuple
    always: tuple = ()


#: ``kind(origins, points)`` draws a ray for each origin; ``points(k)`` are theirs of the k-th pattern of points.
RayKind = Callable[[Origins, Callable[[int], Any]], Drawn]


def ray_sums(
    scene: Any, start: Origins, key: int, n_samples: int, max_distance: float, kinds: Sequence[RayKind]
) -> np.ndarray:
    """Sums over ``n_samples`` rays of each kind, one row per component, ``if_open`` before ``always``: (k, N) float64.

    Every kind has the same components. Rays below the geometric surface are blocked by it.
    """
    stream = stream_key(dr.opaque(mi.UInt32, key), start.pixel)
    limit = dr.opaque(mi.UInt32, n_samples)
    reach = dr.opaque(mi.Float, max_distance)

    def more(index: Any, sums: Any) -> Any:
        return index < limit

    def body(index: Any, sums: Any) -> tuple:
        for kind in kinds:
            drawn = kind(start, lambda pattern: point(stream, mi.UInt32(pattern), index))
            ray = spawn(start.position, start.n_geo, drawn.direction)
            ray.maxt = reach
            above = dr.dot(drawn.direction, start.n_geo) > 0
            visible = above & ~scene.ray_test(ray, coherent=False, active=above)
            terms = (*(dr.select(visible, term, 0) for term in drawn.if_open), *drawn.always)
            sums = [total + term for total, term in zip(sums, terms, strict=True)]
        return index + 1, sums

    n = len(start)
    # Drawn once outside of the loop, for the number of components and their types.
    sample = kinds[0](start, lambda _: mi.Point2f(0.5))
    zeros = [dr.zeros(type(term), n) for term in (*sample.if_open, *sample.always)]
    _, sums = dr.while_loop((dr.zeros(mi.UInt32, n), zeros), more, body, labels=("index", "sums"))
    dr.eval(sums)
    dr.sync_thread()
    return np.concatenate([np.atleast_2d(total.numpy()).astype(np.float64) for total in sums])


def image(values: np.ndarray, start: Origins, shape: tuple[int, int], background: Any = 0.0) -> np.ndarray:
    """Image (H, W, …) of values (…, N) at the start points."""
    result = np.empty((*shape, *values.shape[:-1]), dtype=np.float32)
    result[...] = background
    result.reshape(-1, *values.shape[:-1])[start.pixel.numpy()] = np.moveaxis(values, -1, 0)
    return result


def normals_v(start: Origins, hits: PrimaryHits) -> np.ndarray:
    """(H, W, 3) image of the normals that directions are drawn about, in the view frame; +z on the background."""
    normal = hits.view_to_world[:3, :3].T @ start.normal.numpy().astype(np.float64)
    return image(normal, start, hits.camera.shape, (0, 0, 1))


def bent(mean_direction: np.ndarray, normal_v: np.ndarray) -> np.ndarray:
    """Unit mean directions (H, W, 3), the normal where nothing is visible."""
    length = np.linalg.norm(mean_direction, axis=-1, keepdims=True)
    return np.where(length > 0, mean_direction / np.where(length > 0, length, 1), normal_v)
