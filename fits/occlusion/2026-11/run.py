"""Choose the parameters of `gtao.Pipeline.recommended` on the embedded scenes, and compare it with XeGTAO.

    python fits/occlusion/2026-11/run.py -o DIR [--held-out FOLDER_WITH_SCENES ...]

All combinations of a small grid are scored by the mean logarithm of their RMSE over that of XeGTAO ("high", denoised),
both against ray-traced truth with the same reach; scenes of thin things and solid ones count one half each. Of the
combinations that no seed can tell from the best (0.2 %) the one that assumes the least matter is chosen (smallest
thickness, gap and thickness of isolated occluders, in this order), because the embedded scenes hold few thin things.
The scenes given as held out take no part in the choice. Records are not edited: run into another directory to repeat
it.
"""

import argparse
import itertools
import json
import math
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

import gtao
from gtao import evaluate, io, render

RESOLUTION, SPP, SEED = 256, 256, 7
HELD_OUT_RESOLUTION = 320
RIVAL = "xegtao-high"

#: In units of the radius, but for the exponent.
GRID = {
    "continuing": (0.8, 1.0, 1.25),
    "gap": (0.25, 0.35, 0.5, 0.7),
    "isolated": (0.2, 0.3, 0.4, 0.5),
    "step_exponent": (1.0, 1.25, 1.5),
}
#: Scores are logarithms: combinations this close to the best count as equal.
TOLERANCE = 0.002
#: (slices, steps per side) of the comparison at equal numbers of samples: XeGTAO's own, and ours.
EQUAL_TAPS = {18: ((3, 3), (1, 9)), 54: ((9, 3), (3, 9))}


def views(scenes, resolution):
    """(name, frame, truth, radius) of every camera of every scene: name -> (source, radius, thin)."""
    for name, (source, radius, thin) in scenes.items():
        scene = render.load_scene(source, resolution=resolution)
        for sensor in range(len(scene.sensors())):
            g = render.gbuffer(scene, sensor, albedo=False)
            truth = render.visibility(scene, g, radius, SPP, SEED, sensor=sensor, bent_normal=False)
            yield f"{name}, camera {sensor}", g, truth, radius, thin


def error(pipeline, g, truth):
    image = pipeline.step(g).visibility.numpy()
    return evaluate.corrected_rmse(image, truth.mean.numpy(), truth.variance.numpy(), mask=g.mask.numpy())


def candidate(radius, *, n_slices=3, n_steps=8, **values):
    lengths = {name: values[name] * radius for name in ("continuing", "isolated", "gap")}
    return gtao.Pipeline(
        occlusion=gtao.VisibilityBitmask(
            radius=radius,
            n_slices=n_slices,
            n_steps=n_steps,
            step_exponent=values["step_exponent"],
            thickness=gtao.ContinuityThickness(**lengths),
        ),
        spatial=gtao.PlaneAwareFilter(),
    )


def held_out(folders):
    """Scenes with a ``scenes.json`` that names radii, as sources of scenes that are not part of this package."""
    found = {}
    for folder in folders:
        for entry in json.loads((folder / "scenes.json").read_text())["scenes"]:
            home = folder / entry["id"]
            # A room with its ceiling on is dark everywhere; the open one is lit.
            source = next(p for p in (home / "scene_open.xml", home / "scene.xml") if p.exists())
            found[entry["id"]] = (str(source), float(entry["ao_radius_hint"]), None)
    return found


def embedded():
    infos = [render.scenes.get(name) for name in render.scenes.names("procedural")]
    return {info.name: (info.name, info.radius, not info.solid) for info in infos}


def measured(scenes, resolution, chosen):
    """Per view: RMSE of the choice, of the rival, of both at equal numbers of samples, and the noise of the truth."""
    rows = []
    for name, g, truth, radius, _ in views(scenes, resolution):
        rival = gtao.config.named(RIVAL, radius)
        row = {
            "view": name,
            "radius": radius,
            "recommended": error(candidate(radius, **chosen), g, truth),
            RIVAL: error(rival, g, truth),
            "noise": evaluate.noise_floor(truth.variance.numpy(), mask=g.mask.numpy()),
        }
        for taps, (theirs, ours) in EQUAL_TAPS.items():
            row[f"{RIVAL}, {taps} taps"] = error(gtao.config.with_budget(rival, *theirs), g, truth)
            counts = dict(zip(("n_slices", "n_steps"), ours, strict=True))
            row[f"recommended, {taps} taps"] = error(candidate(radius, **counts, **chosen), g, truth)
        rows.append(row)
    return rows


def summary(rows):
    ratios = np.array([row["recommended"] / row[RIVAL] for row in rows])
    means = {key: float(np.mean([row[key] for row in rows])) for key in rows[0] if key not in ("view", "radius")}
    return {
        "n_views": len(rows),
        "mean_rmse": means,
        "ratio_of_means": means["recommended"] / means[RIVAL],
        "mean_ratio": float(ratios.mean()),
        "worst_ratio": float(ratios.max()),
        "worst_view": rows[int(ratios.argmax())]["view"],
        "n_won": int((ratios < 1).sum()),
    }


def search(scenes):
    """Scores of all combinations, best first."""
    combinations = [dict(zip(GRID, values, strict=True)) for values in itertools.product(*GRID.values())]
    ratios, thin = [], []
    for _, g, truth, radius, is_thin in views(scenes, RESOLUTION):
        rival = error(gtao.config.named(RIVAL, radius), g, truth)
        ratios.append([math.log(error(candidate(radius, **c), g, truth) / rival) for c in combinations])
        thin.append(is_thin)
    ratios, thin = np.array(ratios), np.array(thin)
    scores = 0.5 * ratios[thin].mean(axis=0) + 0.5 * ratios[~thin].mean(axis=0)
    ranked = [
        combinations[i] | {"score": float(scores[i]), "worst": float(ratios[:, i].max())} for i in scores.argsort()
    ]
    return ranked


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="directory for the record")
    parser.add_argument("--held-out", type=Path, nargs="*", default=[], help="folders with scenes.json")
    options = parser.parse_args()
    path = options.output / "record.json"
    if path.exists():
        parser.error(f"{options.output} holds a record, and records are not overwritten; choose another directory")
    started = datetime.now(UTC)
    scenes = embedded()
    ranked = search(scenes)
    level = [c for c in ranked if c["score"] < ranked[0]["score"] + TOLERANCE]
    chosen = {
        name: min(level, key=lambda c: tuple(c[n] for n in ("continuing", "gap", "isolated")))[name] for name in GRID
    }
    numbers = {
        "chosen": chosen,
        "ranking": ranked[:10],
        "n_level": len(level),
        "embedded": measured(scenes, RESOLUTION, chosen),
    }
    numbers["embedded_summary"] = summary(numbers["embedded"])
    others = held_out(options.held_out)
    if others:
        numbers["held_out"] = measured(others, HELD_OUT_RESOLUTION, chosen)
        numbers["held_out_summary"] = summary(numbers["held_out"])
        numbers["all_summary"] = summary(numbers["embedded"] + numbers["held_out"])
    config = {"resolution": RESOLUTION, "held_out_resolution": HELD_OUT_RESOLUTION, "spp": SPP, "rival": RIVAL}
    config |= {"grid": {name: list(values) for name, values in GRID.items()}}
    record = io.provenance(["python", "fits/occlusion/2026-11/run.py"], seed=SEED, config=config) | {
        "kind": "occlusion preset",
        "started": started.isoformat(timespec="seconds"),
        "inputs": [_entry(name, source) for name, (source, *_) in (scenes | others).items()],
        "outputs": [],
        "numbers": numbers,
    }
    io.write_record(path, record)
    print(json.dumps(chosen | numbers.get("all_summary", numbers["embedded_summary"]), indent=1))


def _entry(name, source):
    if source != name:
        return io.file_entry(source) | {"path": f"{name}/{Path(source).name}", "scene": name}
    scene = render.load_scene(source, resolution=RESOLUTION)
    return {"path": f"embedded:{name}", "sha256": render.fingerprint(scene, 0), "scene": name}


if __name__ == "__main__":
    main()
