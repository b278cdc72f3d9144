"""Slices and steps by quality level."""

from typing import Literal

from gtao.errors import ConfigError

__all__ = ["LEVELS", "Level", "counts_of"]

Level = Literal["low", "medium", "high", "ultra"]

#: Slices and steps per side of XeGTAO's quality levels, which Bevy shares.
LEVELS: dict[str, tuple[int, int]] = {"low": (1, 2), "medium": (2, 2), "high": (3, 3), "ultra": (9, 3)}


def counts_of(level: str) -> dict[str, int]:
    """Options of a level.

    Raises:
        ConfigError: it does not exist.
    """
    if level not in LEVELS:
        raise ConfigError(f"level must be one of {', '.join(map(repr, LEVELS))}, got {level!r}")
    n_slices, n_steps = LEVELS[level]
    return {"n_slices": n_slices, "n_steps": n_steps}
