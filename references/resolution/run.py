"""Estimate at half and quarter resolution in every way, and write ``record.json`` and a picture.

    python references/resolution/run.py            # ten minutes on two cores
    python references/resolution/run.py --quick -o out/resolution

``docs/generate.py`` makes the page *Smaller frames* of it. Errors are those of the embedded scenes against the
full-resolution estimate of the same method and against ray-traced truth; costs are CPU times of one thread.
"""

import argparse
import sys
from itertools import product
from pathlib import Path

import cost
import numpy as np
import planes

import gtao
from gtao.workflows.outputs import save_figures

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from sources import kept_pictures, rounded  # noqa: E402  (beside this folder)

RESOLUTION, SPP, SEED = 256, 1024, 0
QUICK = {"resolution": 48, "spp": 64, "scenes": ("stairs", "foliage")}

FACTORS = (2, 4)
PLACED = tuple(product(("nearest", "farthest", "checkerboard", "first"), ("texel", "centre")))
#: The first of each kind is what the page shows beside the others.
WAYS = {
    "bilinear": gtao.BilinearUpsample(),
    "nearest depth": gtao.NearestDepthUpsample(),
    "bilateral": gtao.BilateralUpsample(),
    "plane-aware": gtao.PlaneAwareUpsample(),
}
#: Options other than the defaults, tried on the default frame.
TRIED = {f"nearest depth {t:g}": gtao.NearestDepthUpsample(threshold=t) for t in (0.005, 0.01, 0.05, 0.1, 0.2)}
TRIED |= {f"bilateral {t:g}": gtao.BilateralUpsample(threshold=t) for t in (0.005, 0.01, 0.05, 0.1, 0.2)}
TRIED |= {
    f"plane-aware {t:g}, {a}": gtao.PlaneAwareUpsample(tolerance=t, angle=angle)
    for t in (0.125, 0.25, 0.5, 1.0, 2.0)
    for a, angle in (("0.25", 0.25), ("0.5", 0.5), ("1", 1.0), ("any", np.pi))
}

#: What the picture shows: the scene, the factor, and a window (x, y, width, height) in shares of the frame.
PICTURED, PICTURED_FACTOR, WINDOW = "arcade", 4, (0.2, 0.3, 0.5, 0.5)


def pipelines(radius):
    """Dense slices isolate the resolution, the others are what an application would take."""
    dense = gtao.GTAO(radius=radius, n_slices=8, n_steps=16, noise="none")
    few = gtao.GTAO(radius=radius, n_slices=1, n_steps=8)
    return {
        "dense": gtao.Pipeline(occlusion=dense, clamp=False),
        "1 × 8, filtered": gtao.Pipeline(occlusion=few, spatial=gtao.PlaneAwareFilter()),
        "recommended": gtao.Pipeline.recommended(radius),
    }


def errors(image, full, truth, mask):
    """Of one image, against the full-resolution one and against the truth."""
    return {
        "full": gtao.evaluate.rmse(image, full, mask=mask),
        "bias": gtao.evaluate.bias(image, full, mask=mask),
        "truth": gtao.evaluate.rmse(image, truth, mask=mask),
    }


def label(choice, place):
    return f"{choice}, {place}"


def of_scene(name, config):
    """Everything that is measured on one scene."""
    info = gtao.render.scenes.get(name)
    scene = gtao.render.load_scene(name, resolution=config["resolution"])
    g = gtao.render.gbuffer(scene, albedo=False)
    truth = gtao.render.visibility(scene, g, info.radius, config["spp"], SEED, bent_normal=False).mean
    truth, mask = np.asarray(truth), g.mask.numpy()
    found, images = {}, {}
    for kind, pipeline in pipelines(info.radius).items():
        full = pipeline.step(g).visibility.numpy()
        entry = {"truth": gtao.evaluate.rmse(full, truth, mask=mask), "frames": {}, "tried": {}}
        for factor, (choice, place) in product(FACTORS, PLACED):
            small = gtao.downsample(g, gtao.Downsample(factor=factor, choice=choice, place=place))
            ao = pipeline.step(small)
            rows = {n: gtao.upsample(ao, small, g, way).visibility.numpy() for n, way in WAYS.items()}
            found_rows = {n: errors(image, full, truth, mask) for n, image in rows.items()}
            entry["frames"].setdefault(str(factor), {})[label(choice, place)] = found_rows
            if (choice, place) != (gtao.Downsample().choice, gtao.Downsample().place):
                continue
            if kind == "dense":
                tried = {n: gtao.upsample(ao, small, g, way).visibility.numpy() for n, way in TRIED.items()}
                entry["tried"][str(factor)] = {n: errors(i, full, truth, mask)["full"] for n, i in tried.items()}
                if factor == PICTURED_FACTOR:
                    images = {"full resolution": full} | rows
        found[kind] = entry
    return found, images, mask


def mean(values):
    """The mean over scenes of numbers that stand at the same place."""
    if isinstance(values[0], dict):
        return {key: mean([v[key] for v in values]) for key in values[0]}
    return float(np.mean(values))


def default_of(frames):
    how = gtao.Downsample()
    return {factor: rows[label(how.choice, how.place)]["plane-aware"] for factor, rows in frames.items()}


def picture(images, mask):
    """A window of what the ways make of the same small frame."""
    height, width = mask.shape
    x, y, w, h = (round(share * n) for share, n in zip(WINDOW, (width, height) * 2, strict=True))
    part = (slice(y, y + h), slice(x, x + w))
    images = {name: image[part] for name, image in images.items()}
    full = images.pop("full resolution")
    return gtao.plot.comparison_images(full, images, mask=mask[part], columns=5, reference="full resolution")


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=HERE, help="directory for the record and the picture")
    parser.add_argument("--quick", action="store_true", help="small and noisy, to see every part run")
    options = parser.parse_args()
    config = {"resolution": RESOLUTION, "spp": SPP, "scenes": gtao.render.scenes.names("procedural")}
    config |= QUICK if options.quick else {}
    # Before anything is written: outputs may be files of the repository.
    record = gtao.io.provenance(["python", "references/resolution/run.py"], seed=SEED, config=config)
    scenes, figures = {}, {}
    for name in config["scenes"]:
        scenes[name], images, mask = of_scene(name, config)
        if name == PICTURED or (options.quick and not figures):
            figures = {"ways": picture(images, mask)}
        print(name, default_of(scenes[name]["dense"]["frames"]), file=sys.stderr, flush=True)
    found = {
        "mean": mean(list(scenes.values())),
        "scenes": {
            name: {k: {"truth": e["truth"], **default_of(e["frames"])} for k, e in entry.items()}
            for name, entry in scenes.items()
        },
        "planes": planes.measured(options.quick),
        "cost": cost.measured(options.quick),
    }
    options.output.mkdir(parents=True, exist_ok=True)
    drawn = save_figures(options.output, figures)
    record |= {"kind": "smaller frames", "inputs": [], "numbers": rounded(found)}
    record["outputs"] = kept_pictures({name: options.output / name for name in drawn}, options.output)
    gtao.io.write_record(options.output / "record.json", record, overwrite=True)


if __name__ == "__main__":
    main()
