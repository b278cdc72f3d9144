"""The history of a temporal filter on disk: to the bit, checksummed, whole or not at all."""

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gtao.camera import camera_from_dict
from gtao.camera.pose import pose_of
from gtao.errors import ConfigError, GtaoError, RecordError
from gtao.history import CHANNELS, Contents, History
from gtao.tensors import to_tensor

from .atomic import atomic_path
from .jsontext import canonical_json

__all__ = ["read_history", "write_history"]

SCHEMA = 1


def write_history(path: str | os.PathLike, history: History) -> None:
    """Write a history as an ``.npz``, whole or not at all; same history, same bytes.

    Args:
        path: the file; its folder is made.
        history: may be empty.

    Raises:
        ConfigError: ``history`` is no history.
        RecordError: the file cannot be written.
    """
    if not isinstance(history, History):
        raise ConfigError(f"history must be a gtao.History, got {type(history).__name__}")
    values: dict[str, Any] = {"schema": SCHEMA, "frame_index": history.frame_index, "empty": history.is_empty}
    arrays: dict[str, np.ndarray] = {}
    if history.contents is not None:
        kept = history.contents
        values |= {"camera": kept.camera.to_dict(), "view_to_world": kept.view_to_world}
        planes = {**kept.channels, "count": (kept.count,), "view_z": (kept.view_z,)}
        if kept.deviation is not None:
            planes["deviation"] = (kept.deviation,)
        planes |= {name: value for name in ("normal", "motion") if (value := getattr(kept, name)) is not None}
        arrays = {name: np.stack([np.array(plane) for plane in value]) for name, value in planes.items()}
    header = canonical_json(values)
    texts = {"header": np.array(header), "sha256": np.array(_digest(arrays, header))}
    with atomic_path(path, error=RecordError) as partial, partial.open("wb") as file:
        np.savez(file, **arrays, **texts)


def read_history(path: str | os.PathLike) -> History:
    """Read a history; a step after it gives what it would have given before, to the bit.

    Raises:
        RecordError: the file is missing, cut short, altered or of another version.
        BackendError: there is no usable Dr.Jit backend.
    """
    path = Path(path)
    if not path.exists():
        raise RecordError(f"no history at {path}; check the path")
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
        header, expected = str(arrays.pop("header")), str(arrays.pop("sha256"))
        values = json.loads(header)
    # Damage can surface anywhere inside zipfile, NumPy's header parser or json.
    except Exception as cause:
        reason = str(cause).splitlines()[0] if str(cause) else type(cause).__name__
        raise RecordError(f"{path} is not a whole history ({reason}); remove it and begin with a new one") from None
    if _digest(arrays, header) != expected:
        raise RecordError(f"{path} is damaged (its checksum differs); remove it and begin with a new one")
    if values.get("schema") != SCHEMA:
        raise RecordError(f"{path} has schema {values.get('schema')!r}, this gtao knows {SCHEMA}; begin with a new one")
    history = History()
    try:
        if not values["empty"]:
            history.contents = _contents(arrays, values)
        history.frame_index = int(values["frame_index"])
    except (GtaoError, KeyError, TypeError, ValueError) as cause:
        raise RecordError(f"{path} does not describe a history: {cause}; begin with a new one") from None
    return history


def _contents(arrays: Mapping[str, np.ndarray], values: Mapping[str, Any]) -> Contents:
    camera, pose = camera_from_dict(values["camera"]), values["view_to_world"]
    size = camera.width * camera.height

    def planes(name: str, n: int) -> tuple[Any, ...]:
        stored = arrays[name]
        if stored.shape != (n, size) or stored.dtype.kind != "f":
            raise RecordError(f"{name} has shape {stored.shape} and type {stored.dtype}")
        return tuple(to_tensor(plane, name, (size,)).array for plane in stored)

    return Contents(
        channels={name: planes(name, n) for name, n in CHANNELS.items() if name in arrays},
        count=planes("count", 1)[0],
        deviation=planes("deviation", 1)[0] if "deviation" in arrays else None,
        view_z=planes("view_z", 1)[0],
        normal=planes("normal", 3) if "normal" in arrays else None,
        motion=planes("motion", 2) if "motion" in arrays else None,
        camera=camera,
        view_to_world=None if pose is None else pose_of("view_to_world", pose),
    )


def _digest(arrays: Mapping[str, np.ndarray], header: str) -> str:
    hasher = hashlib.sha256(header.encode())
    for name in sorted(arrays):
        array = arrays[name]
        hasher.update(f"{name} {array.dtype.str} {array.shape}".encode())
        hasher.update(np.ascontiguousarray(array))
    return hasher.hexdigest()
