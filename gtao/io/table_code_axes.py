"""Coordinates of tables in shader code: from normal, view and bent normal to the unit cube."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from .statements import Writer

__all__ = ["COORDINATES", "SCALES", "Geometry"]

#: -ln u of the cone of reflection with u = 0.01: cos α_s = u^(α² / 2).
_RATE = -math.log(0.01)
#: Narrower cones of reflection, radians, are as good as a mirror.
_LEAST = 1e-4


@dataclass
class Geometry:
    """The angles that coordinates are made of, each computed once, when it is first asked for.

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
        """The variable of that name, with the statements that it needs."""
        if name not in _MADE:
            raise AttributeError(name)
        if name not in self._known:
            self._known.add(name)
            value = _MADE[name](self)
            self.let(name, value)
        return name


def _reflected(g: Geometry, i: int) -> str:
    w = g.w
    return f"{w.number(2)} * {g.n_v} * {w.read('normal', i)} - {w.read('view', i)}"


def _bent_less_reflected(g: Geometry, axis: str) -> str:
    return f"{g.w.read('bent_normal', 'xyz'.index(axis))} - {getattr(g, f'r_{axis}')}"


def _beta(g: Geometry) -> str:
    """Twice the arc sine of half the chord, which is right for small angles too."""
    w = g.w
    square = " + ".join(f"{d} * {d}" for d in (g.d_x, g.d_y, g.d_z))
    chord = g.let("chord", w.L.call("root", square))
    return f"{w.number(2)} * {w.L.call('arcsine', w.L.min(f'{w.number(0.5)} * {chord}', w.number(1)))}"


def _cos_beta(g: Geometry) -> str:
    return " + ".join(f"{g.w.read('bent_normal', i)} * {r}" for i, r in enumerate((g.r_x, g.r_y, g.r_z)))


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


def _sin2_half_alpha_s(g: Geometry) -> str:
    """(1 - exp(-2 x)) / 2, for small x as a series, since the difference would lose its digits."""
    w = g.w
    one, half, sixth, last = (w.number(1 / k) for k in (1, 2, 6, 24))
    x = g.let("exponent", f"{w.number(_RATE / 2)} * {g.alpha} * {g.alpha}")
    series = g.let("series", f"{x} * ({one} - {x} * ({half} - {x} * ({sixth} - {x} * {last})))")
    difference = w.L.select(f"{x} < {w.number(0.1)}", series, f"{one} - {g.cos_alpha_s}")
    return w.L.max(f"{half} * {difference}", w.number((_LEAST / 2) ** 2))


def _cos_alpha_s(g: Geometry) -> str:
    return g.w.L.call("exponential", f"{g.w.number(-_RATE / 2)} * {g.alpha} * {g.alpha}")


def _alpha_s(g: Geometry) -> str:
    w = g.w
    return f"{w.number(2)} * {w.L.call('arcsine', w.L.call('root', g.sin2_half_alpha_s))}"


def _overlap(g: Geometry) -> str:
    """How far the rims of the two cones are across each other: 0 one in the other, 1 apart."""
    w = g.w
    return f"{w.number(0.5)} * ({g.beta} - ({g.wider} - {g.narrower})) / {w.L.max(g.narrower, w.number(1e-6))}"


def _theta_o(g: Geometry) -> str:
    w = g.w
    across = g.let("c_x", _cross(g, 1, 2)), g.let("c_y", _cross(g, 2, 0)), g.let("c_z", _cross(g, 0, 1))
    length = w.L.call("root", " + ".join(f"{c} * {c}" for c in across))
    return w.L.angle(length, g.n_v)


def _cross(g: Geometry, i: int, j: int) -> str:
    n, v = (lambda k: g.w.read("normal", k)), (lambda k: g.w.read("view", k))
    return f"{n(i)} * {v(j)} - {n(j)} * {v(i)}"


#: Variable -> function that gives its value and writes what comes before.
_MADE: dict[str, Callable[[Geometry], str]] = {
    "n_v": lambda g: g.w.dot("normal", "view"),
    "r_x": lambda g: _reflected(g, 0),
    "r_y": lambda g: _reflected(g, 1),
    "r_z": lambda g: _reflected(g, 2),
    "d_x": lambda g: _bent_less_reflected(g, "x"),
    "d_y": lambda g: _bent_less_reflected(g, "y"),
    "d_z": lambda g: _bent_less_reflected(g, "z"),
    "beta": _beta,
    "cos_beta": lambda g: " + ".join(
        f"{g.w.read('bent_normal', i)} * {r}" for i, r in enumerate((g.r_x, g.r_y, g.r_z))
    ),
    "n_b": lambda g: g.w.dot("normal", "bent_normal"),
    "visible": lambda g: g.w.clamped("visibility"),
    "squared_sine": _squared_sine,
    "cos_alpha_v": _cos_alpha_v,
    "alpha_v": _alpha_v,
    "alpha": lambda g: "roughness * roughness",
    "sin2_half_alpha_s": _sin2_half_alpha_s,
    "cos_alpha_s": _cos_alpha_s,
    "alpha_s": _alpha_s,
    "narrower": lambda g: g.w.L.min(g.alpha_v, g.alpha_s),
    "wider": lambda g: g.w.L.max(g.alpha_v, g.alpha_s),
    "overlap": _overlap,
    "theta_o": _theta_o,
}


def _right_angles(w: Writer, angle: str) -> str:
    return f"{angle} * {w.number(2 / math.pi)}"


def _published(g: Geometry) -> tuple[str, ...]:
    half = g.w.number(0.5)
    return g.cos_alpha_v, g.cos_alpha_s, f"{half} * {g.cos_beta} + {half}"


def _cosine(g: Geometry) -> tuple[str, ...]:
    w = g.w
    return g.cos_alpha_v, f"({g.cos_alpha_s} - {w.number(0.1)}) * {w.number(1 / 0.9)}", g.cos_beta


def _linear(g: Geometry) -> tuple[str, ...]:
    return _right_angles(g.w, g.alpha_v), g.alpha, _right_angles(g.w, g.beta)


def _overlapping(g: Geometry) -> tuple[str, ...]:
    return _right_angles(g.w, g.alpha_v), g.alpha, g.overlap


def _nested(g: Geometry) -> tuple[str, ...]:
    return f"{g.narrower} / {g.wider}", _right_angles(g.w, g.wider), g.overlap


#: (kind, name of the axes) -> function that gives the coordinates, before they are clamped.
COORDINATES: dict[tuple[str, str], Callable[[Geometry], tuple[str, ...]]] = {
    ("cone-cone", "published"): _published,
    ("cone-cone", "cosine"): _cosine,
    ("cone-cone", "linear"): _linear,
    ("cone-cone", "overlap"): _overlapping,
    ("cone-cone", "nested"): _nested,
}


def _smaller_cone(g: Geometry) -> str:
    """What the smaller cone is of the cone of reflection."""
    w = g.w
    half = g.let("sin_half_narrower", w.L.call("sine", f"{w.number(0.5)} * {g.narrower}"))
    return f"{half} * {half} / {g.sin2_half_alpha_s}"


#: (kind, name of the axes) -> function that gives the factor from what the table holds to what it stands for.
SCALES: dict[tuple[str, str], Callable[[Geometry], str]] = {
    ("cone-cone", "overlap"): _smaller_cone,
    ("cone-cone", "nested"): _smaller_cone,
}
