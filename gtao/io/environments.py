"""Environment maps as files: OpenEXR and Radiance pictures in, OpenEXR out."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gtao.errors import ConfigError, ImageError

from .images import read_channels, write_channels
from .radiance_hdr import MAGICS, read_radiance_hdr

if TYPE_CHECKING:
    from gtao.lighting import EnvironmentMap

__all__ = ["read_environment", "write_environment"]

_CHANNELS = ("R", "G", "B")


def read_environment(path: str | os.PathLike, to_world: Any = None, *, repair: bool = False) -> "EnvironmentMap":
    """Read a latitude-longitude image as light from afar.

    OpenEXR files hold the channels R, G, B, in any layer if there is only one of each, or the luminance Y alone;
    Radiance pictures are those of :func:`gtao.io.read_radiance_hdr`. The kind is told from the content, not the name.

    Args:
        path: the file.
        to_world: 3x3 or 4x4 rotation from the map's frame (+y up, column 0 at -z) to the world. If left out: what
            :func:`write_environment` stored in the file, else the identity.
        repair: False refuses NaN, infinite and negative texels. True sets NaN and negative values to 0 and infinite
            ones to the largest finite value of the image.

    Raises:
        ImageError: the file is missing, damaged, of another kind, lacks the channels, is smaller than 2x2, or has NaN,
            infinite or negative texels.
        ConfigError: ``to_world`` is not a rotation.
        ShapeError: ``to_world`` is neither 3x3 nor 4x4.
    """
    from gtao.lighting import EnvironmentMap

    path = Path(path)
    try:
        with path.open("rb") as file:
            is_picture = file.read(16).startswith(MAGICS)
    except (OSError, ValueError):
        is_picture = False  # the reader of EXR files says why
    image, stored = (read_radiance_hdr(path), None) if is_picture else _read_exr(path)
    if to_world is None:
        to_world = np.eye(3) if stored is None else stored
    broken = int((~np.isfinite(image)).any(-1).sum())
    negative = int((image < 0).any(-1).sum())
    if repair:
        finite = image[np.isfinite(image)]
        largest = finite.max(initial=0.0)
        image = np.clip(np.nan_to_num(image, nan=0.0, posinf=largest, neginf=0.0), 0, None)
    elif broken or negative:
        raise ImageError(
            f"cannot use {path} as light: of {image.shape[0] * image.shape[1]} texels {broken} are NaN or infinite and"
            f" {negative} negative; repair=True makes them 0, or the largest finite value"
        )
    if min(image.shape[:2]) < 2:
        raise ImageError(f"cannot use {path} as light: it has {image.shape[1]}x{image.shape[0]} texels; 2x2 is least")
    return EnvironmentMap(image, to_world)


def _read_exr(path: Path) -> tuple[np.ndarray, Any]:
    channels, metadata = read_channels(path)
    planes = [_plane(path, channels, name) for name in _CHANNELS]
    if all(plane is None for plane in planes) and "Y" in channels:
        planes = [channels["Y"]] * 3
    if any(plane is None for plane in planes):
        raise ImageError(f"{path} lacks one of the channels R, G, B (it has {', '.join(sorted(channels))})")
    with np.errstate(over="ignore"):
        image = np.stack([np.asarray(plane, np.float32) for plane in planes if plane is not None], axis=-1)
    stored = (metadata["manifest"] or {}).get("environment_to_world")
    try:
        stored = None if stored is None else np.array(stored, dtype=np.float64).reshape(3, 3)
    except (TypeError, ValueError):
        raise ImageError(
            f"cannot read {path}: environment_to_world in its header is no 3x3 matrix; write it again"
        ) from None
    return image, stored


def _plane(path: Path, channels: dict[str, np.ndarray], name: str) -> np.ndarray | None:
    if name in channels:
        return channels[name]
    found = [key for key in channels if key.endswith(f".{name}")]
    if len(found) > 1:
        raise ImageError(f"{path} has several channels {name} ({', '.join(sorted(found))}); keep one layer")
    return channels[found[0]] if found else None


def write_environment(path: str | os.PathLike, environment: "EnvironmentMap") -> None:
    """Write an environment map as OpenEXR, float32, that :func:`read_environment` reads without loss.

    The channels are R, G, B; the frame is stored in the header attribute ``gtao`` as ``environment_to_world``, which
    other programs do not look at.

    Args:
        path: the file; its folder is made.
        environment: the map.

    Raises:
        ConfigError: ``environment`` is no :class:`gtao.lighting.EnvironmentMap`.
        ImageError: the file cannot be written, or its name does not end in ``.exr``.
    """
    from gtao.lighting import EnvironmentMap

    if not isinstance(environment, EnvironmentMap):
        raise ConfigError(f"environment must be a gtao.lighting.EnvironmentMap, got {type(environment).__name__}")
    if Path(path).suffix.lower() != ".exr":
        raise ImageError(f"cannot write {path}: environment maps are written as OpenEXR; give a name that ends in .exr")
    planes = {name: environment.radiance[..., i] for i, name in enumerate(_CHANNELS)}
    write_channels(path, planes, {"environment_to_world": environment.to_world.tolist()})
