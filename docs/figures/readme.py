"""Make ``readme.png``: estimate, ray-traced truth and signed error of an embedded scene.

python docs/figures/readme.py
"""

from pathlib import Path

import gtao

from matplotlib.figure import Figure  # isort: skip

SCENE, RESOLUTION, SPP = "stairs", 384, 1024


def main():
    scene = gtao.render.load_scene(SCENE, resolution=RESOLUTION)
    radius = gtao.render.scenes.get(SCENE).radius
    g = gtao.render.gbuffer(scene)
    estimate = gtao.ambient_occlusion(g, gtao.GTAO(radius=radius, n_slices=8, n_steps=16, fetch="linear"))
    truth = gtao.render.visibility(scene, g, radius, SPP, bent_normal=False)
    v, t = estimate.visibility.numpy(), truth.mean.numpy()
    surface = g.mask.numpy()
    rmse = gtao.evaluate.rmse(v, t, mask=surface)
    bias = gtao.evaluate.bias(v, t, mask=surface)

    figure = Figure(figsize=(12.6, 4.5), layout="constrained")
    axes = figure.subplots(1, 3)
    axes[0].imshow(v, cmap="gray", vmin=0, vmax=1)
    axes[0].set_title("gtao: 8 × 16 samples of the depth buffer")
    axes[1].imshow(t, cmap="gray", vmin=0, vmax=1)
    axes[1].set_title(f"ray-traced truth, {SPP} rays per pixel")
    image = axes[2].imshow(v - t, cmap="RdBu_r", vmin=-0.3, vmax=0.3)
    axes[2].set_title(f"error: RMSE {rmse:.3f}, bias {bias:+.3f}")
    for axis in axes:
        axis.set_axis_off()
    figure.colorbar(image, ax=axes[2], shrink=0.85)
    path = Path(__file__).with_suffix(".png")
    with gtao.io.atomic_path(path) as partial:
        figure.savefig(partial, format="png", dpi=90, metadata={"Software": None})


if __name__ == "__main__":
    main()
