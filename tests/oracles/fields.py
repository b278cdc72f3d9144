"""Synthetic height fields with exact depth and exact normals, float64.

Conventions: view frame right-handed, camera along -z, ``view_z`` positive in front; pixel coordinates continuous with
centres at half-integers, y down. A perspective pixel sees (x', y', -1) view_z with x' = (x_px - cx)/fx,
y' = -(y_px - cy)/fy; an orthographic one sees X = (x_px - cx) p, Y = -(y_px - cy) p with pixel size p.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Field:
    """A depth layer: ``view_z`` (H, W), ``normal_v`` (H, W, 3), and keyword arguments of the camera.

    ``orthographic`` says which camera ``camera`` belongs to: {width, height, view_height, cx, cy} or
    {width, height, fx, fy, cx, cy}.
    """

    view_z: np.ndarray
    normal_v: np.ndarray
    camera: dict
    orthographic: bool

    @property
    def scale(self) -> tuple[float, float]:
        """Focal lengths in pixels; for an orthographic camera pixels per scene unit, twice."""
        if self.orthographic:
            return (self.camera["height"] / self.camera["view_height"],) * 2
        return self.camera["fx"], self.camera["fy"]

    @property
    def pixel(self) -> float:
        """Orthographic pixel size in scene units."""
        return 1.0 / self.scale[0]

    def plane_coordinates(self) -> tuple[np.ndarray, np.ndarray]:
        """(x', y') of the pixel centres: X and Y in scene units (orthographic) or per unit view_z (perspective)."""
        height, width = self.view_z.shape
        return _coordinates(width, height, *self.scale, self.camera["cx"], self.camera["cy"])

    def positions(self) -> np.ndarray:
        """View-space points (H, W, 3)."""
        x, y = self.plane_coordinates()
        w = np.ones_like(self.view_z) if self.orthographic else self.view_z
        return np.stack([x * w, y * w, -self.view_z], axis=-1)

    def view_dirs(self) -> np.ndarray:
        """Unit directions from the surface to the camera (H, W, 3)."""
        if self.orthographic:
            return np.broadcast_to([0.0, 0.0, 1.0], (*self.view_z.shape, 3))
        P = self.positions()
        return -P / np.linalg.norm(P, axis=-1, keepdims=True)


def _coordinates(width, height, fx, fy, cx, cy):
    x = (np.arange(width) + 0.5 - cx) / fx
    y = -(np.arange(height) + 0.5 - cy) / fy
    return tuple(np.meshgrid(x, y))


def _perspective(width, height, fx, fy, cx, cy) -> dict:
    return {"width": width, "height": height, "fx": fx, "fy": fy, "cx": cx, "cy": cy}


def _orthographic(width, height, pixel) -> dict:
    return {
        "width": width,
        "height": height,
        "view_height": height * pixel,
        "cx": width / 2,
        "cy": height / 2,
    }


def tilted_plane(tilt, azimuth, off_axis=(0.0, 0.0), *, size=16, f=400.0, distance=3.0) -> Field:
    """Perspective window of ``size`` x ``size`` pixels onto one infinite plane.

    Args:
        tilt: angle between the plane's normal and the view direction at the window's centre, radians.
        azimuth: direction of the tilt about that view direction, radians.
        off_axis: (x, y) angles of the window's centre from the optical axis, radians: the window is a crop of a wider
            image, with the principal point outside of it.
    """
    cx, cy = size / 2 - f * np.tan(off_axis[0]), size / 2 + f * np.tan(off_axis[1])
    x, y = _coordinates(size, size, f, f, cx, cy)
    centre = distance * np.array([np.tan(off_axis[0]), np.tan(off_axis[1]), -1.0])
    V = -centre / np.linalg.norm(centre)
    e1 = np.cross([0.0, 1.0, 0.0], V)
    e1 /= np.linalg.norm(e1)
    n = np.cos(tilt) * V + np.sin(tilt) * (np.cos(azimuth) * e1 + np.sin(azimuth) * np.cross(V, e1))
    view_z = (n @ centre) / (n[0] * x + n[1] * y - n[2])
    if not (view_z > 0).all():
        raise ValueError("the plane leaves the window: reduce the tilt or the window's angular size")
    normal = np.broadcast_to(n, (size, size, 3)).copy()
    return Field(view_z, normal, _perspective(size, size, f, f, cx, cy), orthographic=False)


def gaussians(amplitude, width, *, count=6, seed=0):
    """Sum of Gaussian bumps and dents on [-1, 1]^2 as a function (x, y) -> (h, dh/dx, dh/dy)."""
    rng = np.random.default_rng(seed)
    centres = rng.uniform(-0.8, 0.8, (count, 2))
    heights = amplitude * rng.uniform(0.4, 1.0, count) * rng.choice([-1.0, 1.0], count)
    widths = width * rng.uniform(0.7, 1.3, count)

    def height(x, y):
        h, hx, hy = (np.zeros_like(x) for _ in range(3))
        for (cx, cy), a, s in zip(centres, heights, widths, strict=True):
            g = a * np.exp(-((x - cx) ** 2 + (y - cy) ** 2) / (2 * s * s))
            h, hx, hy = h + g, hx - g * (x - cx) / s**2, hy - g * (y - cy) / s**2
        return h, hx, hy

    return height


def waves(amplitude, frequency):
    """Crossed sinusoids with a skew, as a function (x, y) -> (h, dh/dx, dh/dy)."""

    def height(x, y):
        a, b = frequency * (x + 0.3 * y), frequency * (0.8 * y - 0.4 * x)
        h = amplitude * (np.sin(a) + np.cos(b)) / 2
        hx = amplitude * frequency * (np.cos(a) + 0.4 * np.sin(b)) / 2
        hy = amplitude * frequency * (0.3 * np.cos(a) - 0.8 * np.sin(b)) / 2
        return h, hx, hy

    return height


def from_above(height, *, size=40, extent=1.0, distance=5.0) -> Field:
    """Orthographic view from above of z = height(x, y) on [-extent, extent]^2."""
    camera = _orthographic(size, size, 2 * extent / size)
    scale = size / (2 * extent)
    x, y = _coordinates(size, size, scale, scale, size / 2, size / 2)
    h, hx, hy = height(x, y)
    n = np.stack([-hx, -hy, np.ones_like(h)], axis=-1)
    return Field(distance - h, n / np.linalg.norm(n, axis=-1, keepdims=True), camera, orthographic=True)


def in_perspective(
    height, *, size=40, tan_half=1.0, distance=3.0, slope=(0.0, 0.0), stretch=1.0, shift_px=(0.0, 0.0)
) -> Field:
    """Perspective view of view_z = distance (1 - h) / (1 + slope·(x', y')), h a height function of (x', y')/tan_half.

    With h = 0 this is a plane: ``slope`` tilts it. The image spans about ±tan_half in x' and y'.

    Args:
        stretch: fx/fy, pixels need not be square.
        shift_px: principal point relative to the image centre.
    """
    fx, fy = stretch * size / (2 * tan_half), size / (2 * tan_half)
    cx, cy = size / 2 + shift_px[0], size / 2 + shift_px[1]
    x, y = _coordinates(size, size, fx, fy, cx, cy)
    h, hx, hy = height(x / tan_half, y / tan_half)
    d = 1 + slope[0] * x + slope[1] * y
    z = distance * (1 - h) / d
    zx = -distance * hx / tan_half / d - z * slope[0] / d
    zy = -distance * hy / tan_half / d - z * slope[1] / d
    ray = np.stack([x, y, -np.ones_like(x)], axis=-1)
    px = zx[..., None] * ray + z[..., None] * np.array([1.0, 0.0, 0.0])
    py = zy[..., None] * ray + z[..., None] * np.array([0.0, 1.0, 0.0])
    n = np.cross(px, py)
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    return Field(z, n, _perspective(size, size, fx, fy, cx, cy), orthographic=False)


def inside_sphere(radius, centre, *, size=40, tan_half=1.0) -> Field:
    """Perspective view from the origin of the inner wall of a sphere that encloses it."""
    f = size / (2 * tan_half)
    x, y = _coordinates(size, size, f, f, size / 2, size / 2)
    ray = np.stack([x, y, -np.ones_like(x)], axis=-1)
    view_z = sphere_distance(ray, radius, centre)
    normal = (np.asarray(centre) - ray * view_z[..., None]) / radius
    return Field(view_z, normal, _perspective(size, size, f, f, size / 2, size / 2), orthographic=False)


def sphere_distance(ray, radius, centre) -> np.ndarray:
    """Multiple of ``ray`` at which it leaves the sphere that encloses its origin."""
    a, b, c = np.sum(ray**2, axis=-1), ray @ np.asarray(centre, dtype=float), np.dot(centre, centre) - radius**2
    return (b + np.sqrt(b * b - a * c)) / a


def extruded(profile, *, n_px, pixel, length_px, distance=5.0) -> Field:
    """Orthographic view from above of a height profile along x, constant along y.

    Args:
        profile: x -> (height, slope) for the pixel centres' x (zero in the middle of the image).
        n_px: image width. ``length_px``: image height, the length of the extrusion.
    """
    camera = _orthographic(n_px, length_px, pixel)
    x = (np.arange(n_px) + 0.5 - n_px / 2) * pixel
    h, slope = profile(x)
    n = np.stack([-slope, np.zeros_like(h), np.ones_like(h)], axis=-1)
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    z = np.broadcast_to(distance - h, (length_px, n_px)).copy()
    return Field(z, np.broadcast_to(n, (length_px, n_px, 3)).copy(), camera, orthographic=True)


def walls(left, right, k_left, k_right, **size) -> Field:
    """Floor between x = -left and x = right with vertical walls of heights ``k_left`` and ``k_right`` outside."""

    def profile(x):
        return np.where(x > right, k_right, np.where(x < -left, k_left, 0.0)), np.zeros_like(x)

    return extruded(profile, **size)


def groove(half_width, depth, **size) -> Field:
    """V-shaped groove: planes falling from x = ±half_width to ``depth`` below the surrounding plane at x = 0."""

    def profile(x):
        inside = np.abs(x) < half_width
        slope = depth / half_width
        return np.where(inside, slope * (np.abs(x) - half_width), 0.0), np.where(inside, slope * np.sign(x), 0.0)

    return extruded(profile, **size)


def _radial(n_px, pixel, height_slope, distance=5.0) -> Field:
    camera = _orthographic(n_px, n_px, pixel)
    x, y = _coordinates(n_px, n_px, 1 / pixel, 1 / pixel, n_px / 2, n_px / 2)
    r = np.hypot(x, y)
    h, slope = height_slope(r)
    with np.errstate(invalid="ignore", divide="ignore"):
        n = np.stack([-slope * x / r, -slope * y / r, np.ones_like(r)], axis=-1)
    n[r == 0.0] = [0.0, 0.0, 1.0]
    return Field(distance - h, n / np.linalg.norm(n, axis=-1, keepdims=True), camera, orthographic=True)


def pit(radius, depth, *, n_px, pixel) -> Field:
    """Circular pit with a flat floor and vertical walls in a plane, seen from above, centred in the image."""
    return _radial(n_px, pixel, lambda r: (np.where(r < radius, -depth, 0.0), np.zeros_like(r)))


def bowl(sphere_radius, depth, *, n_px, pixel) -> Field:
    """Spherical bowl (depth <= sphere_radius) sunk into a plane, seen from above, centred in the image."""
    centre = sphere_radius - depth
    rim = np.sqrt(sphere_radius**2 - centre**2)

    def height_slope(r):
        root = np.sqrt(np.maximum(sphere_radius**2 - np.minimum(r, rim) ** 2, 1e-300))
        inside = r < rim
        return np.where(inside, centre - root, 0.0), np.where(inside, r / root, 0.0)

    return _radial(n_px, pixel, height_slope)


def blocks(*, size=40, extent=1.0, height=0.5, n_cells=8, seed=0, distance=5.0) -> Field:
    """Orthographic view from above of a chequered city: square blocks of random heights, every normal upwards.

    ``size`` is a multiple of ``n_cells``, so that every wall lies on a texel boundary.
    """
    if size % n_cells:
        raise ValueError("size must be a multiple of n_cells")
    rng = np.random.default_rng(seed)
    cells = height * rng.uniform(0.0, 1.0, (n_cells, n_cells)) * (rng.random((n_cells, n_cells)) < 0.5)
    h = np.kron(cells, np.ones((size // n_cells, size // n_cells)))
    normal = np.zeros((size, size, 3))
    normal[..., 2] = 1.0
    return Field(distance - h, normal, _orthographic(size, size, 2 * extent / size), orthographic=True)
