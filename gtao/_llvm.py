"""Find an LLVM library that Dr.Jit can use, without loading any.

Dr.Jit opens libLLVM when it is imported and by default takes whatever the loader offers. LLVM 14 and older are
refused; 15 and 16 are accepted but abort the whole process at the first floating-point ``dr.minimum`` or
``dr.maximum``, which Mitsuba uses everywhere. The choice therefore has to be made before the first import.
"""

import ctypes.util
import importlib.metadata
import os
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

MINIMUM_MAJOR = 17
WHEEL = "karellen-llvm-core"
SEARCH_PATH_VARIABLE = "GTAO_LLVM_SEARCH_PATH"
LIBRARY_VARIABLE = "DRJIT_LIBLLVM_PATH"

_NAME = re.compile(r"^libLLVM(?:-(?P<dash>\d+)[\d.]*)?\.so(?:\.(?P<dot>\d+)[\d.]*)?$")
_SYSTEM_DIRECTORIES = (
    "/usr/local/lib",
    "/usr/lib/x86_64-linux-gnu",
    "/usr/lib/aarch64-linux-gnu",
    "/usr/lib64",
    "/usr/lib",
)


@dataclass(frozen=True)
class Library:
    """One libLLVM file. ``major`` is 0 where the version cannot be told."""

    path: str
    major: int
    origin: str  # "environment variable", "system" or "wheel"

    @property
    def usable(self) -> bool:
        return self.major >= MINIMUM_MAJOR


@dataclass(frozen=True)
class Choice:
    """What was found and what Dr.Jit will be given; ``library`` is None when nothing is usable."""

    library: Library | None
    found: tuple[Library, ...]
    reason: str


def major_from_name(path: str | os.PathLike) -> int:
    """Major version read from a library's file name or from the name its links resolve to; 0 if neither tells."""
    for candidate in (Path(path), Path(os.path.realpath(path))):
        match = _NAME.match(candidate.name)
        # Debian names old releases libLLVM-15.so.1: the number after the dash is the version, not the suffix.
        if match and (number := match["dash"] or match["dot"]):
            return int(number)
    return 0


def major_from_probe(path: str | os.PathLike) -> int:
    """Ask the library itself, in a process of its own so that nothing is loaded into this one."""
    script = (
        "import ctypes, sys\n"
        "lib = ctypes.CDLL(sys.argv[1])\n"
        "v = (ctypes.c_uint * 3)()\n"
        "lib.LLVMGetVersion(v, ctypes.byref(v, 4), ctypes.byref(v, 8))\n"
        "print(v[0])\n"
    )
    try:
        run = subprocess.run(
            [sys.executable, "-I", "-c", script, os.fspath(path)], capture_output=True, text=True, timeout=30
        )
        return int(run.stdout) if run.returncode == 0 else 0
    except (OSError, ValueError, subprocess.TimeoutExpired):
        return 0


def _in_directories(directories: Sequence[str | os.PathLike], origin: str) -> list[Library]:
    found: dict[str, Library] = {}
    for directory in map(Path, directories):
        for path in sorted(directory.glob("libLLVM*.so*")):
            real = os.path.realpath(path)
            if _NAME.match(path.name) and real not in found and os.path.isfile(real):
                found[real] = Library(str(path), major_from_name(path), origin)
    return list(found.values())


def _system_libraries() -> list[Library]:
    versioned = sorted(str(p) for p in Path("/usr/lib").glob("llvm-*/lib"))
    return _in_directories([*_SYSTEM_DIRECTORIES, *versioned], "system")


def _wheel_library() -> list[Library]:
    try:
        files = importlib.metadata.files(WHEEL) or []
    except importlib.metadata.PackageNotFoundError:
        return []
    for file in files:
        if file.name.startswith("libLLVM.so."):
            path = Path(str(file.locate())).resolve()
            if path.is_file():
                return [Library(str(path), major_from_name(path), "wheel")]
    return []


def choose(environ: Mapping[str, str] = os.environ) -> Choice:
    """The library to give to Dr.Jit: the user's, else the newest usable one of the system, else the wheel's.

    ``GTAO_LLVM_SEARCH_PATH`` (directories separated by ``:``; may be empty) replaces the system's directories and the
    wheel.
    """
    if user := environ.get(LIBRARY_VARIABLE):
        resolved = user if os.path.exists(user) else ctypes.util.find_library(user)
        major = (major_from_name(user) or major_from_probe(user)) if resolved else 0
        library = Library(user, major, "environment variable")
        if library.usable:
            return Choice(library, (library,), f"{LIBRARY_VARIABLE} is set")
        state = f"LLVM {major}" if major else ("no LLVM library" if resolved else "missing")
        return Choice(None, (library,), f"{LIBRARY_VARIABLE} names {user}, which is {state}")

    if (search := environ.get(SEARCH_PATH_VARIABLE)) is not None:
        found = _in_directories([d for d in search.split(os.pathsep) if d], "system")
    else:
        found = _system_libraries() + _wheel_library()
    usable = [library for library in found if library.usable]
    system = [library for library in usable if library.origin == "system"]
    if system:
        best = max(system, key=lambda library: library.major)
        return Choice(best, tuple(found), "the newest usable system library")
    if usable:
        return Choice(usable[0], tuple(found), f"the one that the package {WHEEL} brings")
    if found:
        versions = ", ".join(str(v) for v in sorted({library.major for library in found}))
        return Choice(
            None,
            tuple(found),
            f"only LLVM {versions} is installed, and Dr.Jit needs {MINIMUM_MAJOR} or newer",
        )
    return Choice(None, (), "no LLVM library is installed")
