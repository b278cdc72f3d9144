"""The task that every implementation is given: one frame and one estimator.

The estimator is the one of the papers, whose work can be counted: slices even in the image, nearest texels, squared
step distances, linear attenuation toward the tangent plane, a search of limited length.
"""

import math
from dataclasses import dataclass

import numpy as np

import gtao

__all__ = ["COUNTS", "FRAME_INDEX", "SIZES", "Frame", "Work", "frame", "label"]

SIZES = {"64": (64, 64), "540p": (960, 540), "1080p": (1920, 1080), "4K": (3840, 2160), "8K": (7680, 4320)}

#: Slices and steps per side: the papers' one direction per pixel, XeGTAO's High and Ultra, and a reference.
COUNTS = {"1x8": (1, 8), "3x3": (3, 3), "9x3": (9, 3), "16x16": (16, 16)}

#: Frame of the noise's cycle in which the pattern is neither turned nor moved.
FRAME_INDEX = 5

SEED = 5
N_SPHERES = 70


@dataclass(frozen=True)
class Work:
    """One estimate: size of the frame, slices, steps per side, and the estimator's lengths."""

    width: int
    height: int
    n_slices: int
    n_steps: int
    radius: float = 0.5
    full: float = 0.2  # distance up to which an occluder counts in full; none from ``radius`` on
    fov_y: float = math.radians(60)
    longest: float = 0.12  # search in the image, as a share of the height

    @classmethod
    def of(cls, size, counts, **changes):
        return cls(*SIZES[size], *counts, **changes)

    @property
    def n_pixels(self):
        return self.width * self.height

    @property
    def n_taps(self):
        """Depth samples of the whole frame."""
        return self.n_pixels * 2 * self.n_slices * self.n_steps

    @property
    def focal_px(self):
        return self.height / 2 / math.tan(self.fov_y / 2)

    @property
    def max_radius_px(self):
        return self.longest * self.height

    @property
    def camera(self):
        return gtao.PerspectiveCamera(self.width, self.height, fov_y=self.fov_y)

    def method(self, **changes):
        """The package's configuration of this estimator."""
        options = {
            "radius": self.radius,
            "n_slices": self.n_slices,
            "n_steps": self.n_steps,
            "falloff": gtao.LinearFalloff(start=self.full, end=self.radius),
            "slice_measure": "screen",
            "step_law": "offset",
            "step_exponent": 2.0,
            "step_jitter": "pixel",
            "min_step_px": 1.0,
            "max_radius_px": self.max_radius_px,
            "border": "replicate",
            "noise": "spatial_4x4",
        }
        return gtao.GTAO(**(options | changes))


def label(counts):
    return f"{counts[0]}x{counts[1]}"


@dataclass(frozen=True)
class Frame:
    """Depth (H, W) and normals (H, W, 3) in float32, in the package's frame: +x right, +y up, looking along -z."""

    view_z: np.ndarray
    normal_v: np.ndarray

    def gbuffer(self, work):
        return gtao.GBuffer(self.view_z, self.normal_v, work.camera)


def frame(work, relief=0.0):
    """Spheres between a ground plane and a back wall, without background; depth and normals in closed form.

    Args:
        work: gives size and camera.
        relief: relative standard deviation of noise on the depth. Without it samples on planes tie with the tangent
            plane, and which of two ties wins is a matter of rounding.
    """
    rng = np.random.default_rng(SEED)
    # Ray slopes; the point at depth z is z (X, Y, -1).
    X = (np.arange(work.width) + 0.5 - work.width / 2) / work.focal_px
    Y = (work.height / 2 - np.arange(work.height) - 0.5) / work.focal_px
    wall, ground = 14.0, 1.2
    floor_z = np.where(ground / wall < -Y, ground / np.maximum(-Y, ground / wall), wall)
    view_z = np.repeat(floor_z[:, None].astype(np.float32), work.width, axis=1)
    normal_v = np.zeros((work.height, work.width, 3), np.float32)
    normal_v[..., 2] = view_z == wall
    normal_v[..., 1] = view_z != wall
    for _ in range(N_SPHERES):
        radius, depth = rng.uniform(0.15, 0.7), rng.uniform(3, 13)
        centre = np.array([rng.uniform(-1, 1) * depth, rng.uniform(0.6 * radius - ground, 0.6), -depth])
        _draw(view_z, normal_v, X, Y, centre, radius)
    if relief:
        view_z *= 1 + np.float32(relief) * rng.standard_normal(view_z.shape, np.float32)
    return Frame(view_z, normal_v)


def _draw(view_z, normal_v, X, Y, centre, radius):
    """A sphere, where it is nearer than what is there."""
    cx, cy, cz = centre
    near = -cz - radius
    columns = np.flatnonzero(abs(X * -cz - cx) <= radius * -cz / near * (1 + abs(X)))
    rows = np.flatnonzero(abs(Y * -cz - cy) <= radius * -cz / near * (1 + abs(Y)))
    if not len(columns) or not len(rows):
        return
    window = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    x, y = X[window[1]][None, :], Y[window[0]][:, None]
    a, b, c = x * x + y * y + 1, x * cx + y * cy - cz, cx * cx + cy * cy + cz * cz - radius * radius
    under = b * b - a * c
    z = (b - np.sqrt(np.maximum(under, 0))) / a
    seen = (under > 0) & (z < view_z[window])
    view_z[window][seen] = z[seen]
    n = np.stack([x * z - cx, y * z - cy, -z - cz], axis=-1) / radius
    normal_v[window][seen] = n[seen]
