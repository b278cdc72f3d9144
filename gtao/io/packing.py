"""Visibility and its directions in few bits, the way that engines store them, and what that costs."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gtao.errors import ConfigError, ShapeError

from .codecs import PACKINGS, Packing, sh_scales
from .directions import Directions, directions_of

__all__ = ["PackingErrors", "pack", "packing", "packing_errors", "unpack"]

_ASK = {"bent_normal": "bent_normal=True", "mean_direction": "bent_normal=True", "visibility_sh": "directional=True"}


def packing(name: str) -> Packing:
    """The packing of that name.

    Raises:
        ConfigError: there is none.
    """
    if name not in PACKINGS:
        raise ConfigError(f"packing must be one of {', '.join(PACKINGS)}, got {name!r}")
    return PACKINGS[name]


def _check(d: Directions, p: Packing) -> None:
    """Refuse what cannot be packed.

    Raises:
        ConfigError: the field that the packing stores is missing.
        ShapeError: shapes do not fit, there are numbers that are not finite, or a direction has no length.
    """
    values = getattr(d, p.needs)
    if values is None:
        raise ConfigError(f"packing {p.name} stores {p.needs}, which this estimate lacks; set {_ASK[p.needs]}")
    n = 9 if p.needs == "visibility_sh" else 3
    if d.visibility.ndim != 2 or values.shape != (*d.visibility.shape, n):
        raise ShapeError(f"{p.needs} must be (H, W, {n}) beside (H, W) visibility, got {values.shape}")
    for name, array in (("visibility", d.visibility), (p.needs, values)):
        if not np.isfinite(array).all():
            raise ShapeError(f"{name} is not finite at {np.count_nonzero(~np.isfinite(array))} values; repair it first")
    if p.needs == "bent_normal" and not np.any(values, axis=-1).all():
        raise ShapeError("bent_normal is zero somewhere; give the normal where nothing is visible")


def pack(ao: Any, name: str = "rgba8") -> np.ndarray:
    """An estimate as texels.

    Visibility in integers is clamped to [0, 1]; the background is what the estimate holds there: open, toward the
    camera; "sh16" alone, which stores no visibility beside the harmonics, brings it back as 0. Directions are in the
    view frame, +z toward the camera.

    Args:
        ao: :class:`gtao.AmbientOcclusion` or :class:`Directions`.
        name: a key of :data:`PACKINGS`.

    Returns:
        (H, W, C) array: uint8, uint16 or float16.

    Raises:
        ConfigError: the packing does not exist, or the estimate lacks what it stores.
        ShapeError: arrays do not fit or hold what cannot be packed.
    """
    p, d = packing(name), directions_of(ao)
    _check(d, p)
    return p.encode(d)


def unpack(texels: Any, name: str = "rgba8", weighting: str = "cosine") -> Directions:
    """What :func:`pack` stored, as far as it could, in float64.

    Args:
        texels: (H, W, C) array.
        name: a key of :data:`PACKINGS`.
        weighting: "cosine" or "uniform", as of the estimate; scales what "sh16" holds of visibility.

    Raises:
        ConfigError: the packing or the weighting does not exist.
        ShapeError: the array has the wrong shape or type.
    """
    p, texels = packing(name), np.asarray(texels)
    if texels.ndim != 3 or texels.shape[2] != len(p.channels) or texels.dtype != p.dtype:
        expected = f"(H, W, {len(p.channels)}) of {np.dtype(p.dtype)}"
        raise ShapeError(f"texels of {name} must be {expected}, got {texels.shape} of {texels.dtype}")
    return p.decode(texels, weighting)


@dataclass(frozen=True, kw_only=True)
class PackingErrors:
    """What a packing did to an estimate. Angles in radians; a bound is what theory allows at most for these data.

    Attributes:
        packing: its name.
        n: pixels compared: those with a direction.
        angle_mean, angle_p99, angle_max, angle_bound: between the bent normals before and after.
        visibility_rms, visibility_max, visibility_bound: absolute differences; the bound is for visibility in [0, 1].
        clamped: share of the pixels whose visibility lies outside [0, 1], which integers cannot hold.
        length_max: largest difference of the length of the mean direction; None where the packing stores none.
        sh_rms, sh_max: of the nine coefficients; None where the packing stores none.
    """

    packing: str
    n: int
    angle_mean: float
    angle_p99: float
    angle_max: float
    angle_bound: float
    visibility_rms: float
    visibility_max: float
    visibility_bound: float
    clamped: float
    length_max: float | None = None
    sh_rms: float | None = None
    sh_max: float | None = None

    def __str__(self) -> str:
        mean, p99, top, bound = np.degrees((self.angle_mean, self.angle_p99, self.angle_max, self.angle_bound))
        angle = f"angle mean {mean:.2g}, 99 % {p99:.2g}, max {top:.2g} of at most {bound:.2g} degrees"
        visibility = f"visibility RMS {self.visibility_rms:.2g}, max {self.visibility_max:.2g}"
        clamped = f", {100 * self.clamped:.2g} % of the pixels clamped" if self.clamped else ""
        return f"{self.packing}: {angle}; {visibility}{clamped}"


def _angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Accurate for angles that the arc cosine would lose."""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1))


def _largest(values: np.ndarray) -> float:
    return float(values.max(initial=0.0))


def _mean(values: np.ndarray) -> float:
    return float(values.mean()) if values.size else 0.0


def _half_step(values: np.ndarray) -> np.ndarray:
    """Largest rounding error of half floats: 11 significant bits, but no finer than the subnormal numbers."""
    return np.maximum(np.abs(values) * 2.0**-11, 2.0**-25)


def _bounds(p: Packing, stored: np.ndarray, weighting: str) -> tuple[float, float]:
    """Of the angle and of visibility, for what is stored at the pixels compared."""
    if np.issubdtype(p.dtype, np.integer):
        assert p.angle_bound is not None
        # Only the octahedral packing of 16 bits stores visibility in 16.
        return p.angle_bound, 0.5 / float(np.iinfo(p.dtype).max)
    step = _half_step(stored)
    vector, scalar, scale = (slice(1, 4), 0, sh_scales(weighting)[0]) if p.name == "sh16" else (slice(0, 3), 3, 1.0)
    relative = np.linalg.norm(step[:, vector], axis=-1) / np.linalg.norm(stored[:, vector], axis=-1)
    return _largest(np.arcsin(np.minimum(relative, 1))), _largest(step[:, scalar]) * scale


def packing_errors(ao: Any, name: str = "rgba8", mask: Any = None) -> PackingErrors:
    """Pack an estimate, unpack it, and compare.

    Args:
        ao: :class:`gtao.AmbientOcclusion` or :class:`Directions`.
        name: a key of :data:`PACKINGS`.
        mask: (H, W) pixels to compare; default: all that have a direction. Those without, among them the background,
            are left out in any case; where none is left, all errors are 0.

    Raises:
        ConfigError: as for :func:`pack`.
        ShapeError: as for :func:`pack`; the mask has another shape.
    """
    p, before = packing(name), directions_of(ao)
    after = unpack(pack(before, name), name, before.weighting)
    zeroth, first = sh_scales(before.weighting)
    if p.name == "sh16":
        assert before.visibility_sh is not None
        sh = before.visibility_sh.astype(np.float64)
        vectors, visibility, stored = sh[..., [3, 1, 2]] * first, sh[..., 0] * zeroth, sh
    else:
        vectors = np.asarray(getattr(before, p.needs), dtype=np.float64)
        visibility = before.visibility.astype(np.float64)
        stored = np.concatenate([vectors, visibility[..., None]], axis=-1)
    directed = before.mean_direction if before.mean_direction is not None else vectors
    chosen = np.any(directed, axis=-1) & np.any(vectors, axis=-1)
    if mask is not None:
        mask = np.asarray(mask.numpy() if hasattr(mask, "numpy") else mask).astype(bool)
        if mask.shape != chosen.shape:
            raise ShapeError(f"mask must have the shape {chosen.shape} of the estimate, got {mask.shape}")
        chosen &= mask
    angles = _angles(vectors[chosen], np.asarray(after.bent_normal)[chosen])
    error = np.abs(after.visibility - visibility)[chosen]
    outside = (visibility < 0) | (visibility > 1)
    angle_bound, visibility_bound = _bounds(p, stored[chosen], before.weighting)
    more: dict[str, float] = {}
    if after.mean_direction is not None:
        lengths = (np.linalg.norm(v, axis=-1)[chosen] for v in (after.mean_direction, vectors))
        more["length_max"] = _largest(np.abs(np.subtract(*lengths)))
    if after.visibility_sh is not None:
        difference = (after.visibility_sh - stored)[chosen]
        more |= {"sh_rms": math.sqrt(_mean(difference**2)), "sh_max": _largest(np.abs(difference))}
    return PackingErrors(
        packing=name,
        n=int(chosen.sum()),
        angle_mean=_mean(angles),
        angle_p99=float(np.quantile(angles, 0.99)) if angles.size else 0.0,
        angle_max=_largest(angles),
        angle_bound=angle_bound,
        visibility_rms=math.sqrt(_mean(error**2)),
        visibility_max=_largest(error),
        visibility_bound=visibility_bound,
        clamped=_mean(outside[chosen]) if np.issubdtype(p.dtype, np.integer) else 0.0,
        **more,
    )
