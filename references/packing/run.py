"""Pack the directions of all procedural embedded scenes in every way, and write ``record.json``.

    python references/packing/run.py            # two minutes on two cores
    python references/packing/run.py --quick -o out/record.json

``docs/generate.py`` makes the table of the page *Bent normals in an engine* of it.
"""

import argparse
from dataclasses import asdict
from pathlib import Path

import numpy as np

import gtao

HERE = Path(__file__).resolve().parent

RESOLUTION, N_SLICES, N_STEPS = 192, 16, 8
QUICK = {"resolution": 32, "n_slices": 4}


def directions(name, config):
    """One row of pixels: those of a scene that show a surface from which something is visible."""
    g = gtao.render.gbuffer(gtao.render.load_scene(name, resolution=config["resolution"]), albedo=False)
    method = gtao.GTAO(
        radius=gtao.render.scenes.get(name).radius,
        n_slices=config["n_slices"],
        n_steps=config["n_steps"],
        directional=True,
    )
    found = gtao.io.directions_of(gtao.ambient_occlusion(g, method))
    seen = np.any(found.mean_direction, axis=-1)
    return found.visibility[seen], found.bent_normal[seen], found.mean_direction[seen], found.visibility_sh[seen]


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=HERE / "record.json")
    parser.add_argument("--quick", action="store_true", help="small frames, to see every part run")
    options = parser.parse_args()
    scenes = gtao.render.scenes.names("procedural")
    config = {"scenes": scenes, "resolution": RESOLUTION, "n_slices": N_SLICES, "n_steps": N_STEPS}
    config |= QUICK if options.quick else {}
    parts = zip(*(directions(name, config) for name in scenes), strict=True)
    visibility, bent, mean, sh = (np.concatenate(part)[None] for part in parts)
    pooled = gtao.io.Directions(visibility=visibility, bent_normal=bent, mean_direction=mean, visibility_sh=sh)
    numbers = {}
    for name, packing in gtao.io.PACKINGS.items():
        errors = {key: v for key, v in asdict(gtao.io.packing_errors(pooled, name)).items() if v is not None}
        numbers[name] = {"bits": packing.bits, "suffix": gtao.io.packed_suffix(name), "about": packing.about, **errors}
        print(gtao.io.packing_errors(pooled, name))
    record = gtao.io.provenance(["python", "references/packing/run.py"], seed=None, config=config)
    record |= {"kind": "errors of packings", "inputs": [], "outputs": [], "numbers": numbers}
    gtao.io.write_record(options.output, record, overwrite=True)


if __name__ == "__main__":
    main()
