"""Angles between normal, view and bent normal in shader code, each computed where it is first asked for."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from .statements import Writer

__all__ = ["Geometry"]

#: -ln u of the cone of reflection with u = 0.01: cos α_s = u^(α² / 2).
_RATE = -math.log(0.01)
#: Narrower cones of reflection, radians, are as good as a mirror.
_LEAST_APERTURE = 1e-4
#: Lobes of smaller microfacet widths are as good as a mirror's.
_LEAST_ALPHA = 1e-3


@dataclass
class Geometry:
    """Variables by name: an attribute is the name of a variable, which is written with all that it needs.

    Attributes:
        w: writer of the language.
        aperture: "seed" or "tilted": how the cone of visible directions follows from visibility.
        weighting: of visibility and bent normal, "cosine" or "uniform".
        lines: the statements so far.
    """

    w: Writer
    aperture: str
    weighting: str
    lines: list[str] = field(default_factory=list)
    _known: set[str] = field(default_factory=set)

    def let(self, name: str, value: str) -> str:
        self.lines.append(self.w.let(name, value))
        return name

    def __getattr__(self, name: str) -> str:
        if name not in _MADE:
            raise AttributeError(name)
        if name not in self._known:
            self._known.add(name)
            self.let(name, _MADE[name](self))
        return name


def _reflected(i: int) -> Callable[[Geometry], str]:
    def write(g: Geometry) -> str:
        return f"{g.w.number(2)} * {g.n_v} * {g.w.read('normal', i)} - {g.w.read('view', i)}"

    return write


def _less_reflected(i: int) -> Callable[[Geometry], str]:
    def write(g: Geometry) -> str:
        reflected = (g.r_x, g.r_y, g.r_z)
        return f"{g.w.read('bent_normal', i)} - {reflected[i]}"

    return write


def _cross(i: int, j: int) -> Callable[[Geometry], str]:
    def write(g: Geometry) -> str:
        n, v = ([g.w.read(name, k) for k in range(3)] for name in ("normal", "view"))
        return f"{n[i]} * {v[j]} - {n[j]} * {v[i]}"

    return write


def _length(g: Geometry, *of: str) -> str:
    return g.w.L.call("root", " + ".join(f"{c} * {c}" for c in of))


def _beta(g: Geometry) -> str:
    """Twice the arc sine of half the chord, which is right for small angles too."""
    w = g.w
    chord = g.let("chord", _length(g, g.d_x, g.d_y, g.d_z))
    return f"{w.number(2)} * {w.L.call('arcsine', w.L.min(f'{w.number(0.5)} * {chord}', w.number(1)))}"


def _cos_beta(g: Geometry) -> str:
    return " + ".join(f"{g.w.read('bent_normal', i)} * {r}" for i, r in enumerate((g.r_x, g.r_y, g.r_z)))


def _across(g: Geometry) -> str:
    """Of the bent normal: along the incidence plane's own normal, which has the direction of n × v."""
    return " + ".join(f"{g.w.read('bent_normal', i)} * {c}" for i, c in enumerate((g.c_x, g.c_y, g.c_z)))


def _cos_chi(g: Geometry) -> str:
    """Of the bent normal's azimuth about the reflected direction; toward the normal where it has none."""
    w = g.w
    square = g.let("square", f"{g.along} * {g.along} + {g.across} * {g.across}")
    some = w.L.max(square, w.number(1e-20))
    return w.L.select(f"{square} > {w.number(1e-20)}", f"{g.along} / {w.L.call('root', some)}", w.number(1))


def _squared_sine(g: Geometry) -> str:
    """Of the half angle of the visible cone."""
    if g.weighting == "uniform":
        return f"{g.visible} * ({g.w.number(2)} - {g.visible})"
    if g.aperture == "seed":
        return g.visible
    return g.w.L.select(f"{g.n_b} > {g.visible}", f"{g.visible} / {g.n_b}", g.w.number(1))


def _cos_alpha_v(g: Geometry) -> str:
    if g.weighting == "uniform":
        return f"{g.w.number(1)} - {g.visible}"
    return g.w.L.call("root", f"{g.w.number(1)} - {g.squared_sine}")


def _alpha_v(g: Geometry) -> str:
    return g.w.L.angle(g.w.L.call("root", g.squared_sine), g.cos_alpha_v)


def _cos_alpha_s(g: Geometry) -> str:
    return g.w.L.call("exponential", f"{g.w.number(-_RATE / 2)} * {g.alpha} * {g.alpha}")


def _sin2_half_alpha_s(g: Geometry) -> str:
    """(1 - exp(-x)) / 2, for small x as a series, since the difference would lose its digits."""
    w = g.w
    one, half, sixth, last = (w.number(1 / k) for k in (1, 2, 6, 24))
    x = g.let("exponent", f"{w.number(_RATE / 2)} * {g.alpha} * {g.alpha}")
    series = g.let("series", f"{x} * ({one} - {x} * ({half} - {x} * ({sixth} - {x} * {last})))")
    difference = w.L.select(f"{x} < {w.number(0.1)}", series, f"{one} - {g.cos_alpha_s}")
    return w.L.max(f"{half} * {difference}", w.number((_LEAST_APERTURE / 2) ** 2))


def _alpha_s(g: Geometry) -> str:
    w = g.w
    return f"{w.number(2)} * {w.L.call('arcsine', w.L.call('root', g.sin2_half_alpha_s))}"


#: Variable -> function that gives its value and writes what comes before.
_MADE: dict[str, Callable[[Geometry], str]] = {
    "n_v": lambda g: g.w.dot("normal", "view"),
    "n_b": lambda g: g.w.dot("normal", "bent_normal"),
    "r_x": _reflected(0),
    "r_y": _reflected(1),
    "r_z": _reflected(2),
    "d_x": _less_reflected(0),
    "d_y": _less_reflected(1),
    "d_z": _less_reflected(2),
    "c_x": _cross(1, 2),
    "c_y": _cross(2, 0),
    "c_z": _cross(0, 1),
    "beta": _beta,
    "cos_beta": _cos_beta,
    "sin_theta_o": lambda g: _length(g, g.c_x, g.c_y, g.c_z),
    "theta_o": lambda g: g.w.L.angle(g.sin_theta_o, g.n_v),
    "along": lambda g: f"{g.n_b} - {g.cos_beta} * {g.n_v}",
    "across": _across,
    "cos_chi": _cos_chi,
    "chi": lambda g: g.w.L.angle(g.w.L.call("absolute", g.across), g.along),
    "visible": lambda g: g.w.clamped("visibility"),
    "squared_sine": _squared_sine,
    "cos_alpha_v": _cos_alpha_v,
    "alpha_v": _alpha_v,
    "alpha": lambda g: "roughness * roughness",
    "lobe_alpha": lambda g: g.w.L.max(g.alpha, g.w.number(_LEAST_ALPHA)),
    "cos_alpha_s": _cos_alpha_s,
    "sin2_half_alpha_s": _sin2_half_alpha_s,
    "alpha_s": _alpha_s,
    "narrower": lambda g: g.w.L.min(g.alpha_v, g.alpha_s),
    "wider": lambda g: g.w.L.max(g.alpha_v, g.alpha_s),
}
