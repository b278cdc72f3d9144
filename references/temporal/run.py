"""Measure the production pipeline on still and moving images against ray-traced truth, and write ``record.json``.

    python references/temporal/run.py                        # some minutes on two cores
    python references/temporal/run.py --part ghosts --part windows
    python references/temporal/run.py --quick -o out/temporal-quick

Parts: "still" is a camera at rest, over the frames, with each stage switched off in turn; "patterns" the same with
every noise pattern; "ghosts" sequences in motion, with what keeps ghosts out switched off in turn; "windows" the width
of the clamp's window. ``docs/generate.py`` makes the page *From one direction per pixel to a still image* of it.
"""

import argparse
import sys
import time
from pathlib import Path

import moving
import still
import variants

import gtao
from gtao.workflows.outputs import save_figures

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from sources import kept_pictures, rounded  # noqa: E402  (beside this folder)

SCENES = ("cornell", "stairs", "arcade", "city", "corner_boxes")
FULL = {
    "still": {"scenes": SCENES, "resolution": 256, "spp": 256, "frames": 48, "cycles": 10},
    "patterns": {"scenes": SCENES, "resolution": 192, "spp": 128, "frames": 48},
    "ghosts": {
        "animations": ("passing_object", "thin_bars", "orbit", "fast_rotation", "cut"),
        "width": 192,
        "height": 108,
        "frames": 48,
        "spp": 64,
        "trail": 12,
    },
    "windows": {
        "animations": ("passing_object", "thin_bars"),
        "widths": (0.0, 0.25, 0.5, 1.0, 2.0, 4.0),
        "width": 192,
        "height": 108,
        "frames": 48,
        "spp": 64,
        "trail": 12,
    },
}
QUICK = {
    "still": {"scenes": SCENES[:2], "resolution": 48, "spp": 32, "frames": 26, "cycles": 2},
    "patterns": {"scenes": SCENES[:2], "resolution": 48, "spp": 32, "frames": 12},
    "ghosts": {"width": 64, "height": 36, "frames": 16, "spp": 16},
    "windows": {"width": 64, "height": 36, "frames": 16, "spp": 16},
}
PARTS = {
    "still": still.measure,
    "patterns": still.measure_patterns,
    "ghosts": moving.measure,
    "windows": moving.measure_windows,
}
#: Variants that the picture of settling shows.
SHOWN = (variants.PUBLISHED, "no spatial filter", "no temporal filter", "full resolution", "no clamp")
#: Scenes that the picture of noise patterns shows.
PATTERN_SCENES = 2
#: What stands across the picture of settling.
LEVELS = {
    "96 directions, half resolution": lambda row, key: row["singles"]["half resolution"][key],
    "limit behind the filters": lambda row, key: row["filtered limit"][key],
}


def at(config):
    """Numbers of frames that curves have a value for."""
    return [k for k in still.KEPT if k <= config["frames"]]


def values(curve, config):
    """A curve's values in the order of the frames; a record sorts them as words."""
    errors = curve.get("rmse", curve)
    return [errors[str(k)] for k in at(config)]


def figures(numbers, config):
    """Name -> figure of what has been measured."""
    drawn = {}
    if "still" in numbers:
        for key, label in (("limit", "RMSE to the dense limit"), ("truth", "RMSE to ray-traced truth")):
            drawn[f"settling-{key}"] = gtao.plot.settling_curves(
                {
                    s: {name: values(row["variants"][name][key], config["still"]) for name in SHOWN}
                    for s, row in numbers["still"].items()
                },
                at=at(config["still"]),
                levels={
                    s: {name: level(row, key) for name, level in LEVELS.items()} for s, row in numbers["still"].items()
                },
                ylabel=label,
                log=True,
            )
    if "patterns" in numbers:
        drawn["patterns"] = gtao.plot.settling_curves(
            {
                f"{s}, {clamp}": {name: values(row["jittered"], config["patterns"]) for name, row in rows.items()}
                for s, by_clamp in list(numbers["patterns"].items())[:PATTERN_SCENES]
                for clamp, rows in by_clamp.items()
            },
            at=at(config["patterns"]),
            ylabel="RMSE to the dense limit",
            log=True,
        )
    if "ghosts" in numbers:
        drawn["moving"] = gtao.plot.settling_curves(
            {
                name: {label: row["rmse"] for label, row in entry["pipelines"].items()}
                for name, entry in numbers["ghosts"].items()
            },
            marks={name: entry["cut"] + 1 for name, entry in numbers["ghosts"].items() if entry["cut"]},
            ylabel="RMSE to ray-traced truth",
        )
    if "windows" in numbers:
        widths = [f"{width:g}" for width in config["windows"]["widths"]]
        rows = numbers["windows"]
        drawn["windows"] = gtao.plot.settling_curves(
            {
                "lag in the trail": {name: [row[w]["ghosting"]["lag"] for w in widths] for name, row in rows.items()},
                "flicker": {name: [row[w]["flicker"]["deviation"] for w in widths] for name, row in rows.items()},
            },
            at=[float(width) for width in widths],
            xlabel="width of the window",
            ylabel="visibility",
        )
    return drawn


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=HERE, help="directory for the record and the pictures")
    parser.add_argument("--part", action="append", choices=PARTS, help="measure only this; the rest is kept")
    parser.add_argument("--quick", action="store_true", help="small and noisy, to see every part run")
    options = parser.parse_args()
    config = {name: FULL[name] | (QUICK[name] if options.quick else {}) for name in PARTS}
    # Before anything is written: outputs may be files of the repository.
    record = gtao.io.provenance(["python", "references/temporal/run.py"], seed=still.SEED, config=config)
    options.output.mkdir(parents=True, exist_ok=True)
    path = options.output / "record.json"
    numbers = gtao.io.read_record(path)["numbers"] if options.part and path.exists() else {}
    for name in options.part or PARTS:
        start = time.perf_counter()
        numbers[name] = rounded(PARTS[name](config[name]))
        print(f"{name}: {time.perf_counter() - start:.0f} s", file=sys.stderr, flush=True)
    numbers["pipeline"] = variants.published(1.0).to_dict()
    record |= {"kind": "temporal pipeline", "inputs": [], "numbers": numbers}
    drawn = save_figures(options.output, figures(numbers, config))
    record["outputs"] = kept_pictures({name: options.output / name for name in drawn}, options.output)
    gtao.io.write_record(path, record, overwrite=True)


if __name__ == "__main__":
    main()
