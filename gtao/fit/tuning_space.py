"""The space that tuning searches: coordinates of the chosen options between their bounds, and back."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gtao.config import IndexFalloff
from gtao.errors import ConfigError

from .tuning_options import CONTINUOUS, continuous, scene_options, with_continuous

__all__ = ["Bounds", "Parameter", "Space"]

Bounds = tuple[float, float] | None


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One option that is tuned.

    Its coordinate is the logarithm of the value where steps are relative, and the position between the bounds else:
    a step of 0.1 is one of 10 % or of a tenth of the range. Bounds are closed, so that an option may end at 0.

    Attributes:
        path: a key of ``gtao.fit.CONTINUOUS``.
        low, high: bounds of the value, in its unit there.
        start: value that the search begins with.
    """

    path: str
    low: float
    high: float
    start: float

    def __post_init__(self) -> None:
        least = " and the lower one positive" if self._relative else ""
        if not (-math.inf < self.low < self.high < math.inf) or (self._relative and self.low <= 0):
            raise ConfigError(
                f"bounds of {self.path} must be finite and increasing{least}, got {self.low:g} and {self.high:g}"
            )
        if not self.low <= self.start <= self.high:
            raise ConfigError(
                f"{self.path} starts at {self.start:g}, outside of its bounds {self.low:g} and {self.high:g};"
                " give other bounds or another start"
            )

    @property
    def _relative(self) -> bool:
        return CONTINUOUS[self.path].relative

    def coordinate(self, value: float) -> float:
        return math.log(value) if self._relative else (value - self.low) / (self.high - self.low)

    def value(self, coordinate: float) -> float:
        # Bounds are reached exactly, whatever the logarithm rounds to: options may end there.
        if coordinate <= self.coordinate(self.low):
            return self.low
        if coordinate >= self.coordinate(self.high):
            return self.high
        return math.exp(coordinate) if self._relative else coordinate * (self.high - self.low) + self.low

    def slope(self, coordinate: float) -> float:
        """Derivative of the value."""
        return self.value(coordinate) if self._relative else self.high - self.low


class Space:
    """Coordinates of the options of one method that are tuned.

    Args:
        method: a configuration or a pipeline.
        parameters: path -> bounds of the values, or None for those of ``gtao.fit.CONTINUOUS``.

    Raises:
        ConfigError: there is nothing to tune, the method has no such option, an option starts outside of its bounds.
    """

    def __init__(self, method: Any, parameters: Mapping[str, Bounds]):
        if not parameters:
            raise ConfigError("there is nothing to tune; name at least one parameter")
        self.method = method
        self.parameters = tuple(self._parameter(path, bounds) for path, bounds in parameters.items())
        self.lower = np.array([p.coordinate(p.low) for p in self.parameters])
        self.upper = np.array([p.coordinate(p.high) for p in self.parameters])
        self.start = np.array([p.coordinate(p.start) for p in self.parameters])

    @classmethod
    def where_possible(cls, method: Any, parameters: Mapping[str, Bounds]) -> "Space":
        """The space of those parameters that the method has."""
        known = continuous(method)
        return cls(method, {path: bounds for path, bounds in parameters.items() if path in known})

    def _parameter(self, path: str, bounds: Bounds) -> Parameter:
        known = continuous(self.method)
        if path not in known:
            raise ConfigError(f"{path!r} cannot be tuned here; choose from {', '.join(known)}")
        if bounds is not None and (not isinstance(bounds, tuple | list) or len(bounds) != 2):
            raise ConfigError(f"bounds of {path} must be None or (low, high), got {bounds!r}")
        low, high = bounds or (CONTINUOUS[path].low, CONTINUOUS[path].high)
        falloff = getattr(getattr(self.method, "occlusion", self.method), "falloff", None)
        if bounds is None and path == "falloff.strength" and isinstance(falloff, IndexFalloff):
            high = 1.0
        return Parameter(path=path, low=float(low), high=float(high), start=known[path])

    def values(self, coordinates: np.ndarray) -> dict[str, float]:
        """Values by path."""
        return {p.path: p.value(float(u)) for p, u in zip(self.parameters, coordinates, strict=True)}

    def build(self, coordinates: np.ndarray, radius: float | None = None) -> Any:
        """The configuration at coordinates, for a radius in scene units."""
        return with_continuous(self.method, self.values(coordinates), radius)

    def options(self, coordinates: np.ndarray, radius: float | None) -> dict[str, float]:
        """All continuous options of :meth:`build` in scene units, by path."""
        return scene_options(self.method, self.values(coordinates), radius)

    def derivatives(self, coordinates: np.ndarray, i: int, radius: float | None) -> dict[str, float]:
        """Derivatives of :meth:`options` by coordinate ``i``, those that are not 0."""
        values, p = self.values(coordinates), self.parameters[i]
        # Options are linear in a value, so that a difference over any step is their derivative.
        step = 1e-3 * (abs(values[p.path]) or 1.0)
        here, there = (scene_options(self.method, values | {p.path: values[p.path] + d}, radius) for d in (0.0, step))
        slope = p.slope(float(coordinates[i]))
        return {path: (there[path] - here[path]) / step * slope for path in here if there[path] != here[path]}
