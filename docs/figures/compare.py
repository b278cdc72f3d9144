"""Make ``compare.png``: an embedded scene by XeGTAO's preset and by the recommended one beside ray-traced truth.

python docs/figures/compare.py
"""

from pathlib import Path

import gtao

from matplotlib.figure import Figure  # isort: skip

SCENE, RESOLUTION, SPP = "machinery", 320, 1024
SHOWN = ("xegtao-high", "recommended")
#: Error at the ends of the scale.
LIMIT = 0.4


def bars(axis, errors):
    """RMSE of all methods, the lowest on top."""
    names = sorted(errors, key=errors.__getitem__, reverse=True)
    colours = ["#0072B2" if name in SHOWN else "0.75" for name in names]
    axis.barh(names, [errors[name] for name in names], 0.7, color=colours)
    for i, name in enumerate(names):
        axis.text(errors[name], i, f" {errors[name]:.3f}", va="center", fontsize=7)
    axis.tick_params(length=0, labelsize=7)
    axis.set_xticks([])
    axis.set_xlim(0, 1.18 * max(errors.values()))
    axis.spines[:].set_visible(False)
    axis.set_title("RMSE against the truth", fontsize=10)


def main():
    scene = gtao.render.load_scene(SCENE, resolution=RESOLUTION)
    radius = gtao.render.scenes.get(SCENE).radius
    g = gtao.render.gbuffer(scene)
    truth = gtao.render.visibility(scene, g, radius, SPP, bent_normal=False)
    t, surface = truth.mean.numpy(), g.mask.numpy()
    images = {name: gtao.config.named(name, radius).step(g).visibility.numpy() for name in gtao.config.NAMED}
    errors = {name: gtao.evaluate.rmse(image, t, mask=surface) for name, image in images.items()}

    height, width = t.shape
    figure = Figure(figsize=(9.6, 6.4 * height / width + 0.8), layout="constrained")
    grid = figure.subplots(2, 3)
    shown = {"ray-traced truth": t} | {name: images[name] for name in SHOWN}
    for axis, (name, image) in zip(grid[0], shown.items(), strict=True):
        axis.imshow(image, cmap="gray", vmin=0, vmax=1)
        axis.set_title(name, fontsize=10)
        axis.set_axis_off()
    for axis, name in zip(grid[1, 1:], SHOWN, strict=True):
        signed = axis.imshow(images[name] - t, cmap="RdBu_r", vmin=-LIMIT, vmax=LIMIT)
        axis.set_title(f"error: RMSE {errors[name]:.3f}", fontsize=10)
        axis.set_axis_off()
    figure.colorbar(signed, ax=grid[1, 1:], location="bottom", shrink=0.6, aspect=40)
    bars(grid[1, 0], errors)
    with gtao.io.atomic_path(Path(__file__).with_suffix(".png")) as path:
        figure.savefig(path, format="png", dpi=90, metadata={"Software": None})


if __name__ == "__main__":
    main()
