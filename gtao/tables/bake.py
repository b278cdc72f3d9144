"""Making tables: quadrature at every texel."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from gtao import backend
from gtao._version import __version__
from gtao.data.specular import KINDS, SpecularTable
from gtao.errors import ConfigError, ShapeError
from gtao.kernels.table_axes import ARGUMENTS, AXES, DEFAULT_AXES, TableAxes

from .brdf import TOLERANCE, Quadrature
from .lanes import lanes, numbers
from .values import DISTRIBUTIONS, value_of

__all__ = ["bake", "environment_brdf", "fitted_texels", "values_at"]

#: Those of 32 along each of five axes; baking holds some hundred bytes for each.
MOST_TEXELS = 32**5


def bake(
    kind: str,
    size: int | Sequence[int] = 32,
    axes: str | None = None,
    *,
    distribution: str = "ggx",
    brdf: Callable[[float], Callable[[Any, Any], Any]] | None = None,
    tolerance: float = TOLERANCE,
    fitted: bool = True,
    progress: Callable[[str, int, int], None] | None = None,
) -> SpecularTable:
    """A table of specular occlusion, by quadrature in double precision: the same bits from the same arguments.

    "cone-cone" is the intersection of two cones, "cone-lobe" an isotropic lobe in a cone, "brdf-5d" all of the
    reflection in a cone, "brdf-4d" that of cones whose axis is in the incidence plane, on the normal's side of the
    reflected direction, and "brdf-3d" that of cones about the normal; "environment-brdf" is what a white dome gives.
    ``settings["quadrature_error"]`` of the result is the largest estimate of the quadrature's error.

    Args:
        kind: key of :data:`gtao.data.specular.KINDS`.
        size: texels along every coordinate, or one number per coordinate, x first.
        axes: parametrisation, a name in :data:`gtao.kernels.table_axes.AXES`; default: the one with the least error.
        distribution: of "cone-lobe": "ggx" or "phong".
        brdf: of "brdf-3d" … "brdf-5d", another material: function from the width α in (0, 1] of its lobe to its BRDF
            as of :func:`gtao.render.brdf`. The table then has one channel, S.
        tolerance: nodes are added until the estimate of the quadrature's error is below; of reflection.
        fitted: texels make the squared error between them the least (theory, eq. (175)); else they are the function
            itself, and the table errs to one side between them.
        progress: called with (task, done, total) in texels.

    Raises:
        ConfigError: there is no such kind, it has no such axes, or an option does not belong to it.
        ShapeError: the size does not fit the kind.
        BackendError: there is no usable backend.
    """
    mapping = _mapping(kind, axes)
    if distribution not in DISTRIBUTIONS or (distribution != "ggx" and kind != "cone-lobe"):
        raise ConfigError(f"a table {kind!r} has no distribution {distribution!r}; only cone-lobe has ggx and phong")
    if brdf is not None and not kind.startswith("brdf"):
        raise ConfigError(f"a table {kind!r} is not made of BRDFs; leave out brdf")
    backend.require()
    shape = _shape(kind, size)
    # The last index is that of x, the first coordinate.
    unit = [i.ravel() / (n - 1) for i, n in zip(np.indices(shape)[::-1], shape[::-1], strict=True)]

    def step(done: int, total: int) -> None:
        if progress is not None:
            progress(f"bake {kind}", done, total)

    found = values_at(mapping, unit, distribution=distribution, brdf=brdf, tolerance=tolerance, progress=step)
    values = found.values.reshape(*shape, -1)
    values = fitted_texels(values) if fitted else values
    settings = {
        "distribution": distribution,
        "brdf": "GGX" if brdf is None else "another",
        "tolerance": tolerance,
        "fitted": fitted,
        "quadrature_error": float(f"{found.error.max():.1e}"),
    }
    return SpecularTable(
        kind=kind,
        axes=mapping.name,
        values=values.astype(np.float32),
        settings=settings,
        source=f"gtao.tables.bake of gtao {__version__}",
    )


def environment_brdf(size: int | Sequence[int] = 64, axes: str | None = None) -> SpecularTable:
    """A and B, what of a white dome a surface reflects: F0 A + B (Karis 2013); see :func:`bake`."""
    return bake("environment-brdf", size, axes)


def values_at(mapping: TableAxes, unit: Sequence[np.ndarray], **options: Any) -> Quadrature:
    """What a table holds at coordinates, each (n,), x first: values (n, C); options of :func:`value_of`."""
    arguments = mapping.from_unit(*lanes(*unit))
    given = [numbers(a, like=unit[0]) for a in arguments]
    scale = numbers(mapping.scale(**dict(zip(ARGUMENTS[mapping.kind], arguments, strict=True))), like=unit[0])
    found = value_of(mapping.kind, tuple(given), **options)
    return found._replace(values=found.values / scale[:, None])


def fitted_texels(values: np.ndarray) -> np.ndarray:
    """Texels (…, C) for linear interpolation of the function that has these values in [0, 1]; ends of axes stay.

    A table of a function's own values lies on its chords, off by h² f'' / 12 on average. Less a twelfth of the second
    differences along every axis it has the least squared error (theory, eq. (175)).
    """
    texels = values.copy()
    for axis in range(values.ndim - 1):
        along, out = np.moveaxis(values, axis, 0), np.moveaxis(texels, axis, 0)
        out[1:-1] -= (along[2:] - 2 * along[1:-1] + along[:-2]) / 12
    return np.clip(texels, 0, 1)


def _mapping(kind: str, axes: str | None) -> TableAxes:
    if kind not in ARGUMENTS:
        raise ConfigError(f"unknown kind of table {kind!r}; choose one of {', '.join(ARGUMENTS)}")
    axes = DEFAULT_AXES[kind] if axes is None else axes
    if (kind, axes) not in AXES:
        known = ", ".join(name for of, name in AXES if of == kind)
        raise ConfigError(f"a table {kind!r} has no axes {axes!r}; choose one of {known}")
    return AXES[kind, axes]


def _shape(kind: str, size: int | Sequence[int]) -> tuple[int, ...]:
    """Of the values without their channels: x is the last."""
    n_axes = KINDS[kind][0]
    sizes = (size,) * n_axes if isinstance(size, int) else tuple(size)
    if len(sizes) != n_axes or not all(isinstance(n, int) and n >= 2 for n in sizes):
        raise ShapeError(f"a table {kind!r} has {n_axes} axes of at least 2 texels, got {size}")
    if math.prod(sizes) > MOST_TEXELS:
        given = "x".join(map(str, sizes))
        raise ShapeError(f"a table has up to {MOST_TEXELS} texels, got {given}; take fewer per axis")
    return sizes[::-1]
