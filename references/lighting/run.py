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
import json
import sys
from pathlib import Path

from PIL import Image

import gtao
from gtao.workflows.lighting.measuring import ALL, CUTS, WINDOWED
from gtao.workflows.lighting.methods import DENSE, GAME, OURS, TRACED
from gtao.workflows.lighting.tables import standings
from gtao.workflows.outputs import save_figures

HERE = Path(__file__).resolve().parent
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

_ASSETS = {
    "author": "Poly Haven",
    "licence": "CC0-1.0",
    "origin": "npm package @pmndrs/assets 1.7.0, which shrank it to 512x512 and compressed it with DWAB",
}
#: What is known of maps that come without a description, by hash.
CREDITS = {
    "82847b3f3e2073d16647be2eb5712dc0f7e37ddc9480a1d45f2270fe8cd048f6": {"title": "city"} | _ASSETS,
    "6fff311b5f3dad0910d8f334a6d9d88218ffd873d72c679ee1b7e4bccfa140e3": {"title": "forest"} | _ASSETS,
    "08038ed9159c24bb732d2218dafa09cef2abaa44f9ce11ec511d87c842d88fad": {"title": "studio"} | _ASSETS,
}


def described(folder):
    """Scenes of a folder with ``scenes.json``: source, radius, axis that points up; credits by hash of the file."""
    scenes, credits = {}, {}
    listing = json.loads((folder / "scenes.json").read_text())
    for entry in listing["scenes"]:
        source = folder / entry["xml"]["default"]
        scenes[entry["id"]] = (str(source), float(entry["ao_radius_hint"]), entry["up_axis"])
        credits[gtao.io.sha256_file(source)] = credit(entry)
    for entry in listing["hdr"]:
        credits[entry["sha256"]] = credit(entry)
    return scenes, credits


def credit(entry):
    source = entry["source"]
    origin = source.get("upstream") or source.get("project")
    return {
        "title": entry["title"],
        "author": entry["author"],
        "licence": entry["licence"]["spdx"],
        "origin": origin,
    }


def rounded(value):
    """Numbers to four digits, which is more than they are worth."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    return float(f"{value:.4g}") if isinstance(value, float) else value


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
    settings = {"scenes": gtao.render.scenes.names("procedural"), "resolution": RESOLUTION, "spp": SPP}
    settings |= QUICK if options.quick else {}
    config = gtao.workflows.CompareLightingConfig(
        **settings | {"scenes": (*settings["scenes"], *(source for source, _, _ in found.values()))},
        environments=(*gtao.workflows.LIGHTS, *map(str, options.maps)),
        radius={name: radius for name, (_, radius, _) in found.items()} or None,
        up={name: up for name, (_, _, up) in found.items()} or None,
        turn=TURN,
        all_sensors=True,
        seed=SEED,
    )

    def progress(task, done, total):
        if task == "scenes":
            print(f"{done} of {total} scenes", file=sys.stderr, flush=True)

    outcome = gtao.workflows.compare_lighting(config, options.full, progress=progress)
    print(outcome.summary())


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
        "inputs": [entry | credits.get(entry["sha256"], {}) for entry in full["inputs"]],
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
    found, credits = {}, dict(CREDITS)
    for folder in options.scenes:
        scenes, known = described(folder)
        found, credits = found | scenes, credits | known
    if not options.again:
        measure(options, found)
    record = kept(gtao.io.read_record(options.full / "record.json"), credits)
    pictures = [name for name in PICTURES if (options.full / name).exists()]
    options.output.mkdir(parents=True, exist_ok=True)
    bars = gtao.plot.lighting_bars(ordered(record["numbers"]["means"]), ours=OURS)
    drawn = save_figures(options.output, {BARS: bars})
    sources = {name: options.output / name for name in drawn} | {name: options.full / name for name in pictures}
    for name, source in sources.items():
        with Image.open(source) as image:
            image.convert("RGB").quantize(256).save(options.output / name, optimize=True)
    record["outputs"] = [gtao.io.file_entry(options.output / name, options.output) for name in sources]
    gtao.io.write_record(options.output / "record.json", record, overwrite=True)


if __name__ == "__main__":
    main()
