"""Ray-traced visibility, the reference that every estimator is measured against."""

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from gtao import display
from gtao.errors import ConfigError

from .chunks import Progress, chunks
from .loading import select_sensor
from .primary import check_normals, shoot
from .sampling import batch_key, check_sampling, point, stream_key
from .variant import ensure_variant
from .walk import Origins, origins, spawn

__all__ = ["Visibility", "visibility"]


@dataclass(frozen=True, kw_only=True)
class Visibility:
    """Visibility of one view, with its uncertainty.

    Attributes:
        mean: (H, W) tensor in [0, 1], 1 = open, 1 on the background.
        variance: (H, W) variance *of the mean* (its root is the standard error), from independent batches; 0
            on the background. Single pixels have few degrees of freedom (``n_batches - 1``): pool them before
            testing.
        count: rays per pixel.
        n_batches: batches that the variance rests on.
        bent_normal: (H, W, 3) unit mean unoccluded direction, view frame; the normal where nothing is
            visible, +z on the background; None unless asked for.
        mean_direction: (H, W, 3) the same before normalisation: the integral of V(ω) ω cos θ / π (or of
            V(ω) ω / 2π), of length at most 2/3 (1/2) when only the weighting shortens it; 0 on the background.
        max_distance: distance beyond which nothing occludes, in scene units.
        seed: of the random numbers.
        weighting: "cosine" or "uniform" over the hemisphere.
    """

    mean: Any
    variance: Any
    count: int
    n_batches: int
    bent_normal: Any = None
    mean_direction: Any = None
    max_distance: float = math.inf
    seed: int = 0
    weighting: str = "cosine"

    def _repr_png_(self) -> bytes:
        return display.grey_png(self.mean)

    def __repr__(self) -> str:
        height, width = self.mean.shape
        return f"Visibility({width}x{height}, {self.count} rays per pixel, max_distance={self.max_distance:g})"


def visibility(
    scene: Any,
    g: Any = None,
    max_distance: float = math.inf,
    spp: int = 256,
    seed: int = 0,
    *,
    sensor: Any = 0,
    normals: str = "shading",
    n_batches: int = 8,
    bent_normal: bool = True,
    weighting: str = "cosine",
    progress: Progress | None = None,
) -> Visibility:
    """Trace rays over the hemisphere from the surface behind every pixel centre (theory, eqs. (1) and (3)).

    Every shape occludes, whatever its BSDF or emission, and so does the surface itself where a normal leans so
    far that directions about it point below the geometric surface. Start points are found anew in the scene, so
    a rounded depth in ``g`` does no harm; directions are drawn about the normals of ``g``. Pixels where only one of
    the two has a surface count as background. As Mitsuba's own, rays start 9e-5 (1 + |p|) off the surface for a
    largest coordinate |p|: scale up scenes much smaller than one unit.

    Args:
        scene: ``mitsuba.Scene``; see :func:`gtao.render.load_scene`.
        g: G-buffer of the same scene and sensor whose normals count. ``None`` uses those of the scene.
        max_distance: surfaces farther than this do not occlude; scene units, may be inf.
        spp: rays per pixel, a multiple of ``n_batches``; powers of two stratify best.
        seed: non-negative; the same seed gives the same bits.
        sensor: index of the sensor, or a ``mitsuba.Sensor``.
        normals: "shading" or "geometric"; only looked at without ``g``.
        n_batches: independent batches, at least two, that the variance is estimated from.
        bent_normal: also average the unoccluded directions.
        weighting: "cosine" for diffuse visibility (theory, eq. (1)), "uniform" for the open share of the solid angle
            (eq. (2)).
        progress: called as ``progress(done, total)`` after each piece of work.

    Raises:
        SceneError: no such sensor, or ``g`` is not of this scene and sensor.
        ConfigError: a parameter is out of range.
        BackendError: there is no usable backend.
    """
    ensure_variant()
    check_sampling(spp, n_batches, seed)
    check_normals(normals)
    if weighting not in ("cosine", "uniform"):
        raise ConfigError(f"weighting must be 'cosine' or 'uniform', got {weighting!r}")
    if not max_distance > 0:
        raise ConfigError(f"max_distance must be positive (inf for no limit), got {max_distance}")
    hits = shoot(scene, select_sensor(scene, sensor), normals)
    start = origins(hits, g)
    n, per_batch = len(start), spp // n_batches
    open_rays = np.zeros((n_batches, n), dtype=np.uint32)
    direction = np.zeros((3, n))
    for chunk in chunks(n, n_batches, per_batch, progress):
        key = batch_key(seed, chunk.batch)
        part = start.part(chunk.start, chunk.stop)
        count, total = _trace(scene, part, key, per_batch, max_distance, bent_normal, weighting)
        open_rays[chunk.batch, chunk.start : chunk.stop] = count
        if bent_normal:
            direction[:, chunk.start : chunk.stop] += total

    shape = hits.camera.shape
    pixel = start.pixel.numpy()
    batch_mean = open_rays / per_batch
    mean, variance = np.ones(shape), np.zeros(shape)
    mean.flat[pixel] = batch_mean.mean(0)
    variance.flat[pixel] = batch_mean.var(0, ddof=1) / n_batches
    bent = vector = None
    if bent_normal:
        vector, bent = _directions(hits, start, direction / spp)
    return Visibility(
        mean=mi.TensorXf(mean.astype(np.float32)),
        variance=mi.TensorXf(variance.astype(np.float32)),
        count=spp,
        n_batches=n_batches,
        bent_normal=bent,
        mean_direction=vector,
        max_distance=float(max_distance),
        seed=seed,
        weighting=weighting,
    )


def _trace(
    scene: Any, start: Origins, key: int, n_rays: int, max_distance: float, sum_directions: bool, weighting: str
) -> tuple[np.ndarray, np.ndarray | None]:
    """Unoccluded rays per start point, and the sum of their directions."""
    stream = stream_key(dr.opaque(mi.UInt32, key), start.pixel)
    limit = dr.opaque(mi.UInt32, n_rays)
    reach = dr.opaque(mi.Float, max_distance)

    def more(index: Any, count: Any, total: Any) -> Any:
        return index < limit

    def body(index: Any, count: Any, total: Any) -> tuple:
        ray = spawn(start.position, start.n_geo, start.normal, point(stream, mi.UInt32(0), index), weighting)
        ray.maxt = reach
        above = dr.dot(ray.d, start.n_geo) > 0
        visible = above & ~scene.ray_test(ray, coherent=False, active=above)
        if sum_directions:
            total = total + dr.select(visible, ray.d, 0)
        return index + 1, count + dr.select(visible, mi.UInt32(1), 0), total

    n = len(start)
    state = (dr.zeros(mi.UInt32, n), dr.zeros(mi.UInt32, n), dr.zeros(mi.Vector3f, n))
    _, count, total = dr.while_loop(state, more, body, labels=("index", "count", "total"))
    dr.eval(count, total)
    dr.sync_thread()
    return count.numpy(), total.numpy() if sum_directions else None


def _directions(hits: Any, start: Origins, mean_w: np.ndarray) -> tuple[Any, Any]:
    """Mean directions in the view frame, as they are and normalised, as (H, W, 3) tensors."""
    to_view = hits.view_to_world[:3, :3].T
    pixel = start.pixel.numpy()
    mean_v = (to_view @ mean_w).T
    normal_v = (to_view @ start.normal.numpy().astype(np.float64)).T
    length = np.linalg.norm(mean_v, axis=1, keepdims=True)
    shape = (*hits.camera.shape, 3)
    vector, bent = np.zeros(shape), np.tile([0.0, 0.0, 1.0], (*hits.camera.shape, 1))
    vector.reshape(-1, 3)[pixel] = mean_v
    bent.reshape(-1, 3)[pixel] = np.where(length > 0, mean_v / np.where(length > 0, length, 1), normal_v)
    return mi.TensorXf(vector.astype(np.float32)), mi.TensorXf(bent.astype(np.float32))
