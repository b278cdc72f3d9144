"""The aperture of the reflection cone, refitted: what the published u = 0.01 is the best of, and what it is not.

    python fits/aperture/2026-11/run.py -o DIR

One fit for each way to say what is near: the published one (dissimilarity of images, cosine-weighted visibility, its
seed aperture), the root mean square error instead, uniform weighting, slices of the depth buffer instead of rays, and
the reflection out of the same cone of visibility instead of the traced one: there nothing but the lobe is replaced by
a cone. Records are not edited: run into another directory to repeat it.
"""

import argparse
import shutil
from pathlib import Path

import gtao
from gtao import io

#: Name -> what differs from the published way.
VARIANTS = {
    "published way": {},
    "rmse": {"metric": "rmse"},
    "uniform": {"weighting": "uniform"},
    "dense slices": {"source": "dense", "weighting": "uniform"},
    "cone": {"reference": "cone", "weighting": "uniform"},
    "cone, rmse": {"reference": "cone", "weighting": "uniform", "metric": "rmse"},
}
#: Kept beside the record, of the first.
FIGURES = ("curves.png", "by_roughness.png")


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="directory for the record")
    parser.add_argument("--resolution", type=int, default=128)
    parser.add_argument("--spp", type=int, default=256)
    options = parser.parse_args()
    path = options.output / "record.json"
    if path.exists():
        parser.error(f"{path} exists, and records are not overwritten; choose another directory")
    numbers, inputs = {}, []
    for name, changes in VARIANTS.items():
        config = gtao.workflows.FitApertureConfig(
            resolution=options.resolution, spp=options.spp, all_sensors=True, **changes
        )
        outcome = gtao.workflows.fit_aperture(config, options.output / "work" / name.replace(", ", "-"))
        numbers[name] = {k: v for k, v in outcome.result.to_dict().items() if k not in ("grid", "curves")}
        numbers[name]["changes"] = changes
        inputs = outcome.record["inputs"]
        print(f"{name}\n{outcome.summary()}", flush=True)
    first = options.output / "work" / next(iter(VARIANTS)).replace(", ", "-")
    for figure in FIGURES:
        shutil.copyfile(first / figure, options.output / figure)
    record = io.provenance(
        ["python", "fits/aperture/2026-11/run.py"],
        seed=0,
        config={"resolution": options.resolution, "spp": options.spp, "all_sensors": True, "variants": VARIANTS},
    )
    record |= {"kind": "aperture fits", "inputs": inputs, "numbers": numbers}
    record["outputs"] = [io.file_entry(options.output / figure, options.output) for figure in FIGURES]
    io.write_record(path, record)


if __name__ == "__main__":
    main()
