"""Small frames to tune on: a bumpy floor with boxes on it, some background, no renderer."""

import numpy as np

import gtao
from gtao import fit


def frame(seed, shape=(36, 48), dtype=np.float32, background=True):
    """A frame of random blocks on a wavy wall that is about 4 units away and 4 units high."""
    generator = np.random.default_rng(seed)
    height, width = shape
    y, x = np.mgrid[:height, :width]
    phase = generator.uniform(0, 2 * np.pi, 2)
    z = 4 + 0.25 * np.sin(6 * x / width + phase[0]) * np.cos(5 * y / height + phase[1])
    for _ in range(9):
        x0, y0 = generator.integers(0, width - 6), generator.integers(0, height - 6)
        w, h = generator.integers(3, 10, 2)
        z[y0 : y0 + h, x0 : x0 + w] -= generator.uniform(0.1, 0.6)
    if background:
        z[:3, : width // 2] = np.inf
    return gtao.GBuffer(z.astype(dtype), None, gtao.PerspectiveCamera(width, height, 2 * np.arctan(0.5)))


def problems(method, n_scenes=2, radii=(0.5, 0.8), frames=(0,), **options):
    """Views whose truth is what the method says at their radius."""
    made = []
    for scene in range(n_scenes):
        for radius in radii:
            g = frame(scene, **options)
            truth = sum(image(g, fit.at_radius(method, radius), k) for k in frames) / len(frames)
            made.append(
                fit.Problem(name=f"{scene}, {radius:g}", scene=f"scene {scene}", g=g, truth=truth, radius=radius)
            )
    return made


def image(g, method, frame_index=0):
    if isinstance(method, gtao.Pipeline):
        return np.asarray(method.step(g, frame_index=frame_index).visibility, dtype=np.float64)
    return np.asarray(gtao.ambient_occlusion(g, method, frame_index=frame_index).visibility, dtype=np.float64)
