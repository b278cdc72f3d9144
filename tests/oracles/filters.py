"""Spatial filters pixel by pixel, float64 NumPy, written from their definitions.

Each function returns the weight matrix of one pass: ``W[i, j]`` is the weight with which pixel j enters pixel i (flat
indices, before normalisation). Applying a pass is then a matter of matrices, which no kernel of the package uses.
"""

import numpy as np

from .fields import Field


def average(weights, values):
    """Rows of ``weights`` normalised, applied to (n,) or (n, channels) values; rows without weight keep their value."""
    total = weights.sum(axis=1)
    result = np.array(values, dtype=np.float64)
    for i in np.flatnonzero(total > 0):
        j = np.flatnonzero(weights[i])
        result[i] = weights[i, j] @ np.asarray(values)[j] / total[i]
    return result


def fitted(weights, values, coordinates, ridge):
    """Constant term of the ridge regression v ~ a + b dx + c dy about every pixel, by a linear solver."""
    result = np.array(values, dtype=np.float64)
    for i, row in enumerate(weights):
        j = np.flatnonzero(row)
        if len(j) == 0:
            continue
        design = np.column_stack([np.ones(len(j)), coordinates[j] - coordinates[i]])
        root = np.sqrt(row[j])[:, None]
        # The ridge as two more observations: each slope is 0.
        rows = np.vstack([root * design, np.sqrt(ridge) * np.eye(3)[1:]])
        right = np.concatenate([root[:, 0] * np.asarray(values)[j], [0.0, 0.0]])
        result[i] = np.linalg.lstsq(rows, right, rcond=None)[0][0]
    return result


def edge_links(view_z, threshold=0.011, quantised=True):
    """Links to left, right, top, bottom: (H, W, 4) in [0, 1], NaN toward the background."""
    height, width = view_z.shape
    links = np.zeros((height, width, 4))
    for y in range(height):
        for x in range(width):
            z = view_z[y, x]
            if not np.isfinite(z):
                continue
            near = [
                view_z[min(max(y + dy, 0), height - 1), min(max(x + dx, 0), width - 1)]
                for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1))
            ]
            steps = [(1e9 * z if np.isinf(n) else n) - z for n in near]
            slope = ((steps[1] - steps[0]) / 2, (steps[3] - steps[2]) / 2)
            rest = (steps[0] + slope[0], steps[1] - slope[0], steps[2] + slope[1], steps[3] - slope[1])
            for k in range(4):
                link = min(max(1.25 - min(abs(steps[k]), abs(rest[k])) / (threshold * z), 0.0), 1.0)
                links[y, x, k] = np.round(2.9 * link) / 3 if quantised else link
                if np.isinf(near[k]):
                    links[y, x, k] = np.nan
    return links


def edge_weights(view_z, links, beta, diagonal=0.425, leak_threshold=2.5, leak_strength=0.5):
    """One pass of XeGTAO's filter."""
    height, width = view_z.shape
    offsets = {"L": (-1, 0), "R": (1, 0), "T": (0, -1), "B": (0, 1)}
    number = {name: k for k, name in enumerate("LRTB")}
    opposite = {"L": "R", "R": "L", "T": "B", "B": "T"}
    weights = np.zeros((height * width,) * 2)

    def at(x, y, names):
        """Coordinates reached from (x, y), kept inside the frame after every step together."""
        dx, dy = (sum(offsets[n][axis] for n in names) for axis in (0, 1))
        return min(max(x + dx, 0), width - 1), min(max(y + dy, 0), height - 1)

    for y in range(height):
        for x in range(width):
            if not np.isfinite(view_z[y, x]):
                continue
            i = y * width + x
            weights[i, i] += beta
            joint = {}
            for name in "LRTB":
                u, v = at(x, y, name)
                joint[name] = links[y, x, number[name]] * np.nan_to_num(links[v, u, number[opposite[name]]])
            closed = 4 - sum(np.nan_to_num(value) for value in joint.values())
            leak = min(max(closed - leak_threshold, 0.0), 1.0) / (4 - leak_threshold) * leak_strength
            joint = {n: 0.0 if np.isnan(v) else min(v + leak, 1.0) for n, v in joint.items()}
            for name in "LRTB":
                u, v = at(x, y, name)
                weights[i, v * width + u] += joint[name]
            for a, b in ("LT", "TR", "BL", "RB"):
                total = 0.0
                for first, second in ((a, b), (b, a)):
                    u, v = at(x, y, first)
                    total += joint[first] * np.nan_to_num(links[v, u, number[second]])
                u, v = at(x, y, a + b)
                weights[i, v * width + u] += diagonal * total
    return weights


def bilateral_weights(view_z, threshold=0.1, order=2, odd_frame=False, planar=False):
    """The slides' filter on the footprint {-1, 0, 1, 2}², on odd frames {-2, -1, 0, 1}².

    ``planar`` extrapolates 1 / z; where that is not positive there is no surface to expect.
    """
    offsets = range(-2, 2) if odd_frame else range(-1, 3)
    height, width = view_z.shape
    weights = np.zeros((height * width,) * 2)

    def depth(x, y):
        inside = 0 <= x < width and 0 <= y < height
        return view_z[y, x] if inside and np.isfinite(view_z[y, x]) else None

    for y in range(height):
        for x in range(width):
            z = depth(x, y)
            if z is None:
                continue
            lines = [[depth(x + k * a, y + k * b) for k in range(-2, 3)] for a, b in ((1, 0), (0, 1))]
            if planar:
                lines = [[None if d is None else 1 / d for d in line] for line in lines]
            along = [parabola(line, order) for line in lines]
            for dy in offsets:
                for dx in offsets:
                    tap = depth(x + dx, y + dy)
                    if tap is None:
                        continue
                    predicted = along[0](dx) + along[1](dy) - (1 / z if planar else z)
                    if planar and predicted <= 0:
                        continue
                    predicted = 1 / predicted if planar else predicted
                    weight = max(0.0, 1 - abs(tap - predicted) / (threshold * z))
                    weights[y * width + x, (y + dy) * width + x + dx] = weight
    return weights


def parabola(depths, order):
    """Newton's form from five depths (None: no surface) at -2 … 2: the middle one, the nearer in depth of its
    neighbours, and the smaller of the two second differences that contain both."""
    z = depths[2]
    if order == 0 or depths[1] is None is depths[3]:
        return lambda d: z
    side = 1
    if depths[3] is None or (depths[1] is not None and abs(depths[1] - z) < abs(depths[3] - z)):
        side = -1
    first = depths[2 + side] - z
    triples = [(depths[1], z, depths[3]), (z, depths[2 + side], depths[2 + 2 * side])]
    second = [a - 2 * b + c for a, b, c in triples if None not in (a, b, c)]
    bend = min(second, key=abs) if order == 2 and second else 0.0
    return lambda d: z + side * d * first + bend * (side * d) * (side * d - 1) / 2


def plane_weights(field: Field, size=5, tolerance=0.5, odd_frame=False):
    """Distances from tangent planes, point by point."""
    height, width = field.view_z.shape
    points, normals = field.positions().reshape(-1, 3), field.normal_v.reshape(-1, 3)
    depth = field.view_z.ravel()
    if size % 2:
        profile = {d: 0.5 if abs(d) == size // 2 else 1.0 for d in range(-(size // 2), size // 2 + 1)}
    else:
        first = -(size // 2) if odd_frame else 1 - size // 2
        profile = dict.fromkeys(range(first, first + size), 1.0)
    weights = np.zeros((height * width,) * 2)
    for i in np.flatnonzero(np.isfinite(depth)):
        y, x = divmod(int(i), width)
        for dy, along_y in profile.items():
            for dx, along_x in profile.items():
                if not (0 <= x + dx < width and 0 <= y + dy < height):
                    continue
                j = (y + dy) * width + x + dx
                if not np.isfinite(depth[j]):
                    continue
                apart = points[j] - points[i]
                distance = max(abs(apart @ normals[i]), abs(apart @ normals[j]))
                pixel = field.pixel if field.orthographic else (depth[i] + depth[j]) / 2 / min(field.scale)
                weights[i, j] = along_x * along_y * max(0.0, 1 - distance / (tolerance * pixel))
    return weights
