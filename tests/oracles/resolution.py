"""Smaller frames and the way back, pixel by pixel, float64 NumPy, written from their definitions."""

import numpy as np

from .fields import Field


def chosen(view_z, factor, choice):
    """(rows, columns, 2): row and column of the pixel that stands for every block."""
    height, width = view_z.shape
    rows, columns = int(np.ceil(height / factor)), int(np.ceil(width / factor))
    result = np.zeros((rows, columns, 2), int)
    for j in range(rows):
        for i in range(columns):
            block = [
                (y, x)
                for y in range(factor * j, min(factor * j + factor, height))
                for x in range(factor * i, min(factor * i + factor, width))
            ]
            surfaces = [p for p in block if np.isfinite(view_z[p])]
            nearest = choice == "nearest" or (choice == "checkerboard" and (i + j) % 2 == 0)
            if not surfaces:
                result[j, i] = block[0]
            elif choice == "first":
                result[j, i] = surfaces[0]
            else:
                result[j, i] = (min if nearest else max)(surfaces, key=lambda p: view_z[p])
    return result


def smaller_camera(field: Field, factor) -> dict:
    height, width = (int(np.ceil(n / factor)) for n in field.view_z.shape)
    c = field.camera
    result = {"width": width, "height": height, "cx": c["cx"] / factor, "cy": c["cy"] / factor}
    if field.orthographic:
        pixel = c["view_height"] / c["height"] * factor
        return result | {"view_height": height * pixel}
    return result | {"fx": c["fx"] / factor, "fy": c["fy"] / factor}


def downsampled(field: Field, factor, choice, place) -> Field:
    """Where the eye ray of every small pixel meets the tangent plane of its chosen pixel, or that pixel's depth."""
    picked = chosen(field.view_z, factor, choice)
    at = tuple(np.moveaxis(picked, -1, 0))
    z, n, points = field.view_z[at], field.normal_v[at], field.positions()[at]
    small = Field(z.copy(), n, smaller_camera(field, factor), field.orthographic)
    if place == "texel":
        return small
    X, Y = small.plane_coordinates()
    for p in np.ndindex(z.shape):
        if not np.isfinite(z[p]):
            continue
        if field.orthographic:
            origin, ray = np.array([X[p], Y[p], 0.0]), np.array([0.0, 0.0, -1.0])
        else:
            origin, ray = np.zeros(3), np.array([X[p], Y[p], -1.0])
        # Seen from behind or edge-on, a plane says nothing of the neighbourhood.
        away = n[p] @ (points[p] if not field.orthographic else ray) >= 0
        across = n[p] @ ray
        met = n[p] @ (points[p] - origin) / across if across else np.inf
        if field.orthographic:
            edge_on = abs(n[p][2]) * 1e3 <= np.hypot(*n[p][:2]) or met <= 0
        else:
            edge_on = not z[p] / 2 < met < z[p] * 2
        if away or edge_on:
            continue
        block = field.view_z[factor * p[0] : factor * (p[0] + 1), factor * p[1] : factor * (p[1] + 1)]
        if block.size == factor**2:
            # All of the block is known: its centre is as deep as something in it.
            depths = block[np.isfinite(block)]
            met = min(max(met, depths.min()), depths.max())
        small.view_z[p] = met
    return small


def texels(small_shape, u, v):
    """(row, column, bilinear weight) of the 2×2 texels around continuous coordinates of the small frame."""
    found = []
    i0, j0 = int(np.floor(u - 0.5)), int(np.floor(v - 0.5))
    for j in (j0, j0 + 1):
        for i in (i0, i0 + 1):
            share = (1 - abs(u - 0.5 - i)) * (1 - abs(v - 0.5 - j))
            found.append((*_within(small_shape, j, i), share))
    return found


def wider(small_shape, u, v):
    """(row, column) of the 4×4 texels around."""
    i0, j0 = int(np.floor(u - 0.5)), int(np.floor(v - 0.5))
    return [_within(small_shape, j, i) for j in range(j0 - 1, j0 + 3) for i in range(i0 - 1, i0 + 3)]


def _within(shape, j, i):
    return min(max(j, 0), shape[0] - 1), min(max(i, 0), shape[1] - 1)


def falloff(d, e=0.0):
    return 1 / (1 + min(d, 1e6) ** 4 + e**2)


def upsampling(field: Field, small: Field, method, threshold=None, angle=0.5):
    """(H W, h w) weights before normalisation of "bilinear", "nearest_depth", "bilateral" or "planes"."""
    shape, small_shape = field.view_z.shape, small.view_z.shape
    weights = np.zeros((field.view_z.size, small.view_z.size))
    scale = [a / b for a, b in zip(small.scale, field.scale, strict=True)]
    offset = [small.camera[k] - s * field.camera[k] for k, s in zip(("cx", "cy"), scale, strict=True)]
    points, small_points = field.positions(), small.positions()
    for y, x in np.ndindex(shape):
        z = field.view_z[y, x]
        if not np.isfinite(z):
            continue
        u, v = (s * (p + 0.5) + o for s, p, o in zip(scale, (x, y), offset, strict=True))
        row = weights[y * shape[1] + x]

        def alike(q, p=(y, x)):
            """Falloff by the distance from each other's tangent planes and by the turn of the normals."""
            D = small_points[q] - points[p]
            mean = 1.0 if field.orthographic else (field.view_z[p] + small.view_z[q]) / 2
            width = mean / min(small.scale)
            d = max(abs(D @ field.normal_v[p]), abs(D @ small.normal_v[q])) / width / threshold
            # How long the chord between the normals is beside one that spans the angle, squared.
            chord = np.linalg.norm(field.normal_v[p] - small.normal_v[q]) / (2 * np.sin(angle / 2))
            return falloff(d, chord**2)

        near = [((j, i), share) for j, i, share in texels(small_shape, u, v) if np.isfinite(small.view_z[j, i])]
        steps = [abs(small.view_z[q] - z) for q, _ in near]
        if method == "nearest_depth":
            if len(near) == 4 and max(steps) < threshold * z:
                counts = [share for _, share in near]
            else:
                counts = [float(k == int(np.argmin(steps))) for k in range(len(near))]
        elif method == "bilinear":
            counts = [share for _, share in near]
        elif method == "bilateral":
            counts = [share * falloff(s / (threshold * z)) for (_, share), s in zip(near, steps, strict=True)]
        else:
            counts = [share * alike(q) for q, share in near]
        for (q, _), count in zip(near, counts, strict=True):
            row[q[0] * small_shape[1] + q[1]] += count
        total = sum(counts)
        if method == "planes" and total < 1 / 16:
            many = [q for q in wider(small_shape, u, v) if np.isfinite(small.view_z[q])]
            if many:
                best = max(many, key=alike)
                row[best[0] * small_shape[1] + best[1]] += (1 - 16 * total) / 4 * alike(best)
    return weights


def interpolated(weights, values, open_value):
    """Rows of ``weights`` normalised, applied to (n, channels) values; rows without weight get ``open_value``."""
    total = weights.sum(axis=1, keepdims=True)
    result = weights @ np.asarray(values, float)
    return np.where(total > 0, result / np.where(total > 0, total, 1), open_value)
