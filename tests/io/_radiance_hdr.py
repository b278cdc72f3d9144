"""A writer of Radiance pictures, from the description of the format."""

import numpy as np


def rgbe(seed, height, width):
    """(H, W, 4) bytes of a picture: runs, noise, black, and neither (1, 1, 1) nor (2, 2) at the start of a pixel."""
    rng = np.random.default_rng(seed)
    pixels = rng.integers(3, 256, (height, width, 4), dtype=np.uint8)
    pixels[..., 3] = rng.integers(120, 140, (height, width))
    pixels[:, width // 4 : width // 2] = pixels[:, width // 4 : width // 4 + 1]
    pixels[height // 2, : width // 3] = 0
    return pixels


def decoded(pixels):
    """Mantissa times 2^(exponent - 136); an exponent of 0 is black."""
    p = pixels.astype(np.float64)
    return np.where(p[..., 3:] > 0, p[..., :3] * 2.0 ** (p[..., 3:] - 136), 0).astype(np.float32)


def header(resolution, *lines):
    return "\n".join(["#?RADIANCE", "# written by a test", *lines, "", resolution, ""]).encode()


def flat(pixels):
    return pixels.tobytes()


def old_runs(pixels):
    """Repeated pixels as (1, 1, 1, n), n up to 255, then (1, 1, 1, n) for 256 n, and so on."""
    out = b""
    for row in pixels:
        j = 0
        while j < len(row):
            end = j + 1
            while end < len(row) and (row[end] == row[j]).all():
                end += 1
            out += row[j].tobytes()
            repeats = end - j - 1
            while repeats:
                out += bytes([1, 1, 1, repeats % 256])
                repeats //= 256
            j = end
    return out


def new_runs(pixels):
    """By components: 128 + n and a byte for runs of n <= 127, n and bytes for n <= 128 others."""
    out = b""
    for row in pixels:
        out += bytes([2, 2, len(row) >> 8, len(row) & 255])
        for component in row.T:
            j = 0
            while j < len(component):
                end = j + 1
                while end < len(component) and end - j < 127 and component[end] == component[j]:
                    end += 1
                if end - j > 3:
                    out += bytes([128 + end - j, component[j]])
                else:
                    end = min(j + 128, len(component))
                    out += bytes([end - j]) + component[j:end].tobytes()
                j = end
    return out
