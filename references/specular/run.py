"""Compare all methods of specular occlusion with traced reflections, and write ``record.json`` and pictures.

    python references/specular/run.py                        # embedded scenes, light that needs no file
    python references/specular/run.py --quick -o out/specular-quick
    python references/specular/run.py --maps A.hdr B.hdr … --scenes FOLDER
    python references/specular/run.py --again --scenes FOLDER        # from what an earlier run left in --full

``docs/generate.py`` makes the page *Specular occlusion against traced reflections* of it. The comparison itself is
`gtao compare-specular`, whose whole output (report, pictures, complete record) stays in ``--full``; kept is what the
page shows. Maps and scenes of others are not part of the project: the record names them with their authors, licences
and hashes.
"""

import argparse
import sys
from pathlib import Path

import gtao
from gtao.workflows.outputs import save_figures
from gtao.workflows.specular.methods import DENSE, GAME, RECOMMENDED, TRACED
from gtao.workflows.specular.run import SHOWN
from gtao.workflows.specular.tables import step_means
from gtao.workflows.standings import mean, ranked

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from sources import credited, described, kept_pictures, measured, rounded  # noqa: E402  (beside this folder)

FULL = HERE.parents[1] / "out" / "specular"

RESOLUTION, SPP, LIT_SPP, SEED = 96, 128, 64, 0
#: Degrees from each frame to the next: the golden angle visits all directions evenly.
TURN = 137.5
QUICK = {
    "resolution": 32,
    "spp": 64,
    "lit_spp": 32,
    "scenes": ("stairs", "foliage"),
    "roughness": (0.2, 0.5, 0.8),
}

SOURCES = (TRACED, DENSE, GAME, RECOMMENDED)
#: All frames, those of embedded scenes, those of files.
SCOPES = ("all", "embedded", "files")

#: Pictures that are drawn from the record.
CURVES, STEPS = "methods", "steps"
#: Other pictures to keep, in 256 colours.
PICTURES = (
    "stairs-camera-0_0.3_ray-traced-visibility.png",
    "head-camera-0_0.7_ray-traced-visibility.png",
    "head-camera-0_0.7_dense-slices.png",
    "cornell-camera-0_gradient-roughness-0.5.png",
)


def measure(options, found):
    """Run the comparison into the directory for everything."""
    settings = {"scenes": gtao.render.scenes.names("procedural"), "resolution": RESOLUTION, "spp": SPP}
    settings |= {"lit_spp": LIT_SPP, "seed": SEED} | (QUICK if options.quick else {})
    study, lights = gtao.workflows.compare_specular, gtao.workflows.SPECULAR_LIGHTS
    measured(study, gtao.workflows.CompareSpecularConfig, settings, lights, found, options, TURN)


def scopes(inputs):
    """Scope -> names of its frames; none that is empty."""
    frames = {entry["frame"]: entry["path"].startswith("embedded:") for entry in inputs if "frame" in entry}
    found = {"all": set(frames), "embedded": {f for f, own in frames.items() if own}}
    found["files"] = found["all"] - found["embedded"]
    return {scope: names for scope, names in found.items() if names}


def within(frames, names):
    return {name: numbers for name, numbers in frames.items() if name in names}


def overall(dome):
    """Source -> method -> mean rank and wins over all frames and roughnesses."""
    together = {f"{frame} {r}": numbers for r, frames in dome.items() for frame, numbers in frames.items()}
    return {
        source: {name: {"rank": row["rank"], "wins": row["wins"]} for name, row in methods.items()}
        for source, methods in ranked(together, {}).items()
    }


def dome_of(dome, names):
    """Source -> roughness -> method -> rmse and bias, of some frames."""
    found = {source: {} for source in SOURCES}
    for r, frames in dome.items():
        for source, methods in ranked(within(frames, names), {}).items():
            found[source][r] = {name: {"rmse": row["rmse"], "bias": row["bias"]} for name, row in methods.items()}
    return found


def kept(full, credits):
    """What the page needs of the full record."""
    numbers = full["numbers"]
    files = {entry["path"]: entry["light"] for entry in full["inputs"] if "light" in entry}
    parts = scopes(full["inputs"])
    views = [entry for entry in full["inputs"] if "frame" in entry]
    record = {key: full[key] for key in ("created", "started", "git", "versions", "device", "seed", "config")}
    found = {
        "order": [f"{r:g}" for r in full["config"]["roughness"]],
        "lights": [name for s in full["config"]["environments"] if (name := files.get(s, s)) in numbers["lit"]],
        "frames": {scope: len(names) for scope, names in parts.items()},
        "tilt": {scope: mean([v["tilt"] for v in views if v["frame"] in names]) for scope, names in parts.items()},
        "dome": {scope: dome_of(numbers["dome"], names) for scope, names in parts.items()},
        "overall": overall(numbers["dome"]),
        "noise": {r: mean([f["noise"] for f in frames.values()]) for r, frames in numbers["dome"].items()},
        "steps": {
            scope: step_means({r: within(frames, names) for r, frames in numbers["steps"].items()})
            for scope, names in parts.items()
        },
        "cones": numbers["cones"],
        "lit": numbers["lit_standings"],
        "lit_means": numbers["lit_means"],
        "lit_frames": {n: {r: len(f) for r, f in rows.items()} for n, rows in numbers["lit"].items()},
        "notes": numbers["notes"],
    }
    return record | {
        "kind": "comparison of specular occlusion",
        "command": ["python", "references/specular/run.py"],
        "inputs": credited(full["inputs"], credits),
        "numbers": rounded(found),
    }


def curves(numbers):
    """Source -> roughness -> method -> error, in the order in which they are drawn; a record sorts them by name."""
    dome = numbers["dome"]["all"]
    return {s: {r: {m: row["rmse"] for m, row in dome[s][r].items()} for r in numbers["order"]} for s in SOURCES}


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=HERE, help="directory for the record and the pictures")
    parser.add_argument("--full", type=Path, default=FULL, help="directory for all that gtao compare-specular writes")
    parser.add_argument("--maps", type=Path, nargs="*", default=[], help="environment maps")
    parser.add_argument("--scenes", type=Path, nargs="*", default=[], help="folders with scenes.json")
    parser.add_argument("--quick", action="store_true", help="small and noisy, to see every part run")
    parser.add_argument("--again", action="store_true", help="measure nothing, keep anew what lies in --full")
    options = parser.parse_args()
    found, credits = described(options.scenes)
    if not options.again:
        measure(options, found)
    record = kept(gtao.io.read_record(options.full / "record.json"), credits)
    pictures = [name for name in PICTURES if (options.full / name).exists()]
    options.output.mkdir(parents=True, exist_ok=True)
    numbers = record["numbers"]
    steps = {r: numbers["steps"]["all"][r] for r in numbers["order"]}
    figures = {CURVES: gtao.plot.specular_curves(curves(numbers), shown=SHOWN), STEPS: gtao.plot.specular_steps(steps)}
    drawn = save_figures(options.output, figures)
    sources = {name: options.output / name for name in drawn} | {name: options.full / name for name in pictures}
    record["outputs"] = kept_pictures(sources, options.output)
    gtao.io.write_record(options.output / "record.json", record, overwrite=True)


if __name__ == "__main__":
    main()
