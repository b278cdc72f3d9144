"""Sequences in motion: ghosts behind occluders, flicker, and how fast a filter settles after a cut."""

import sys

import variants

import gtao

SEED = 0
#: Directions of each frame's estimate without a past.
BASELINE_DIRECTIONS = 16


def play(name, pipelines, config):
    """Scores of some pipelines over an animation, each frame of which is made once.

    Returns:
        Name of the pipeline -> what :meth:`gtao.evaluate.TemporalScores.result` says, and per frame the "distance" from
        the estimate without a past; the animation.
    """
    animation = gtao.render.animations.build(name, width=config["width"], height=config["height"])
    frames = range(min(config["frames"], animation.n_frames))
    histories = {label: gtao.History() for label in pipelines}
    scores = {label: gtao.evaluate.TemporalScores(config["trail"]) for label in pipelines}
    distances = {label: [] for label in pipelines}
    sequence = gtao.render.sequence(animation, frames, truth_spp=config["spp"], seed=SEED)
    for frame in sequence:
        seen = {"mask": frame.g.mask.numpy(), "motion": frame.g.motion.numpy(), "disoccluded": frame.disoccluded}
        truth, variance = frame.truth.mean.numpy(), frame.truth.variance.numpy()
        baselines = {}
        for label, pipeline in pipelines.items():
            alone = variants.without_past(pipeline, BASELINE_DIRECTIONS)
            if alone not in baselines:
                baselines[alone] = alone.step(frame.g, frame_index=frame.index).visibility.numpy()
            image = pipeline.step(frame.g, histories[label]).visibility.numpy()
            scores[label].add(image, truth, variance, baseline=baselines[alone], **seen)
            distances[label].append(gtao.evaluate.rmse(image, baselines[alone], mask=seen["mask"]))
    print(f"{name}: {len(frames)} frames, {len(pipelines)} pipelines", file=sys.stderr)
    return {label: score.result() | {"distance": distances[label]} for label, score in scores.items()}, animation


def measure(config):
    """Animation -> pipeline -> scores; the one with a cut also says how many frames it takes to settle."""
    numbers = {}
    for name in config["animations"]:
        radius = gtao.render.animations.get(name).radius
        rows, animation = play(name, variants.clamps(radius), config)
        if animation.cut is not None and animation.cut < config["frames"] - 4:
            for row in rows.values():
                row["convergence"] = gtao.evaluate.convergence_frames(row["distance"], animation.cut)
        kept = {label: {k: v for k, v in row.items() if k not in ("bias", "distance")} for label, row in rows.items()}
        numbers[name] = {"radius": radius, "cut": animation.cut, "pipelines": kept}
    return numbers


def measure_windows(config):
    """Animation -> width of the clamp's window -> scores."""
    numbers = {}
    for name in config["animations"]:
        radius = gtao.render.animations.get(name).radius
        rows, _ = play(name, variants.windows(radius, config["widths"]), config)
        numbers[name] = {width: {key: row[key] for key in ("flicker", "ghosting")} for width, row in rows.items()}
    return numbers
