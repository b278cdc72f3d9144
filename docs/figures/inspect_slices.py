"""Make ``slices.png`` and ``weights.png``: what a method and a filter look at for one pixel of an embedded scene.

python docs/figures/inspect_slices.py
"""

from pathlib import Path

import gtao

HERE = Path(__file__).resolve().parent
SCENE, RESOLUTION, X, Y = "arcade", 96, 40, 62


def main():
    g = gtao.render.gbuffer(gtao.render.load_scene(SCENE, resolution=RESOLUTION))
    method = gtao.GTAO(radius=gtao.render.scenes.get(SCENE).radius, n_slices=4, n_steps=8)
    figures = {
        "slices": gtao.plot.slices(gtao.inspect_slices(g, method, X, Y), g),
        "weights": gtao.plot.filter_weights(gtao.filter_weights(g, gtao.SpatialFilter(), X, Y), g),
    }
    for name, figure in figures.items():
        with gtao.io.atomic_path(HERE / f"{name}.png") as path:
            figure.savefig(path, format="png", dpi=90, metadata={"Software": None})


if __name__ == "__main__":
    main()
