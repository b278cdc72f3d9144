"""Angles of eye rays in a half-slice against geometry in space, and what a piece of surface sweeps."""

import numpy as np
import pytest
from kernels.test_ray_path import FIELDS, scene

import drjit as dr  # isort: skip

from gtao.kernels.blocked_angles import Line, swept

RADII = [np.inf, 0.7, 9.0]


def half_slices(name, precision, radius, n=60, seed=0):
    """Random half-slices of a field: the kernel's lines, and pixels, V and T as arrays."""
    field = FIELDS[name]()
    rng = np.random.default_rng(seed)
    pixels = np.argwhere(np.isfinite(field.view_z))
    pixels = pixels[rng.integers(0, len(pixels), n)]
    V = field.view_dirs()[pixels[:, 0], pixels[:, 1]]
    T = np.cross(V, rng.normal(size=(n, 3)))
    T /= np.linalg.norm(T, axis=1, keepdims=True)
    _, cells, view = scene(field, precision, "linear", radius)
    x, y = precision.lanes(pixels[:, 1]), precision.lanes(pixels[:, 0])
    X, Y = dr.fma(x, view.ax, view.bx), dr.fma(y, view.ay, view.by)
    z = precision.lanes(field.view_z[pixels[:, 0], pixels[:, 1]])
    lean = precision.Float(1) if field.orthographic else dr.sqrt(X * X + Y * Y + 1)
    lanes = [tuple(precision.lanes(c) for c in v.T) for v in (T, V)]
    line = Line.of(*lanes, (x, y, X, Y, z, lean), cells, view, np.isinf(radius))
    return field, line, pixels, V, T


def eye_rays(field, line, t):
    """Origins and unit directions of the eye rays at t pixels along the lines, with their image coordinates."""
    x, y = (np.array(v, dtype=np.float64) for v in line.at(t))
    fx, fy = field.scale
    X, Y = (x + 0.5 - field.camera["cx"]) / fx, -(y + 0.5 - field.camera["cy"]) / fy
    if field.orthographic:
        origin = np.stack([X, Y, np.zeros_like(X)], axis=1)
        return origin, np.tile([0.0, 0.0, -1.0], (len(X), 1))
    direction = np.stack([X, Y, -np.ones_like(X)], axis=1)
    return np.zeros_like(direction), direction / np.linalg.norm(direction, axis=1, keepdims=True)


def angle(point, P, V, T):
    """Angle from V toward T of points as seen from P, and how far they are off the slice's plane."""
    D = point - P
    D = D / np.linalg.norm(D, axis=1, keepdims=True)
    return np.arctan2(np.sum(D * T, axis=1), np.sum(D * V, axis=1)), np.abs(np.sum(D * np.cross(V, T), axis=1))


@pytest.mark.parametrize("radius", RADII)
@pytest.mark.parametrize("name", ["waves", "waves from above"])
def test_where_eye_rays_meet_the_sphere(precision, name, radius):
    field, line, pixels, V, T = half_slices(name, precision, radius)
    P = field.positions()[pixels[:, 0], pixels[:, 1]]
    for share in (0.02, 0.3, 0.9):
        t = line.end * share
        origin, e = eye_rays(field, line, t)
        enter, leave = (np.array(a + 0 * t, dtype=np.float64) for a in line.sphere(t))
        if np.isinf(radius):
            want, off = angle(P + e, P, V, T)
            assert leave == pytest.approx(want, abs=20 * precision.tolerance)
            assert (enter <= 0).all()
            continue
        # |origin + s e - P| = radius.
        b = np.sum(e * (origin - P), axis=1)
        root = np.sqrt(b * b + radius**2 - np.sum((origin - P) ** 2, axis=1))
        for got, s in ((enter, -b - root), (leave, -b + root)):
            want, off = angle(origin + s[:, None] * e, P, V, T)
            assert off == pytest.approx(0, abs=20 * precision.tolerance)
            # Near the rim the square root doubles the digits lost.
            assert got == pytest.approx(want, abs=20 * precision.tolerance)


@pytest.mark.parametrize("name", ["waves", "waves from above"])
def test_the_rim_is_where_eye_rays_touch_the_sphere(precision, name):
    radius = 0.4
    field, line, pixels, _, _ = half_slices(name, precision, radius)
    P = field.positions()[pixels[:, 0], pixels[:, 1]]
    origin, e = eye_rays(field, line, line.rim)
    closest = (P - origin) - np.sum(e * (P - origin), axis=1, keepdims=True) * e
    assert np.linalg.norm(closest, axis=1) == pytest.approx(np.full(len(P), radius), rel=10 * precision.tolerance)


def test_an_eye_inside_the_sphere_looks_to_the_frames_border(precision):
    _, line, *_ = half_slices("waves", precision, 9.0)
    _, unlimited, *_ = half_slices("waves", precision, np.inf)
    assert np.array_equal(np.array(line.end), np.array(unlimited.end))


@pytest.mark.parametrize("name", ["waves", "waves from above"])
def test_where_the_surface_is(precision, name):
    field, line, pixels, V, T = half_slices(name, precision, np.inf)
    P = field.positions()[pixels[:, 0], pixels[:, 1]]
    rng = np.random.default_rng(5)
    z = rng.uniform(0.7, 1.3, len(P)) * field.view_z[pixels[:, 0], pixels[:, 1]]
    t = line.end * 0.4
    origin, e = eye_rays(field, line, t)
    S = origin + (z / -e[:, 2])[:, None] * e
    want, off = angle(S, P, V, T)
    assert off == pytest.approx(0, abs=20 * precision.tolerance)
    w, w0 = (-z, P[:, 2]) if field.orthographic else (1 / z, -1 / P[:, 2])
    got = np.array(line.surface(t, precision.lanes(w - w0)), dtype=np.float64)
    assert got == pytest.approx(want, abs=20 * precision.tolerance)


def test_lines_end_at_the_border_of_the_frame(precision):
    field, line, *_ = half_slices("waves", precision, np.inf)
    height, width = field.view_z.shape
    x, y = (np.array(v, dtype=np.float64) for v in line.at(line.end))
    distance = np.minimum.reduce([abs(x + 0.5), abs(x - width + 0.5), abs(y + 0.5), abs(y - height + 0.5)])
    assert distance == pytest.approx(0, abs=1e-4)
    assert ((x > -0.51) & (x < width - 0.49) & (y > -0.51) & (y < height - 0.49)).all()


def _wobbling(rng):
    """Surface, enter and leave angles along a line as smooth functions of s, crossing one another now and then."""
    a, b, c = rng.uniform(0.3, 2.9), rng.normal() * 2, rng.normal() * 3
    top = rng.uniform(1.4, 3.0)
    low = rng.uniform(0.1, 1.3)
    fall, rise = rng.uniform(0.1, 2.0), rng.uniform(0.1, 2.0)
    return (
        lambda s: a + b * s + c * s * s,
        lambda s: low + rise * s,
        lambda s: top - fall * s - 0.3 * s * s,
    )


def test_what_a_piece_sweeps_converges_with_its_length(precision):
    """The union over many points, as an interval: its ends are off by the second order of the piece's length.

    Asked of pieces on which the surface crosses the sphere, in front or at the back; without the crossing the error
    would be of first order. A crossing twice, which both ends hide, is as rare as it is short.
    """
    rng = np.random.default_rng(7)
    curves = [(_wobbling(rng), rng.uniform(0.2, 0.8)) for _ in range(4000)]
    errors = {"front": [], "back": []}
    for length in (0.2, 0.1, 0.05):
        values = np.array([[[f(m + side * length / 2) for f in fs] for fs, m in curves] for side in (-1, 1)])
        at = [tuple(precision.lanes(values[side, :, k]) for k in range(3)) for side in (0, 1)]
        first, last = (np.array(v, dtype=np.float64) for v in swept(*at))
        begin = np.maximum(values[..., 0], values[..., 1])
        some = begin < values[..., 2]
        crossings = {
            "front": some.all(axis=0) & (np.diff(values[..., 0] < values[..., 1], axis=0)[0]),
            "back": some[0] != some[1],
        }
        for kind, where in crossings.items():
            miss = []
            assert where.sum() > 20
            for k in np.flatnonzero(where):
                fs, m = curves[k]
                surface, enter, leave = (f(m + np.linspace(-0.5, 0.5, 2001) * length) for f in fs)
                begin = np.maximum(surface, enter)
                some_of_it = begin < leave
                low, high = begin[some_of_it].min(), leave[some_of_it].max()
                miss.append(abs(first[k] - low) + abs(last[k] - high))
            errors[kind].append(np.mean(miss))
    for kind in errors:
        assert errors[kind][0] < 0.02
        assert np.log2(errors[kind][0] / errors[kind][2]) > 3.2


def test_nothing_is_swept_where_nothing_is_blocked(precision):
    lanes = precision.lanes
    behind = (lanes([2.5]), lanes([0.4]), lanes([2.0]))
    first, last = swept(behind, behind)
    assert np.array(first)[0] == np.inf
    assert np.array(last)[0] == -np.inf
