"""Frames that spatial filters are put to the test on: planes and spheres, seen exactly."""

import numpy as np

import gtao

WIDTH, HEIGHT, FIELD_OF_VIEW = 160, 120, 1.0

#: Steps of depth, as a share of the nearer depth: below the bilateral filter's threshold, above it, and far above it.
STEPS = (0.05, 0.15, 0.5)
#: Angles in degrees between a plane's normal and the view direction.
TILTS = (30, 60, 75, 85)


def camera():
    return gtao.PerspectiveCamera(WIDTH, HEIGHT, FIELD_OF_VIEW)


def rays():
    """Directions of the eye rays with unit depth, (H, W, 3)."""
    c = camera()
    x, y = np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5
    X, Y = np.meshgrid((x - c.cx) / c.fx, -(y - c.cy) / c.fy)
    return np.stack([X, Y, -np.ones_like(X)], axis=-1)


def plane(normal, point):
    """Depth and normal along every eye ray; inf where the plane is behind the eye or seen from its back."""
    n = np.asarray(normal, dtype=float) / np.linalg.norm(normal)
    d = rays()
    with np.errstate(divide="ignore"):
        z = (n @ np.asarray(point, dtype=float)) / (d @ n)
    z = np.where((z > 0) & (d @ n < 0), z, np.inf)
    return z, np.broadcast_to(n, d.shape)


def sphere(centre, radius):
    """The same of a sphere."""
    d, c = rays(), np.asarray(centre, dtype=float)
    a, b = (d * d).sum(axis=-1), d @ c
    under = b * b - a * (c @ c - radius * radius)
    z = np.where(under > 0, (b - np.sqrt(np.maximum(under, 0))) / a, np.inf)
    seen = np.isfinite(z)
    n = np.where(seen[..., None], (d * np.where(seen, z, 0)[..., None] - c) / radius, [0.0, 0.0, 1.0])
    return z, n


def nearest(*surfaces):
    """What is seen of several surfaces."""
    z = np.stack([s[0] for s in surfaces])
    first = z.argmin(axis=0)
    n = np.take_along_axis(np.stack([s[1] for s in surfaces]), first[None, ..., None], axis=0)[0]
    return z.min(axis=0), n


def step(share):
    """Two planes that face the eye, the right one farther by a share of the depth."""
    left, right = plane((0, 0, 1), (0, 0, -3)), plane((0, 0, 1), (0, 0, -3 * (1 + share)))
    column = np.arange(WIDTH)[None, :] < WIDTH // 2
    return np.where(column, left[0], right[0]), left[1]


def slope(degrees):
    """An endless plane, tilted about an axis that is not one of the image's."""
    tilt, turn = np.radians(degrees), 0.4
    n = (np.sin(tilt) * np.sin(turn), np.sin(tilt) * np.cos(turn), np.cos(tilt))
    return plane(n, (0, 0, -3))


def floor():
    """A floor up to the horizon, which runs through the middle of the frame."""
    return plane((0, 1, 0), (0, -1, 0))


def corner():
    """A floor seen at a grazing angle, and the wall that it ends at."""
    return nearest(floor(), plane((0, 0, 1), (0, 0, -12)))


def spheres():
    """Rows of ever smaller spheres on a floor: from 24 to 3 pixels in radius."""
    found = [floor()]
    for row, (z, radius) in enumerate(((4, 0.7), (8, 0.6), (14, 0.5), (22, 0.5))):
        spacing = 2.6 * radius
        for k in range(-6, 7):
            found.append(sphere(((k + 0.5 * (row % 2)) * spacing, radius - 1, -z - row), radius))
    return nearest(*found)


def eaves():
    """A roof that leans away up to its edge, beyond which there is a wall where the roof would go on to in two texels.

    The least that a prediction from the slope can be fooled by; the surfaces have nothing to do with each other.
    """
    z, n = plane((-np.sin(1.2), 0, np.cos(1.2)), (0, 0, -3))
    edge = WIDTH // 2
    on_roof = np.arange(WIDTH)[None, :] < edge
    wall = z[HEIGHT // 2, edge + 1]
    return np.where(on_roof, z, wall), np.where(on_roof[..., None], n, [0.0, 0.0, 1.0])


def frame(surface):
    """The frame of what a function above returned."""
    z, n = surface
    return gtao.GBuffer(z, np.ascontiguousarray(n), camera())


def two_values():
    """1 to the left of the edge of :func:`step`, 0 to the right of it."""
    return np.broadcast_to(np.arange(WIDTH)[None, :] < WIDTH // 2, (HEIGHT, WIDTH)).astype(float)


#: Name -> frame and radius of the occlusion.
FRAMES = {
    **{f"step {100 * s:g} %": (lambda s=s: step(s), 1.0) for s in STEPS},
    **{f"slope {t}°": (lambda t=t: slope(t), 1.0) for t in TILTS},
    "grazing floor": (floor, 1.0),
    "floor and wall": (corner, 1.5),
    "spheres": (spheres, 1.0),
    "eaves": (eaves, 1.0),
}
