"""What a ground truth depends on in a scene, as a hash: geometry and camera, not materials or lights."""

import hashlib
from typing import Any

import mitsuba as mi
import numpy as np

from .loading import select_sensor
from .variant import ensure_variant

__all__ = ["feed", "fingerprint"]

# Parameters of a shape that do not move its surface.
_IRRELEVANT = ("bsdf", "emitter", "sensor", "medium", "silhouette")


def feed(digest: Any, node: Any, skip: tuple[str, ...] = ()) -> None:
    """Add all parameters of a scene or a part of it to a hash, but those whose names hold one of ``skip``."""
    parameters = mi.traverse(node)
    digest.update(node.class_name().encode())
    for name in sorted(parameters.keys()):
        if any(word in name for word in skip):
            continue
        value = parameters[name]
        value = getattr(value, "matrix", value)
        data = value if isinstance(value, bool | int | float | str) else np.ascontiguousarray(value)
        digest.update(name.encode())
        digest.update(data.tobytes() if isinstance(data, np.ndarray) else repr(data).encode())


def fingerprint(scene: Any, sensor: Any = 0) -> str:
    """SHA-256 over every shape's geometry and the camera, as 64 hexadecimal digits.

    Two scenes with the same fingerprint have the same G-buffer geometry, visibility and transport images.

    Raises:
        SceneError: there is no such sensor.
    """
    ensure_variant()
    digest = hashlib.sha256()
    chosen = select_sensor(scene, sensor)
    for shape in scene.shapes():
        feed(digest, shape, _IRRELEVANT)
    feed(digest, chosen, ("shutter",))
    return digest.hexdigest()
