"""How densely samples should lie near the pixel: GTAO's error against the height field, by `step_exponent`.

    python fits/steps/2026-11/run.py -o DIR

Every embedded procedural scene, both cameras, with the scene's radius and without one, at several numbers of samples.
The default of `gtao.GTAO` is the exponent with the lowest mean logarithm of the error at its default numbers of slices
and steps; with fewer steps even ones are a little better still. Records are not edited: run into another directory to
repeat it.
"""

import argparse
import math
from pathlib import Path

import numpy as np

import gtao
from gtao import evaluate, io, render

RESOLUTION, SEED = 192, 0
EXPONENTS = (1.0, 1.25, 1.5, 2.0)
DEFAULT = (gtao.GTAO().n_slices, gtao.GTAO().n_steps)
#: Slices and steps per side.
BUDGETS = ((3, 3), (9, 3), DEFAULT)


def errors(g, radius):
    """RMSE without noise by budget and exponent."""
    march = gtao.HeightfieldRayMarch(radius=radius, n_directions=8, rays_per_direction=8, seed=SEED)
    truth = gtao.ambient_occlusion(g, march)
    field, variance, mask = truth.visibility.numpy(), truth.variance.numpy(), g.mask.numpy()
    return [
        [
            evaluate.corrected_rmse(
                gtao.ambient_occlusion(
                    g, gtao.GTAO(radius=radius, n_slices=n_slices, n_steps=n_steps, step_exponent=p)
                ).visibility.numpy(),
                field,
                variance,
                mask=mask,
            )
            for p in EXPONENTS
        ]
        for n_slices, n_steps in BUDGETS
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="directory for the record")
    path = parser.parse_args().output / "record.json"
    if path.exists():
        parser.error(f"{path} exists, and records are not overwritten; choose another directory")
    rows, inputs = [], []
    for name in render.scenes.names("procedural"):
        scene = render.load_scene(name, resolution=RESOLUTION)
        inputs.append({"path": f"embedded:{name}", "sha256": render.fingerprint(scene, 0), "scene": name})
        for sensor in range(len(scene.sensors())):
            g = render.gbuffer(scene, sensor, albedo=False)
            rows += [errors(g, radius) for radius in (render.scenes.get(name).radius, math.inf)]
    table = np.array(rows).reshape(-1, 2, len(BUDGETS), len(EXPONENTS))
    scores = np.log(table[:, :, BUDGETS.index(DEFAULT)]).mean(axis=(0, 1))
    numbers = {
        "exponents": list(EXPONENTS),
        "mean_rmse": {
            reach: {f"{s}x{n}": table[:, i, j].mean(axis=0).tolist() for j, (s, n) in enumerate(BUDGETS)}
            for i, reach in enumerate(("scene's radius", "no radius"))
        },
        "score": scores.tolist(),
        "chosen": EXPONENTS[int(scores.argmin())],
        "n_views": len(table),
    }
    config = {"resolution": RESOLUTION, "exponents": list(EXPONENTS), "budgets": [list(b) for b in BUDGETS]}
    record = io.provenance(["python", "fits/steps/2026-11/run.py"], seed=SEED, config=config)
    record |= {"kind": "step exponent", "inputs": inputs, "outputs": [], "numbers": numbers}
    io.write_record(path, record)
    print(numbers)


if __name__ == "__main__":
    main()
