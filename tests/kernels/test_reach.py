"""Lengths of a search within the frame, against the lines of its border in float64."""

from types import SimpleNamespace

import numpy as np
import pytest

from gtao.kernels import reach

WIDTH, HEIGHT = 37, 21
# How far inside the outermost half texel the search ends.
MARGIN = 0.499


def switches(**options):
    defaults = {
        "width": WIDTH,
        "height": HEIGHT,
        "border": "shorten",
        "unlimited": True,
        "clamp_px": False,
        "step_law": "strata",
    }
    return SimpleNamespace(**(defaults | options))


def to_border(x, y, dx, dy):
    """Length from (x, y) along (dx, dy) to the first of the four lines that bound the frame."""
    x_line = WIDTH - 1 + MARGIN if dx > 0 else -MARGIN
    y_line = HEIGHT - 1 + MARGIN if dy > 0 else -MARGIN
    lengths = [(line - at) / d for line, at, d in ((x_line, x, dx), (y_line, y, dy)) if d]
    return min(lengths)


def lengths(precision, x, y, dx, dy):
    lanes = precision.lanes
    both = reach.reaches(switches(), None, None, None, None, None, (lanes(dx), lanes(dy)), lanes(x), lanes(y))
    return [np.array(side) for side in both]


def test_a_search_ends_at_the_border(precision):
    rng = np.random.default_rng(5)
    n = 300
    x, y, phi = rng.integers(0, WIDTH, n), rng.integers(0, HEIGHT, n), rng.uniform(0, 2 * np.pi, n)
    dx, dy = np.cos(phi), np.sin(phi)
    behind, ahead = lengths(precision, x, y, dx, dy)
    assert ahead == pytest.approx(list(map(to_border, x, y, dx, dy)), rel=10 * precision.tolerance)
    assert behind == pytest.approx(list(map(to_border, x, y, -dx, -dy)), rel=10 * precision.tolerance)


@pytest.mark.parametrize(("dx", "dy"), [(1, 0), (-1, 0), (0, 1), (0, -1), (-0.0, 1), (1, 1e-12), (-1e-12, -1)])
def test_a_search_along_an_axis_ends_at_the_border(precision, dx, dy):
    """A direction that never meets two of the lines, or only far away, is no division by zero."""
    x, y = 3, 17
    behind, ahead = lengths(precision, [x], [y], [dx], [dy])
    along = (dx, 0) if abs(dx) > abs(dy) else (0, dy)
    assert ahead[0] == pytest.approx(to_border(x, y, *along), rel=10 * precision.tolerance)
    assert behind[0] == pytest.approx(to_border(x, y, -along[0], -along[1]), rel=10 * precision.tolerance)


@pytest.mark.parametrize(("fx", "fy", "unit"), [(50.0, 50.0, True), (50.0, 50.0, False), (50.0, 80.0, False)])
def test_directions_are_unit_vectors_in_pixels(precision, fx, fy, unit):
    """Down is positive in the image; with square pixels a unit vector stays one."""
    phi = np.linspace(0, np.pi, 7)
    size = 1 if unit else 1.7
    ux, uy = size * np.cos(phi), size * np.sin(phi)
    scalars = SimpleNamespace(fx=precision.Float(fx), fy=precision.Float(fy))
    k = SimpleNamespace(unit_directions=unit)
    (dx, dy), length = reach.direction(k, scalars, precision.lanes(ux), precision.lanes(uy))
    want = np.hypot(fx * ux, fy * uy)
    assert np.array(length) == pytest.approx(want if not unit else [fx], rel=precision.tolerance)
    assert np.array(dx) == pytest.approx(fx * ux / want, abs=precision.tolerance)
    assert np.array(dy) == pytest.approx(-fy * uy / want, abs=precision.tolerance)


def test_a_side_shorter_than_its_least_distance_has_no_sample(precision):
    side = reach.Side.of(precision.lanes([0.499, 1.0, 4.0]), precision.Float(1), "strata")
    assert list(np.array(side.inside)) == [False, True, True]
