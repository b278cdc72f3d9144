"""Blocked arcs of occluders of finite thickness, written out for one pixel (Therrien et al. 2023), float64 NumPy.

Every arc is found from points: where matter begins and ends on the eye ray of a sample, clipped to the sphere of the
radius. The share of a slice's hemisphere that it holds is integrated by quadrature, and what is open is integrated
between angles that bisection finds from that share.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from . import slice_march, slice_oracle
from .fields import Field


@dataclass(frozen=True)
class Open:
    """What is open of a pixel: integrals over π, or over 2π without the cosine."""

    share: float
    first: np.ndarray
    second: np.ndarray


def visibility(field: Field, row: int, column: int, *, rounding="exact", n_sectors=32, **march) -> float:
    """Mean over slices at azimuths π(i + ½)/n of the weighted open share.

    Args:
        rounding: "exact" measures the union of arcs, what sectors tend to; "nearest" tests the middle of each of
            ``n_sectors`` sectors; "outward" closes ⌈n w⌉ sectors from the one on in which an arc of share w begins.
        march: of :func:`_slices`.
    """
    shares = [s.weight * (1 - _closed(s.arcs, rounding, n_sectors)) for s in _slices(field, row, column, **march)]
    return float(np.mean(shares))


def open_directions(field: Field, row: int, column: int, *, rounding="exact", n_sectors=32, **march) -> Open:
    """The directions ω that :func:`visibility` counts: their share and the means of ω and ω ωᵀ, in the view frame."""
    found = []
    for s in _slices(field, row, column, **march):
        pieces = _gaps(s.arcs) if rounding == "exact" else open_runs(_closed_sectors(s.arcs, rounding, n_sectors))
        found.append(sum((s.integrals(*piece) for piece in pieces), start=np.zeros(13)))
    share, *moments = np.mean(found, axis=0)
    return Open(share, np.array(moments[:3]), np.reshape(moments[3:], (3, 3)))


@dataclass(frozen=True)
class Slice:
    """A slice, what it weighs when it is open, and its blocked arcs as intervals of the share that lies below."""

    V: np.ndarray
    T: np.ndarray
    nV: float
    nT: float
    weighting: str
    weight: float
    arcs: list

    def angle(self, x: float) -> float:
        """The angle below which the share x lies."""
        gamma = np.arctan2(self.nT, self.nV)
        low, high = gamma - np.pi / 2, gamma + np.pi / 2
        # 60 halvings of π.
        for _ in range(60):
            middle = 0.5 * (low + high)
            below = _share_below(self.weighting, self.nV, self.nT, middle) < x
            low, high = (middle, high) if below else (low, middle)
        return 0.5 * (low + high)

    def integrals(self, x0: float, x1: float) -> np.ndarray:
        """Share, ω and ω ωᵀ, integrated between two shares."""
        theta, weights = quadrature(self.weighting, self.nV, self.nT, self.angle(x0), self.angle(x1))
        omega = np.cos(theta)[:, None] * self.V + np.sin(theta)[:, None] * self.T
        second = np.einsum("n,ni,nj->ij", weights, omega, omega).ravel()
        found = np.concatenate([[weights.sum()], weights @ omega, second])
        # ∫ |sin θ| of an open slice is 2.
        return found if self.weighting == "cosine" else found / 2


def _slices(
    field: Field,
    row: int,
    column: int,
    *,
    radius: float = np.inf,
    n_slices: int,
    n_steps: int,
    bodies,
    weighting: str = "cosine",
    cut: str = "sphere",
    exponent: float = 1.25,
    successive: bool = False,
    linked: bool = False,
) -> Iterator[Slice]:
    """The slices of one pixel.

    Args:
        bodies: function of a texel's row and column: list of (front, back) depths of the matter on its eye ray.
        successive: give ``bodies`` the texel before on the march, at first the pixel's own, as a third argument.
        cut: "sphere" clips matter to the radius, "sample" ignores a body whose front lies beyond it, "none" neither.
        linked: a body whose extent in depth overlaps that of the body of the same number at the sample before, or
            misses it by less than 3 (sheets: 9) times the distance between the two eye rays, is the same body: what
            lies between the two is blocked, too. The shaded point is a sample that blocks nothing.
    """
    P, N = slice_march.point(field, row, column), field.normal_v[row, column]
    V = slice_march.view_dir(field, row, column)
    for i in range(n_slices):
        phi = np.pi * (i + 0.5) / n_slices
        T = slice_oracle.tangent(V, phi)
        nV, nT = N @ V, N @ T
        below = partial(_share_below, weighting, nV, nT)
        arcs = []
        for side in (-1, 1):
            samples, _ = slice_march.texels(
                field,
                row,
                column,
                phi if side > 0 else phi + np.pi,
                radius=radius,
                n_steps=n_steps,
                exponent=exponent,
            )
            gamma = np.arctan2(nT, nV)
            z = field.view_z[row, column]
            before = [(side * (gamma + side * np.pi / 2),) * 2 + (z, z)], (row, column)
            for texel in samples:
                there = bodies(*texel, before[1]) if successive else bodies(*texel)
                found = [(_blocked(field, texel, body, P, V, radius, cut), body) for body in there]
                for number, (ends, body) in enumerate(found):
                    if ends is None:
                        continue
                    if linked and number < len(before[0]) and before[0][number] is not None:
                        first, last, *extent = before[0][number]
                        if _one_body(body, extent, _across(field, texel, before[1], body[0])):
                            ends = min(first, ends[0]), max(last, ends[1])
                    arcs.append(sorted(below(side * angle) for angle in ends))
                before = [None if ends is None else (*ends, *body) for ends, body in found], texel
        yield Slice(V, T, nV, nT, weighting, _weight(weighting, nV, nT), arcs)


def _blocked(field, texel, body, P, V, radius, cut):
    """Angles to V of the two ends of the arc that a body blocks, None if it blocks nothing."""
    front, back = body
    if not np.isfinite(front):
        return None
    origin, ray = slice_march.eye_ray(field, *texel)
    near = origin + front * ray - P
    if cut == "sample" and np.linalg.norm(near) > radius:
        return None
    low, high = front, back
    if cut == "sphere" and np.isfinite(radius):
        # |origin + z ray - P|² = r²
        o = origin - P
        a, b, c = ray @ ray, o @ ray, o @ o - radius**2
        if b * b <= a * c:
            return None
        root = np.sqrt(b * b - a * c)
        low, high = max(low, (-b - root) / a), min(high, (-b + root) / a)
        if low > high:
            return None
    # Matter without end is closed down to the tangent plane.
    first = _angle(origin + low * ray - P, V)
    return first, np.pi if np.isinf(high) else _angle(origin + high * ray - P, V)


def _one_body(body, before, across) -> bool:
    slope = 9.0 if body[0] == body[1] and before[0] == before[1] else 3.0
    return max(body[0], before[0]) - min(body[1], before[1]) <= slope * across


def _across(field, texel, other, view_z) -> float:
    """Distance between two eye rays at a depth."""
    return float(np.linalg.norm(slice_march.point(field, *texel, view_z) - slice_march.point(field, *other, view_z)))


def _angle(D, V) -> float:
    along = D @ V
    return np.arctan2(np.linalg.norm(D - along * V), along)


def _share_below(weighting, nV, nT, theta) -> float:
    """Share of the slice's hemisphere that lies below θ."""
    gamma = np.arctan2(nT, nV)
    low, high = gamma - np.pi / 2, gamma + np.pi / 2
    theta = np.clip(theta, low, high)
    if weighting == "angle":
        return (theta - low) / np.pi
    return _integral(weighting, nV, nT, low, theta) / _integral(weighting, nV, nT, low, high)


# Exact to rounding for the integrands below over up to π.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)


def _integral(weighting, nV, nT, a, b) -> float:
    """∫ |sin θ|, times the cosine to the normal if it counts, over [a, b]."""
    return quadrature(weighting, nV, nT, a, b)[1].sum()


def quadrature(weighting, nV, nT, a, b):
    """Angles and weights of that integral, in two pieces that meet at θ = 0."""
    pieces = ((a, np.clip(0.0, a, b)), (np.clip(0.0, a, b), b))
    theta = np.concatenate([0.5 * (low + high) + 0.5 * (high - low) * _NODES for low, high in pieces])
    weights = np.concatenate([0.5 * (high - low) * _WEIGHTS for low, high in pieces]) * np.abs(np.sin(theta))
    if weighting == "cosine":
        weights = weights * (nV * np.cos(theta) + nT * np.sin(theta))
    return theta, weights


def _weight(weighting, nV, nT) -> float:
    gamma = np.arctan2(nT, nV)
    return _integral(weighting, nV, nT, gamma - np.pi / 2, gamma + np.pi / 2) if weighting == "cosine" else 1.0


def _closed(arcs, rounding, n) -> float:
    return union_length(arcs) if rounding == "exact" else _closed_sectors(arcs, rounding, n).mean()


def _closed_sectors(arcs, rounding, n) -> np.ndarray:
    closed = np.zeros(n, dtype=bool)
    middles = (np.arange(n) + 0.5) / n
    for low, high in arcs:
        if rounding == "nearest":
            closed |= (low < middles) & (middles <= high)
        else:
            first = int(n * low)
            closed[first : first + int(np.ceil(n * (high - low)))] = True
    return closed


def open_runs(closed):
    """Runs of open sectors as intervals of [0, 1]."""
    ends = np.flatnonzero(np.diff(np.concatenate([[True], closed, [True]])))
    return [(first / len(closed), last / len(closed)) for first, last in zip(ends[::2], ends[1::2], strict=True)]


def _gaps(intervals):
    """What a union of intervals leaves of [0, 1]."""
    end = 0.0
    for low, high in [*sorted(intervals), (1.0, 1.0)]:
        if low > end:
            yield end, low
        end = max(end, high)


def union_length(intervals) -> float:
    """Length of a union of intervals."""
    total, end = 0.0, -np.inf
    for low, high in sorted(intervals):
        total += max(high - max(low, end), 0.0)
        end = max(end, high)
    return total
