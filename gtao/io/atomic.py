"""Files that appear whole or not at all: written beside their place, flushed, then renamed into it."""

import contextlib
import errno
import hashlib
import os
import platform
import secrets
from collections.abc import Iterator
from pathlib import Path

from gtao.errors import GtaoError, ImageError

__all__ = ["atomic_path", "ensure_writable", "write_text"]

_MACHINE = hashlib.sha256(platform.node().encode()).hexdigest()[:8]

_REASONS = {
    errno.EACCES: ("permission denied", "choose another place or make the folder writable"),
    errno.EPERM: ("permission denied", "choose another place or make the folder writable"),
    errno.EROFS: ("the file system is read-only", "choose another place"),
    errno.ENOSPC: ("no space left on the device", "free some space or choose another place"),
    errno.EDQUOT: ("the disk quota is used up", "free some space or choose another place"),
    errno.ENOTDIR: ("a parent of it is a file, not a folder", "choose another place"),
    errno.EEXIST: ("a parent of it is a file, not a folder", "choose another place"),
    errno.ENAMETOOLONG: ("the name is too long", "choose a shorter one"),
}


def _failure(path: Path, cause: OSError, error: type[GtaoError]) -> GtaoError:
    reason, advice = _REASONS.get(cause.errno or 0, (cause.strerror or str(cause), "choose another place"))
    return error(f"cannot write {path}: {reason}; {advice}")


def _process_runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def _remove_abandoned(path: Path) -> None:
    """Drop what killed writers of the same file left behind; those of other machines cannot be asked."""
    start = f".{path.name}.{_MACHINE}-"
    for other in path.parent.iterdir():
        if other.name.startswith(start) and ".partial" in other.name:
            pid = other.name[len(start) :].split("-")[0]
            if pid.isdigit() and not _process_runs(int(pid)):
                other.unlink(missing_ok=True)


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _prepare(path: str | os.PathLike, error: type[GtaoError]) -> tuple[Path, Path]:
    """The place to write to (links followed, folders made) and the empty file beside it."""
    target = Path(path)
    try:
        target = target.resolve()
        if target.is_dir():
            raise error(f"cannot write {path}: it is a folder; give the name of a file")
        # Renaming over /dev/null or a pipe would replace the device itself.
        if target.exists() and not target.is_file():
            raise error(f"cannot write {path}: it is a device or a pipe; give the name of a regular file")
        if target.exists() and not os.access(target, os.W_OK):
            raise PermissionError(errno.EACCES, "permission denied")
        target.parent.mkdir(parents=True, exist_ok=True)
        _remove_abandoned(target)
        unique = f"{_MACHINE}-{os.getpid()}-{secrets.token_hex(4)}"
        partial = target.with_name(f".{target.name}.{unique}.partial{target.suffix}")
        os.close(os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
    except OSError as cause:
        if isinstance(cause, GtaoError):
            raise
        raise _failure(Path(path), cause, error) from None
    except (RuntimeError, ValueError) as cause:  # a loop of links, a NUL in the name
        raise error(f"cannot write {os.fspath(path)!r}: {cause}; choose another place") from None
    return target, partial


def _missing_folders(path: str | os.PathLike) -> list[Path]:
    """Folders that writing ``path`` would make, the deepest first."""
    try:
        folders = Path(path).resolve().parents
    except (OSError, RuntimeError, ValueError):  # no place to write to, as _prepare will say
        return []
    return [folder for folder in folders if not os.path.exists(folder)]


@contextlib.contextmanager
def atomic_path(path: str | os.PathLike, *, error: type[GtaoError] = ImageError) -> Iterator[Path]:
    """Write a file under a temporary name and move it to ``path`` when it is complete.

    Folders on the way are made. The temporary file lies in the folder of ``path``, has its suffix, and is
    removed when the body raises. What a killed process left of the same file is removed by the next writer.

    Args:
        path: where the file shall appear; an existing regular file is replaced, its mode kept.
        error: class of the error raised when the place cannot be written.

    Yields:
        The path to write to.

    Raises:
        error: ``path`` is a folder or a device, or the file system refuses; one line that says why.
    """
    target, partial = _prepare(path, error)
    try:
        yield partial
        if target.exists():
            os.chmod(partial, target.stat().st_mode & 0o7777)
        _sync(partial)
        os.replace(partial, target)
        _sync(target.parent)
    except OSError as cause:
        if isinstance(cause, GtaoError):
            raise
        raise _failure(Path(path), cause, error) from None
    finally:
        partial.unlink(missing_ok=True)


def ensure_writable(path: str | os.PathLike, *, error: type[GtaoError] = ImageError) -> None:
    """Raise now, before hours of work, what :func:`atomic_path` would raise for ``path`` at their end.

    Nothing stays behind: folders that the trial needed are removed again.

    Raises:
        error: as for :func:`atomic_path`.
    """
    missing = _missing_folders(path)
    try:
        _, partial = _prepare(path, error)
        partial.unlink(missing_ok=True)
    finally:
        for folder in missing:
            with contextlib.suppress(OSError):
                folder.rmdir()


def write_text(path: str | os.PathLike, text: str, *, error: type[GtaoError] = ImageError) -> None:
    """Write ``text`` as UTF-8, whole or not at all.

    Raises:
        error: as for :func:`atomic_path`.
    """
    with atomic_path(path, error=error) as partial:
        partial.write_text(text, encoding="utf-8")
