"""Depth layers as channels: ``Z`` and ``ZBack`` of the first, as OpenEXR names them, ``layers.01.Z`` … behind it."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from gtao.errors import ShapeError
from gtao.layers import DepthLayers

from .foreign import BACKGROUND_FROM

__all__ = ["layer_channels", "layers_of"]


def _names(k: int) -> tuple[str, str]:
    return ("Z", "ZBack") if k == 0 else (f"layers.{k:02d}.Z", f"layers.{k:02d}.ZBack")


def layer_channels(layers: DepthLayers) -> dict[str, np.ndarray]:
    """Name -> (H, W) for all layers; the first front is the frame's own ``Z`` and left out."""
    channels = {}
    for k, pair in enumerate(zip(layers.front.numpy(), layers.back.numpy(), strict=True)):
        channels |= dict(zip(_names(k), pair, strict=True))
    del channels["Z"]
    return channels


def layers_of(path: Any, channels: Mapping[str, np.ndarray], view_z: np.ndarray) -> DepthLayers | None:
    """The layers in a file of ours, or None if it has none.

    Args:
        path: the file, for errors.
        channels: name -> (H, W).
        view_z: (H, W) where the first layer begins.

    Raises:
        ShapeError: the layers are not in order, or not a number.
    """
    names = [_names(0)]
    while all(name in channels for name in _names(len(names))):
        names.append(_names(len(names)))
    if "ZBack" not in channels:
        return None
    ends = [np.stack([channels[pair[i]] for pair in names]).astype(np.float32) for i in (0, 1)]
    front, back = (np.where(end >= BACKGROUND_FROM, np.float32(np.inf), end) for end in ends)
    front[0] = view_z
    try:
        return DepthLayers(front, back)
    except ShapeError as cause:
        raise ShapeError(f"the layers of {path} cannot be used: {cause}") from None
