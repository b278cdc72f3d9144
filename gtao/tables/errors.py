"""How far tables are from what they stand for, between their texels."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from gtao.data.specular import SpecularTable
from gtao.errors import ConfigError
from gtao.kernels.table_axes import ARGUMENTS, AXES
from gtao.kernels.table_lookup import lookup

from .brdf import cone_shares, hemisphere_terms
from .configurations import configurations
from .lanes import lanes, numbers
from .values import value_of

__all__ = ["ChannelErrors", "TableErrors", "errors", "look_up"]

#: Reflectance at normal incidence of common materials, for errors of the two channels together.
F0 = 0.04


@dataclass(frozen=True)
class ChannelErrors:
    """Errors of one channel: root mean square, 99th percentile of the absolute error, largest, and where that is.

    ``where`` has the arguments there — angles in radians, alpha the microfacet width —, what the table says and what
    is true.
    """

    name: str
    rms: float
    p99: float
    max: float
    where: Mapping[str, float]

    def __str__(self) -> str:
        place = ", ".join(f"{name} {value:.3g}" for name, value in self.where.items())
        return f"{self.name}: RMS {self.rms:.5f}, 99 % {self.p99:.4f}, largest {self.max:.3f} at {place}"


@dataclass(frozen=True)
class TableErrors:
    """What :func:`errors` finds: an entry per channel, and for ratios one more, of S at F0 = 0.04."""

    channels: tuple[ChannelErrors, ...]
    n: int

    def __getitem__(self, name: str) -> ChannelErrors:
        return next(channel for channel in self.channels if channel.name == name)

    def __str__(self) -> str:
        return "\n".join(map(str, self.channels))

    def to_dict(self) -> dict[str, Any]:
        return {"n": self.n, "channels": [asdict(channel) for channel in self.channels]}


def look_up(table: SpecularTable, arguments: Mapping[str, np.ndarray]) -> np.ndarray:
    """(n, C) channels of a table at arguments by name, each (n,); linear between texels, in double precision."""
    axes = AXES[table.kind, table.axes]
    like = next(iter(arguments.values()))
    given = dict(zip(arguments, lanes(*arguments.values()), strict=True))
    (texels,) = lanes(table.values)
    found = lookup(texels, table.size, table.n_channels, axes.to_unit(**given))
    scale = numbers(axes.scale(**given), like=like)
    return np.stack([numbers(channel, like=like) * scale for channel in found], axis=-1)


def errors(
    table: SpecularTable,
    n: int = 20000,
    seed: int = 0,
    *,
    against: str = "table",
    uniform: str = "alpha",
    tilt: float = 0.5 * np.pi,
) -> TableErrors:
    """Errors of looking a table up, against quadrature at random places.

    Visibility is uniform in [0, 1], of a cone that a normal along its axis sees; the microfacet width in [0.03, 1], or
    perceptual roughness in [0.1, 1]. For cones and lobes, and for cones about the normal, β is uniform in
    [0°, 90°]; else the reflected direction is anywhere above the surface, and so is the cone's axis, up to ``tilt``.

    Args:
        table: of GGX; its values may have been rounded, see :func:`gtao.tables.quantised`.
        n: number of places.
        seed: of their random numbers.
        against: "table", what its texels stand for: the error of size, axes and encoding. "cone", S at F0 = 0.04 of
            what a surface reflects of the light in a cone wherever its axis is: that of what the kind leaves out too.
        uniform: "alpha" or "roughness".
        tilt: largest angle between normal and axis, radians, in (0, π/2].

    Raises:
        ConfigError: an option is not one of the above, or the table is of another BRDF.
        BackendError: there is no usable backend.
    """
    if against not in ("table", "cone"):
        raise ConfigError(f"against must be 'table' or 'cone', got {against!r}")
    if table.settings.get("brdf", "GGX") != "GGX":
        raise ConfigError("errors are known of tables of GGX; this one is of another BRDF")
    whole = against == "cone"
    if whole and table.kind == "environment-brdf":
        raise ConfigError("a table 'environment-brdf' knows no cones; use against='table'")
    places = configurations("brdf-5d" if whole else table.kind, n, seed, uniform=uniform, tilt=tilt)
    given = {name: places[name] for name in ARGUMENTS[table.kind]}
    found = look_up(table, given)
    if whole:
        truth = cone_shares(*(places[name] for name in ARGUMENTS["brdf-5d"])).values
        found, truth = (_together(x, places) for x in (found, truth))
        return TableErrors((_channel("S", found, truth, places),), n)
    settings = {"distribution": table.settings.get("distribution", "ggx")}
    truth = value_of(table.kind, tuple(given.values()), **settings).values
    names = {1: ("S",), 2: ("A", "B") if table.kind == "environment-brdf" else ("S_A", "S_B")}[table.n_channels]
    channels = [_channel(name, found[:, i], truth[:, i], given) for i, name in enumerate(names)]
    if names == ("S_A", "S_B"):
        together = (_together(x, given) for x in (found, truth))
        channels.append(_channel("S", *together, given))
    return TableErrors(tuple(channels), n)


def _together(ratios: np.ndarray, places: Mapping[str, np.ndarray]) -> np.ndarray:
    """S at F0 of ratios (n, 2), or the S that is all there is (n, 1)."""
    if ratios.shape[1] == 1:
        return ratios[:, 0]
    terms = hemisphere_terms(places["alpha"], places.get("theta_o", places["beta"])).values * (F0, 1.0)
    return np.sum(ratios * terms, axis=1) / np.sum(terms, axis=1)


def _channel(name: str, found: np.ndarray, truth: np.ndarray, places: Mapping[str, np.ndarray]) -> ChannelErrors:
    error = np.abs(found - truth)
    worst = int(np.argmax(error))
    where = {key: float(values[worst]) for key, values in places.items()}
    return ChannelErrors(
        name=name,
        rms=float(np.sqrt(np.mean(error**2))),
        p99=float(np.quantile(error, 0.99)),
        max=float(error[worst]),
        where=where | {"table": float(found[worst]), "truth": float(truth[worst])},
    )
