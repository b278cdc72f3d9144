"""Shade a textured scene as a renderer in real time would, beside Mitsuba's path tracer, and write ``record.json``.

    python references/shading/run.py            # less than a minute on two cores
    python references/shading/run.py --quick -o out/shading-quick

Every variant is (1 - F) ρ/π E + F S L (Jimenez et al. 2016, Eq. 4) of a G-buffer, with light from a pre-filtered map,
and differs in what occludes E and L. The path tracer renders the very same surfaces, ``gtao.render.coated``, so that
all differences come from visibility, the split of the integral, and light between surfaces.
``docs/howto/specular.md`` shows the picture and the numbers.
"""

import argparse
from pathlib import Path

import mitsuba as mi
import numpy as np
from PIL import Image
from scene import sky, yard

import gtao

HERE = Path(__file__).resolve().parent

#: Shading is done for FINE² points of each pixel, as the path tracer spreads its own over it.
FULL = {"width": 240, "height": 160, "fine": 2, "spp": 1024, "traced_spp": 128, "n_slices": 16, "n_steps": 32}
QUICK = {"width": 48, "height": 32, "fine": 2, "spp": 16, "traced_spp": 16, "n_slices": 4, "n_steps": 8}
#: Depth of paths: light straight from the sky, and light from other surfaces too.
DIRECT, WHOLE = 2, 8
SEED = 0
PICTURE = "comparison.png"

#: Methods of specular occlusion by name; None: nothing is occluded.
METHODS = {
    "no occlusion": None,
    "visibility": gtao.VisibilityAsSpecular(),
    "Lagarde 2014": gtao.Lagarde2014(),
    "two cones": gtao.ConeCone(),
    "GTSO": gtao.ConeTable(),
}
#: Name -> (occlusion of diffuse light, method of specular occlusion).
VARIANTS = {name: ("open" if method is None else "visibility", method) for name, method in METHODS.items()}
VARIANTS["visibility, diffuse only"] = ("visibility", None)
VARIANTS["GTSO, directional"] = ("directional", METHODS["GTSO"])
SHOWN = ("no occlusion", "Lagarde 2014", "GTSO", "GTSO, directional")


class Frame:
    """What a renderer in real time knows of a frame: G-buffer, light, an estimate."""

    def __init__(self, config):
        self.fine = config["fine"]
        size = config["width"] * self.fine, config["height"] * self.fine
        self.environment = sky()
        self.scene = yard(self.environment, *size)
        self.g = gtao.render.gbuffer(self.scene)
        look = {show: gtao.render.gbuffer(yard(self.environment, *size, show=show)) for show in ("roughness", "f0")}
        self.roughness, self.f0 = look["roughness"].albedo.numpy()[..., 0], look["f0"].albedo.numpy()
        rotation = gtao.render.view_to_world(self.scene)
        probe = gtao.lighting.prefilter(self.environment)
        self.light = probe.lookup(gtao.reflected_directions(self.g, rotation), self.roughness)
        # The roughest level is irradiance over π.
        self.irradiance = np.pi * probe.lookup(self.g.normal_v.numpy() @ rotation[:3, :3].T, 1.0)
        options = {"n_slices": config["n_slices"], "n_steps": config["n_steps"], "bent_normal": True}
        self.ao = gtao.ambient_occlusion(self.g, gtao.GTAO(weighting="uniform", **options))
        cosine = gtao.ambient_occlusion(self.g, gtao.GTAO(directional=True, **options))
        sh = gtao.lighting.to_view(self.environment.project(2), rotation)
        self.directional = np.maximum(gtao.irradiance(sh, self.g, cosine).numpy(), 0)
        self.open = gtao.AmbientOcclusion(visibility=self.g.types.Tensor(np.ones(self.g.shape, np.float32)))

    def shaded(self, diffuse, method, bounces):
        """A variant, (H, W, 3): the mean of the points of every pixel."""
        visibility = self.ao.cosine_visibility.numpy()[..., None]
        many = gtao.multibounce(self.ao.cosine_visibility, self.g.albedo).numpy() if bounces else visibility
        E = {
            "open": self.irradiance,
            "visibility": self.irradiance * many,
            # Bounces raise directional irradiance by the factor by which they raise visibility.
            "directional": self.directional * many / np.maximum(visibility, 1e-3),
        }[diffuse]
        ao, method = self._estimate(method)
        image = gtao.shade(ao, self.g, E, self.light, self.roughness, self.f0, method=method, fit=None)
        return self.pixels(image)

    def glossy(self, method):
        """The specular part of a variant, (H, W, 3)."""
        ao, method = self._estimate(method)
        S = gtao.specular_occlusion(ao, self.g, self.roughness, self.f0, method)
        return self.pixels(gtao.specular_radiance(S, self.light, self.g, self.roughness, self.f0))

    def _estimate(self, method):
        return (self.open, gtao.VisibilityAsSpecular()) if method is None else (self.ao, method)

    def pixels(self, image):
        image = np.asarray(image.numpy() if hasattr(image, "numpy") else image, dtype=np.float64)
        height, width = image.shape[0] // self.fine, image.shape[1] // self.fine
        return image.reshape(height, self.fine, width, self.fine, -1).mean((1, 3))


def error(image, truth, where):
    """Root mean square difference over the mean of the truth, where there are surfaces only."""
    return float(np.sqrt(np.mean((image - truth)[where] ** 2)) / truth[where].mean())


def traced_composites(frame, config):
    """Composites of the slides for the specular part, of visibility that is traced, and what they approximate."""
    options = {"roughness": frame.roughness, "spp": config["traced_spp"], "environment": frame.environment}
    exact = gtao.render.specular(frame.scene, frame.g, f0=frame.f0, **options)
    factors = gtao.render.split_integrals(frame.scene, frame.g, **options)
    split = (frame.g, frame.roughness, frame.f0)
    above = np.maximum(factors.above.mean.numpy(), 1e-3)
    visible, lit = factors.visibility.mean.numpy() / above, factors.radiance.mean.numpy() / above[..., None]
    images = {
        "two splits, traced": gtao.specular_radiance(1.0, lit, *split),
        "three splits, traced": gtao.specular_radiance(visible, frame.light, *split),
        "GTSO, traced": gtao.specular_radiance(exact.occlusion.mean, frame.light, *split),
    }
    return {name: frame.pixels(image) for name, image in images.items()}, frame.pixels(exact.radiance.mean)


def path_traced(frame, config, depth):
    """The mean of two renderings, and their noise."""
    scene = yard(frame.environment, config["width"], config["height"], depth)
    first, second = (mi.render(scene, spp=config["spp"], seed=SEED + k).numpy().astype(float) for k in range(2))
    return (first + second) / 2, (first - second) / 2


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=HERE, help="directory for the record and the picture")
    parser.add_argument("--quick", action="store_true", help="small and noisy, to see every part run")
    options = parser.parse_args()
    config = FULL | (QUICK if options.quick else {})
    # Before anything is written: outputs may be files of the repository.
    record = gtao.io.provenance(["python", "references/shading/run.py"], seed=SEED, config=config)
    frame = Frame(config)
    where = frame.pixels(frame.g.mask)[..., 0] == 1
    metal = frame.pixels(frame.f0)[..., 0] > 0.5
    numbers, shown, titles = {}, [], []
    for name, depth in (("direct", DIRECT), ("with bounces", WHOLE)):
        truth, noise = path_traced(frame, config, depth)
        images = {variant: frame.shaded(*parts, depth > DIRECT) for variant, parts in VARIANTS.items()}
        numbers[name] = {variant: error(image, truth, where) for variant, image in images.items()}
        numbers[name]["noise of the path tracer"] = error(truth + noise, truth, where)
        shown += [truth, *(images[variant] for variant in SHOWN)]
        titles += [f"path tracing, {name}", *(f"{variant}: {numbers[name][variant]:.2f}" for variant in SHOWN)]
    composites, exact = traced_composites(frame, config)
    composites = {name: frame.glossy(method) for name, method in METHODS.items()} | composites
    for name, region in (("specular part of metals", metal), ("specular part of coats", where & ~metal)):
        numbers[name] = {method: error(image, exact, region) for method, image in composites.items()}
    for name, values in numbers.items():
        print(name, *(f"  {key}: {value:.3f}" for key, value in values.items()), sep="\n")
    options.output.mkdir(parents=True, exist_ok=True)
    path = options.output / PICTURE
    gtao.plot.image_row(shown, titles, limits=(0, 1.25), columns=1 + len(SHOWN)).savefig(path, dpi=90)
    with Image.open(path) as picture:
        picture.convert("RGB").quantize(256).save(path, optimize=True)
    record |= {"kind": "shading beside a path tracer", "inputs": [], "numbers": numbers}
    record["outputs"] = [gtao.io.file_entry(path, options.output)]
    gtao.io.write_record(options.output / "record.json", record, overwrite=True)


if __name__ == "__main__":
    main()
