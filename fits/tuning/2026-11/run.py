"""XeGTAO's constants, tuned to ray-traced truth, against the published ones at equal numbers of samples.

    python fits/tuning/2026-11/run.py -o DIR [--held-out FOLDER_WITH_SCENES ...] [--cache DIR]

Every embedded procedural scene, both cameras, at its own radius. Three scenes at a time are left out and scored by what
was tuned on the others; scenes given as held out take part in no tuning. Tuned are the radius multiplier, the falloff
range, the sample distribution, the thin-occluder compensation and the power, with 3x3 slices and steps per side and
XeGTAO's filter.

The offset of the depth pyramid stays as published: it trades error for time, and a fit that does not count time turns
the pyramid off. Records are not edited: run into another directory to repeat it.
"""

import argparse
from pathlib import Path

from gtao import workflows

CONSTANTS = ("radius_multiplier", "falloff.start", "step_exponent", "thin_occluder_compensation", "power")
SETTINGS = {"parameters": CONSTANTS, "resolution": 128, "spp": 128, "radii": (1.0,), "folds": 4, "seed": 0}


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="directory for the records")
    parser.add_argument("--held-out", type=Path, nargs="*", default=[], help="folders of scenes")
    parser.add_argument("--cache", type=Path, help="directory of traced views")
    options = parser.parse_args()
    held_out = tuple(map(str, options.held_out))
    folder = options.output / "constants"
    if (folder / "record.json").exists():
        parser.error(f"{folder} holds a record, and records are not overwritten")
    config = workflows.TuneConfig(held_out=held_out, **SETTINGS)
    print(workflows.tune(config, folder, cache=options.cache).summary())


if __name__ == "__main__":
    main()
