"""Light from afar by name: files, and light that needs none."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from gtao import io, render
from gtao.errors import ConfigError
from gtao.lighting import EnvironmentMap, disc, gradient_sky, non_negative, von_mises_fisher, window
from gtao.plot.comparing import figure_name

from .methods import ORDERS

__all__ = ["Light", "lights", "placed"]

#: Kind of the window against ringing.
WINDOW = "laplacian"
#: Rows of the maps that are made here: a texel is 1.4 degrees high.
HEIGHT = 128
#: Directions along each side of a texel of Mitsuba's sky: a dozen fall into the sun.
SUN_SAMPLES = 16
UP = (0.0, 1.0, 0.0)
#: Where lobes and discs stand: elevation and azimuth, radians.
ELEVATION, AZIMUTH = math.radians(40), math.radians(30)
#: Linear RGB of the sky: zenith, horizon, ground.
SKY = ((0.25, 0.45, 1.0), (0.9, 0.95, 1.0), (0.12, 0.1, 0.08))


@dataclass(frozen=True, eq=False)
class Light:
    """Light, with its top toward +y of the world.

    Attributes:
        name: what tables call it.
        map: its radiance.
        source: file with its hash, or an empty dictionary.
    """

    name: str
    map: EnvironmentMap
    source: dict[str, Any]

    @cached_property
    def widths(self) -> dict[int, float]:
        """Highest band -> width of the window that leaves no negative radiance anywhere; inf where none is needed."""
        light = self.map.project(max(ORDERS))
        return {order: non_negative(light[: (order + 1) ** 2], WINDOW)[1] for order in ORDERS}

    def windowed(self, light: np.ndarray, order: int) -> np.ndarray:
        """Coefficients of the light in any frame, up to a band, without negative radiance."""
        cut = light[: (order + 1) ** 2]
        return cut if math.isinf(self.widths[order]) else window(cut, WINDOW, self.widths[order])


def lights(given: Sequence[str]) -> list[Light]:
    """Light of every word or file.

    Raises:
        ConfigError: a word says nothing, a number in it is out of range, or pictures under two of them would have
            one name.
        ImageError: a file cannot be read.
    """
    found = [_light(text) for text in given]
    names = [light.name for light in found]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ConfigError(f"light given more than once, or files of one name: {', '.join(twice)}; rename one")
    pictures: dict[str, str] = {}
    for name in names:
        other = pictures.setdefault(figure_name("", name), name)
        if other != name:
            raise ConfigError(f"pictures under {other!r} and {name!r} would have the same file names; rename one file")
    return found


def placed(light: Light, up: str, turn: float) -> EnvironmentMap:
    """The map in a world whose ``up`` axis is the vertical, turned about it by ``turn`` degrees."""
    angle = math.radians(turn)
    c, s = math.cos(angle), math.sin(angle)
    turned = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return EnvironmentMap(light.map.radiance, FROM_Y[up] @ turned @ light.map.to_world)


#: Rotations that take +y to each axis.
FROM_Y = {
    "x": np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]),
    "y": np.eye(3),
    "z": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),
}


def _light(text: str) -> Light:
    kind, colon, value = text.partition(":")
    make = _MADE.get(kind)
    if make is not None and bool(colon) == make.needs_number:
        return Light(text, make.function(_number(text, value)) if colon else make.function(), {})
    path = Path(text)
    if path.suffix.lower() in (".hdr", ".exr"):
        # What compression has pulled below zero is not worth refusing a picture for.
        return Light(path.stem, io.read_environment(path, repair=True), io.file_entry(path))
    words = ", ".join(f"{name}:NUMBER" if made.needs_number else name for name, made in _MADE.items())
    raise ConfigError(f"light must be a .hdr or .exr file or one of {words}, got {text!r}")


def _number(text: str, value: str) -> float:
    try:
        return float(value)
    except ValueError:
        raise ConfigError(f"light {text!r} must have a number after the colon") from None


def _direction() -> tuple[float, float, float]:
    across = math.cos(ELEVATION)
    return across * math.cos(AZIMUTH), math.sin(ELEVATION), across * math.sin(AZIMUTH)


def _sky() -> EnvironmentMap:
    return gradient_sky(UP, *SKY).map(HEIGHT)


def _lobe(kappa: float) -> EnvironmentMap:
    return von_mises_fisher(_direction(), kappa).map(HEIGHT)


def _disc(degrees: float) -> EnvironmentMap:
    if not 0 < degrees <= 180:
        raise ConfigError(f"environment disc:DEGREES must lie above 0 and at most at 180 degrees, got {degrees:g}")
    return disc(_direction(), math.radians(degrees)).map(HEIGHT)


def _sun_and_sky() -> EnvironmentMap:
    scene = render.load_scene({"type": "scene", "light": {"type": "sunsky"}})
    found = render.environment(scene, HEIGHT, samples=SUN_SAMPLES)
    return EnvironmentMap(found.radiance, FROM_Y["z"].T @ found.to_world)


@dataclass(frozen=True)
class _Made:
    function: Callable[..., EnvironmentMap]
    needs_number: bool


_MADE = {
    "gradient": _Made(_sky, False),
    "vmf": _Made(_lobe, True),
    "disc": _Made(_disc, True),
    "sunsky": _Made(_sun_and_sky, False),
}
