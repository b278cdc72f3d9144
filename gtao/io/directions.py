"""Directions of an estimate as NumPy arrays, and their channels in EXR files."""

import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from gtao.errors import ConfigError, ImageError

from .images import read_channels

__all__ = [
    "Directions",
    "check_weighting",
    "direction_channels",
    "direction_manifest",
    "directions_of",
    "read_directions",
    "weighting_of",
]

#: (l, m) of the nine coefficients, as the manifest says it.
SH_INDICES = tuple((band, m) for band in range(3) for m in range(-band, band + 1))
WEIGHTINGS = ("cosine", "uniform")


def check_weighting(weighting: str) -> None:
    """Raise ConfigError unless there is such a weighting."""
    if weighting not in WEIGHTINGS:
        raise ConfigError(f"weighting must be 'cosine' or 'uniform', got {weighting!r}")


@dataclass(frozen=True, kw_only=True)
class Directions:
    """Visibility and where it is open, in the view frame; NumPy arrays with the meaning of
    :class:`gtao.AmbientOcclusion`.

    Attributes:
        visibility: (H, W), 1 = open.
        bent_normal: (H, W, 3) unit vectors, or None.
        mean_direction: (H, W, 3) un-normalised mean direction, or None.
        visibility_sh: (H, W, 9) coefficients of the visible hemisphere, bands 0 to 2, or None.
        weighting: "cosine" or "uniform", of all of them.
    """

    visibility: np.ndarray
    bent_normal: np.ndarray | None = None
    mean_direction: np.ndarray | None = None
    visibility_sh: np.ndarray | None = None
    weighting: str = "cosine"

    def __post_init__(self) -> None:
        check_weighting(self.weighting)


def weighting_of(config: Any) -> str:
    """ "cosine" or "uniform", of a method or a pipeline."""
    return getattr(getattr(config, "occlusion", config), "weighting", "cosine")


def _array(values: Any) -> np.ndarray | None:
    return None if values is None else np.asarray(values.numpy() if hasattr(values, "numpy") else values)


def directions_of(ao: Any) -> Directions:
    """The directions of a :class:`gtao.AmbientOcclusion`; a :class:`Directions` as it is.

    The average horizon gives no mean direction, only a bent normal.
    """
    if isinstance(ao, Directions):
        return ao
    names = ["visibility", "bent_normal", "mean_direction", "visibility_sh"]
    if getattr(getattr(ao.config, "occlusion", ao.config), "bent_normal", None) == "average_horizon":
        names.remove("mean_direction")
    return Directions(**{name: _array(getattr(ao, name)) for name in names}, weighting=weighting_of(ao.config))


def direction_channels(found: Directions) -> dict[str, np.ndarray]:
    """What goes into ``extra`` of :func:`gtao.io.write_gbuffer`: ``visibility.mean``, and as far as they are there
    ``bent``, ``mean_direction`` and ``visibility_sh``.
    """
    named = {
        "visibility.mean": found.visibility,
        "bent": found.bent_normal,
        "mean_direction": found.mean_direction,
        "visibility_sh": found.visibility_sh,
    }
    return {name: values for name, values in named.items() if values is not None}


def direction_manifest(found: Directions) -> dict[str, Any]:
    """What a reader of the channels has to know, for the manifest; empty without directions."""
    if found.bent_normal is None and found.mean_direction is None and found.visibility_sh is None:
        return {}
    told: dict[str, Any] = {"frame": "view: +x right, +y up, the camera looks along -z", "weighting": found.weighting}
    if found.visibility_sh is not None:
        told["visibility_sh"] = {
            "basis": "real spherical harmonics, no Condon-Shortley phase, Y_1 = sqrt(3 / (4 pi)) (y, z, x)",
            "indices": [list(index) for index in SH_INDICES],
        }
    return {"directions": told}


def read_directions(path: str | os.PathLike) -> Directions:
    """Read what ``gtao occlusion`` or ``gtao render`` wrote: visibility and the directions beside it, float32.

    Raises:
        ImageError: the file cannot be read, or has neither bent normals nor coefficients.
    """
    channels, metadata = read_channels(path)
    names = {
        "bent_normal": [f"bent.{axis}" for axis in "XYZ"],
        "mean_direction": [f"mean_direction.{axis}" for axis in "XYZ"],
        "visibility_sh": [f"visibility_sh.{i:02d}" for i in range(len(SH_INDICES))],
    }
    found = {
        key: np.stack([channels[name] for name in wanted], axis=-1).astype(np.float32)
        for key, wanted in names.items()
        if all(name in channels for name in wanted)
    }
    if not found or "visibility.mean" not in channels:
        raise ImageError(
            f"{path} has no visibility with directions; write it by gtao occlusion --set bent_normal=true or"
            " --set directional=true"
        )
    told = (metadata["manifest"] or {}).get("directions")
    weighting = told.get("weighting", "cosine") if isinstance(told, dict) else "cosine"
    return Directions(visibility=channels["visibility.mean"].astype(np.float32), **found, weighting=weighting)
