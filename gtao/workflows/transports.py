"""Transport images of all views, from the cache where it has them."""

import gc
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

import numpy as np

from gtao import render
from gtao.errors import SceneError
from gtao.estimators import ambient_occlusion

from .settings import RefitConfig
from .views import open_scene

__all__ = ["SceneData", "collect"]

#: Part of every cache key: raise it when the sampling changes and old counts must not be mixed with new ones.
TRANSPORT_VERSION = 1

Report = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class SceneData:
    """Counts of one scene, all its cameras together.

    Attributes:
        name: of the scene.
        transport: counts of the first camera, or of all cameras side by side.
        screen: estimated visibility per valid pixel, or None.
        fingerprints: of the views, see :func:`gtao.render.fingerprint`.
        visibility: (H, W) traced visibility of the first camera, for pictures.
    """

    name: str
    transport: Any
    screen: np.ndarray | None
    fingerprints: tuple[str, ...]
    visibility: np.ndarray


def _key(config: RefitConfig, fingerprint: str) -> dict[str, Any]:
    return {
        "kind": "transport",
        "version": TRANSPORT_VERSION,
        "fingerprint": fingerprint,
        "spp": config.spp,
        "n_batches": config.n_batches,
        "n_bounces": config.n_bounces,
        "normals": config.normals,
        "seed": config.seed,
        "mitsuba": version("mitsuba"),
        "drjit": version("drjit"),
    }


def _one_view(scene: Any, sensor: int, config: RefitConfig, cache: Any, progress: Any) -> tuple[Any, Any, str]:
    fingerprint = render.fingerprint(scene, sensor)
    key = _key(config, fingerprint)
    stored = cache.get(key)
    if stored is not None:
        transport = render.Transport(**stored.fields())
    else:
        transport = render.transport(
            scene,
            None,
            config.n_bounces,
            config.spp,
            config.seed,
            sensor=sensor,
            n_batches=config.n_batches,
            normals=config.normals,
            progress=progress,
        )
        cache.put(key, transport)
    screen = None
    if config.regressor == "screen":
        g = render.gbuffer(scene, sensor, normals=config.normals, albedo=False)
        screen = ambient_occlusion(g, config.screen_method).visibility.numpy().ravel()[transport.pixel]
    return transport, screen, fingerprint


def _side_by_side(transports: list[Any]) -> Any:
    """Counts of several cameras as one image below the other."""
    first = transports[0]
    if len(transports) == 1:
        return first
    width = max(t.width for t in transports)
    pixels, top = [], 0
    for t in transports:
        pixels.append((top + t.pixel // t.width) * width + t.pixel % t.width)
        top += t.height
    return render.Transport(
        escaped=np.concatenate([t.escaped for t in transports], axis=2),
        remaining=np.concatenate([t.remaining for t in transports], axis=1),
        pixel=np.concatenate(pixels).astype(np.uint32),
        edge=np.concatenate([t.edge for t in transports]),
        width=width,
        height=top,
        spp=first.spp,
        n_batches=first.n_batches,
        n_bounces=first.n_bounces,
        seed=first.seed,
    )


def collect(sources: dict[str, str], config: RefitConfig, cache: Any, progress: Report | None) -> list[SceneData]:
    """Transport counts of every scene, rendered or taken from the cache.

    Args:
        sources: source of each scene by name, see :func:`gtao.workflows.views.scene_names`.
        config: settings.
        cache: a :class:`gtao.io.cache.TransportCache`.
        progress: called as ``progress(task, done, total)``.

    Raises:
        SceneError: a scene cannot be loaded, or shows no surface.
    """
    data = []
    for i, (name, source) in enumerate(sources.items()):
        if progress:
            progress("scenes", i, len(sources))
        scene, n_sensors = open_scene(source, config.resolution)
        transports, screens, fingerprints = [], [], []
        for sensor in range(n_sensors if config.all_sensors else 1):

            def step(done: int, total: int, task: str = f"  {name}") -> None:
                if progress:
                    progress(task, done, total)

            transport, screen, fingerprint = _one_view(scene, sensor, config, cache, step)
            transports.append(transport)
            screens.append(screen)
            fingerprints.append(fingerprint)
        if not any(transport.pixel.size for transport in transports):
            raise SceneError(f"no pixel of scene {source} shows a surface; point its camera at one")
        data.append(
            SceneData(
                name=name,
                transport=_side_by_side(transports),
                screen=None if config.regressor == "ray" else np.concatenate(screens),
                fingerprints=tuple(fingerprints),
                visibility=transports[0].visibility,
            )
        )
        del scene
        gc.collect()
    if progress:
        progress("scenes", len(sources), len(sources))
    return data
