"""The numbers of ``gtao.Pipeline.recommended(radius, temporal=True)``, chosen on the embedded animations.

    python fits/temporal/2026-11/run.py -o DIR

One slice of the recommended bitmask per frame, its filter, and a temporal filter whose options are searched one after
the other: by how much normals and depths may differ, the neighbourhood clamp, the convergence time, the noise. The
score is the mean logarithm of the error against ray-traced truth, over animations and, where shadows move, their
trails, from frame FIRST on. Values are listed by preference: taken is the first whose error is within a share of GAIN
of the least.

Beside the result stand the single frame of three slices, one slice without history, half resolution and the published
pipeline. Records are not edited: run into another directory to repeat it.
"""

import argparse
import hashlib
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

import gtao
from gtao import evaluate, io, render

RESOLUTION, N_FRAMES, FIRST, SPP, SEED = 160, 24, 8, 128, 0
AT_REST = "still"
#: Animations in which shadows move over what stands still: the trails of so many frames behind them count besides.
TRAILS, TRAIL = ("passing_object", "thin_bars"), 12
ANIMATIONS = (AT_REST, "orbit", "passing_object", "thin_bars", "fast_rotation", "waves")

#: Less is not worth a narrower tolerance, a weaker clamp, another convergence time or other noise than the slides'.
GAIN = 0.005
START = {"crease": None, "tolerance": 0.05, "window": (0.5, 0.0), "frames": 24, "noise": "spatial_4x4"}
#: Options in the order in which they are searched; windows are those of ranges and of deviations, None is no clamp.
SEARCH = {
    "crease": (None, 1.0, 0.5, 0.25, 0.1),
    "tolerance": (0.05, 0.02, 0.01, 0.005, 0.0025),
    "window": (
        (0.0, 0.0),
        (0.0, 0.5),
        (0.25, 0.0),
        (0.0, 1.0),
        (0.5, 0.0),
        (0.25, 1.0),
        (0.5, 1.0),
        (1.0, 0.0),
        (0.0, 2.0),
        (0.25, 2.0),
        None,
    ),
    "frames": (24, 12, 48, 6),
    "noise": (
        "spatial_4x4",
        "spatial_4x4_fine",
        "spatial_4x4_spread",
        "interleaved_gradient",
        "interleaved_gradient_cycled",
        "interleaved_gradient_golden",
        "hilbert_r2",
        "blue_noise",
        "sobol",
    ),
}


def temporal(crease, tolerance, window, frames):
    clamp = {"clamp": False} if window is None else dict(zip(("clamp_window", "deviation_window"), window, strict=True))
    moving = min(frames, gtao.TemporalFilter().moving_frames)
    depth = {"disocclusion": tolerance, "covering": tolerance}
    return gtao.TemporalFilter(crease=crease, frames=frames, moving_frames=moving, **depth, **clamp)


def pipeline(radius, noise, n_slices=1, **options):
    """The recommended pipeline with fewer slices, and with a history where there are options for it."""
    whole = gtao.Pipeline.recommended(radius)
    occlusion = replace(whole.occlusion, n_slices=n_slices, noise=noise)
    return replace(whole, occlusion=occlusion, temporal=temporal(**options) if options else None)


def sequences():
    """Name -> radius and, for each frame, it, traced truth, its variance, its trail; and what a record says of them."""
    found, inputs = {}, []
    for name in ANIMATIONS:
        animation = render.animations.build(name, width=RESOLUTION, height=RESOLUTION)
        frames, tracker = [], evaluate.TrailTracker(TRAIL, shared_noise=True)
        for frame in render.sequence(animation, frames=range(N_FRAMES), truth_spp=SPP, seed=SEED):
            truth, variance = frame.truth.mean.numpy(), frame.truth.variance.numpy()
            trail = tracker.add(truth, variance, motion=frame.g.motion.numpy()) != 0
            frames.append((frame.g, truth, variance, trail))
        depth = frames[-1][0].view_z.numpy().tobytes()
        inputs.append({"path": f"embedded:{name}", "sha256": hashlib.sha256(depth).hexdigest(), "animation": name})
        found[name] = animation.radius, frames
        print(name, file=sys.stderr, flush=True)
    return found, inputs


def images(method, frames):
    """Visibility frame after frame."""
    history = gtao.History()
    for g, *_ in frames:
        yield method.step(g, history).visibility.numpy().astype(np.float64)


def errors(make, found):
    """Animation -> root mean square error over the frames from FIRST on, without the noise of the truth.

    Of the animations in TRAILS also that within the trail.
    """
    rows = {}
    for name, (radius, frames) in found.items():
        whole, behind = [], []
        for image, (g, truth, variance, trail) in list(zip(images(make(radius), frames), frames, strict=True))[FIRST:]:
            squares, mask = np.square(image - truth) - variance, g.mask.numpy()
            whole.append(squares[mask].mean())
            behind.append(squares[mask & trail])
        rows[name] = root(np.mean(whole))
        if name in TRAILS:
            rows[f"{name}, trail"] = root(np.concatenate(behind).mean())
    return rows


def root(square):
    return float(np.sqrt(max(square, 0)))


def restlessness(make, found):
    """Root mean square change from frame to frame where nothing moves, from frame FIRST on."""
    radius, frames = found[AT_REST]
    shown = list(images(make(radius), frames))[FIRST:]
    mask = frames[0][0].mask.numpy()
    return float(np.sqrt(np.mean([np.square(b - a)[mask] for a, b in pairwise(shown)])))


def score(rows):
    return float(np.mean(np.log(list(rows.values()))))


def searched(found):
    """The chosen options, and every score on the way."""
    chosen, steps = dict(START), {}
    for option, values in SEARCH.items():
        steps[option] = {}
        for value in values:
            options = chosen | {option: value}
            steps[option][str(value)] = score(errors(lambda radius, o=options: pipeline(radius, **o), found))
        enough = min(steps[option].values()) + np.log1p(GAIN)
        chosen[option] = next(value for value in values if steps[option][str(value)] <= enough)
        print(option, steps[option], chosen[option], file=sys.stderr, flush=True)
    return chosen, steps


def beside(chosen):
    """What the result is compared with: name -> function of the radius."""
    noise = chosen["noise"]
    small = {"downsample": gtao.Downsample(), "upsample": gtao.PlaneAwareUpsample()}
    return {
        "one slice, history": lambda radius: pipeline(radius, **chosen),
        "two slices, history": lambda radius: pipeline(radius, n_slices=2, **chosen),
        "one slice, history, half resolution": lambda radius: replace(pipeline(radius, **chosen), **small),
        "one slice, history as in the slides": lambda radius: replace(
            pipeline(radius, noise), temporal=gtao.TemporalFilter()
        ),
        "one slice": lambda radius: pipeline(radius, noise),
        "three slices": gtao.Pipeline.recommended,
        "published": gtao.Pipeline.as_published,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="directory for the record")
    path = parser.parse_args().output / "record.json"
    if path.exists():
        parser.error(f"{path} exists, and records are not overwritten; choose another directory")
    found, inputs = sequences()
    chosen, steps = searched(found)
    methods = beside(chosen)
    compared = {name: errors(make, found) for name, make in methods.items()}
    flicker = {name: restlessness(make, found) for name, make in methods.items()}
    numbers = {"chosen": chosen, "scores": steps, "order": list(methods), "rmse": compared, "flicker": flicker}
    config = {
        "resolution": RESOLUTION,
        "n_frames": N_FRAMES,
        "first": FIRST,
        "spp": SPP,
        "gain": GAIN,
        "trail": TRAIL,
        "animations": list(ANIMATIONS),
        "start": START,
        "search": {name: list(values) for name, values in SEARCH.items()},
    }
    record = io.provenance(["python", "fits/temporal/2026-11/run.py"], seed=SEED, config=config)
    record |= {"kind": "temporal pipeline", "inputs": inputs, "outputs": [], "numbers": numbers}
    io.write_record(path, record)
    for name, rows in compared.items():
        print(f"{name:36}", *(f"{value:.4f}" for value in (*rows.values(), flicker[name])))


if __name__ == "__main__":
    main()
