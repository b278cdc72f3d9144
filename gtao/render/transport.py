"""Transport images: the light that leaves a uniformly coloured scene after each number of bounces.

Under a white dome of radiance 1 and with one albedo ρ everywhere, the light that a point reflects, divided by
ρ, is the sum over k of ρ^(k-1) T_k. T_k is the probability that a cosine-distributed walk from the point
leaves the scene after exactly k surfaces, and does not depend on ρ: one set of walks serves every albedo.
"""

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from gtao.errors import ConfigError

from .chunks import Progress, chunks
from .edges import depth_edges
from .loading import select_sensor
from .primary import check_normals, facing_normal, ray_flags, shoot
from .sampling import batch_key, check_sampling, point, stream_key
from .transport_result import Transport
from .variant import ensure_variant
from .walk import Origins, cosine_direction, origins, spawn

__all__ = ["Transport", "transport"]


def transport(
    scene: Any,
    g: Any = None,
    n_bounces: int = 24,
    spp: int = 256,
    seed: int = 0,
    *,
    sensor: Any = 0,
    n_batches: int = 8,
    normals: str = "shading",
    progress: Progress | None = None,
) -> Transport:
    """Count after how many surfaces the walks of every pixel leave the scene (theory, eqs. (34) and (35)).

    Emitters and materials are ignored, all surfaces are two-sided and diffuse, every direction that meets no
    surface sees the dome. The estimate is what Mitsuba's ``path`` integrator computes for that scene with
    ``max_depth = n_bounces + 1``, at all albedos at once. Pixels where only one of scene and ``g`` has a surface
    count as background. The counts take ``2 n_batches n_bounces`` bytes per pixel, other memory is bounded.

    Args:
        scene: ``mitsuba.Scene``; see :func:`gtao.render.load_scene`.
        g: G-buffer of the same scene and sensor, whose normals the first bounce is about; ``None`` uses those
            of the scene.
        n_bounces: K, the surfaces that a walk may meet, the visible one included.
        spp: walks per pixel, a multiple of ``n_batches``; powers of two stratify best.
        seed: non-negative; the same seed gives the same bits.
        sensor: index of the sensor, or a ``mitsuba.Sensor``.
        n_batches: mutually independent batches, at least two.
        normals: "shading" or "geometric", at all bounces (but see ``g``).
        progress: called as ``progress(done, total)`` after each piece of work.

    Raises:
        SceneError: no such sensor, or ``g`` is not of this scene and sensor.
        ConfigError: a parameter is out of range.
        BackendError: there is no usable backend.
    """
    ensure_variant()
    check_sampling(spp, n_batches, seed)
    check_normals(normals)
    if isinstance(n_bounces, bool) or not isinstance(n_bounces, int) or n_bounces < 1:
        raise ConfigError(f"n_bounces must be a positive integer, got {n_bounces!r}")
    hits = shoot(scene, select_sensor(scene, sensor), normals)
    start = origins(hits, g)
    n, per_batch = len(start), spp // n_batches
    counter = np.uint16 if per_batch <= np.iinfo(np.uint16).max else np.uint32
    escaped = np.zeros((n_batches, n_bounces, n), dtype=counter)
    remaining = np.zeros((n_batches, n), dtype=counter)
    for chunk in chunks(n, n_batches, per_batch, progress):
        key = batch_key(seed, chunk.batch)
        lanes = slice(chunk.start, chunk.stop)
        part = start.part(chunk.start, chunk.stop)
        escaped[chunk.batch, :, lanes], remaining[chunk.batch, lanes] = _walk(
            scene, part, key, per_batch, n_bounces, normals
        )
    pixel = start.pixel.numpy().copy()
    return Transport(
        escaped=escaped,
        remaining=remaining,
        pixel=pixel,
        edge=depth_edges(hits).ravel()[pixel],
        width=hits.camera.width,
        height=hits.camera.height,
        spp=spp,
        n_batches=n_batches,
        n_bounces=n_bounces,
        seed=seed,
    )


def _walk(
    scene: Any, start: Origins, key: int, n_walks: int, n_bounces: int, normals: str
) -> tuple[np.ndarray, np.ndarray]:
    """Escapes per bounce (K, N) and walks that did not escape (N,).

    A lane starts its next walk as soon as one ends, so that lanes with short walks do not wait for long ones.
    """
    n = len(start)
    lane = dr.arange(mi.UInt32, n)
    stream = stream_key(dr.opaque(mi.UInt32, key), start.pixel)
    limit, depth = dr.opaque(mi.UInt32, n_walks), dr.opaque(mi.UInt32, n_bounces)
    escapes = dr.zeros(mi.UInt32, n_bounces * n)
    flags = ray_flags(normals)

    def more(index: Any, bounce: Any, position: Any, n_geo: Any, normal: Any, inside: Any) -> Any:
        return index < limit

    def body(index: Any, bounce: Any, position: Any, n_geo: Any, normal: Any, inside: Any) -> tuple:
        ray = spawn(position, n_geo, cosine_direction(normal, point(stream, bounce, index)))
        si = scene.ray_intersect(ray, ray_flags=flags, coherent=False)
        hit = si.is_valid()
        # A lane writes to its own counters only, so the addition needs no atomics.
        dr.scatter_reduce(
            dr.ReduceOp.Add, escapes, mi.UInt32(1), bounce * n + lane, ~hit, mode=dr.ReduceMode.NoConflicts
        )
        bounce = bounce + 1
        lost = hit & (bounce >= depth)
        end = ~hit | lost
        return (
            index + dr.select(end, mi.UInt32(1), 0),
            dr.select(end, 0, bounce),
            dr.select(end, start.position, si.p),
            dr.select(end, start.n_geo, si.n),
            dr.select(end, start.normal, facing_normal(si, ray.d, normals)),
            inside + dr.select(lost, mi.UInt32(1), 0),
        )

    zero = dr.zeros(mi.UInt32, n)
    first = (zero, zero, start.position, start.n_geo, start.normal, zero)
    labels = ("index", "bounce", "position", "n_geo", "normal", "inside")
    *_, inside = dr.while_loop(first, more, body, labels=labels)
    dr.eval(escapes, inside)
    dr.sync_thread()
    return escapes.numpy().reshape(n_bounces, n), inside.numpy()
