"""Packed estimates as files: PNG for integers, EXR for half floats."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gtao._version import __version__
from gtao.errors import ImageError

from .directions import Directions, direction_manifest, directions_of
from .images import MANIFEST, read_channels, write_channels
from .jsontext import plain
from .packing import pack, packing, unpack
from .png import read_png, write_png

__all__ = ["packed_suffix", "read_packed", "write_packed"]


def packed_suffix(name: str) -> str:
    """``.png`` or ``.exr``.

    Raises:
        ConfigError: there is no such packing.
    """
    return ".png" if np.issubdtype(packing(name).dtype, np.integer) else ".exr"


def write_packed(
    path: str | os.PathLike, ao: Any, name: str = "rgba8", *, manifest: Mapping[str, Any] | None = None
) -> None:
    """Write a packed estimate, whole or not at all.

    Integers become a PNG of 8 or 16 bits per channel whose numbers are data: import it as linear, not as sRGB, and do
    not let a program premultiply its alpha. Half floats become an EXR with the channels ``R G B A`` ("zh16") or
    ``visibility_sh.00`` … ``visibility_sh.08`` ("sh16"). Either says in a note ``gtao`` (JSON) how it is packed, so
    that :func:`read_packed` needs nothing else. The same estimate gives the same bytes.

    Args:
        path: the file, ending in :func:`packed_suffix`; its folder is made.
        ao: :class:`gtao.AmbientOcclusion` or :class:`Directions`.
        name: a key of :data:`PACKINGS`.
        manifest: what else shall be known about the file.

    Raises:
        ConfigError: the packing does not exist, or the estimate lacks what it stores.
        ShapeError: arrays do not fit or hold what cannot be packed.
        ImageError: the name ends otherwise, or the file cannot be written.
        RecordError: the manifest holds what JSON cannot.
    """
    suffix = packed_suffix(name)
    if Path(path).suffix.lower() != suffix:
        raise ImageError(f"cannot write {path}: packing {name} makes {suffix} files; give a name that ends so")
    d = directions_of(ao)
    texels = pack(d, name)
    told = {
        "made_by": f"gtao {__version__}",
        **(manifest or {}),
        **direction_manifest(d),
        "packing": {"name": name, "channels": list(packing(name).channels), "weighting": d.weighting},
    }
    if suffix == ".png":
        write_png(path, texels, {MANIFEST: json.dumps(plain(told), sort_keys=True)})
        return
    channels = {channel: texels[..., i] for i, channel in enumerate(packing(name).channels)}
    write_channels(path, channels, told, half=True)


def read_packed(path: str | os.PathLike) -> Directions:
    """Read what :func:`write_packed` wrote, and unpack it.

    Raises:
        ImageError: the file cannot be read, or does not say how it is packed.
    """
    path = Path(path)
    if path.suffix.lower() == ".png":
        texels, notes = read_png(path)
        try:
            manifest = json.loads(notes.get(MANIFEST, "null"))
        except ValueError:
            manifest = None
    else:
        planes, metadata = read_channels(path)
        manifest = metadata["manifest"]
        names = _told(path, manifest)["channels"]
        if not all(name in planes for name in names):
            raise ImageError(f"cannot read {path}: it lacks channels of its packing; pack the estimate again")
        texels = np.stack([planes[name] for name in names], axis=-1)
    told = _told(path, manifest)
    try:
        return unpack(texels, told["name"], told["weighting"])
    except ValueError as cause:
        raise ImageError(f"cannot read {path}: {cause}") from None


def _told(path: Path, manifest: Any) -> dict[str, Any]:
    """Name, weighting and channels of the packing that a note describes."""
    told = (manifest if isinstance(manifest, dict) else {}).get("packing")
    try:
        told = dict(told or {})
        name, weighting = str(told["name"]), str(told["weighting"])
        channels = packing(name).channels
    except (TypeError, ValueError, KeyError):
        raise ImageError(f"{path} does not say how it is packed; write it by gtao.io.write_packed") from None
    return {"name": name, "weighting": weighting, "channels": channels}
