"""Compare all methods of irradiance with ray-traced light, and write ``record.json`` and pictures.

    python references/lighting/run.py                        # embedded scenes, light that needs no file
    python references/lighting/run.py --quick -o out/lighting-quick
    python references/lighting/run.py --maps A.hdr B.exr … --scenes FOLDER
    python references/lighting/run.py --again --scenes FOLDER        # from what an earlier run left in --full

``docs/generate.py`` makes the page *Directional occlusion under light* of it. The comparison itself is
`gtao compare-lighting`, whose whole output (report, pictures, complete record) stays in ``--full``; kept is what the
page shows. Maps and scenes of others are not part of the project: the record names them with their authors, licences
and hashes, and README.md says where they come from.
"""

import argparse
import sys
from pathlib import Path

import gtao
from gtao.workflows.lighting.measuring import ALL, CUTS, WINDOWED
from gtao.workflows.lighting.methods import DENSE, GAME, OURS, TRACED
from gtao.workflows.lighting.tables import standings
from gtao.workflows.outputs import save_figures

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from sources import credited, described, kept_pictures, measured, rounded  # noqa: E402  (beside this folder)

FULL = HERE.parents[1] / "out" / "lighting"

RESOLUTION, SPP, SEED = 128, 512, 0
#: Degrees from each frame to the next: the golden angle visits all directions evenly.
TURN = 137.5
QUICK = {"resolution": 32, "spp": 64, "scenes": ("stairs", "foliage")}

#: The picture of the errors of every method, drawn from the record.
BARS = "methods"
#: Other pictures to keep, in 256 colours.
PICTURES = (
    "stairs-camera-0_vmf-20.png",
    "arcade-camera-1_sunsky.png",
    "city-camera-1_forest.png",
)


def noises(numbers):
    """Light -> cut -> mean over the frames of the noise of the truth over the mean irradiance."""
    return {
        light: {cut: sum(f["noise"] for f in frames.values()) / len(frames) for cut, frames in cuts.items()}
        for light, cuts in numbers.items()
    }


def compared(lights):
    """Light -> cut -> standings, from the errors of every frame."""
    return {light: {cut: standings(frames, cut) for cut, frames in cuts.items()} for light, cuts in lights.items()}


def ordered(means):
    """Means as they are drawn; a record sorts them by name."""
    return {cut: {source: means[cut][source] for source in (TRACED, DENSE, GAME)} for cut in (*CUTS, ALL, WINDOWED)}


def measure(options, found):
    """Run the comparison into the directory for everything."""
    settings = {"scenes": gtao.render.scenes.names("procedural"), "resolution": RESOLUTION, "spp": SPP, "seed": SEED}
    settings |= QUICK if options.quick else {}
    study, lights = gtao.workflows.compare_lighting, gtao.workflows.LIGHTS
    measured(study, gtao.workflows.CompareLightingConfig, settings, lights, found, options, TURN)


def kept(full, credits):
    """What the page needs of the full record."""
    numbers = full["numbers"]
    files = {entry["path"]: entry["light"] for entry in full["inputs"] if "light" in entry}
    lights = [files.get(name, name) for name in full["config"]["environments"]]
    compared_by_light = compared(numbers["lights"])
    record = {key: full[key] for key in ("created", "started", "git", "versions", "device", "seed", "config")}
    return record | {
        "kind": "comparison under light",
        "command": ["python", "references/lighting/run.py"],
        "inputs": credited(full["inputs"], credits),
        "numbers": {
            "order": [light for light in lights if light in compared_by_light],
            "standings": rounded(compared_by_light),
            "means": rounded(numbers["means"]),
            "noise": rounded(noises(numbers["lights"])),
            "frames": {light: len(cuts["all bands"]) for light, cuts in numbers["lights"].items()},
            "notes": numbers["notes"],
        },
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=HERE, help="directory for the record and the pictures")
    parser.add_argument("--full", type=Path, default=FULL, help="directory for all that gtao compare-lighting writes")
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
    bars = gtao.plot.lighting_bars(ordered(record["numbers"]["means"]), ours=OURS)
    drawn = save_figures(options.output, {BARS: bars})
    sources = {name: options.output / name for name in drawn} | {name: options.full / name for name in pictures}
    record["outputs"] = kept_pictures(sources, options.output)
    gtao.io.write_record(options.output / "record.json", record, overwrite=True)


if __name__ == "__main__":
    main()
