"""Options of the way back from a smaller frame are tuned like those of the estimate."""

import pytest
from fit._views import problems

import gtao
from gtao import fit

ESTIMATE = gtao.GTAO(radius=1.0, n_slices=1, n_steps=4, power=1.2)
CASES = {
    "bilateral": (gtao.BilateralUpsample(threshold=0.1), {"upsample.threshold": 0.03}),
    "planes": (gtao.PlaneAwareUpsample(), {"upsample.tolerance": 0.25, "upsample.angle": 0.9}),
}


@pytest.mark.parametrize(("upsample", "target"), CASES.values(), ids=CASES)
def test_gradients_recover_the_options(upsample, target):
    start = gtao.Pipeline(occlusion=ESTIMATE, downsample=gtao.Downsample(), upsample=upsample)
    target = target | {"power": 1.4}
    views = problems(fit.with_continuous(start, target))
    result = fit.tune(views, start, target.keys())
    assert {p.by for p in result.parameters} == {"gradient"}
    # Single precision: images to 1e-7, their squares' roots in the coordinates.
    assert result.values == pytest.approx(target, rel=0.01)
    assert result.loss < 1e-3 * result.start_loss
