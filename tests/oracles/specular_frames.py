"""Pixels of specular occlusion from definitions: angles by arc cosines, apertures by bisection, tables by loops."""

import itertools

import numpy as np
from scipy.optimize import brentq

from oracles import cones


def view_directions(camera):
    """(H, W, 3) unit vectors to the viewer, through pixel centres."""
    y, x = np.mgrid[: camera.height, : camera.width] + 0.5
    if camera.is_orthographic:
        return np.broadcast_to([0.0, 0.0, 1.0], (*x.shape, 3))
    d = np.stack([(x - camera.cx) / camera.fx, -(y - camera.cy) / camera.fy, -np.ones_like(x)], axis=-1)
    return -d / np.linalg.norm(d, axis=-1, keepdims=True)


def angle(a, b):
    return np.arccos(np.clip(np.sum(a * b, axis=-1), -1, 1))


def mirrored(v, n):
    return 2 * np.sum(n * v, axis=-1, keepdims=True) * n - v


def azimuth(n, v, b):
    """χ of b about the mirrored direction, from the frame in which n = z and v has no y."""
    x = n * np.sum(n * v, axis=-1, keepdims=True) - v
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    y = np.cross(n, x)
    theta = angle(n, v)[..., None]
    along = -np.cos(theta) * x + np.sin(theta) * n
    return np.abs(np.arctan2(np.sum(b * y, axis=-1), np.sum(b * along, axis=-1)))


def aperture(kind, A, n, b, uniform=False):
    """Half angle of one pixel's cone."""
    tilt = angle(n, b)
    if kind == "matched":
        return brentq(lambda alpha: visibility(alpha, tilt, uniform) - A, 0, np.pi / 2 + tilt, xtol=1e-12)
    if uniform:
        return np.arccos(1 - A)
    return np.arcsin(np.sqrt(A if kind == "seed" else min(A / np.cos(tilt), 1)))


def visibility(alpha, tilt, uniform=False):
    """Visibility of a cone about an axis that leans away from the normal, cut by the tangent plane."""
    solid_angle, energy, *_ = cones.moments([0, 0, 1], [np.sin(tilt), 0, np.cos(tilt)], alpha)
    return solid_angle / (2 * np.pi) if uniform else energy / np.pi


def lagarde(nv, A, roughness):
    return np.clip((nv + A) ** np.exp2(-16 * roughness - 1) - 1 + A, 0, 1)


def interpolated(values, unit):
    """Channels of a table (…, n_y, n_x, C) at one point of the unit cube (x, y, …), texel by texel."""
    position = np.clip(unit, 0, 1)[::-1] * (np.array(values.shape[:-1]) - 1)
    total = np.zeros(values.shape[-1])
    for texel in itertools.product(*map(range, values.shape[:-1])):
        total += values[texel] * np.prod(np.clip(1 - np.abs(position - texel), 0, None))
    return total
