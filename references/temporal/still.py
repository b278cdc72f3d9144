"""A camera at rest: how errors fall with the number of frames, what each stage buys, and what noise patterns do."""

import sys

import numpy as np
import variants

import gtao

SEED = 0


class View:
    """A scene, its ray-traced truth, and what estimates converge to."""

    def __init__(self, name, config):
        info = gtao.render.scenes.get(name)
        self.name, self.radius = name, info.radius
        self.scene = gtao.render.load_scene(name, resolution=config["resolution"])
        self.g = gtao.render.gbuffer(self.scene)
        self.mask = self.g.mask.numpy()
        truth = gtao.render.visibility(self.scene, self.g, self.radius, config["spp"], SEED, bent_normal=False)
        self.truth, self.variance = truth.mean.numpy().astype(float), truth.variance.numpy().astype(float)
        whole = variants.published(self.radius)
        self.limits = {
            "half": variants.limits(self.radius, whole, self.g),
            "full": variants.limits(self.radius, variants.stages(self.radius)["full resolution"], self.g),
        }

    def limits_of(self, pipeline):
        return self.limits["full" if pipeline.downsample is None else "half"]

    def off_truth(self, image):
        return gtao.evaluate.corrected_rmse(image, self.truth, self.variance, mask=self.mask)

    def rmse(self, image, other):
        return gtao.evaluate.rmse(image, other, mask=self.mask)

    def bias(self, image, other):
        return gtao.evaluate.bias(image, other, mask=self.mask)

    def frames(self, pipeline, n):
        """The results of n frames, (H, W) each."""
        history = gtao.History()
        for _ in range(n):
            yield pipeline.step(self.g, history).visibility.numpy().astype(float)

    def curve(self, pipeline, n):
        """Errors of every frame, and flicker once the filter has settled."""
        limits, meter = self.limits_of(pipeline), gtao.evaluate.FlickerMeter()
        found = {"truth": [], "limit": [], "bias": [], "jittered bias": []}
        for k, image in enumerate(self.frames(pipeline, n)):
            found["truth"].append(self.off_truth(image))
            found["limit"].append(self.rmse(image, limits["limit"]))
            found["bias"].append(self.bias(image, limits["limit"]))
            found["jittered bias"].append(self.bias(image, limits["jittered"]))
            if k >= n // 2:
                meter.add(image, mask=self.mask)
        found["flicker"] = meter.result().deviation
        found["slope"], found["slope error"] = gtao.evaluate.drift(found["bias"], min(variants.CYCLE, n - 3))
        return found

    def filtered_limit(self):
        """The limit behind the filters: what is left of errors that no number of frames takes away."""
        whole = variants.published(self.radius)
        alone = variants.without_past(whole, variants.DIRECTIONS)
        frames = [k + parity for k in range(0, variants.CYCLE, 6) for parity in (0, 1)]
        image = variants.mean_of(alone, self.g, frames)
        limit = self.limits["half"]["limit"]
        return {
            "truth": self.off_truth(image),
            "limit": self.rmse(image, limit),
            "bias": self.bias(image, limit),
        }


def measure(config):
    """Scene -> errors of single frames, of limits, and of every variant over the frames."""
    numbers = {}
    for name in config["scenes"]:
        view = View(name, config)
        half = view.limits["half"]
        row = {
            "radius": view.radius,
            "noise": gtao.evaluate.noise_floor(view.variance, mask=view.mask),
            "limits": {
                which: {
                    "truth": view.off_truth(image),
                    "bias to truth": view.bias(image, view.truth),
                    "bias to limit": view.bias(image, half["limit"]),
                    "limit": view.rmse(image, half["limit"]),
                }
                for which, image in half.items()
            },
            "filtered limit": view.filtered_limit(),
            "singles": {},
            "variants": {},
        }
        for label, pipeline in variants.singles(view.radius).items():
            (image,) = view.frames(pipeline, 1)
            limit = view.limits_of(pipeline)["limit"]
            row["singles"][label] = {"truth": view.off_truth(image), "limit": view.rmse(image, limit)}
        for label, pipeline in variants.stages(view.radius).items():
            row["variants"][label] = view.curve(pipeline, config["frames"])
        numbers[name] = row
        ours, single = row["variants"][variants.PUBLISHED], row["singles"]["half resolution"]
        k = min(variants.CYCLE, config["frames"]) - 1
        print(f"{name}: {ours['truth'][k] / single['truth']:.3f}, bias {ours['bias'][k]:+.4f}", file=sys.stderr)
    return numbers


def measure_patterns(config):
    """Scene -> noise pattern -> errors of the unbiased limit after some numbers of frames, and flicker."""
    numbers = {}
    for name in config["scenes"]:
        view = View(name, config)
        numbers[name] = {}
        for label, pipeline in variants.patterns(view.radius).items():
            images = list(view.frames(pipeline, config["frames"]))
            limit = view.limits["half"]["jittered"]
            meter = gtao.evaluate.FlickerMeter()
            for image in images[len(images) // 2 :]:
                meter.add(image, mask=view.mask)
            numbers[name][label] = {
                "limit": [view.rmse(image, limit) for image in images],
                "truth": [view.off_truth(image) for image in images],
                "bias": float(np.mean([view.bias(image, limit) for image in images[len(images) // 2 :]])),
                "flicker": meter.result().deviation,
            }
    return numbers
