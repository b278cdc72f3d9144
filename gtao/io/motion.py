"""Motion as channels ``motion.X``, ``motion.Y`` (pixels), ``motion.Z`` (depth); the pose in the manifest."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from gtao.camera.pose import Pose, pose_of
from gtao.errors import ImageError, ShapeError
from gtao.gbuffer import GBuffer

__all__ = ["motion_channels", "motion_of", "pose_in"]

_NAMES = ("motion.X", "motion.Y", "motion.Z")


def motion_channels(g: GBuffer) -> dict[str, np.ndarray]:
    """Name -> (H, W) of the two or three channels of a frame's motion; nothing where it has none."""
    if g.motion is None:
        return {}
    motion = g.motion.numpy()
    return {name: motion[..., i] for i, name in enumerate(_NAMES[: motion.shape[-1]])}


def motion_of(channels: Mapping[str, np.ndarray]) -> np.ndarray | None:
    """(H, W, 2) or (H, W, 3) motion, or None."""
    names = [name for name in _NAMES if name in channels]
    if names[:2] != list(_NAMES[:2]):
        return None
    return np.stack([channels[name].astype(np.float32) for name in names], axis=-1)


def pose_in(path: Any, manifest: Mapping[str, Any]) -> Pose | None:
    """The pose in a manifest, or None.

    Raises:
        ImageError: it is no rigid 4x4 matrix.
    """
    stored = manifest.get("view_to_world")
    try:
        return None if stored is None else pose_of("view_to_world", stored)
    except ShapeError as cause:
        raise ImageError(f"{path} holds a damaged pose: {cause}") from None
