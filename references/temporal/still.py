"""A camera at rest: how errors fall with the number of frames, what each stage buys, and what noise patterns do."""

import sys

import variants

import gtao

SEED = 0
#: Numbers of frames that curves keep.
KEPT = (1, 2, 3, 4, 6, 8, 12, 18, 24, 36, 48)


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
        self._limits = {}

    def limits_of(self, pipeline):
        """Limits of a pipeline's estimate, at its resolution and brought back to full size as it does."""
        key = pipeline.occlusion, pipeline.downsample, pipeline.upsample
        if key not in self._limits:
            self._limits[key] = variants.limits(pipeline, self.g)
        return self._limits[key]

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

    def curve(self, pipeline, n, limits):
        """Errors after the frames that are kept, against the truth and some limits, and flicker in the second half."""
        meter = gtao.evaluate.FlickerMeter()
        found = {"truth": {}} | {key: {"rmse": {}, "bias": {}} for key in limits}
        for k, image in enumerate(self.frames(pipeline, n), 1):
            if k > n // 2:
                meter.add(image, mask=self.mask)
            if k in KEPT:
                found["truth"][str(k)] = self.off_truth(image)
                for key in limits:
                    limit = self.limits_of(pipeline)[key]
                    found[key]["rmse"][str(k)] = self.rmse(image, limit)
                    found[key]["bias"][str(k)] = self.bias(image, limit)
        found["flicker"] = meter.result().deviation
        return found

    def cycles(self, pipeline, n):
        """Bias in the last frame of each cycle of the slides' tables, and its mean over the cycle."""
        limit, found = self.limits_of(pipeline)["limit"], []
        for image in self.frames(pipeline, n * variants.CYCLE):
            found.append(self.bias(image, limit))
        cycles = [found[k : k + variants.CYCLE] for k in range(0, len(found), variants.CYCLE)]
        return {"last": [cycle[-1] for cycle in cycles], "mean": [sum(cycle) / len(cycle) for cycle in cycles]}

    def filtered_limit(self):
        """The limit behind the filters: what is left of errors that no number of frames takes away."""
        whole = variants.published(self.radius)
        alone = variants.without_past(whole, variants.DIRECTIONS)
        frames = [k + parity for k in range(0, variants.CYCLE, 6) for parity in (0, 1)]
        image = variants.mean_of(alone, self.g, frames)
        limit = self.limits_of(whole)["limit"]
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
        whole = variants.published(view.radius)
        half = view.limits_of(whole)
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
            row["variants"][label] = view.curve(pipeline, config["frames"], ("limit", "jittered"))
        row["cycles"] = {
            label: view.cycles(variants.stages(view.radius)[label], config["cycles"])
            for label in (variants.PUBLISHED, "no clamp")
        }
        numbers[name] = row
        ours, single = row["variants"][variants.PUBLISHED], row["singles"]["half resolution"]
        k = str(variants.CYCLE)
        print(
            f"{name}: {ours['truth'][k] / single['truth']:.3f}, bias {ours['limit']['bias'][k]:+.4f}", file=sys.stderr
        )
    return numbers


def measure_patterns(config):
    """Scene -> "clamp" or "no clamp" -> noise pattern -> errors over the frames, and flicker."""
    numbers = {}
    for name in config["scenes"]:
        view = View(name, config)
        numbers[name] = {}
        for clamp in (True, False):
            rows = numbers[name]["clamp" if clamp else "no clamp"] = {}
            for label, pipeline in variants.patterns(view.radius, clamp).items():
                rows[label] = view.curve(pipeline, config["frames"], ("jittered",))
    return numbers
