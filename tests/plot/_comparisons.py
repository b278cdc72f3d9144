"""Small comparisons with everything in them, made from numbers alone."""

import numpy as np

from gtao import evaluate, plot

H, W = 24, 32


def images(seed=0):
    """Truth, its mask, and three estimates, the second of which is best."""
    generator = np.random.default_rng(seed)
    y, x = np.mgrid[:H, :W]
    truth = 0.5 + 0.4 * np.sin(x / 6) * np.cos(y / 5)
    noise = generator.standard_normal((3, H, W))
    mask = (x - W / 2) ** 2 + (y - H / 2) ** 2 < 13**2
    names = ("first", "second & <best>", "third")
    return truth, mask, {n: truth + s * e + s for n, s, e in zip(names, (0.1, 0.02, 0.2), noise, strict=True)}


def budgets():
    """Two: the steps of the first cancel, those of the second add up."""
    truth, mask, estimates = images()
    layer = truth + 0.3 * (1 - truth)
    return {
        "first": evaluate.error_budget(
            {"truth": truth, "depth layer": layer, "samples": estimates["third"], "heuristic": estimates["first"]},
            variances={"truth": 1e-5},
            mask=mask,
            block=8,
        ),
        "second": evaluate.error_budget(
            {"truth": truth, "depth layer": truth + 0.1, "samples": truth + 0.15, "heuristic": truth + 0.2},
            mask=mask,
            block=8,
        ),
    }


def scene(name="hall", seed=0, groups=("own defaults", "18 taps per pixel"), **changes):
    truth, mask, estimates = images(seed)
    variance = np.full((H, W), 1e-5)
    methods = [
        plot.MethodResult(
            name=label,
            label=label,
            metrics=evaluate.scores(image, truth, variance=variance, mask=mask, perceptual=False),
            group=group,
            taps=18.0,
            milliseconds=1.5 + i,
            visibility=image if group == groups[0] else None,
            settings=f"GTAO(n_slices={i})",
            ours=label == "first",
        )
        for group in groups
        for i, (label, image) in enumerate(estimates.items())
    ]
    position = np.dstack([np.zeros((H, W)), np.zeros((H, W)), np.full((H, W), -2.0)])
    normal = np.broadcast_to((0.0, 0.6, 0.8), (H, W, 3))
    by = evaluate.strata_of(position, normal, truth)
    options = {
        "name": name,
        "radius": 0.5,
        "truth": truth,
        "methods": methods,
        "mask": mask,
        "noise": evaluate.noise_floor(variance, mask=mask),
        "limit_rmse": 0.05,
        "budgets": budgets(),
        "curves": {label: [(6, 0.2), (18, 0.1)] for label in estimates},
        "deviations": {"engine": [("published", 0.1), ("power", 0.12)]},
        "strata": {
            label: evaluate.stratify(image, truth, by=by, mask=mask, variance=variance)
            for label, image in estimates.items()
        },
        "notes": ("One note.",),
    }
    return plot.SceneComparison(**(options | changes))
