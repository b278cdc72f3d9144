"""Compare all named methods on all procedural embedded scenes, and write ``record.json``.

    python references/comparison/run.py            # about a quarter of an hour on two cores
    python references/comparison/run.py --quick -o out/record.json

``docs/generate.py`` makes a part of the page *Validation* of it. The comparison itself is `gtao compare`, whose whole
output (report, pictures, complete record) stays in ``--full``; kept is what the page shows. Added are how well the two
ground truths of a depth buffer agree, and what each guess about thickness is worth beside the measured one.
"""

import argparse
import sys
from datetime import UTC, datetime
from pathlib import Path

import gtao

import numpy as np  # isort: skip

HERE = Path(__file__).resolve().parent
FULL = HERE.parents[1] / "out" / "comparison"

RESOLUTION, SPP, SEED = 192, 2048, 0
#: Azimuths and elevations of the height field's ray march, per pixel.
RAYS = (16, 16)
#: (slices, steps per side) of the comparison at equal numbers of samples.
BUDGETS = ((3, 3), (9, 3))
QUICK = {"resolution": 48, "spp": 64, "scenes": ("stairs", "foliage"), "rays_per_direction": 4}

#: Methods whose error budgets the page shows.
BUDGETED = ("gtao", "xegtao-high", "recommended")
#: (slices, steps per side) with which guesses about thickness are compared: as few as usual, and dense.
THICKNESS_COUNTS = ((4, 8), (16, 32))
#: Bodies per pixel of the frame that thickness is measured in.
N_LAYERS = 4
METRICS = ("rmse", "corrected_rmse", "field_rmse", "bias", "ssim", "flip")


def settings(quick):
    options = {"resolution": RESOLUTION, "spp": SPP, "n_directions": RAYS[0], "rays_per_direction": RAYS[1]}
    options |= {"scenes": tuple(gtao.render.scenes.names("procedural")), "budgets": BUDGETS, "curve": ((1, 2),)}
    # Times of a small frame on whatever else the machine does would say little.
    options |= {"rounds": 1, "seed": SEED}
    return gtao.workflows.CompareConfig(**(options | (QUICK if quick else {})))


def kept(numbers, notes):
    """What the page needs of one scene."""
    return {key: numbers[key] for key in ("radius", "noise", "limit_rmse", "deviations")} | {
        "methods": [{k: row[k] for k in ("group", "method", "taps", *METRICS)} for row in numbers["methods"]],
        "budgets": {name: numbers["budgets"][name] for name in BUDGETED},
        "notes": list(notes),
    }


def agreement(g, radius, config):
    """Dense slices minus rays, on the same depth buffer, without the noise of either."""
    mask = g.mask.numpy()
    counts = {"n_directions": config.n_directions, "rays_per_direction": config.rays_per_direction}
    rays = gtao.ambient_occlusion(g, gtao.HeightfieldRayMarch(radius=radius, seed=SEED, **counts))
    # Slices bring no variance with them. Two independent runs do.
    a, b = (
        gtao.ambient_occlusion(g, gtao.HeightfieldHorizon(radius=radius, seed=seed)).visibility.numpy()
        for seed in (SEED, SEED + 1)
    )
    variances = {"rays": rays.variance.numpy(), "slices": (a - b) ** 2 / 4}
    budget = gtao.evaluate.error_budget(
        {"rays": rays.visibility.numpy(), "slices": (a + b) / 2}, variances=variances, mask=mask
    )
    return {
        "noise_of_rays": gtao.evaluate.noise_floor(variances["rays"], mask=mask),
        "noise_of_slices": gtao.evaluate.noise_floor(variances["slices"], mask=mask),
        "difference": gtao.io.number(budget.biases[0], budget.bias_error[0]),
        "mean_square": gtao.io.number(budget.total, budget.total_error),
    }


def thicknesses(scene, g, radius, config):
    """RMSE of a bitmask, without filter, by what it takes occluders for; lengths relative to the radius."""
    truth = gtao.render.visibility(scene, g, radius, config.spp, SEED, bent_normal=False)
    mask = g.mask.numpy()
    layers = gtao.render.layers(scene, g, N_LAYERS)
    layered = {n: g.with_layers(gtao.DepthLayers(layers.front[:n], layers.back[:n])) for n in (1, N_LAYERS)}
    slope = 0.25 * radius / float(np.median(g.view_z.numpy()[mask]))
    guesses = {
        "solid": (None, g),
        "linear, 1/4 at the median depth": (gtao.LinearThickness(slope=slope), g),
        "constant, 1/4": (gtao.ConstantThickness(thickness=0.25 * radius), g),
        "constant, 1/2": (gtao.ConstantThickness(thickness=0.5 * radius), g),
        "by continuity, as recommended": (gtao.Pipeline.recommended(radius).occlusion.thickness, g),
        "measured, first body": (gtao.MeasuredThickness(), layered[1]),
        f"measured, {N_LAYERS} bodies": (gtao.MeasuredThickness(), layered[N_LAYERS]),
    }

    def error(frame, thickness, n_slices, n_steps):
        method = gtao.VisibilityBitmask(radius=radius, n_slices=n_slices, n_steps=n_steps, thickness=thickness)
        image = gtao.ambient_occlusion(frame, method).visibility.numpy()
        return gtao.evaluate.corrected_rmse(image, truth.mean.numpy(), truth.variance.numpy(), mask=mask)

    return {
        label: {f"{n} × {m}": error(frame, thickness, n, m) for n, m in THICKNESS_COUNTS}
        for label, (thickness, frame) in guesses.items()
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=HERE / "record.json")
    parser.add_argument("--full", type=Path, default=FULL, help="directory for everything that gtao compare writes")
    parser.add_argument("--quick", action="store_true", help="small and noisy, to see every part run")
    options = parser.parse_args()
    started = datetime.now(UTC)
    config = settings(options.quick)

    def progress(task, done, total):
        if task == "scenes":
            print(f"{done} of {total} scenes", file=sys.stderr, flush=True)

    outcome = gtao.workflows.compare(config, options.full, progress=progress)
    measured = outcome.record["numbers"]
    numbers = {scene.name: kept(measured[scene.name], scene.notes) for scene in outcome.comparison.scenes}
    for name, entry in numbers.items():
        info = gtao.render.scenes.get(name)
        scene = gtao.render.load_scene(name, resolution=config.resolution)
        g = gtao.render.gbuffer(scene, albedo=False)
        entry["solid"] = info.solid
        entry["truths"] = agreement(g, info.radius, config)
        entry["thickness"] = thicknesses(scene, g, info.radius, config)
    record = gtao.io.provenance(["python", "references/comparison/run.py"], seed=SEED, config=config.to_dict())
    record |= {
        "kind": "comparison of methods",
        "started": started.isoformat(timespec="seconds"),
        "inputs": outcome.record["inputs"],
        "outputs": [],
        "numbers": {"scenes": numbers},
    }
    gtao.io.write_record(options.output, record, overwrite=True)
    print(outcome.summary())


if __name__ == "__main__":
    main()
