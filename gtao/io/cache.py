"""Transport images are kept under the hash of everything that they depend on."""

import contextlib
import hashlib
import json
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gtao.errors import RecordError

from .atomic import ensure_writable
from .jsontext import canonical_json
from .transport import StoredTransport, read_transport, write_transport

__all__ = ["TransportCache", "default_cache_directory"]


def _writable(directory: Path) -> Path:
    """``directory``, made if missing; it stays, lest processes that start together remove it from one another."""
    with contextlib.suppress(OSError, ValueError):
        directory.mkdir(parents=True, exist_ok=True)
    ensure_writable(directory / ".probe", error=RecordError)
    return directory


def default_cache_directory() -> Path:
    """Where transport images are kept between runs.

    ``$GTAO_CACHE_DIR`` if it is set, else ``$XDG_CACHE_HOME/gtao``, else ``~/.cache/gtao``; where that cannot
    be written, ``gtao-cache`` in the folder for temporary files.

    Raises:
        RecordError: ``$GTAO_CACHE_DIR`` is set but cannot be written.
    """
    own = os.environ.get("GTAO_CACHE_DIR")
    if own:
        return _writable(Path(own))
    base = os.environ.get("XDG_CACHE_HOME")
    try:
        # XDG: a relative path is to be ignored.
        directory = (Path(base) if base and os.path.isabs(base) else Path.home() / ".cache") / "gtao"
    except RuntimeError:  # no home
        directory = None
    if directory is not None:
        with contextlib.suppress(RecordError):
            return _writable(directory)
    return Path(tempfile.gettempdir()) / "gtao-cache"


class TransportCache:
    """Transport images by content: the key says what they are made of, the file name is its hash.

    Several processes may share a directory: an entry appears whole or not at all.

    Args:
        directory: where the entries lie; made if missing.

    Raises:
        RecordError: the directory cannot be written.

    Attributes:
        directory: as given.
        damaged: one line for each damaged entry that :meth:`get` met and removed.
    """

    def __init__(self, directory: str | os.PathLike):
        self.directory = _writable(Path(directory))
        self.damaged: list[str] = []

    def path(self, key: Mapping[str, Any]) -> Path:
        """The file of a key: the SHA-256 of its canonical JSON.

        Raises:
            RecordError: the key holds what JSON cannot.
        """
        digest = hashlib.sha256(canonical_json(key).encode()).hexdigest()
        return self.directory / f"{digest}.npz"

    def get(self, key: Mapping[str, Any]) -> StoredTransport | None:
        """The entry of ``key`` or None. A damaged one is removed, noted in :attr:`damaged`, and is a miss."""
        path = self.path(key)
        if not path.exists():
            return None
        try:
            stored = read_transport(path)
            if stored.metadata.get("key") != json.loads(canonical_json(key)):
                raise RecordError(f"{path} belongs to another key")
        except RecordError as cause:
            self.damaged.append(str(cause))
            path.unlink(missing_ok=True)
            return None
        return stored

    def put(self, key: Mapping[str, Any], transport: Any, metadata: Mapping[str, Any] | None = None) -> Path:
        """Keep ``transport`` (see :func:`write_transport`) under ``key``; returns its file.

        Raises:
            RecordError: the counts do not add up, or the directory cannot be written.
        """
        path = self.path(key)
        write_transport(path, transport, {**(metadata or {}), "key": key})
        return path
