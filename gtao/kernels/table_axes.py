"""Coordinates of specular-occlusion tables: what angles and roughness become in the unit cube, and back.

A parametrisation belongs to a kind of table. ``to_unit`` maps the arguments to coordinates in [0, 1], the first of
them x, along which texels are neighbours in memory; ``from_unit`` is its inverse, which tables are baked with; what a
table holds is to be multiplied by ``scale``. All are differentiable and finite for every argument.

Arguments: ``alpha_v`` half angle of the visibility cone, ``beta`` angle between its axis and the reflected direction,
``alpha`` the microfacet width (the square of perceptual roughness), ``theta_o`` angle between normal and view
direction, ``chi`` azimuth of the cone's axis about the reflected direction, 0 toward the normal. Angles in radians.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import drjit as dr

from . import table_axes_cones as cones
from . import table_axes_lobes as lobes

__all__ = ["ARGUMENTS", "AXES", "DEFAULT_AXES", "TableAxes", "table_axes"]

#: Kind of table -> arguments that it depends on. In 4-D chi is 0, in 3-D the cone's axis is the normal too.
ARGUMENTS: Mapping[str, tuple[str, ...]] = {
    "cone-cone": ("alpha_v", "beta", "alpha"),
    "cone-lobe": ("alpha_v", "beta", "alpha"),
    "brdf-3d": ("alpha_v", "beta", "alpha"),
    "brdf-4d": ("alpha_v", "beta", "alpha", "theta_o"),
    "brdf-5d": ("alpha_v", "beta", "alpha", "theta_o", "chi"),
    "environment-brdf": ("alpha", "theta_o"),
}


def _one(*_: Any) -> float:
    return 1.0


@dataclass(frozen=True)
class TableAxes:
    """A parametrisation of one kind of table.

    Attributes:
        kind, name: where it is found in :data:`AXES`.
        names: what the coordinates stand for, x first.
    """

    kind: str
    name: str
    names: tuple[str, ...]
    _to: Callable[..., tuple[Any, ...]]
    _from: Callable[..., tuple[Any, ...]]
    _scale: Callable[..., Any] = _one

    def to_unit(
        self, alpha_v: Any = 0.0, beta: Any = 0.0, alpha: Any = 0.0, theta_o: Any = 0.0, chi: Any = 0.0
    ) -> tuple[Any, ...]:
        """Coordinates in [0, 1], x first; arguments outside the domain count as moved to its border."""
        given = {"alpha_v": alpha_v, "beta": beta, "alpha": alpha, "theta_o": theta_o, "chi": chi}
        unit = self._to(*(given[name] for name in ARGUMENTS[self.kind]))
        return tuple(dr.select(u > 0, dr.select(u < 1, u, 1), 0) for u in unit)

    def from_unit(self, *unit: Any) -> tuple[Any, ...]:
        """The arguments of :data:`ARGUMENTS` that coordinates stand for, in that order."""
        return self._from(*unit)

    def scale(self, alpha_v: Any = 0.0, beta: Any = 0.0, alpha: Any = 0.0, theta_o: Any = 0.0, chi: Any = 0.0) -> Any:
        """Factor from what the table holds to what it stands for."""
        given = {"alpha_v": alpha_v, "beta": beta, "alpha": alpha, "theta_o": theta_o, "chi": chi}
        return self._scale(*(given[name] for name in ARGUMENTS[self.kind]))


_3D = ("alpha_v", "beta", "roughness")
_4D = (*_3D, "theta_o")

_ALL = (
    TableAxes(
        "cone-cone", "published", ("cos_alpha_v", "cos_alpha_s", "beta"), cones.to_published, cones.from_published
    ),
    TableAxes("cone-cone", "cosine", ("cos_alpha_v", "cos_alpha_s", "cos_beta"), cones.to_cosine, cones.from_cosine),
    TableAxes("cone-cone", "linear", ("alpha_v", "alpha", "beta"), cones.to_linear, cones.from_linear),
    TableAxes(
        "cone-cone", "overlap", ("alpha_v", "alpha", "overlap"), cones.to_overlap, cones.from_overlap, cones.scale
    ),
    TableAxes("cone-cone", "nested", ("ratio", "wider", "overlap"), cones.to_nested, cones.from_nested, cones.scale),
    TableAxes("cone-lobe", "linear", ("alpha_v", "beta", "alpha"), lobes.to_linear_lobe, lobes.from_linear_lobe),
    TableAxes("cone-lobe", "lobe", _3D, lobes.to_lobe, lobes.from_lobe),
    TableAxes("brdf-3d", "linear", _3D, lobes.to_linear_3d, lobes.from_linear_3d),
    TableAxes("brdf-3d", "lobe", _3D, lobes.to_lobe_3d, lobes.from_lobe_3d),
    TableAxes("brdf-4d", "linear", _4D, lobes.to_linear_4d, lobes.from_linear_4d),
    TableAxes(
        "brdf-4d",
        "cosine",
        ("cos_alpha_v", "cos_beta", "roughness", "cos_theta_o"),
        lobes.to_cosine_4d,
        lobes.from_cosine_4d,
    ),
    TableAxes("brdf-4d", "lobe", _4D, lobes.to_lobe_4d, lobes.from_lobe_4d),
    TableAxes("brdf-5d", "linear", (*_4D, "chi"), lobes.to_linear_5d, lobes.from_linear_5d),
    TableAxes("brdf-5d", "lobe", (*_4D, "cos_chi"), lobes.to_lobe_5d, lobes.from_lobe_5d),
    TableAxes("environment-brdf", "cosine", ("cos_theta_o", "roughness"), lobes.to_environment, lobes.from_environment),
    TableAxes(
        "environment-brdf",
        "root",
        ("root_cos_theta_o", "roughness"),
        lobes.to_environment_root,
        lobes.from_environment_root,
    ),
)

#: (kind, name) -> parametrisation.
AXES: Mapping[tuple[str, str], TableAxes] = {(axes.kind, axes.name): axes for axes in _ALL}

#: Kind -> name of the parametrisation with the smallest error.
DEFAULT_AXES: Mapping[str, str] = {
    "cone-cone": "nested",
    "cone-lobe": "lobe",
    "brdf-3d": "lobe",
    "brdf-4d": "lobe",
    "brdf-5d": "lobe",
    "environment-brdf": "root",
}


def table_axes(kind: str, name: str) -> TableAxes:
    """The parametrisation of that name; KeyError where there is none."""
    return AXES[kind, name]
