"""The door to the OpenEXR binding: opens files quietly and turns what can go wrong into one line."""

import contextlib
import os
import re
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from io import StringIO
from pathlib import Path
from typing import Any

import OpenEXR

from gtao.errors import ImageError

__all__ = ["captured_notices", "check_readable", "open_exr", "reason_of"]

_MAGIC = b"\x76\x2f\x31\x01"
_STDERR_LOCK = threading.Lock()


@contextlib.contextmanager
def captured_notices() -> Iterator[Callable[[], str]]:
    """Keep OpenEXR from writing to stdout (its Python part) and to file descriptor 2 (its C part).

    What was caught is the reason that an error should give; it is dropped when all went well.
    """
    with _STDERR_LOCK, tempfile.TemporaryFile() as caught, contextlib.redirect_stdout(StringIO()) as printed:
        sys.stderr.flush()
        saved = os.dup(2)
        os.dup2(caught.fileno(), 2)

        def text() -> str:
            caught.seek(0)
            return caught.read().decode("utf-8", "replace") + printed.getvalue()

        try:
            yield text
        finally:
            os.dup2(saved, 2)
            os.close(saved)


def reason_of(notices: str, path: str) -> str:
    """The first line of OpenEXR's notices without the path and the error code."""
    first = next((line for line in notices.splitlines() if line.strip()), "")
    first = re.sub(r"^Warning: Exception raised reading pixel data for part \d+ - ", "", first)
    first = re.sub(r"\(EXR_ERR_\w+\) ", "", first.replace(f"{path}: ", ""))
    return first.strip() or "the pixel data are incomplete"


def check_readable(path: Path) -> None:
    """Raise ImageError unless ``path`` is a regular file that begins like an OpenEXR image."""
    try:
        if path.exists() and not path.is_file():
            raise ImageError(f"cannot read {path}: it is not a regular file; give the name of an EXR file")
        with path.open("rb") as file:
            start = file.read(4)
    except FileNotFoundError:
        raise ImageError(f"cannot read {path}: there is no such file; check the path") from None
    except ImageError:
        raise
    except (OSError, ValueError) as cause:
        reason = getattr(cause, "strerror", None) or str(cause)
        raise ImageError(f"cannot read {path}: {reason.lower()}; check the path and its permissions") from None
    if start != _MAGIC:
        what = "it is empty" if not start else "it is not an OpenEXR image"
        raise ImageError(f"cannot read {path}: {what}; export the image as EXR")


def open_exr(path: Path, *, header_only: bool) -> Any:
    """An ``OpenEXR.File``, from which parts with damaged pixels are missing; ImageError when none is left."""
    with captured_notices() as notices:
        try:
            file = OpenEXR.File(str(path), separate_channels=True, header_only=header_only)
        except MemoryError:
            raise ImageError(f"cannot read {path}: it does not fit into memory; crop or split the image") from None
        # The binding reports damaged headers through several exception types.
        except Exception as cause:
            reason = str(cause).replace(f"'{path}'", "it").splitlines()[0]
            raise ImageError(f"cannot read {path}: damaged header ({reason}); export the image again") from None
        n_parts = len(file.parts)
        if n_parts == 0:
            reason = reason_of(notices(), str(path))
            raise ImageError(f"cannot read {path}: damaged or cut short ({reason}); export the image again")
    return file
