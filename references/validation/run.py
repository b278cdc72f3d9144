"""Measure the estimator against its oracles and against ray-traced truth, and write ``record.json``.

    python references/validation/run.py            # about half an hour on two cores
    python references/validation/run.py --part planes --part marching

``docs/generate.py`` turns the record into the page *Validation*. The oracles are those of the tests: float64 NumPy that
shares no code with the kernels.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

HERE = Path(__file__).resolve().parent
# The oracles are found only after this line, so the imports below it cannot stand at the top.
sys.path.insert(0, str(HERE.parents[1] / "tests"))

import gtao  # noqa: E402  (as said above)

import numpy as np  # noqa: E402  isort: skip
from analytic import _tables  # noqa: E402  isort: skip
from oracles import heightfield  # noqa: E402  isort: skip
from oracles.fields import Field  # noqa: E402  isort: skip

RESOLUTION = 384
SPP = 8192
SEED = 0
#: Random pixels per scene on which the height field is ray-marched, and rays per pixel.
N_PIXELS, N_RAYS = 500, 4096
#: One depth layer "can know the answer" where its limit lies within this of the truth.
KNOWABLE = 0.02
#: Directions are compared at this resolution, with so many rays per pixel and where so much is visible.
DIRECTIONS_RESOLUTION, DIRECTIONS_RAYS, VISIBLE = 192, 1024, 0.05

METHODS = {
    "published settings": lambda r: gtao.GTAO.as_published(r),
    "default, 4 × 8": lambda r: gtao.GTAO(radius=r),
    "4 × 8, linear fetch": lambda r: gtao.GTAO(radius=r, fetch="linear"),
    "dense, 64 × 256": lambda r: gtao.GTAO(
        radius=r, n_slices=64, n_steps=256, step_exponent=1.0, fetch="linear", noise="none"
    ),
}
DENSE = "dense, 64 × 256"
DIRECTED = ("default, 4 × 8", DENSE)


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


def planes():
    """Mean visibility of open planes, true value 1: worst window and mean, per tilt and variant."""
    rows = []
    for tilt in _tables.TILTS:
        row = {"tilt_degrees": tilt}
        for name, options in _tables.OPEN_PLANE.items():
            means = _tables.open_plane(tilt, **options)
            row[name] = {"mean": float(means.mean()), "low": float(means.min()), "high": float(means.max())}
        rows.append(row)
    return rows


def marching():
    """Dense estimates against exact ray marching of the same height field."""
    return [
        {"field": name, "radius": radius, **_tables.against_marching(name, radius)}
        for name in _tables.MARCHED
        for radius in (np.inf, 0.5)
    ]


def as_field(g):
    """The G-buffer as the oracles know it."""
    camera = {k: v for k, v in g.camera.to_dict().items() if k not in ("type", "near")}
    z, n = g.view_z.numpy().astype(float), g.normal_v.numpy().astype(float)
    return Field(z, n, camera, orthographic=g.camera.is_orthographic)


def scenes():
    """Every procedural scene with a finite radius: errors against ray-traced truth, and what one layer can know."""
    rows = []
    for name in gtao.render.scenes.names("procedural"):
        info = gtao.render.scenes.get(name)
        scene = gtao.render.load_scene(name, resolution=RESOLUTION)
        g = gtao.render.gbuffer(scene)
        truth = gtao.render.visibility(scene, g, info.radius, SPP, SEED, bent_normal=False)
        surface = g.mask.numpy()
        t = truth.mean.numpy()
        images = {
            label: gtao.ambient_occlusion(g, make(info.radius)).visibility.numpy() for label, make in METHODS.items()
        }
        pixels = np.argwhere(surface)
        pixels = pixels[np.random.default_rng(SEED).choice(len(pixels), N_PIXELS, replace=False)]
        at = tuple(pixels.T)
        limit = heightfield.visibility(as_field(g), pixels, n_rays=N_RAYS, radius=info.radius, seed=SEED)
        knowable = np.abs(limit.visibility - t[at]) < KNOWABLE
        error = (images[DENSE] - t)[at][knowable]
        rows.append(
            {
                "scene": name,
                "solid": info.solid,
                "radius": info.radius,
                "mean_visibility": float(t[surface].mean()),
                "truth_standard_error": rms(np.sqrt(truth.variance.numpy()[surface])),
                "errors": {
                    label: {"rmse": rms((v - t)[surface]), "bias": float((v - t)[surface].mean())}
                    for label, v in images.items()
                },
                "limit_rmse": rms(limit.visibility - t[at]),
                "limit_standard_error": rms(limit.standard_error),
                "knowable_share": float(knowable.mean()),
                "dense_rmse_where_knowable": rms(error),
                "dense_bias_where_knowable": float(error.mean()),
            }
        )
        print(name, {k: v for k, v in rows[-1].items() if k.endswith("knowable")}, flush=True)
    return rows


def normals():
    """Angle between normals derived from depth and the true geometric ones, in degrees."""
    rows = []
    for name in gtao.render.scenes.names("procedural"):
        scene = gtao.render.load_scene(name, resolution=RESOLUTION)
        g = gtao.render.gbuffer(scene, normals="geometric")
        derived = gtao.GBuffer(g.view_z, None, g.camera).normal_v.numpy()
        surface = g.mask.numpy()
        chord = np.linalg.norm(derived - g.normal_v.numpy(), axis=-1)[surface]
        angle = np.degrees(2 * np.arcsin(np.clip(chord / 2, 0, 1)))
        rows.append(
            {
                "scene": name,
                "median": float(np.median(angle)),
                "mean": float(angle.mean()),
                "share_above_5_degrees": float(np.mean(angle > 5)),
            }
        )
    return rows


def degrees_between(a, b):
    """Angles between unit vectors, in degrees; by the chord, which small angles do not cancel in."""
    return np.degrees(2 * np.arcsin(np.clip(np.linalg.norm(a - b, axis=-1) / 2, 0, 1)))


def directions():
    """Bent normals and harmonics of every procedural scene, against the same height field and against the scene."""
    rows = []
    for name in gtao.render.scenes.names("procedural"):
        info = gtao.render.scenes.get(name)
        scene = gtao.render.load_scene(name, resolution=DIRECTIONS_RESOLUTION)
        g = gtao.render.gbuffer(scene)
        march = gtao.HeightfieldRayMarch(
            radius=info.radius, n_directions=64, rays_per_direction=DIRECTIONS_RAYS // 64, directional=True
        )
        marched = gtao.ambient_occlusion(g, march)
        traced = gtao.render.directional(scene, g, info.radius, DIRECTIONS_RAYS, SEED)
        truths = {
            "height field": (marched.visibility, marched.bent_normal, marched.visibility_sh),
            "scene": (traced.visibility, traced.bent_normal, traced.mean),
        }
        estimates = {label: replace(METHODS[label](info.radius), directional=True) for label in DIRECTED}
        averaged = replace(estimates[DENSE], directional=False, bent_normal="average_horizon")
        estimates["average of the horizons"] = averaged
        # Two marches with other random numbers differ by √2 of the noise of one.
        again = gtao.ambient_occlusion(g, replace(march, seed=SEED + 1))
        seen = g.mask.numpy() & (marched.visibility.numpy() > VISIBLE)
        noise = degrees_between(marched.bent_normal.numpy(), again.bent_normal.numpy())[seen].mean() / np.sqrt(2)
        row = {"scene": name, "noise_degrees": float(noise), "errors": {against: {} for against in truths}}
        for label, method in estimates.items():
            ao = gtao.ambient_occlusion(g, method)
            bent, sh = ao.bent_normal.numpy(), None if ao.visibility_sh is None else ao.visibility_sh.numpy()
            for against, truth in truths.items():
                visibility, true_bent, true_sh = (image.numpy() for image in truth)
                seen = g.mask.numpy() & (visibility > VISIBLE)
                found = {"degrees": float(degrees_between(bent, true_bent)[seen].mean())}
                if sh is not None:
                    found["harmonics"] = rms((sh - true_sh)[g.mask.numpy()]) / rms(true_sh[g.mask.numpy()])
                row["errors"][against][label] = found
        rows.append(row)
        print(name, row["errors"]["height field"], flush=True)
    return rows


PARTS = {"directions": directions, "planes": planes, "marching": marching, "scenes": scenes, "normals": normals}


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--part", action="append", choices=PARTS, help="measure only this; the rest is kept")
    parser.add_argument("-o", "--output", type=Path, default=HERE / "record.json")
    options = parser.parse_args()
    numbers = gtao.io.read_record(options.output)["numbers"] if options.part else {}
    for name in options.part or PARTS:
        numbers[name] = PARTS[name]()
    config = {
        "resolution": RESOLUTION,
        "spp": SPP,
        "n_pixels": N_PIXELS,
        "n_rays": N_RAYS,
        "knowable": KNOWABLE,
        "directions": {"resolution": DIRECTIONS_RESOLUTION, "n_rays": DIRECTIONS_RAYS, "visible": VISIBLE},
        "methods": {name: make(1.0).to_dict() for name, make in METHODS.items()},
    }
    record = gtao.io.provenance(["python", "references/validation/run.py"], seed=SEED, config=config)
    record |= {"kind": "validation", "inputs": [], "outputs": [], "numbers": numbers}
    gtao.io.write_record(options.output, record, overwrite=True)


if __name__ == "__main__":
    main()
