"""Scenes whose visibility is known in closed form.

"Endless" surfaces reach ``FAR`` scene units; each docstring bounds what the missing rest changes at distances of
order 1. Lengths are in scene units and angles in radians unless a name says otherwise.
"""

import math

import numpy as np

from gtao.errors import ConfigError

from . import closed_forms
from .compose import Orthographic, Perspective, compose
from .mesh import Reflectance
from .registry import scene
from .surface import Surface, block, box, equal_area_radius, merge, move, relief, revolve, rotation

FAR = 2.0**14
#: Distances from the origin, doubling up to FAR: triangles near the origin are small and their hit points exact.
REACH = 2.0 ** np.arange(-1, 15)
ALONG = np.concatenate([-REACH[::-1], [0.0], REACH])
#: Sides of the polygons that stand for circles of the same area: radii are right to (pi / N_AROUND)² / 3 = 5e-5.
N_AROUND = 256
#: Shifts cameras along directions in which the scene is endless: a ray exactly through an edge may slip between the
#: two triangles.
OFF_EDGE = 0.0137


def _check(low: float, high: float, **values: float) -> None:
    for name, value in values.items():
        if not isinstance(value, int | float) or not low <= value <= high:
            raise ConfigError(f"{name} must be a number in [{low:.4g}, {high:.4g}], got {value!r}")


def _endless_box(low: float, high: float, bottom: float, top: float) -> Surface:
    """Box from x = low to high, endless along y."""
    inner = [x for x in ALONG if low < x < high]
    xs = [low, *inner, high]
    return block(xs, ALONG, [bottom, top])


@scene(
    kind="analytic",
    radius=1.0,
    solid=True,
    views=("perspective, 100 degrees of field of view", "orthographic"),
    expected_visibility=lambda position, tilt=0.0: closed_forms.constant(1.0, position),
    uniform=True,
)
def open_plane(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5, tilt: float = 0.0) -> dict:
    """Plane under an open sky, tilted against the cameras: visibility 1 everywhere.

    The cameras look straight down at the origin, the first from 4 units above; ``tilt`` in [0, 1.4] radians
    (80 degrees) turns the plane's upper side about the x axis, towards the bottom of the image. T_1 = 1,
    T_k = 0 for k > 1.
    """
    _check(0, 1.4, tilt=tilt)
    # The turn about z keeps the edges of triangles off the rows and diagonals of pixels.
    linear = rotation((1, 0, 0), tilt) @ rotation((0, 0, 1), 0.3)
    plane = move(_endless_box(-FAR, FAR, -1.0, 0.0), linear=linear)
    views = [
        Perspective((0, 0, 4), (0, 0, 0), 100, up=(0, 1, 0)),
        Orthographic((0, 0, 16), (0, 0, 0), 4),
    ]
    return compose(plane, views, width, height, reflectance)


@scene(
    kind="analytic",
    radius=1.0,
    solid=True,
    views=("from the centre towards a corner", "from a corner across the room"),
    expected_visibility=lambda position: closed_forms.constant(0.0, position),
    uniform=True,
)
def closed_box(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5) -> dict:
    """Inside of a closed cube of side 2: visibility 0 everywhere, T_k = 0."""
    room = merge(
        *(
            box(np.where(axis, side - 0.5, -2.0), np.where(axis, side + 0.5, 2.0))
            for axis in np.eye(3, dtype=bool)
            for side in (-1.5, 1.5)
        )
    )
    views = [Perspective((0, 0, 0), (1, 0.8, -0.7), 90), Perspective((-0.8, -0.8, 0.7), (1, 0.7, -0.5), 80)]
    return compose(room, views, width, height, reflectance)


@scene(
    kind="analytic",
    radius=1.0,
    solid=True,
    views=("orthographic, straight down", "perspective, along the groove"),
    expected_visibility=lambda position, angle=math.pi / 2: closed_forms.constant(
        0.5 * (1 - math.cos(angle)), position
    ),
    uniform=True,
)
def v_groove(
    width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5, angle: float = math.pi / 2
) -> dict:
    """Endless V-shaped groove between two half planes: visibility (1 - cos angle) / 2 everywhere.

    The groove follows the y axis; ``angle`` in [0.2, pi] radians is between its faces. T_k = A (1 - A)^(k-1). A face
    that ends at FAR raises the visibility at distance d from the groove by less than d / FAR.
    """
    _check(0.2, math.pi, angle=angle)
    half = angle / 2
    x, y = np.meshgrid(ALONG * math.sin(half), ALONG, indexing="ij")
    groove = relief(np.stack([x, y, np.abs(ALONG)[:, None] * math.cos(half) + 0 * y], -1), -1.0)
    views = [
        Orthographic((OFF_EDGE, OFF_EDGE, 16), (OFF_EDGE, OFF_EDGE, 0), 1.5 * math.sin(half)),
        Perspective((OFF_EDGE, -2, 2.5), (0, 0.5, 0.3), 50),
    ]
    return compose(groove, views, width, height, reflectance)


@scene(
    kind="analytic",
    radius=2.0,
    solid=True,
    views=("orthographic, straight down on the ground before the wall", "perspective, oblique"),
    expected_visibility=lambda position, d=1.0, k=1.0: closed_forms.wall(position, d, k),
)
def wall(
    width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5, d: float = 1.0, k: float = 1.0
) -> dict:
    """Ground before an endless wall: visibility (1 + cos e) / 2, tan e = k / distance to the wall.

    The first camera's axis meets the ground at distance ``d`` from the wall of height ``k``, both in [0.01, 8]. The
    ends of the wall and of the ground, at FAR, change the visibility by less than 1e-4.
    """
    _check(0.01, 8, d=d, k=k)
    parts = merge(_endless_box(-FAR, FAR, -1.0, 0.0), _endless_box(d, d + closed_forms.WALL_THICKNESS, -0.5, k))
    views = [
        Orthographic((0, OFF_EDGE, k + 16), (0, OFF_EDGE, 0), 1.9 * d),
        Perspective((-2 * d, -1.5 * d, k + 2 * d), (d, OFF_EDGE, 0.03 * k), 55),
    ]
    return compose(parts, views, width, height, reflectance)


@scene(
    kind="analytic",
    radius=2.0,
    solid=True,
    views=("orthographic, straight down on the floor", "perspective, into the trench"),
    expected_visibility=lambda position, d1=1.0, d2=0.5, k=1.0: closed_forms.trench(position, d1, d2, k),
)
def trench(
    width: int = 128,
    height: int = 128,
    *,
    reflectance: Reflectance = 0.5,
    d1: float = 1.0,
    d2: float = 0.5,
    k: float = 1.0,
) -> dict:
    """Endless trench with walls at x = -d1 and d2: visibility of the floor (cos e1 + cos e2) / 2.

    ``d1``, ``d2`` and the depth ``k`` are in [0.01, 8]. The first camera's axis meets the floor at the middle between
    the walls. The ends of the trench, at FAR, change the visibility by less than 1e-4.
    """
    _check(0.01, 8, d1=d1, d2=d2, k=k)
    parts = merge(
        _endless_box(-d1 - 1, d2 + 1, -1.0, 0.0), _endless_box(-FAR, -d1, -0.5, k), _endless_box(d2, FAR, -0.5, k)
    )
    span, middle = d1 + d2, (d2 - d1) / 2
    views = [
        Orthographic((middle, OFF_EDGE, k + 16), (middle, OFF_EDGE, 0), 0.95 * span),
        Perspective((middle, -1.5 * span, k + 1.5 * span), (middle + OFF_EDGE * span, 0, 0), 55),
    ]
    return compose(parts, views, width, height, reflectance)


@scene(
    kind="analytic",
    radius=2.0,
    solid=True,
    views=("orthographic, straight down on the floor", "perspective, into the pit"),
    expected_visibility=lambda position, radius=1.0, k=1.0: closed_forms.pit(position, radius, k),
)
def pit(
    width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5, radius: float = 1.0, k: float = 1.0
) -> dict:
    """Cylindrical pit of radius R and depth k: visibility of the floor's centre R² / (R² + k²).

    ``radius`` and ``k`` are in [0.01, 8]; floor and wall have closed forms everywhere. The circle is a polygon of 256
    sides and the same area.
    """
    _check(0.01, 8, radius=radius, k=k)
    rim = 2 * radius
    solid = revolve([(rim, -0.5), (rim, k), (radius, k), (radius, 0.0)], N_AROUND)
    views = [
        Orthographic((0, 0, k + 16), (0, 0, 0), 1.9 * radius),
        Perspective((0, -1.5 * radius, k + 2 * radius), (0, 0, 0.4 * k), 50),
    ]
    return compose(solid, views, width, height, reflectance)


@scene(
    kind="analytic",
    radius=4.0,
    solid=True,
    views=("from the centre, down", "orthographic, straight down through the opening"),
    expected_visibility=lambda position, opening=0.25: closed_forms.bowl(position, opening),
    uniform=True,
)
def bowl(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5, opening: float = 0.25) -> dict:
    """Unit sphere with a cap of area share ``opening`` removed: visibility ``opening`` everywhere inside.

    ``opening`` is in [0.01, 0.9], T_k = s (1 - s)^(k-1). The sphere has 256 x 112 facets; each ring of it has the
    area of its circle.
    """
    _check(0.01, 0.9, opening=opening)
    rim = math.acos(1 - 2 * opening)
    theta = np.linspace(rim, math.pi, 113)[:-1]
    inside = np.stack([np.sin(theta), np.cos(theta)], axis=-1)
    outside = [(1.2, -1.2), (1.2, math.cos(rim))]
    views = [
        Perspective((0, 0, 0), (0, 0, -1), 100, up=(0, 1, 0)),
        Orthographic((0, 0, 16), (0, 0, 0), 1.35 * math.sin(rim)),
    ]
    shell = revolve([*outside, *inside], N_AROUND)
    # The fan that closes the sphere meets the pole, not the height of the last ring.
    shell.vertices[-1] = (0, 0, -equal_area_radius(N_AROUND))
    return compose(shell, views, width, height, reflectance)


@scene(
    kind="analytic",
    radius=1.0,
    solid=True,
    views=("along the diagonal", "close to one edge"),
    expected_visibility=lambda position: closed_forms.constant(0.25, position),
    uniform=True,
)
def corner(width: int = 128, height: int = 128, *, reflectance: Reflectance = 0.5) -> dict:
    """Three endless quarter planes that meet at right angles: visibility 1/4 everywhere.

    From a point of one face the sky is a quarter of the hemisphere's azimuths. T_k = 3^(k-1) / 4^k. Faces that end
    at FAR raise the visibility at distance d from the corner by less than d / FAR.
    """
    thin, far = [-1.0, 0.0], [-1.0, 0.0, *REACH]
    parts = merge(block(thin, far, far), block(far, thin, far), block(far, far, thin))
    views = [Perspective((3.1, 2.9, 3), (0.4, 0.4, 0.4), 45), Perspective((1.5, 2.5, 0.8), (0.2, 0.2, 0.4), 50)]
    return compose(parts, views, width, height, reflectance)
