"""Containers of tables: where the texels lie in a file, and where what is known about them."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gtao.errors import ImageError, RecordError

from .atomic import atomic_path, write_text
from .dds import read_dds, write_dds
from .images import read_channels, write_channels
from .jsontext import canonical_json, pretty_json, read_json

__all__ = ["CONTAINERS", "Container", "dds_format", "sidecar"]

Manifest = Mapping[str, Any]


@dataclass(frozen=True)
class Container:
    """A kind of file.

    Attributes:
        encodings: those that it holds, the default first.
        write: function of a path, of (…, H, W, n) texels or blocks, and of the manifest.
        read: function of a path; the bytes of the texels or blocks, and the manifest, neither of them checked.
        beside: whether the manifest is a file of its own, :func:`sidecar`.
    """

    encodings: tuple[str, ...]
    write: Callable[[Path, np.ndarray, Manifest], None]
    read: Callable[[Path], tuple[bytes, Any]]
    beside: bool = True


def sidecar(path: Path) -> Path:
    """The file beside a table that says what the table's own format has no place for."""
    return path.with_name(path.name + ".json")


def _write_sidecar(path: Path, manifest: Manifest) -> None:
    write_text(sidecar(path), pretty_json(manifest))


def _read_sidecar(path: Path) -> Any:
    if not path.exists():
        raise ImageError(f"cannot read {path}: no such file or directory; check the path and its permissions")
    try:
        return read_json(sidecar(path), "description of a table")
    except RecordError as cause:
        raise ImageError(f"cannot read {path}: {cause}") from None


def _write_raw(path: Path, texels: np.ndarray, manifest: Manifest) -> None:
    with atomic_path(path) as partial:
        partial.write_bytes(texels.tobytes())
    _write_sidecar(path, manifest)


def _read_raw(path: Path) -> tuple[bytes, Any]:
    manifest = _read_sidecar(path)
    try:
        return path.read_bytes(), manifest
    except OSError as cause:
        raise ImageError(f"cannot read {path}: {cause.strerror or cause}; check the path") from None


def _loaded(path: Path) -> Any:
    try:
        with path.open("rb") as file:
            loaded = np.load(file, allow_pickle=False)
            return loaded if isinstance(loaded, np.ndarray) else {name: loaded[name] for name in loaded.files}
    # Damage can surface anywhere inside zipfile, zlib or NumPy's header parser.
    except Exception as cause:
        reason = getattr(cause, "strerror", None) or str(cause) or type(cause).__name__
        raise ImageError(f"cannot read {path}: {reason.splitlines()[0].lower()}; write the table again") from None


def _write_npy(path: Path, texels: np.ndarray, manifest: Manifest) -> None:
    with atomic_path(path) as partial, partial.open("wb") as file:
        np.save(file, texels, allow_pickle=False)
    _write_sidecar(path, manifest)


def _read_npy(path: Path) -> tuple[bytes, Any]:
    manifest, texels = _read_sidecar(path), _loaded(path)
    if not isinstance(texels, np.ndarray):
        raise ImageError(f"cannot read {path}: it holds several arrays; name it .npz if it is a table")
    return texels.tobytes(), manifest


def _write_npz(path: Path, texels: np.ndarray, manifest: Manifest) -> None:
    with atomic_path(path) as partial, partial.open("wb") as file:
        np.savez_compressed(file, texels=texels, manifest=np.array(canonical_json(manifest)))


def _read_npz(path: Path) -> tuple[bytes, Any]:
    arrays = _loaded(path)
    try:
        return arrays["texels"].tobytes(), json.loads(str(arrays["manifest"]))
    except (KeyError, IndexError, ValueError, TypeError):
        raise ImageError(f"cannot read {path}: it does not hold a table; write it by gtao.io.write_table") from None


def _write_exr(path: Path, texels: np.ndarray, manifest: Manifest) -> None:
    rows = texels.reshape(-1, *texels.shape[-2:])
    planes = {name: rows[..., i] for i, name in enumerate("RG"[: texels.shape[-1]])}
    write_channels(path, planes, {"table": manifest}, half=manifest["encoding"] == "half")


def _read_exr(path: Path) -> tuple[bytes, Any]:
    planes, metadata = read_channels(path)
    texels = np.stack([planes[name] for name in sorted(planes, reverse=True)], axis=-1)  # R, then G
    return texels.tobytes(), (metadata["manifest"] or {}).get("table")


def dds_format(encoding: str, n_channels: int) -> str:
    """Name of the DDS format of an encoding."""
    kind = {"unorm8": "8_UNORM", "unorm16": "16_UNORM", "half": "16_FLOAT", "float": "32_FLOAT"}
    if encoding == "bc4":
        return ("BC4_UNORM", "BC5_UNORM")[n_channels - 1]
    bits, _, number = kind[encoding].partition("_")
    return "".join(f"{channel}{bits}" for channel in "RG"[:n_channels]) + f"_{number}"


def _write_dds(path: Path, texels: np.ndarray, manifest: Manifest) -> None:
    slices = texels.reshape(-1, *texels.shape[-3:]) if texels.ndim > 3 else texels
    write_dds(path, slices, dds_format(manifest["encoding"], len(manifest["channels"])))
    _write_sidecar(path, manifest)


def _read_dds(path: Path) -> tuple[bytes, Any]:
    manifest = _read_sidecar(path)
    return read_dds(path)[0].tobytes(), manifest


_RAW = Container(("float", "half", "unorm16", "unorm8", "bc4"), _write_raw, _read_raw)

#: Suffix of a file -> container.
CONTAINERS: dict[str, Container] = {
    ".npy": Container(("float", "half", "unorm16", "unorm8"), _write_npy, _read_npy),
    ".npz": Container(("float", "half", "unorm16", "unorm8"), _write_npz, _read_npz, beside=False),
    ".exr": Container(("float", "half"), _write_exr, _read_exr, beside=False),
    ".dds": Container(("half", "unorm16", "unorm8", "float", "bc4"), _write_dds, _read_dds),
    ".raw": _RAW,
    ".bin": _RAW,
}
