"""Procedural scenes of flat walls and steps. Walls are thick and overlap, so that no light leaks along edges."""

import numpy as np

from .compose import Perspective, compose
from .mesh import Reflectance
from .registry import scene
from .surface import Surface, box, copies, cylinder, generator, merge, move, revolve, rotation, sphere, tube

GROUND = box((-30, -30, -1), (30, 30, 0))


def _boxes(low: np.ndarray, high: np.ndarray) -> Surface:
    """One axis-aligned box for each row of ``low`` and ``high`` (k, 3)."""
    size = high - low
    return copies(box((0, 0, 0), (1, 1, 1)), low, size[:, :, None] * np.eye(3))


def _turned_box(size, centre, angle: float) -> Surface:
    """Box standing on the ground z = 0, turned about its vertical axis."""
    half = np.array(size) / 2
    return move(box(-half * (1, 1, 0), half * (1, 1, 2)), centre, rotation((0, 0, 1), angle))


@scene(
    kind="procedural",
    radius=0.7,
    solid=True,
    views=("the whole box through its open front", "inside, into the corner behind the low box"),
)
def cornell(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5) -> dict:
    """Box interior, open at the front and through a hatch in the ceiling, with two turned boxes."""
    t = 0.2
    room = merge(
        box((-1 - t, -1, -t), (1 + t, 1 + t, 0)),
        box((-1 - t, 1, -t), (1 + t, 1 + t, 2 + t)),
        box((-1 - t, -1, -t), (-1, 1 + t, 2 + t)),
        box((1, -1, -t), (1 + t, 1 + t, 2 + t)),
        box((-1 - t, -1, 2), (-0.35, 1 + t, 2 + t)),
        box((0.35, -1, 2), (1 + t, 1 + t, 2 + t)),
        box((-1 - t, -1, 2), (1 + t, -0.35, 2 + t)),
        box((-1 - t, 0.35, 2), (1 + t, 1 + t, 2 + t)),
        _turned_box((0.6, 0.6, 1.2), (-0.35, 0.35, 0), 0.3),
        _turned_box((0.6, 0.6, 0.6), (0.37, -0.3, 0), -0.3),
    )
    views = [Perspective((0.09, -4.0, 1.06), (0.02, 0, 0.98), 36), Perspective((-0.75, -0.8, 1.5), (0.6, 0.5, 0.2), 75)]
    return compose(room, views, width, height, reflectance)


@scene(
    kind="procedural",
    radius=0.8,
    solid=True,
    views=("from below, three-quarter", "from the foot of the flight, close"),
)
def stairs(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5) -> dict:
    """Nine steps between a parapet and a balustrade, up to a walled landing."""
    n, rise, going, half = 9, 0.2, 0.32, 1.1
    i = np.arange(n)
    steps = _boxes(
        np.stack([np.full(n, -half - 0.1), i * going, np.full(n, -0.5)], -1),
        np.stack([np.full(n, half + 0.1), np.full(n, n * going + 1.6), (i + 1) * rise], -1),
    )
    parapet = _boxes(
        np.stack([np.full(n, -half - 0.35), i * going - 0.12, np.full(n, -0.5)], -1),
        np.stack([np.full(n, -half), np.full(n, n * going + 1.6), (i + 1) * rise + 0.75], -1),
    )
    y, z = (i + 0.5) * going, (i + 1) * rise
    post = revolve([(0.05, -0.1), (0.035, 0.1), (0.065, 0.3), (0.03, 0.55), (0.06, 0.8)], 12)
    posts = copies(post, np.stack([np.full(n, half - 0.1), y, z], -1), np.broadcast_to(np.eye(3), (n, 3, 3)))
    rail_y = np.array([y[0] - 0.3, *y[[0, -1]], y[-1] + 1.4])
    rail_z = np.array([z[0], *z[[0, -1]], z[-1] + 0.02]) + 0.8
    rail = tube(np.stack([np.full(4, half - 0.1), rail_y, rail_z], -1), 0.08, 12)
    top = n * rise
    back = n * going + 1.3
    walls = merge(
        box((-half - 0.35, back, -0.5), (half + 0.6, back + 0.4, top + 1.7)),
        box((-half - 0.35, back - 0.5, top + 1.3), (half + 0.6, back + 0.4, top + 1.7)),
        box((half + 0.3, -0.4, -0.5), (half + 0.6, back + 0.4, 0.9)),
    )
    views = [
        Perspective((2.9, -3.0, 3.3), (-0.1, 1.5, 0.9), 42),
        Perspective((0.2, -1.3, 1.1), (0.1, 1.6, 1.0), 62),
    ]
    return compose(merge(GROUND, steps, parapet, posts, rail, walls), views, width, height, reflectance)


@scene(
    kind="procedural",
    radius=1.0,
    solid=True,
    views=("the front, three-quarter", "along the passage behind the columns"),
)
def arcade(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5) -> dict:
    """Row of columns with a back wall, niches and a roof."""
    n, pitch, depth, top = 7, 1.4, 1.9, 2.6
    x = (np.arange(n) - (n - 1) / 2) * pitch
    end = x[-1] + 0.6
    shaft = [(0.3, -0.1), (0.3, 0.12), (0.24, 0.16), (0.24, 0.26), (0.19, 0.32), (0.16, 2.2), (0.24, 2.36), (0.24, 2.5)]
    columns = copies(
        revolve([*shaft, (0.3, 2.5), (0.3, 2.7)], 24),
        np.stack([x, np.zeros(n), np.zeros(n)], -1),
        np.broadcast_to(np.eye(3), (n, 3, 3)),
    )
    ribs = _boxes(
        np.stack([x - 0.12, np.full(n, -0.2), np.full(n, top - 0.25)], -1),
        np.stack([x + 0.12, np.full(n, depth + 0.3), np.full(n, top + 0.1)], -1),
    )
    piers = _boxes(
        np.stack([x - 0.35, np.full(n, depth - 0.25), np.full(n, -0.2)], -1),
        np.stack([x + 0.35, np.full(n, depth + 0.3), np.full(n, top + 0.1)], -1),
    )
    shell = merge(
        box((-end, -0.6, -0.5), (end, depth + 0.6, 0.08)),
        box((-end - 0.3, -0.9, -0.5), (end + 0.3, 0.0, 0.04)),
        box((-end, depth, -0.5), (end, depth + 0.6, top + 0.4)),
        box((-end, -0.4, top), (end, depth + 0.6, top + 0.5)),
        box((-end, -0.55, top + 0.3), (end, depth + 0.6, top + 0.6)),
        box((-end, -0.3, -0.5), (-end + 0.35, depth + 0.6, top + 0.2)),
    )
    views = [
        Perspective((3.6, -4.6, 1.9), (-0.6, 0.6, 1.2), 50),
        Perspective((3.9, 0.9, 1.5), (-3.0, 0.9, 1.1), 70),
    ]
    return compose(merge(GROUND, columns, ribs, piers, shell), views, width, height, reflectance)


@scene(
    kind="procedural",
    radius=0.8,
    solid=True,
    views=("oblique, across all of them", "steeply down into the deep ones"),
)
def trenches(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5) -> dict:
    """Six parallel trenches of different width and depth in a plane, one of them bridged."""
    widths = np.array([0.25, 0.4, 0.6, 0.9, 0.5, 1.2])
    depths = np.array([1.0, 0.5, 1.3, 0.8, 1.8, 0.35])
    ridge = 0.2
    left = np.cumsum([0, *(widths[:-1] + ridge)]) - (widths.sum() + 5 * ridge) / 2
    right = left + widths
    half = 1.8
    floors = _boxes(
        np.stack([left - 0.1, np.full(6, -half - 0.1), np.full(6, -3.0)], -1),
        np.stack([right + 0.1, np.full(6, half + 0.1), -depths], -1),
    )
    low = np.concatenate([[-30.0], right])
    high = np.concatenate([left, [30.0]])
    ridges = _boxes(
        np.stack([low, np.full(7, -half - 0.1), np.full(7, -3.0)], -1),
        np.stack([high, np.full(7, half + 0.1), np.zeros(7)], -1),
    )
    rest = merge(box((-30, -30, -3), (30, -half, 0)), box((-30, half, -3), (30, 30, 0)))
    bridge = merge(
        box((left[3] - 0.2, -0.3, -0.02), (right[3] + 0.2, 0.35, 0.12)),
        box((left[2] - 0.2, 0.9, -0.02), (right[2] + 0.2, 1.1, 0.1)),
    )
    views = [
        Perspective((0.2, -2.4, 3.6), (-0.1, -0.1, -0.4), 44),
        Perspective((0.6, 1.6, 2.4), (0.35, 0.1, -1.0), 50),
    ]
    return compose(merge(floors, ridges, rest, bridge), views, width, height, reflectance)


@scene(
    kind="procedural",
    radius=1.0,
    solid=True,
    views=("from above, oblique", "low above the roofs"),
)
def city(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5, seed: int = 11) -> dict:
    """Grid of blocks of different heights with setbacks, roof structures and streets."""
    rng = generator(seed)
    n, pitch = 11, 1.0
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    x, y = (i - (n - 1) / 2) * pitch, (j - (n - 1) / 2) * pitch
    half = rng.uniform(0.3, 0.42, (n * n, 2))
    tall = 0.4 + 2.4 * rng.beta(1.2, 2.2, n * n)
    centre = np.stack([x, y, np.zeros(n * n)], -1)

    def stack(shrink, bottom, top, rows=slice(None)):
        wide = np.column_stack([half * shrink, np.zeros(n * n)])
        return _boxes(
            (centre - wide + np.outer(bottom, (0, 0, 1)))[rows], (centre + wide + np.outer(top, (0, 0, 1)))[rows]
        )

    setback = tall + rng.uniform(0.2, 0.6, n * n)
    parts = [
        GROUND,
        stack(1.0, np.full(n * n, -0.5), tall),
        stack(0.65, tall - 0.1, setback, rng.random(n * n) < 0.5),
        stack(0.3, tall - 0.1, setback + 0.15, rng.random(n * n) < 0.4),
        stack(1.12, np.full(n * n, -0.5), np.full(n * n, 0.12)),
    ]
    views = [Perspective((3.4, -4.8, 5.2), (0.2, -0.6, 0.6), 44), Perspective((0.9, -6.4, 2.6), (0.35, -2.5, 0.5), 50)]
    return compose(merge(*parts), views, width, height, reflectance)


@scene(
    kind="procedural",
    radius=0.8,
    solid=True,
    views=("along the diagonal", "low, along one wall"),
)
def corner_boxes(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5) -> dict:
    """Trihedral corner of two walls and a floor, with boxes, a shelf, a ball and a drum."""
    parts = merge(
        box((-0.5, -0.5, -0.5), (6, 6, 0)),
        box((-0.5, -0.5, -0.5), (0, 6, 3.2)),
        box((-0.5, -0.5, -0.5), (6, 0, 3.2)),
        _turned_box((0.9, 0.9, 0.9), (0.75, 0.8, 0), 0.35),
        _turned_box((0.5, 0.7, 1.6), (1.9, 0.5, 0), -0.15),
        _turned_box((0.6, 0.6, 0.5), (0.75, 0.8, 0.9), -0.2),
        _turned_box((0.8, 0.5, 0.35), (1.5, 1.7, 0), 0.8),
        box((-0.1, 0.9, 1.8), (0.55, 2.9, 1.92)),
        box((-0.1, 0.9, 2.35), (0.55, 2.9, 2.47)),
        move(sphere(32, 20), (0.55, 2.2, 0.4), 0.4 * np.eye(3)),
        move(cylinder(0.3, 0, 0.8), (2.8, 1.0, 0)),
    )
    views = [Perspective((4.6, 4.2, 3.2), (0.9, 0.9, 0.8), 42), Perspective((3.2, 3.2, 1.0), (0.2, 1.2, 0.9), 50)]
    return compose(parts, views, width, height, reflectance)
