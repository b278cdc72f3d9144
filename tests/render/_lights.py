"""Environment maps with a known answer, or with everything that makes sampling hard."""

import numpy as np

from gtao.lighting import EnvironmentMap

SUN = 8e4


def rotation(seed):
    """A rotation that no axis is aligned with."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.linalg.det(q)


def constant(*colour):
    """The same radiance from everywhere."""
    return EnvironmentMap(np.tile(np.float32(colour), (4, 8, 1)))


def rough(height=8, seed=0, width=None):
    """Random texels, black ones among them, turned out of the axes."""
    rng = np.random.default_rng(seed)
    shape = (height, width or 2 * height)
    texels = rng.exponential(size=(*shape, 3)) * (rng.random((*shape, 1)) > 0.3)
    return EnvironmentMap(texels.astype(np.float32), rotation(seed + 1))


def sunny(towards, height=32):
    """A coloured sky and one texel of sun, whose centre is in the direction ``towards``."""
    texels = np.tile(np.float32([0.3, 0.5, 1.0]), (height, 2 * height, 1))
    row, column = height // 3, height // 5
    texels[row, column] = (SUN, 0.9 * SUN, 0.8 * SUN)
    local = EnvironmentMap(texels).directions()[row, column]
    return EnvironmentMap(texels, between(local, towards))


def between(a, b):
    """The smallest rotation that takes the unit vector a to the direction of b."""
    b = np.asarray(b, float) / np.linalg.norm(b)
    half = a + b
    return np.eye(3) - np.outer(half, half) / (1 + a @ b) + 2 * np.outer(b, a)
