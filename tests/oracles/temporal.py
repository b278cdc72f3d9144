"""The temporal filter pixel by pixel, float64 NumPy, written from its definition."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .harmonics import basis


@dataclass
class State:
    """What is kept between frames: images by name, number of frames, depth and motion (H, W, 3)."""

    images: dict[str, np.ndarray]
    count: np.ndarray
    view_z: np.ndarray
    motion: np.ndarray
    deviation: np.ndarray = None
    normal: np.ndarray = None


@dataclass
class Options:
    frames: float = 24.0
    moving_frames: float = 8.0
    moving_speed_px: float = 16.0
    disocclusion: float = 0.1
    covering: float = np.inf
    crease: float = None
    derivatives: str = "first"
    clamp: bool = True
    clamp_window: float = 0.5
    deviation_window: float = 0.0
    velocity_weighting: bool = True
    velocity_scale_px: float = 4.0
    orthographic: bool = False
    turn: Any = field(default_factory=lambda: np.eye(3))


def saturate(x):
    return min(max(x, 0.0), 1.0)


def depth_weight(expected, found, disocclusion, covering=np.inf, scale=None):
    """Trust in a texel of depth ``found`` where the surface is expected at depth ``expected``."""
    excess = (expected - found) / (expected if scale is None else scale)
    return saturate(1 - excess / disocclusion) if excess > 0 else saturate(1 + excess / covering)


def mix(current, history, bilinear, weights):
    return sum(b * (current + w * (h - current)) for b, w, h in zip(bilinear, weights, history, strict=True))


def slope(z, y, x, dy, dx, orthographic):
    """One-sided difference of 1/z (z in parallel projection), on the side where it is smaller."""
    height, width = z.shape
    f = (lambda v: v) if orthographic else (lambda v: 1 / v)
    found = []
    for sign in (1, -1):
        j, i = y + sign * dy, x + sign * dx
        if 0 <= j < height and 0 <= i < width and np.isfinite(z[j, i]):
            found.append(sign * (f(z[j, i]) - f(z[y, x])))
    return min(found, key=abs, default=0.0)


def expected_depth(z, y, x, change, dy, dx, o: Options):
    """Depth of the pixel's surface in the previous frame at (dx, dy) texels from where the pixel was."""
    before = z[y, x] - change
    sx, sy = (slope(z, y, x, *axis, o.orthographic) if o.derivatives == "first" else 0.0 for axis in ((0, 1), (1, 0)))
    if o.orthographic:
        return before + sx * dx + sy * dy, before
    inverse = 1 / before + sx * dx + sy * dy
    # Beyond the horizon of its plane a surface is infinitely far.
    return (1 / inverse if inverse > 1e-12 else 1e12), None


def block_means(v, z, y, x):
    """Means of the surface pixels of the four 2×2 blocks around a pixel."""
    height, width = z.shape
    means = []
    for sy in (-1, 0):
        for sx in (-1, 0):
            inside = [
                v[j, i]
                for j in (y + sy, y + sy + 1)
                for i in (x + sx, x + sx + 1)
                if 0 <= j < height and 0 <= i < width and np.isfinite(z[j, i])
            ]
            means.append(np.mean(inside))
    return means


def turned(image, turn):
    """What stands in the previous view frame in this one: numbers, vectors, harmonics of bands 0 to 2."""
    if image.ndim == 2:
        return image
    if image.shape[-1] == 3:
        return image @ turn.T
    # The turned function has at ω what the function has at Rᵀ ω.
    directions = np.random.default_rng(0).standard_normal((40, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return image @ np.linalg.lstsq(basis(directions), basis(directions @ turn), rcond=None)[0].T


def crease_weight(normal, found, crease):
    """Trust in a texel with another normal, by the cosine of the angle between them."""
    return saturate(1 - (1 - normal @ found) / (1 - np.cos(crease)))


def step(images, z, motion, past: State | None, o: Options, normal=None) -> State:
    """The next state, whose images are the result; background 1 in images of one channel, 0 in others."""
    surface = np.isfinite(z)
    if past is None:
        return State(images, surface.astype(float), z, motion, np.zeros(z.shape), normal)
    height, width = z.shape
    old = {name: turned(image, o.turn) for name, image in past.images.items()}
    faced = None if o.crease is None else turned(past.normal, o.turn)
    result = {name: np.full(image.shape, 1.0 if image.ndim == 2 else 0.0) for name, image in images.items()}
    count, deviation = np.zeros((height, width)), np.zeros((height, width))
    for y, x in np.argwhere(surface):
        mx, my, change = motion[y, x]
        qx, qy = x + 0.5 - mx, y + 0.5 - my
        x0, y0 = int(np.floor(qx - 0.5)), int(np.floor(qy - 0.5))
        bilinear, weights, places = [], [], []
        for j in (y0, y0 + 1):
            for i in (x0, x0 + 1):
                dx, dy = i + 0.5 - qx, j + 0.5 - qy
                bilinear.append((1 - abs(dx)) * (1 - abs(dy)))
                there = 0 <= j < height and 0 <= i < width and past.count[j, i] > 0
                places.append((j, i) if there else (0, 0))
                expected, scale = expected_depth(z, y, x, change, dy, dx, o)
                trust = 0.0
                if there:
                    trust = depth_weight(expected, past.view_z[j, i], o.disocclusion, o.covering, scale)
                    trust *= 1.0 if o.crease is None else crease_weight(normal[y, x], faced[j, i], o.crease)
                weights.append(trust)
        share = np.dot(bilinear, weights)
        counts = np.array([past.count[p] if w > 0 else 1.0 for p, w in zip(places, weights, strict=True)])
        variance = np.dot(np.multiply(bilinear, weights), 1 / counts) / share if share > 0 else 1.0
        speed = saturate(np.hypot(mx, my) / o.moving_speed_px)
        rate = (1 - speed) / o.frames + speed / o.moving_frames
        alpha = max(1 / (1 / variance + 1), rate)
        h = {
            name: mix(image[y, x], [old[name][p] if w > 0 else 0.0 for p, w in zip(places, weights, strict=True)],
                      bilinear, weights)
            for name, image in images.items()
        }  # fmt: skip
        v = images["visibility"][y, x]
        kept, moved = h["visibility"], 0.0
        if o.clamp:
            means = block_means(images["visibility"], z, y, x)
            usual = sum(b * w * past.deviation[p] for b, w, p in zip(bilinear, weights, places, strict=True))
            deviation[y, x] = usual + (abs(v - h["visibility"]) - usual) / 16
            window = o.clamp_window * (max(means) - min(means)) + o.deviation_window * usual
            if o.velocity_weighting:
                # Half a texel to either side is rounded to even.
                j = min(max(int(np.round(y - my)), 0), height - 1)
                i = min(max(int(np.round(x - mx)), 0), width - 1)
                window *= saturate(1 - np.hypot(*(motion[y, x, :2] - past.motion[j, i, :2])) / o.velocity_scale_px)
            kept = min(max(h["visibility"], min(means) - window), max(means) + window)
            moved = saturate((kept - h["visibility"]) / (v - h["visibility"])) if v != h["visibility"] else 0.0
        result["visibility"][y, x] = (1 - alpha) * kept + alpha * v
        for name in images:
            if name != "visibility":
                d, c = h[name], images[name][y, x]
                result[name][y, x] = (1 - alpha) * (d + moved * (c - d)) + alpha * c
        a = 1 - share * (1 - alpha)
        count[y, x] = 1 / (a**2 + (1 - a) ** 2 * variance)
    return State(result, count, z, motion, deviation, normal)
