"""The papers' noise: 16 rotations and 4 offsets per 4×4 pixels, from the slides' formulas."""

import math

import numpy as np

__all__ = ["directions", "pattern"]


def pattern(rows, columns):
    """Number of the rotation, 0 to 15, and offset in [0, 1), per pixel of the given rows and columns."""
    y, x = np.asarray(rows)[:, None], np.asarray(columns)[None, :]
    rotation = (((x + y) & 3) << 2) + (x & 3)
    return rotation, (((y - x) & 3) / 4).astype(np.float32)


def directions(n_slices, y_down):
    """Cosine and sine of all azimuths, (slices, 16) in float32; the image's y counts down, so the sine may turn."""
    phi = (np.arange(n_slices)[:, None] + np.arange(16) / 16) * (math.pi / n_slices)
    sine = np.sin(phi) if y_down else -np.sin(phi)
    return np.cos(phi).astype(np.float32), sine.astype(np.float32)
