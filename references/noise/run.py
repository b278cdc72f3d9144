"""What every noise pattern leaves of the error, over frames, samples and filters, and write ``record.json``.

    python references/noise/run.py                      # a minute on one core
    python references/noise/run.py --quick -o out/noise
    python references/noise/run.py --mask               # only makes the package's mask of blue noise anew

``docs/generate.py`` makes the page *Noise over space and time* of it.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import gtao
from gtao.data.blue_noise import MASK_FILE
from gtao.kernels.noise import PATTERNS
from gtao.workflows.outputs import save_figures

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from sources import rounded  # noqa: E402  (beside this folder)

SCENES = ("stairs", "arcade", "cornell", "machinery", "foliage", "head")
N_STEPS = 8
FILTERS = {
    "no filter": None,
    "spatial 4×4": gtao.SpatialFilter(),
    "edge-aware": gtao.EdgeAwareFilter(),
    "edge-aware, 3 passes": gtao.EdgeAwareFilter(passes=3),
    "plane-aware": gtao.PlaneAwareFilter(),
}
#: Filters that movements and numbers of slices are measured with.
FEW = ("no filter", "spatial 4×4", "plane-aware")
N_FRAMES = (1, 2, 3, 4, 6, 8, 12, 16, 24)
N_SLICES = (1, 2, 4, 8)
#: Frames that numbers of slices are measured over.
FRAMES_OF_SLICES = (1, 6)
SIGMAS = (1.2, 1.5, 1.9, 2.3)
SIZE = 64
#: Patterns that pictures show: those that differ in a single frame, and those that differ over frames.
IN_SPACE = ("spatial_4x4", "spatial_4x4_unbracketed", "interleaved_gradient", "hilbert_r2", "blue_noise", "white")
OVER_TIME = (
    *("spatial_4x4", "spatial_4x4_fine", "spatial_4x4_spread", "interleaved_gradient", "interleaved_gradient_golden"),
    *("hilbert_r2", "blue_noise", "sobol", "white"),
)
SETTINGS = {"resolution": 112, "scenes": SCENES}
QUICK = {"resolution": 32, "scenes": SCENES[:1]}
QUICK_FRAMES, QUICK_SLICES = (1, 2), (1, 2)


def pooled(parts):
    """Numbers of all scenes, which count the same: number of frames -> name -> value."""
    return {
        str(n): {
            "deviation": float(np.sqrt(np.mean([p[n].variance for p in parts]))),
            "rmse": float(np.sqrt(np.mean([p[n].rmse ** 2 for p in parts]))),
            "bias": float(np.mean([p[n].bias for p in parts])),
        }
        for n in parts[0]
    }


def measured(frames, choices, filters, n_frames):
    """Filter -> choice -> number of frames -> numbers, and how often each choice is first.

    Args:
        frames: (G-buffer, method, dense limit) of each scene.
        choices: name -> function of the method that gives the arguments of ``gtao.noise.variance``.
    """
    found = {
        spatial: {
            name: [
                gtao.noise.variance(g, *given[:1], FILTERS[spatial], n_frames=n_frames, limit=limit, masks=given[1])
                for g, method, limit in frames
                for given in [choice(method)]
            ]
            for name, choice in choices.items()
        }
        for spatial in filters
    }
    first = {
        spatial: {
            str(n): [min(rows, key=lambda name: rows[name][i][n].variance) for i in range(len(frames))]
            for n in n_frames
        }
        for spatial, rows in found.items()
    }
    return {s: {name: pooled(parts) for name, parts in rows.items()} for s, rows in found.items()}, first


def frames_of(settings):
    """(G-buffer, method, dense limit) of each scene."""
    for name in settings["scenes"]:
        scene = gtao.render.load_scene(name, resolution=settings["resolution"])
        g = gtao.render.gbuffer(scene, albedo=False)
        method = gtao.GTAO(radius=gtao.render.scenes.get(name).radius, n_slices=1, n_steps=N_STEPS)
        yield g, method, gtao.noise.dense_limit(g, method)


def uncertainty(frames):
    """Root mean square difference of two halves of the dense limit's frames, over two: what the limit itself lacks."""
    squares = []
    for g, method, _ in frames:
        a, b = (gtao.noise.dense_limit(g, replace(method, seed=seed), n_frames=8).visibility.numpy() for seed in (1, 2))
        squares.append(np.mean((a - b)[g.mask.numpy()].astype(np.float64) ** 2))
    return float(np.sqrt(np.mean(squares)) / 2)


def of_pattern(name, **options):
    return lambda method: (replace(method, noise=name, **options), None)


def spectra():
    """Pattern -> spectrum of the first Fourier term of its rotations, over 24 frames."""
    return {name: gtao.noise.spectrum(name, SIZE, 24, harmonic=1) for name in PATTERNS if name != "none"}


def below(spectrum, limit):
    """Share of the power below a frequency, over that of uncorrelated noise."""
    n = len(spectrum.power)
    axis = np.arange(n) - n // 2
    low = np.hypot(*np.meshgrid(axis, axis)) < limit * n
    low[n // 2, n // 2] = False
    return float(spectrum.power[low].mean())


def distinct(values):
    """Number of different values modulo 1, to single precision."""
    return len(np.unique(np.round(np.ravel(values) * 2**16).astype(int) % 2**16))


def counts():
    """Tables of the slides: directions and offsets of 4×4 pixels, and directions of a pixel, in 24 frames."""
    found = {}
    for name in ("spatial_4x4", "spatial_4x4_unbracketed", "spatial_4x4_fine", "spatial_4x4_spread"):
        values = gtao.noise.values(name, 4, 24)
        gaps = np.diff(np.sort(values[:6, 0, 0, 0]), append=np.sort(values[:6, 0, 0, 0])[0] + 1)
        found[name] = {
            "directions": distinct(values[..., 0]),
            "positions": N_STEPS * distinct(values[..., 1]),
            "widest_gap": float(gaps.max() * 180),
        }
    return found


def figures(numbers, found):
    """The pictures of the page."""
    tiles = {name: gtao.noise.values(name, SIZE)[0, ..., 0] for name in found}
    curves = {
        s: {p: {n: row["deviation"] for n, row in by_n.items()} for p, by_n in rows.items() if p != "none"}
        for s, rows in numbers["patterns"].items()
    }
    return {
        "patterns": gtao.plot.noise_patterns({name: tiles[name] for name in IN_SPACE}, found),
        "spectra": gtao.plot.noise_spectra({name: found[name] for name in IN_SPACE}),
        "errors": gtao.plot.noise_errors(curves, shown=OVER_TIME),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=HERE, help="directory for the record and the pictures")
    parser.add_argument("--quick", action="store_true", help="small frames, to see every part run")
    parser.add_argument("--mask", action="store_true", help="write the mask in the package, and nothing else")
    options = parser.parse_args()
    if options.mask:
        np.save(MASK_FILE, gtao.noise.blue_noise_mask())
        return
    settings = QUICK if options.quick else SETTINGS
    n_frames, n_slices = (QUICK_FRAMES, QUICK_SLICES) if options.quick else (N_FRAMES, N_SLICES)
    of_slices = QUICK_FRAMES if options.quick else FRAMES_OF_SLICES
    config = settings | {"n_steps": N_STEPS, "filters": {k: f and f.to_dict() for k, f in FILTERS.items()}}
    # Before anything is written: outputs may be files of the repository.
    record = gtao.io.provenance(["python", "references/noise/run.py"], seed=0, config=config)
    frames = list(frames_of(settings))
    patterns, first = measured(frames, {name: of_pattern(name) for name in PATTERNS}, FILTERS, n_frames)
    movements, _ = measured(frames, {k: lambda m, v=v: (m, v) for k, v in gtao.noise.MOVEMENTS.items()}, FEW, n_frames)
    by_slices = {
        str(n): measured(frames, {p: of_pattern(p, n_slices=n) for p in PATTERNS if p != "none"}, FEW, of_slices)[0]
        for n in n_slices
    }
    found = spectra()
    masks = {s: gtao.noise.spectrum(gtao.noise.void_and_cluster(SIZE, 1993, s) / SIZE**2) for s in SIGMAS}
    numbers = {
        "patterns": patterns,
        "first": first,
        "movements": movements,
        "slices": by_slices,
        "counts": counts(),
        "limit_uncertainty": uncertainty(frames),
        "low": {name: {str(f): below(s, f) for f in (0.125, 0.25)} for name, s in found.items()},
        "sigmas": {f"{s:g}": {str(f): below(m, f) for f in (0.125, 0.25, 0.375)} for s, m in masks.items()},
    }
    options.output.mkdir(parents=True, exist_ok=True)
    names = save_figures(options.output, figures(numbers, found))
    record |= {"kind": "noise of slices and steps", "inputs": [], "numbers": rounded(numbers)}
    record["outputs"] = [gtao.io.file_entry(options.output / name, options.output) for name in names]
    gtao.io.write_record(options.output / "record.json", record, overwrite=True)


if __name__ == "__main__":
    main()
