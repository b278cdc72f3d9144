"""Ray-traced visibility, traced once and kept: by the hash of everything that it depends on."""

import hashlib
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from gtao import io, render
from gtao.errors import GtaoError
from gtao.gbuffer import GBuffer

__all__ = ["N_BATCHES", "kept_truth"]

#: Batches of rays that the variance of a truth rests on.
N_BATCHES = 8

#: Part of every key: raise it when the sampling changes and old truths must not be mixed with new ones.
TRUTH_VERSION = 1


def kept_truth(
    scene: Any,
    sensor: int,
    g: GBuffer,
    cache: Path,
    *,
    fingerprint: str,
    radius: float,
    spp: int,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Mean of the visibility and variance of that mean, from the cache if it has them; both (H, W) float32.

    Args:
        scene, sensor, g: what to trace.
        cache: directory of traced views; a damaged entry is traced again, and replaced.
        fingerprint: of the view, see :func:`gtao.render.fingerprint`.
        radius: reach of occluders in scene units.
        spp, seed: of :func:`gtao.render.visibility`; spp is a multiple of :data:`N_BATCHES`.
        progress: called as ``progress(done, total)`` while rays are traced.

    Raises:
        ImageError: the cache cannot be written.
    """
    key: dict[str, Any] = {"kind": "visibility", "version": TRUTH_VERSION, "fingerprint": fingerprint, "radius": radius}
    key |= {"spp": spp, "seed": seed, **{package: version(package) for package in ("mitsuba", "drjit")}}
    path = cache / f"{hashlib.sha256(io.canonical_json(key).encode()).hexdigest()}.exr"
    if path.exists():
        try:
            mean, variance, _ = io.read_truth(path)
            if mean.shape == g.shape:
                return mean, variance
        except GtaoError:  # damaged
            pass
    truth = render.visibility(
        scene, g, radius, spp, seed, sensor=sensor, n_batches=N_BATCHES, bent_normal=False, progress=progress
    )
    extra = {"visibility.mean": truth.mean, "visibility.var": truth.variance}
    io.write_gbuffer(path, g, extra=extra, manifest={"config": {"max_distance": radius}, "key": key})
    return truth.mean.numpy(), truth.variance.numpy()
