"""Where numbers come from: program, versions, device, command; without a trace of the machine's folders."""

import hashlib
import importlib.metadata
import os
import platform
import subprocess
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from gtao.errors import RecordError

__all__ = ["file_entry", "git_state", "portable", "provenance", "sha256_file", "versions"]

_PACKAGES = ("mitsuba", "drjit", "numpy", "scipy", "OpenEXR")


def sha256_file(path: str | os.PathLike) -> str:
    """SHA-256 of a file's content, in hexadecimal.

    Raises:
        RecordError: the file cannot be read.
    """
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as cause:
        raise RecordError(f"cannot read {path}: {(cause.strerror or str(cause)).lower()}; check the path") from None


def portable(path: str | os.PathLike, base: str | os.PathLike | None = None) -> str:
    """How a record calls a file: relative to ``base`` (default: the working directory), or by its name."""
    text = os.fspath(path)
    absolute = os.path.abspath(text)
    inside = os.path.relpath(absolute, os.path.abspath(base or os.curdir))
    return Path(absolute).name if inside.startswith(os.pardir) else Path(inside).as_posix()


def file_entry(path: str | os.PathLike, base: str | os.PathLike | None = None) -> dict[str, Any]:
    """Name, size in bytes and SHA-256 of a file, as records list their inputs and outputs.

    Raises:
        RecordError: the file cannot be read.
    """
    digest = sha256_file(path)
    return {"path": portable(path, base), "bytes": os.stat(path).st_size, "sha256": digest}


def _git(folder: Path, *arguments: str) -> str | None:
    try:
        done = subprocess.run(
            ["git", "-C", str(folder), *arguments], capture_output=True, text=True, check=True, timeout=30
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()


def git_state() -> dict[str, Any] | None:
    """``{"commit", "dirty"}`` of the repository that the package runs from; None for an installed package.

    ``dirty`` is True when a tracked file differs from the commit.
    """
    package = Path(__file__).resolve().parents[1]
    top = _git(package, "rev-parse", "--show-toplevel")
    # An installed copy may lie inside somebody else's repository.
    if top is None or Path(top).resolve() != package.parent:
        return None
    commit = _git(package, "rev-parse", "HEAD")
    changes = _git(package, "status", "--porcelain", "--untracked-files=no")
    if commit is None or changes is None:
        return None
    return {"commit": commit, "dirty": bool(changes)}


def versions() -> dict[str, str | None]:
    """Versions of gtao, Python and the packages below it, without importing them; None if missing."""
    from gtao._version import __version__

    found: dict[str, str | None] = {"gtao": __version__, "python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found[name] = None
    return found


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _device() -> tuple[dict[str, Any], str | None]:
    """The device that Dr.Jit uses, and the version of LLVM if it does."""
    from gtao import backend

    state = backend.report()
    llvm = ".".join(map(str, state.llvm_version)) if state.llvm_version else None
    return {"backend": state.backend, "processor": _processor(), "n_cpus": os.cpu_count()}, llvm


def _portable_argument(argument: str) -> str:
    """A command-line word with its path, if it is or holds an absolute one, made portable."""
    option, equals, value = argument.partition("=")
    if equals and os.path.isabs(value):
        return f"{option}={portable(value)}"
    return portable(argument) if os.path.isabs(argument) else argument


def provenance(command: Sequence[str] | str, seed: int | None, config: Any) -> dict[str, Any]:
    """The part of a record that says how its numbers were made.

    Args:
        command: the command line, program first; absolute paths in it are made portable.
        seed: the seed of the run, or None if nothing is random.
        config: a configuration object or a dict of options.

    Returns:
        ``created`` (UTC, ISO 8601), ``command``, ``git``, ``versions``, ``device``, ``seed``, ``config``; a dict
        that :func:`gtao.io.write_record` takes once ``kind``, ``inputs``, ``outputs``, ``numbers`` are added.
    """
    words = [command] if isinstance(command, str) else list(command)
    if words:
        words[0] = Path(words[0]).name if os.path.isabs(words[0]) else words[0]
    device, llvm = _device()
    return {
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": [_portable_argument(word) for word in words],
        "git": git_state(),
        "versions": {**versions(), "llvm": llvm},
        "device": device,
        "seed": seed,
        "config": dict(config) if isinstance(config, Mapping) else config,
    }
