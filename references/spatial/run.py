"""What spatial filters leave of the noise of one slice, and what they blur: ``record.json`` and pictures.

    python references/spatial/run.py            # a minute or two on two cores
    python references/spatial/run.py --quick -o out/spatial-quick

``docs/generate.py`` makes the page *Spatial filters* of it.
"""

import argparse
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import frames
import numpy as np

import gtao
from gtao.workflows.outputs import save_figures

import drjit as dr  # isort: skip  (after gtao, which chooses the LLVM library)

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from sources import kept_pictures, rounded  # noqa: E402  (beside this folder)

#: Frames of the noise that errors are taken over, and of the dense limit.
N_FRAMES, N_DENSE = 6, 512
#: The estimate that is filtered.
N_STEPS, NOISE = 8, "spatial_4x4"
SCENES, RESOLUTION = ("stairs", "city", "head", "cloth", "pile", "foliage", "terrain"), 160
QUICK = {"n_frames": 2, "n_dense": 32, "scenes": ("stairs",), "resolution": 48}

FILTERS = {
    "bilateral, none": gtao.SpatialFilter(derivatives="none"),
    "bilateral, first": gtao.SpatialFilter(derivatives="first"),
    "bilateral, second": gtao.SpatialFilter(derivatives="second"),
    "bilateral, planar first": gtao.SpatialFilter(derivatives="first", planar=True),
    "bilateral, planar second": gtao.SpatialFilter(derivatives="second", planar=True),
    "edge-aware, 1 pass": gtao.EdgeAwareFilter(passes=1),
    "edge-aware, 2 passes": gtao.EdgeAwareFilter(passes=2),
    "edge-aware, 3 passes": gtao.EdgeAwareFilter(passes=3),
    "plane-aware": gtao.PlaneAwareFilter(),
    "plane-aware, mean of 4×4": gtao.PlaneAwareFilter(size=4, fit="constant"),
}
#: Rows of pixels below the horizon of the grazing floor that are listed.
BELOW = (2, 3, 4, 6, 8, 12, 16, 24, 32, 48)
#: Distance from an edge in pixels from which on nothing may leak across it.
CLEAR = 2
#: Rounds of the timing, and copies of a frame side by side that it is made on.
ROUNDS, COPIES = 8, 6
# Larger than any footprint, so that impulses so far apart do not meet.
APART = 8

ERROR_LIMIT = 0.15
PICTURED = ("step 15 %", "slope 75°", "grazing floor", "spheres")
COLUMNS = (
    "noisy",
    "bilateral, none",
    "bilateral, first",
    "bilateral, second",
    "bilateral, planar first",
    "edge-aware, 1 pass",
    "edge-aware, 3 passes",
    "plane-aware",
)


def method(radius):
    return gtao.GTAO(radius=radius, n_slices=1, n_steps=N_STEPS, noise=NOISE)


def dense(g, radius, n):
    """Mean over many frames of noise that covers directions and offsets evenly: what averaging can reach at best."""
    even = replace(method(radius), noise="hilbert_r2")
    return np.mean([np.array(gtao.ambient_occlusion(g, even, frame_index=k).visibility) for k in range(n)], axis=0)


def filtered(g, image, spatial, k=0):
    ao = gtao.AmbientOcclusion(visibility=g.types.Tensor(np.ascontiguousarray(image, dtype=np.float64)))
    return np.array(gtao.denoise(ao, g, spatial, frame_index=k).visibility)


def counted_taps(g, spatial):
    """(Σ w)² / Σ w² for every pixel: by how much the filter divides the variance of white noise."""
    y, x = np.indices(g.shape)
    squares = np.zeros(g.shape)
    for i in range(APART):
        for j in range(APART):
            squares += filtered(g, (x % APART == i) & (y % APART == j), spatial) ** 2
    return 1 / np.where(np.isfinite(np.array(g.view_z)), squares, 1)


def pattern(error, surface):
    """What changes from pixel to pixel: less its mean over a period of the noise, on the surface."""

    def mean(image):
        for axis in (0, 1):
            padded = np.pad(image, [(2, 2) if a == axis else (0, 0) for a in (0, 1)])
            n = image.shape[axis]
            parts = [np.take(padded, range(d, d + n), axis=axis) for d in range(5)]
            image = sum(w * p for w, p in zip((0.5, 1, 1, 1, 0.5), parts, strict=True)) / 4
        return image

    return error - mean(np.where(surface, error, 0)) / np.maximum(mean(surface.astype(float)), 1e-9)


def rms(image, where):
    return float(np.sqrt(np.mean(image[where] ** 2)))


def measured(g, radius, options):
    """Errors of every filter on one frame; and what pictures show."""
    surface = np.isfinite(np.array(g.view_z))
    limit = dense(g, radius, options["n_dense"])
    noisy = [
        np.array(gtao.ambient_occlusion(g, method(radius), frame_index=k).visibility)
        for k in range(options["n_frames"])
    ]
    shown = {"noisy": noisy[0] - limit}
    rows = {"none": {"total": float(np.sqrt(np.mean([rms(n - limit, surface) ** 2 for n in noisy])))}}
    for name, spatial in FILTERS.items():
        # Filters are linear in the image: what they do to the limit and to the noise adds up.
        blurred = [filtered(g, limit, spatial, k) - limit for k in (0, 1)]
        left = [filtered(g, n - limit, spatial, k) for k, n in enumerate(noisy)]
        total = [residue + blurred[k % 2] for k, residue in enumerate(left)]

        def over(images):
            return float(np.sqrt(np.mean([rms(image, surface) ** 2 for image in images])))

        rows[name] = {
            "total": over(total),
            "blur": over(blurred),
            "noise": over(left),
            "pattern": over([pattern(residue, surface) for residue in left]),
            "taps": float(counted_taps(g, spatial)[surface].mean()),
        }
        shown[name] = total[0]
    return rows, {name: np.where(surface, image, np.nan) for name, image in shown.items()}


def leaks():
    """Step or eaves -> filter -> largest error of an image of two values, everywhere and from CLEAR pixels on."""
    image, found = frames.two_values(), {}
    away = np.abs(np.arange(frames.WIDTH) + 0.5 - frames.WIDTH / 2) > CLEAR
    for name in (*(n for n in frames.FRAMES if n.startswith("step")), "eaves"):
        g = frames.frame(frames.FRAMES[name][0]())
        found[name] = {}
        for label, spatial in FILTERS.items():
            error = np.max([np.abs(filtered(g, image, spatial, k) - image) for k in (0, 1)], axis=(0, 1))
            found[name][label] = {"largest": float(error.max()), "clear": float(error[away].max())}
    return found


def horizon():
    """Rows below the horizon -> filter -> taps that count."""
    g = frames.frame(frames.floor())
    first = int(np.isfinite(np.array(g.view_z))[:, 0].argmax())
    found = {name: counted_taps(g, spatial)[:, 8:-8].mean(axis=1) for name, spatial in FILTERS.items()}
    return {str(n): {name: float(taps[first + n - 1]) for name, taps in found.items()} for n in BELOW}


def costs():
    """CPU time on one thread, least of some rounds in turn, beside that of the estimate."""
    threads = dr.thread_count()
    dr.set_thread_count(1)
    surface, radius = frames.FRAMES["floor and wall"]
    z, n = surface()
    # Single precision, and enough pixels for what a call costs not to show.
    z, n = (np.tile(a.astype(np.float32), (COPIES, COPIES) + (1,) * (a.ndim - 2)) for a in (z, n))
    g = gtao.GBuffer(z, n, gtao.PerspectiveCamera(z.shape[1], z.shape[0], frames.FIELD_OF_VIEW))
    ao = gtao.ambient_occlusion(g, method(radius))
    dr.eval(ao.visibility, g.normal_v)
    jobs = {name: partial(gtao.denoise, ao, g, spatial) for name, spatial in FILTERS.items()}
    jobs["estimate"] = partial(gtao.ambient_occlusion, g, method(radius))
    least = dict.fromkeys(jobs, np.inf)
    for _ in range(ROUNDS):
        for name, job in jobs.items():
            start = time.process_time()
            dr.eval(job().visibility)
            dr.sync_thread()
            least[name] = min(least[name], time.process_time() - start)
    dr.set_thread_count(threads)
    return {name: 1e9 * seconds / z.size for name, seconds in least.items()}


def main():
    parser = argparse.ArgumentParser(description="errors of spatial filters")
    parser.add_argument("-o", "--output", type=Path, default=HERE, help="directory for the record and pictures")
    parser.add_argument("--quick", action="store_true", help="few and small frames, to see every part run")
    arguments = parser.parse_args()
    options = {"n_frames": N_FRAMES, "n_dense": N_DENSE, "scenes": SCENES, "resolution": RESOLUTION}
    options |= QUICK if arguments.quick else {}
    config = options | {"n_steps": N_STEPS, "noise": NOISE, "clear": CLEAR}
    config |= {"filters": {k: f.to_dict() for k, f in FILTERS.items()}}
    # Before anything is written: outputs may be files of the repository.
    record = gtao.io.provenance(["python", "references/spatial/run.py"], seed=None, config=config)
    numbers, images = {}, {}
    for name, (surface, radius) in frames.FRAMES.items():
        numbers[name], images[name] = measured(frames.frame(surface()), radius, options)
        print(name, {k: round(v["total"], 4) for k, v in numbers[name].items()}, flush=True)
    for name in options["scenes"]:
        g = gtao.render.gbuffer(gtao.render.load_scene(name, resolution=options["resolution"]), albedo=False)
        numbers[name], _ = measured(g, gtao.render.scenes.get(name).radius, options)
        print(name, {k: round(v["total"], 4) for k, v in numbers[name].items()}, flush=True)
    shown = [images[name][column] for name in PICTURED for column in COLUMNS]
    titles = [f"{name}\n{column}" for name in PICTURED for column in COLUMNS]
    figure = gtao.plot.image_row(shown, titles, limits=(-ERROR_LIMIT, ERROR_LIMIT), columns=len(COLUMNS))
    arguments.output.mkdir(parents=True, exist_ok=True)
    save_figures(arguments.output, {"errors": figure})
    record |= {
        "kind": "errors of spatial filters",
        "inputs": [],
        "outputs": kept_pictures({"errors.png": arguments.output / "errors.png"}, arguments.output),
        "numbers": rounded({"errors": numbers, "leaks": leaks(), "horizon": horizon(), "costs": costs()}),
    }
    gtao.io.write_record(arguments.output / "record.json", record, overwrite=True)


if __name__ == "__main__":
    main()
