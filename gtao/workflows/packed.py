"""Packed files beside the EXR of an estimate."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from gtao import io
from gtao.errors import ConfigError

__all__ = ["packed_paths", "write_packings"]

#: Setting that makes an estimator give what a packing stores.
_SETTINGS = {
    "bent_normal": "bent_normal=true",
    "mean_direction": "bent_normal=true",
    "visibility_sh": "directional=true",
}


def _gives(method: Any, needs: str) -> bool:
    if getattr(method, "directional", False):
        return True
    bent = getattr(method, "bent_normal", False)
    # The average horizon has a direction without a length.
    return (needs == "bent_normal" and bool(bent)) or (needs == "mean_direction" and bent is True)


def packed_paths(output: Path, packings: Iterable[str], method: Any) -> dict[str, Path]:
    """Packing -> file: ``out.rgba8.png`` beside ``out.exr``; found out before any work is done.

    Raises:
        ConfigError: a packing does not exist, or the method does not give what it stores.
        ImageError: a file cannot be written.
    """
    paths = {}
    for name in packings:
        suffix = io.packed_suffix(name)
        needs = io.PACKINGS[name].needs
        if not _gives(method, needs):
            setting = _SETTINGS[needs]
            if not hasattr(method, setting.partition("=")[0]):
                raise ConfigError(f"{type(method).__name__} gives no directions to pack as {name}; use another method")
            raise ConfigError(f"packing {name} stores {needs}; add --set {setting}")
        paths[name] = output.with_name(f"{output.stem}.{name}{suffix}")
        io.ensure_writable(paths[name])
    return paths


def write_packings(ao: Any, paths: dict[str, Path], manifest: dict[str, Any]) -> dict[Path, io.PackingErrors]:
    """Write the files, and measure what packing costs.

    Raises:
        ShapeError: the estimate holds what cannot be packed.
        ImageError: a file cannot be written.
    """
    errors = {path: io.packing_errors(ao, name) for name, path in paths.items()}
    for name, path in paths.items():
        io.write_packed(path, ao, name, manifest=manifest)
    return errors
