"""Coordinates of tables in shader code, as :mod:`gtao.kernels.table_axes` defines them."""

import math
from collections.abc import Callable

from .table_code_geometry import Geometry

__all__ = ["COORDINATES", "SCALES"]

Coordinates = tuple[str, ...]


def _right_angles(g: Geometry, angle: str) -> str:
    return f"{angle} * {g.w.number(2 / math.pi)}"


def _half_turns(g: Geometry, angle: str) -> str:
    return f"{angle} * {g.w.number(1 / math.pi)}"


def _half_and_half(g: Geometry, cosine: str) -> str:
    half = g.w.number(0.5)
    return f"{half} * {cosine} + {half}"


def _overlap(g: Geometry) -> str:
    """How far the rims of the two cones are across each other: 0 one in the other, 1 apart.

    Neither is wider than a hemisphere, with the apertures that there is code for.
    """
    w = g.w
    return f"{w.number(0.5)} * ({g.beta} - ({g.wider} - {g.narrower})) / {w.L.max(g.narrower, w.number(1e-6))}"


def _smaller_cone(g: Geometry) -> str:
    """What the smaller cone is of the cone of reflection."""
    half = g.let("sin_half_narrower", g.w.L.call("sine", f"{g.w.number(0.5)} * {g.narrower}"))
    return f"{half} * {half} / {g.sin2_half_alpha_s}"


def _cone_published(g: Geometry) -> Coordinates:
    return g.cos_alpha_v, g.cos_alpha_s, _half_and_half(g, g.cos_beta)


def _cone_cosine(g: Geometry) -> Coordinates:
    w = g.w
    return g.cos_alpha_v, f"({g.cos_alpha_s} - {w.number(0.1)}) * {w.number(1 / 0.9)}", g.cos_beta


def _cone_linear(g: Geometry) -> Coordinates:
    return _right_angles(g, g.alpha_v), g.alpha, _right_angles(g, g.beta)


def _cone_overlap(g: Geometry) -> Coordinates:
    return _right_angles(g, g.alpha_v), g.alpha, _overlap(g)


def _cone_nested(g: Geometry) -> Coordinates:
    return f"{g.narrower} / {g.wider}", _half_turns(g, g.wider), _overlap(g)


def _near(g: Geometry, x: str, width: str, end: float) -> str:
    """[0, end] to [0, 1], fine near 0; ``width`` is a sum."""
    end_ = g.w.number(end)
    return f"{x} * ({width} + {end_}) / ({end_} * ({x} + {width}))"


def _near_both(g: Geometry, x: str, width: str, end: float) -> str:
    """[0, end] to [0, 1], fine near both ends."""
    half, middle, end_ = (g.w.number(k) for k in (0.5, end / 2, end))
    above = g.let("above", f"({x} - {middle}) * {width} * ({width} + {end_})")
    return f"{half} + {above} / ({end_} * ({x} + {width}) * ({end_} - {x} + {width}))"


def _around(g: Geometry, x: str, centre: str, width: str, end: float) -> str:
    """[0, end] to [0, 1], fine near the centre."""
    end_ = g.w.number(end)
    g.let("from_centre", f"{x} - {centre}")
    place = g.let("place", f"from_centre / ({width} + {g.w.L.call('absolute', 'from_centre')})")
    low = g.let("low", f"-{centre} / ({width} + {centre})")
    high = g.let("high", f"({end_} - {centre}) / ({width} + {end_} - {centre})")
    return f"({place} - {low}) / ({high} - {low})"


def _cone(g: Geometry) -> str:
    width = g.let("cone_width", f"{g.w.number(4)} * {g.lobe_alpha} + {g.w.number(1)}")
    return _near(g, g.alpha_v, width, math.pi)


def _height(g: Geometry) -> str:
    """Of the view direction over the horizon."""
    w = g.w
    height = g.let("height", w.L.max(f"{w.number(math.pi / 2)} - {g.theta_o}", w.number(0)))
    return _near(g, height, g.let("height_width", f"{g.lobe_alpha} + {w.number(0.5)}"), math.pi / 2)


def _beside_rim(g: Geometry, width: str) -> str:
    return _around(g, g.beta, g.alpha_v, g.let("lobe_width", width), math.pi)


def _lobe_linear(g: Geometry) -> Coordinates:
    return _right_angles(g, g.alpha_v), _half_turns(g, g.beta), g.alpha


def _lobe(g: Geometry) -> Coordinates:
    return _cone(g), _beside_rim(g, f"{g.w.number(3)} * {g.lobe_alpha}"), "roughness"


def _brdf_linear_3d(g: Geometry) -> Coordinates:
    return _right_angles(g, g.alpha_v), _right_angles(g, g.beta), "roughness"


def _brdf_lobe_3d(g: Geometry) -> Coordinates:
    w, end = g.w, math.pi / 2
    cone_width = g.let("cone_width", f"{g.lobe_alpha} + {w.number(0.5)}")
    lobe_width = g.let("lobe_width", f"{w.number(3)} * {g.lobe_alpha} + {w.number(1)}")
    return _near_both(g, g.alpha_v, cone_width, end), _around(g, g.beta, g.alpha_v, lobe_width, end), "roughness"


def _brdf_linear_4d(g: Geometry) -> Coordinates:
    return _right_angles(g, g.alpha_v), _half_turns(g, g.beta), "roughness", _right_angles(g, g.theta_o)


def _brdf_cosine_4d(g: Geometry) -> Coordinates:
    return g.cos_alpha_v, _half_and_half(g, g.cos_beta), "roughness", g.n_v


def _brdf_lobe_4d(g: Geometry) -> Coordinates:
    return *_lobe(g), _height(g)


def _brdf_linear_5d(g: Geometry) -> Coordinates:
    return *_brdf_linear_4d(g), _half_turns(g, g.chi)


def _brdf_lobe_5d(g: Geometry) -> Coordinates:
    """The lobe is narrower across the incidence plane, toward grazing angles."""
    w = g.w
    one = w.number(1)
    across = g.let("narrowing", w.L.min(f"{g.lobe_alpha} * {g.lobe_alpha} + {g.n_v} * {g.n_v}", one))
    cos2_chi = g.let("cos2_chi", f"{g.cos_chi} * {g.cos_chi}")
    factor = w.L.call("root", f"({one} - {cos2_chi}) * {across} + {cos2_chi}")
    width = f"{w.number(3)} * {g.lobe_alpha} * {factor}"
    half = w.number(0.5)
    return _cone(g), _beside_rim(g, width), "roughness", _height(g), f"{half} - {half} * {g.cos_chi}"


def _environment_cosine(g: Geometry) -> Coordinates:
    return g.n_v, "roughness"


def _environment_root(g: Geometry) -> Coordinates:
    return g.w.L.call("root", g.w.L.max(g.n_v, g.w.number(0))), "roughness"


#: (kind, name of the axes) -> function that gives the coordinates, before they are clamped.
COORDINATES: dict[tuple[str, str], Callable[[Geometry], Coordinates]] = {
    ("cone-cone", "published"): _cone_published,
    ("cone-cone", "cosine"): _cone_cosine,
    ("cone-cone", "linear"): _cone_linear,
    ("cone-cone", "overlap"): _cone_overlap,
    ("cone-cone", "nested"): _cone_nested,
    ("cone-lobe", "linear"): _lobe_linear,
    ("cone-lobe", "lobe"): _lobe,
    ("brdf-3d", "linear"): _brdf_linear_3d,
    ("brdf-3d", "lobe"): _brdf_lobe_3d,
    ("brdf-4d", "linear"): _brdf_linear_4d,
    ("brdf-4d", "cosine"): _brdf_cosine_4d,
    ("brdf-4d", "lobe"): _brdf_lobe_4d,
    ("brdf-5d", "linear"): _brdf_linear_5d,
    ("brdf-5d", "lobe"): _brdf_lobe_5d,
    ("environment-brdf", "cosine"): _environment_cosine,
    ("environment-brdf", "root"): _environment_root,
}

#: (kind, name of the axes) -> function that gives the factor from what the table holds to what it stands for.
SCALES: dict[tuple[str, str], Callable[[Geometry], str]] = {
    ("cone-cone", "overlap"): _smaller_cone,
    ("cone-cone", "nested"): _smaller_cone,
}
