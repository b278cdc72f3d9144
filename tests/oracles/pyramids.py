"""A depth pyramid texel by texel, float64 NumPy, from what a texel stands for."""

import numpy as np


def levels(view_z, n_levels, name, start=None, end=None):
    """``n_levels`` images; the sides of each are half those of the one before, rounded up."""
    images = [np.asarray(view_z, dtype=np.float64)]
    while len(images) < n_levels:
        below = images[-1]
        height, width = ((side + 1) // 2 for side in below.shape)
        image = np.empty((height, width))
        for y in range(height):
            for x in range(width):
                four = below[2 * y : 2 * y + 2, 2 * x : 2 * x + 2]
                if name == "rotated_grid":
                    image[y, x] = four[min(x % 2, four.shape[0] - 1), min(y % 2, four.shape[1] - 1)]
                elif name == "harmonic":
                    # Where there are less than four, the outermost count twice.
                    full = np.pad(four, [(0, 2 - four.shape[0]), (0, 2 - four.shape[1])], mode="edge")
                    image[y, x] = np.inf if np.isinf(full).all() else 1 / np.mean(1 / full)
                else:
                    image[y, x] = texel(four.ravel(), name, start, end)
        images.append(image)
    return images


def texel(depths, name, start, end):
    """One texel of the one, two or four below it."""
    if name == "min":
        return depths.min()
    if name == "max":
        return depths.max()
    if name == "average":
        surfaces = depths[np.isfinite(depths)]
        return surfaces.mean() if len(surfaces) else np.inf
    if np.isinf(depths).any():
        return np.inf
    weights = np.clip((end - (depths.max() - depths)) / (end - start), 0, 1)
    return (weights * depths).sum() / weights.sum()


def packed(images, table):
    """The levels in one buffer, where ``table`` (:class:`gtao.kernels.pyramid.Table`) has them; NaN in between."""
    buffer = np.full(table.size, np.nan)
    for k, image in enumerate(images):
        _part(buffer, table, k)[:, : image.shape[1]] = image
    return buffer


def unpacked(buffer, table):
    """The levels of a buffer as images."""
    return [_part(np.asarray(buffer), table, k)[:, :width] for k, width in enumerate(table.widths)]


def _part(buffer, table, k):
    stride = table.stride >> k
    return buffer[table.offsets[k] :][: stride * table.heights[k]].reshape(-1, stride)
