"""Transport images on disk: the counts of a path trace, compressed, checksummed, whole or not at all."""

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from gtao.errors import RecordError

from .atomic import atomic_path
from .jsontext import canonical_json

__all__ = ["StoredTransport", "read_transport", "write_transport"]

SCHEMA = 1
_ARRAYS = ("escaped", "remaining", "pixel", "edge")
_COUNTS = ("width", "height", "spp", "n_batches", "n_bounces", "seed")


@dataclass(frozen=True, kw_only=True)
class StoredTransport:
    """What a transport file holds: the fields of ``gtao.render.Transport``.

    Attributes:
        escaped: (n_batches, n_bounces, N) paths of a batch that left the scene after exactly 1, 2 … bounces.
        remaining: (n_batches, N) paths still inside after the last bounce.
        pixel: (N,) flat index ``y * width + x`` of the pixels that show a surface.
        edge: (N,) True at depth edges.
        width, height: size of the image in pixels.
        spp: paths per pixel over all batches.
        n_batches: independent batches.
        n_bounces: bounces K that were followed.
        seed: seed of the run.
        metadata: what the writer wanted to be known besides: name, camera, versions.
    """

    escaped: np.ndarray
    remaining: np.ndarray
    pixel: np.ndarray
    edge: np.ndarray
    width: int
    height: int
    spp: int
    n_batches: int
    n_bounces: int
    seed: int
    metadata: dict[str, Any] = field(default_factory=dict)

    def fields(self) -> dict[str, Any]:
        """Everything but the metadata, to rebuild ``Transport(**stored.fields())``."""
        return {name: getattr(self, name) for name in (*_ARRAYS, *_COUNTS)}


def _digest(arrays: Mapping[str, np.ndarray], header: str) -> str:
    hasher = hashlib.sha256(header.encode())
    for name in _ARRAYS:
        array = arrays[name]
        hasher.update(f"{name} {array.dtype.str} {array.shape}".encode())
        hasher.update(np.ascontiguousarray(array))
    return hasher.hexdigest()


def _check(transport: StoredTransport) -> None:
    """Shapes fit together and no path is lost."""
    t = transport
    for name in ("width", "height", "spp", "n_batches", "n_bounces"):
        value = getattr(t, name)
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            raise RecordError(f"{name} must be a positive integer, got {value!r}")
    n = t.pixel.size
    expected = {
        "escaped": (t.n_batches, t.n_bounces, n),
        "remaining": (t.n_batches, n),
        "pixel": (n,),
        "edge": (n,),
    }
    for name, shape in expected.items():
        array = getattr(t, name)
        if array.shape != shape:
            raise RecordError(f"{name} has shape {array.shape}, expected {shape}")
        wanted = "b" if name == "edge" else "u"
        if array.dtype.kind != wanted:
            raise RecordError(f"{name} has type {array.dtype}, expected {'bool' if wanted == 'b' else 'unsigned'}")
    if n and (int(t.pixel.max()) >= t.width * t.height or (np.diff(t.pixel.astype(np.int64)) <= 0).any()):
        raise RecordError(f"pixel must rise strictly and stay below {t.width * t.height}")
    if t.spp % t.n_batches:
        raise RecordError(f"spp {t.spp} is no multiple of n_batches {t.n_batches}")
    total = t.escaped.sum(axis=1, dtype=np.uint64) + t.remaining
    if (total != t.spp // t.n_batches).any():
        n_bad = int((total != t.spp // t.n_batches).sum())
        raise RecordError(f"{n_bad} pixels have lost or gained paths")


def write_transport(path: str | os.PathLike, transport: Any, metadata: Mapping[str, Any] | None = None) -> None:
    """Write transport counts as a compressed ``.npz``, whole or not at all; same input, same bytes.

    Args:
        path: the file; its folder is made.
        transport: an object with the fields of :class:`StoredTransport` but ``metadata``.
        metadata: plain values to store with it.

    Raises:
        RecordError: the counts do not add up, or the file cannot be written.
    """
    arrays = {name: np.asarray(getattr(transport, name)) for name in _ARRAYS}
    counts = {name: int(getattr(transport, name)) for name in _COUNTS}
    try:
        _check(StoredTransport(**arrays, **counts))
    except RecordError as cause:
        raise RecordError(f"cannot write {path}: {cause}") from None
    header = canonical_json({"schema": SCHEMA, **counts, "metadata": dict(metadata or {})})
    texts = {"header": np.array(header), "sha256": np.array(_digest(arrays, header))}
    with atomic_path(path, error=RecordError) as partial, partial.open("wb") as file:
        np.savez_compressed(file, **arrays, **texts)


def read_transport(path: str | os.PathLike) -> StoredTransport:
    """Read transport counts and check that they are whole.

    Raises:
        RecordError: the file is missing, cut short, altered, or the counts do not add up.
    """
    path = Path(path)
    if not path.exists():
        raise RecordError(f"no transport file at {path}; check the path")
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            content = {name: stored[name] for name in (*_ARRAYS, "header", "sha256")}
        header = str(content.pop("header"))
        expected = str(content.pop("sha256"))
        values = json.loads(header)
    # Damage can surface anywhere inside zipfile, zlib, NumPy's header parser or json.
    except Exception as cause:
        reason = str(cause).splitlines()[0] if str(cause) else type(cause).__name__
        raise RecordError(f"{path} is not a whole transport file ({reason}); remove it and render again") from None
    if _digest(content, header) != expected:
        raise RecordError(f"{path} is damaged (its checksum differs); remove it and render again")
    schema = values.pop("schema", None)
    if schema != SCHEMA:
        raise RecordError(f"{path} has schema {schema!r}, this gtao knows {SCHEMA}; render again")
    try:
        transport = StoredTransport(**content, **values)
        _check(transport)
    except (RecordError, TypeError) as cause:
        raise RecordError(f"{path}: {cause}; remove it and render again") from None
    return transport
