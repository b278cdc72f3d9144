"""Options of spatial filters are tuned like those of the estimate before them, on any frame of the noise."""

from dataclasses import replace

import numpy as np
import pytest
from fit._views import frame, image, problems

import gtao
from gtao import fit

NOISY = gtao.GTAO(radius=1.0, n_slices=1, n_steps=4, power=1.2)
#: Filter to begin with, and the options that the truth is made with.
CASES = {
    "bilateral": (gtao.SpatialFilter(threshold=0.1), {"spatial.threshold": 0.03}),
    "bilateral, planar": (gtao.SpatialFilter(derivatives="first", planar=True), {"spatial.threshold": 0.04}),
    "planes": (gtao.PlaneAwareFilter(tolerance=0.5), {"spatial.tolerance": 1.3}),
    "planes, even": (gtao.PlaneAwareFilter(size=4, fit="constant"), {"spatial.tolerance": 0.9}),
    "edge-aware": (
        gtao.EdgeAwareFilter(quantised_edges=False),
        {"spatial.beta": 0.5, "spatial.edge_threshold": 0.03, "spatial.diagonal_weight": 0.7},
    ),
}
every_case = pytest.mark.parametrize(("spatial", "target"), CASES.values(), ids=CASES)


@every_case
@pytest.mark.parametrize("k", [0, 3])
def test_gradients_recover_the_options_of_a_filter(spatial, target, k):
    """With the estimate's own along, and on an odd frame, which even footprints lie otherwise on."""
    start = gtao.Pipeline(occlusion=NOISY, spatial=spatial)
    target = target | {"power": 1.4}
    views = problems(fit.with_continuous(start, target), frames=(k,))
    result = fit.tune(views, start, target.keys(), frames=(k,))
    assert {p.by for p in result.parameters} == {"gradient"}
    # Single precision, as for options of estimates: images to 1e-7, their squares' roots in the coordinates.
    assert result.values == pytest.approx(target, rel=0.01)
    assert result.loss < 1e-3 * result.start_loss
    assert getattr(result.method.spatial, next(iter(target)).partition(".")[2]) == next(iter(result.values.values()))


@pytest.mark.parametrize("spatial", [gtao.SpatialFilter(), gtao.PlaneAwareFilter(size=4, fit="constant")])
def test_the_parity_of_the_frame_is_part_of_the_fit(spatial):
    """What an even footprint makes of one frame it cannot make of its neighbour."""
    start = gtao.Pipeline(occlusion=replace(NOISY, noise="none"), spatial=spatial)
    views = problems(start, frames=(1,))
    name = "spatial.threshold" if isinstance(spatial, gtao.SpatialFilter) else "spatial.tolerance"
    losses = [fit.tune(views, start, [name], frames=(k,)).loss for k in (1, 0)]
    assert losses[0] < 1e-9 < 1e-5 < losses[1]


@pytest.mark.parametrize(
    ("spatial", "path", "bounds"),
    [
        (gtao.SpatialFilter(threshold=0.3, derivatives="none"), "spatial.threshold", (0.002, 0.5)),
        (gtao.PlaneAwareFilter(tolerance=3.0), "spatial.tolerance", (0.1, 5.0)),
        (gtao.EdgeAwareFilter(edge_threshold=0.2, quantised_edges=False), "spatial.edge_threshold", (5e-4, 0.5)),
    ],
)
def test_the_optimum_for_noisy_frames_is_found(spatial, path, bounds):
    """Between noise and blur, where the truth is no filtered image: what a scan of the loss finds."""
    frames = (0, 1)
    dense = replace(NOISY, n_slices=32, noise="none")
    views = [fit.Problem(name=f"{seed}", g=g, truth=image(g, dense)) for seed, g in ((s, frame(s)) for s in range(2))]
    start = gtao.Pipeline(occlusion=NOISY, spatial=spatial)

    def loss(value):
        method = fit.with_options(start, {path: float(value)})
        errors = [image(v.g, method, k) - v.truth for v in views for k in frames]
        surfaces = [v.g.mask.numpy().astype(bool) for v in views for _ in frames]
        return np.mean([np.mean(e[s] ** 2) for e, s in zip(errors, surfaces, strict=True)])

    result = fit.tune(views, start, {path: bounds}, frames=frames)
    scanned = {value: loss(value) for value in np.geomspace(*bounds, 13)}
    best = min(scanned, key=scanned.__getitem__)
    assert result.loss == pytest.approx(loss(result.values[path]), rel=1e-4)
    # No worse than the best of the scan by more than the scan's own steps leave open.
    assert result.loss < 1.002 * scanned[best]
    assert bounds[0] < best < bounds[1]
    assert result.loss < 0.95 * result.start_loss
