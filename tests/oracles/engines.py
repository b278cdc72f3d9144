"""What engines compute at one pixel, in float64, written from the facts of their sources.

Independent of the kernels: vectors and axes instead of components in a slice, plain loops, one pixel at a time. Frames
are in the conventions of the package: right-handed view frame, camera along -z, row 0 at the top.

Every function takes the pixel's column and row, and its noise (direction, step), both in [0, 1).
"""

import math
from dataclasses import dataclass, field

import numpy as np

from .slice_oracle import unit

GOLDEN = 0.6180339887498948
XEGTAO_LEVELS = {"low": (1, 2), "medium": (2, 2), "high": (3, 3), "ultra": (9, 3)}


@dataclass
class Frame:
    """Depth, normals and pinhole intrinsics; ``levels`` is a depth pyramid that starts with the depth itself."""

    view_z: np.ndarray
    normal: np.ndarray
    f: float
    cx: float
    cy: float
    levels: list[np.ndarray] = field(default_factory=list)

    def __post_init__(self):
        self.levels = self.levels or [self.view_z]

    def point(self, u, v, z):
        """Position of depth ``z`` seen at the continuous pixel coordinates (u, v)."""
        return np.array([(u - self.cx) / self.f * z, -(v - self.cy) / self.f * z, -z])

    def texel(self, x, y, level=0):
        """Depth of texel (x, y) of a level, clamped to its border."""
        image = self.levels[level]
        height, width = image.shape
        return float(image[min(max(int(y), 0), height - 1), min(max(int(x), 0), width - 1)])

    def nearest(self, u, v, level=0):
        """Depth of the texel of a level that holds the point (u, v) of the frame."""
        return self.texel(math.floor(u / 2**level), math.floor(v / 2**level), level)

    def bilinear(self, u, v, level):
        """1/z between the four texels of a level around (u, v), as a depth."""
        x, y = u / 2**level - 0.5, v / 2**level - 0.5
        # Clamp to edge: coordinates beyond the outermost centres read these.
        height, width = self.levels[level].shape
        x, y = min(max(x, 0), width - 1), min(max(y, 0), height - 1)
        x0, y0 = math.floor(x), math.floor(y)
        a, b = x - x0, y - y0
        total = 0.0
        for dx, dy, weight in ((0, 0, (1 - a) * (1 - b)), (1, 0, a * (1 - b)), (0, 1, (1 - a) * b), (1, 1, a * b)):
            if weight:
                total += weight / self.texel(x0 + dx, y0 + dy, level)
        return 1 / total if total else math.inf


def clamp(x, low, high):
    return min(max(x, low), high)


def lerp(a, b, t):
    return a + t * (b - a)


def frac(x):
    return x - math.floor(x)


def blocks(image):
    """The 2×2 blocks of an image as an (H/2, W/2, 2, 2) array."""
    h, w = image.shape
    return image.reshape(h // 2, 2, w // 2, 2).swapaxes(1, 2)


def xegtao_level(image, radius):
    """Mean of four, weighted by closeness in depth to the farthest."""
    four = blocks(image).reshape(image.shape[0] // 2, image.shape[1] // 2, 4)
    reach = 0.75 * 1.457 * radius
    start, width = reach * (1 - 0.615), reach * 0.615
    result = np.empty(four.shape[:2])
    for index in np.ndindex(*result.shape):
        z = four[index]
        far = max(z)
        # The background is infinitely far: what is not, is too near to it.
        weights = [1.0 if far == d else clamp((start + width - (far - d)) / width, 0, 1) for d in z]
        result[index] = far if math.isinf(far) else float(np.dot(weights, z) / sum(weights))
    return result


def nearest_level(image):
    return blocks(image).min(axis=(2, 3))


def rotated_grid_level(image):
    h, w = image.shape[0] // 2, image.shape[1] // 2
    return np.array([[image[2 * y + (x & 1), 2 * x + (y & 1)] for x in range(w)] for y in range(h)])


def harmonic_level(image):
    mean = (1 / blocks(image)).mean(axis=(2, 3))
    return np.where(mean > 0, 1 / np.where(mean > 0, mean, 1), np.inf)


def pyramid(image, reduce, n_levels):
    levels = [image]
    while len(levels) < n_levels:
        levels.append(reduce(levels[-1]))
    return levels


def two_term(x):
    a = abs(x)
    p = (math.pi / 2 - 0.156583 * a) * math.sqrt(1 - a)
    return p if x >= 0 else math.pi - p


def bit_trick(x):
    """The same, its square root from the bits of a float32."""
    a = abs(x)
    bits = (int(np.float32(1 - a).view(np.int32)) >> 1) + 0x1FBD1DF5
    p = (math.pi / 2 - 0.156583 * a) * float(np.int32(bits).view(np.float32))
    return p if x >= 0 else math.pi - p


def hilbert_index(x, y):
    """Position of a pixel on the Hilbert curve through its tile of 64×64."""
    x, y, index, size = x % 64, y % 64, 0, 32
    while size:
        right, down = int(x & size > 0), int(y & size > 0)
        index += size * size * ((3 * right) ^ down)
        if not down:
            if right:
                x, y = 63 - x, 63 - y
            x, y = y, x
        size //= 2
    return index


def hilbert_noise(x, y, frame=0):
    index = hilbert_index(x, y) + 288 * (frame % 64)
    return frac(0.5 + index * 0.7548776662466927), frac(0.5 + index * 0.5698402909980532)


def papers_noise(x, y):
    return (4 * ((x + y) & 3) + (x & 3)) / 16, 0.25 * ((y - x) & 3)


def gradient_noise(x, y):
    """Interleaved gradient noise for the direction, the papers' offsets for the steps."""
    return frac(52.9829189 * frac(0.06711056 * x + 0.00583715 * y)), 0.25 * ((y - x) & 3)


def _slice(V, N, phi, *, normalise=True):
    """Axes of the slice at image angle phi and the normal in it: (along, projected, signed sine's sign, length)."""
    direction = np.array([math.cos(phi), math.sin(phi), 0.0])
    along = direction - (direction @ V) * V
    axis = np.cross(direction, V)
    axis = unit(axis) if normalise else axis
    projected = N - axis * (N @ axis)
    return along, projected, np.sign(along @ projected), float(np.linalg.norm(projected))


def _arc(h, n, cos_n):
    return (cos_n + 2 * h * math.sin(n) - math.cos(2 * h - n)) / 4


def _setup(frame, i, j, z):
    P = frame.point(i + 0.5, j + 0.5, z)
    return P, unit(-P), unit(frame.normal[j, i])


def xegtao(frame, i, j, noise, *, quality, radius):
    """GameTechDev/XeGTAO: the main pass, before the denoiser."""
    n_slices, n_steps = XEGTAO_LEVELS[quality]
    P, V, N = _setup(frame, i, j, frame.texel(i, j) * 0.99999)
    reach = 1.457 * radius
    reach_px = reach * frame.f / -P[2]
    total = clamp((10 - reach_px) / 100, 0, 1) * 0.5
    for s in range(n_slices):
        phi = math.pi * (s + noise[0]) / n_slices
        _, projected, sign, length = _slice(V, N, phi)
        cos_n = clamp(projected @ V / length, 0, 1)
        n = sign * bit_trick(cos_n)
        low = (math.cos(n + math.pi / 2), math.cos(n - math.pi / 2))
        H = list(low)
        for step in range(n_steps):
            jitter = frac(noise[1] + (s + step * n_steps) * GOLDEN)
            d = ((step + jitter) / n_steps) ** 2 * reach_px + 1.3
            level = round(clamp(math.log2(d) - 3.3, 0, 5))
            level = min(level, len(frame.levels) - 1)
            ox, oy = round(d * math.cos(phi)), round(-d * math.sin(phi))
            for side, sign_of_side in enumerate((1, -1)):
                u, v = i + 0.5 + sign_of_side * ox, j + 0.5 + sign_of_side * oy
                z = frame.nearest(u, v, level)
                if math.isinf(z):
                    continue
                D = frame.point(u, v, z) - P
                distance = float(np.linalg.norm(D))
                weight = clamp((reach - distance) / (0.615 * reach), 0, 1)
                H[side] = max(H[side], lerp(low[side], D @ V / distance, weight))
        h0, h1 = -bit_trick(H[1]), bit_trick(H[0])
        total += lerp(length, 1, 0.05) * (_arc(h0, n, cos_n) + _arc(h1, n, cos_n))
    return max(0.03, max(total / n_slices, 0) ** 2.2)


def hdrp(frame, i, j, noise, *, radius, n_steps=6, angles=(60 / 360, 300 / 360)):
    """Unity HDRP without temporal accumulation, at full resolution, intensity 1."""
    height, width = frame.view_z.shape
    # Integer coordinates are the positions of texels there, which shifts the image and nothing else.
    P, V, N = _setup(frame, i, j, frame.texel(i, j))
    longest = max(16, 40 * math.sqrt(height * width / (540 * 960)))
    reach_px = clamp(0.5 * radius * frame.f / -P[2], n_steps, longest)
    step_px = max(1, reach_px / (n_steps + 1))
    total = 0.0
    for angle in angles:
        phi = math.pi * (noise[0] + angle)
        H = [-1.0, -1.0]
        for side, sign_of_side in enumerate((1, -1)):
            for step in range(n_steps):
                d = sign_of_side * (step + 1 + noise[1]) * step_px
                x = clamp(i + d * math.cos(phi), 2, width - 2)
                y = clamp(j - d * math.sin(phi), 2, height - 2)
                z = frame.texel(x // 2, y // 2, 1)
                ray = frame.point(x + 0.5, y + 0.5, 1.0)
                D = ray * z - P if math.isfinite(z) else ray * 1e12
                d2 = float(D @ D)
                c = D @ V / math.sqrt(d2)
                falloff = clamp(1 - d2 / radius**2, 0, 1)
                H[side] = lerp(H[side], c, falloff) if c > H[side] else lerp(H[side], c, 0.03)
        _, projected, sign, length = _slice(V, N, phi)
        cos_n = projected @ V / length
        n = sign * two_term(cos_n)
        h0, h1 = max(-two_term(H[1]) - n, -math.pi / 2) + n, min(two_term(H[0]) - n, math.pi / 2) + n
        total += _arc(h0, n, cos_n) + _arc(h1, n, cos_n)
    return clamp(total / len(angles), 0, 1)


def _filament_tap(frame, i, j, d, phi, side):
    level = int(clamp(math.floor(math.log2(d)) - 3, 0, len(frame.levels) - 1))
    u, v = i + 0.5 + side * d * math.cos(phi), j + 0.5 - side * d * math.sin(phi)
    return u, v, frame.nearest(u, v, level)


def filament(frame, i, j, noise, *, radius, n_slices=4, n_steps=3, thickness=0.004, exact_cosine=False):
    """Filament's GTAO, at full resolution, with the frame's normals.

    The first term of its arcs is the cosine of the approximate angle; ``exact_cosine`` takes the exact one instead.
    """
    P, V, N = _setup(frame, i, j, frame.texel(i, j))
    step_px = radius * frame.f / -P[2] / (n_steps + 1)
    total = 0.0
    for s in range(n_slices):
        phi = math.pi * (s + noise[0]) / n_slices
        _, projected, sign, length = _slice(V, N, phi)
        cos_n = clamp(projected @ V / length, 0, 1)
        n = sign * two_term(cos_n)
        H = [-1.0, -1.0]
        for step in range(n_steps):
            d = max((step + noise[1]) * step_px, 1 + step)
            for side, sign_of_side in enumerate((1, -1)):
                u, v, z = _filament_tap(frame, i, j, d, phi, sign_of_side)
                D = frame.point(u, v, z) - P if math.isfinite(z) else frame.point(u, v, 1e12)
                d2 = float(D @ D)
                c = D @ V / math.sqrt(d2)
                falloff = clamp(2 * d2 / radius**2, 0, 1)
                H[side] = lerp(c, H[side], falloff) if c > H[side] else lerp(H[side], c, thickness)
        h0 = n + clamp(-two_term(H[1]) - n, -math.pi / 2, math.pi / 2)
        h1 = n + clamp(two_term(H[0]) - n, -math.pi / 2, math.pi / 2)
        first = cos_n if exact_cosine else math.cos(n)
        total += length * (_arc(h0, n, first) + _arc(h1, n, first))
    return clamp(total / n_slices, 0, 1)


def _close(mask, low, high, n_sectors):
    """Set ⌈n (high - low)⌉ sectors from ⌊n low⌋ on."""
    first, count = int(low * n_sectors), math.ceil((high - low) * n_sectors)
    for bit in range(first, min(first + count, n_sectors)):
        mask.add(bit)


def filament_bitmask(frame, i, j, noise, *, radius, thickness, n_slices=4, n_steps=3):
    """Filament's GTAO with visibility bitmasks of 32 sectors. Sectors are counted from the other end there."""
    P, V, N = _setup(frame, i, j, frame.texel(i, j))
    step_px = radius * frame.f / -P[2] / (n_steps + 1)
    total = 0.0
    for s in range(n_slices):
        phi = math.pi * (s + noise[0]) / n_slices
        _, projected, sign, length = _slice(V, N, phi)
        n = sign * two_term(clamp(projected @ V / length, 0, 1))
        mask: set[int] = set()
        for step in range(n_steps):
            d = max((step + noise[1]) * step_px, 1 + step)
            for sign_of_side in (1, -1):
                u, v, z = _filament_tap(frame, i, j, d, phi, sign_of_side)
                if math.isfinite(z):
                    _close(mask, *_sector_ends(frame.point(u, v, z) - P, V, n, sign_of_side, thickness), 32)
        total += 1 - len(mask) / 32
    return clamp(total / n_slices, 0, 1)


def _sector_ends(D, V, n, side, thickness):
    """Both ends of what a sample blocks, as angles from -T to +T mapped to [0, 1], the smaller first."""
    back = D - V * thickness
    theta = [side * two_term(clamp(E @ V / np.linalg.norm(E), -1, 1)) for E in (D, back)]
    return sorted(clamp((t - n) / math.pi + 0.5, 0, 1) for t in theta)


def bevy(frame, i, j, noise, *, quality, radius, thickness, bias):
    """Bevy's visibility bitmask, before the denoiser; ``bias`` is the share of depth that its bias makes."""
    n_slices, n_steps = XEGTAO_LEVELS[quality]
    n_sectors = 2 * n_steps
    P, V, N = _setup(frame, i, j, frame.texel(i, j) * (1 - bias))
    reach_px = radius * frame.f / -P[2]
    closed = 0
    for s in range(n_slices):
        phi = math.pi * (s + noise[0]) / n_slices
        _, projected, sign, length = _slice(V, N, phi, normalise=False)
        n = sign * two_term(clamp(projected @ V / length, 0, 1))
        mask: set[int] = set()
        for step in range(n_steps):
            jitter = frac(noise[1] + (s + step * n_steps) * GOLDEN)
            d = ((step + jitter) / n_steps) ** 2 * reach_px
            level = round(clamp(math.log2(d) - 3.3, 0, 5)) if d > 0 else 0
            level = min(level, len(frame.levels) - 1)
            for side in (1, -1):
                u, v = i + 0.5 + side * d * math.cos(phi), j + 0.5 - side * d * math.sin(phi)
                z = frame.bilinear(u, v, level)
                if math.isfinite(z):
                    _close(mask, *_sector_ends(frame.point(u, v, z) - P, V, n, side, thickness), n_sectors)
        closed += len(mask)
    return clamp(1 - closed / (n_slices * n_sectors), 0.03, 1)


def threejs_node(frame, i, j, noise, *, radius, thickness, n_slices=3, n_steps=6):
    """three.js, the node for WebGPU."""

    def nearest_of_four(u, v):
        x, y = math.floor(u - 0.5), math.floor(v - 0.5)
        return min(frame.texel(x + a, y + b) for a in (0, 1) for b in (0, 1))

    P, V, N = _setup(frame, i, j, nearest_of_four(i + 0.5, j + 0.5))
    reach_px = radius * frame.f / -P[2]
    total = 0.0
    for s in range(n_slices):
        phi = math.pi * (s + noise[0]) / n_slices
        along, projected, _, length = _slice(V, N, phi)
        projected = projected / max(length, 1e-4)
        n = math.copysign(math.acos(clamp(projected @ V, 0, 1)), projected @ along)
        H = [math.cos(n + math.pi / 2), math.cos(n - math.pi / 2)]
        for step in range(n_steps):
            d = ((step + 1 + noise[1]) / n_steps) ** 2 * reach_px
            for side, sign in enumerate((1, -1)):
                u, v = i + 0.5 + sign * d * math.cos(phi), j + 0.5 - sign * d * math.sin(phi)
                z = nearest_of_four(u, v)
                if not math.isfinite(z):
                    continue
                D = frame.point(u, v, z) - P
                distance = float(np.linalg.norm(D))
                if abs(D[2]) < thickness:
                    c = D @ V / max(distance, 1e-4)
                    H[side] = lerp(max(H[side], c), H[side], clamp(distance / radius, 0, 1) ** 2)
        h0, h1 = -math.acos(H[1]), math.acos(H[0])
        total += length * (_arc(h0, n, math.cos(n)) + _arc(h1, n, math.cos(n)))
    return clamp(total / n_slices, 0, 1)


def threejs_webgl(frame, i, j, noise, *, radius, thickness, n_slices=3, n_steps=6):
    """three.js, the pass for WebGL, before its denoiser."""
    P, V, N = _setup(frame, i, j, frame.texel(i, j))
    reach_px = radius * frame.f / -P[2]
    total = 0.0
    for s in range(n_slices):
        phi = math.pi * (s + noise[0]) / n_slices
        along, projected, _, length = _slice(V, N, phi)
        T, projected = unit(along), projected / length
        H = [-(projected @ T), projected @ T]
        for step in range(n_steps):
            d = (step + 1) / n_steps * reach_px
            for side, sign in enumerate((1, -1)):
                u, v = i + 0.5 + sign * d * math.cos(phi), j + 0.5 - sign * d * math.sin(phi)
                z = frame.nearest(u, v)
                if not math.isfinite(z):
                    continue
                D = frame.point(u, v, z) - P
                if abs(D[2]) < thickness:
                    H[side] += max(0.0, D @ V / np.linalg.norm(D) - H[side]) * 2 / (step + 2)
        sine = [math.sqrt(1 - c * c) for c in H]
        across = 0.5 * (math.acos(H[0]) - math.acos(H[1]) + sine[1] * H[1] - sine[0] * H[0])
        total += (projected @ T) * across + (projected @ V) * 0.5 * (2 - H[0] ** 2 - H[1] ** 2)
    return clamp(total / n_slices, 0, 1)
