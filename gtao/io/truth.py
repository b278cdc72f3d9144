"""Ray-traced visibility in EXR files."""

import math
import os

import numpy as np

from gtao.errors import ImageError

from .images import read_channels

__all__ = ["read_truth"]


def read_truth(path: str | os.PathLike) -> tuple[np.ndarray, np.ndarray, float]:
    """The ground truth that ``gtao render`` wrote beside a G-buffer.

    Returns:
        (H, W) visibility in [0, 1]; (H, W) variance of its mean, 0 where the file holds none; the reach of occluders
        in scene units from the manifest, ``inf`` where it names none.

    Raises:
        ImageError: the file cannot be read or has no channel ``visibility.mean``, or one that is not finite.
    """
    channels, metadata = read_channels(path)
    if "visibility.mean" not in channels:
        raise ImageError(f"{path} has no channel visibility.mean; write frames with their truth by gtao render")
    mean = channels["visibility.mean"].astype(np.float32)
    variance = channels.get("visibility.var", np.zeros_like(mean)).astype(np.float32)
    if not (np.isfinite(mean).all() and np.isfinite(variance).all() and (variance >= 0).all()):
        raise ImageError(f"visibility.mean or visibility.var of {path} is not finite or negative; render it again")
    config = (metadata["manifest"] or {}).get("config")
    radius = config.get("max_distance", math.inf) if isinstance(config, dict) else math.inf
    return mean, variance, float(radius)
