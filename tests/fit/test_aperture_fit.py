"""The fit of the reflection cone's aperture finds what was planted."""

import json
import math

import numpy as np
import pytest

import gtao
from gtao import fit
from gtao.fit import apertures as module


def share(alpha_v, alpha_s, beta):
    """Smooth stand-in for two cones: all that matters here is that it falls with the aperture in a known way."""
    return 1 / (1 + np.exp((beta - alpha_v) / (0.2 * alpha_s + 1e-3)))


def samples(u, *, n_scenes=4, roughness=(0.4, 0.7), noise=0.0, seed=0, side=24):
    """``u`` is a number, or a function of scene and roughness."""
    generator = np.random.default_rng(seed)
    found = []
    for scene in range(n_scenes):
        y, x = np.mgrid[:side, :side] / side
        alpha_v, beta = 0.4 + 0.8 * x, 1.5 * (y + 0.05 * scene)
        for r in roughness:

            def image(value, r=r, alpha_v=alpha_v, beta=beta):
                return share(alpha_v, math.acos(value ** (r**4 / 2)), beta)

            truth = image(u(scene, r) if callable(u) else u) + noise * generator.normal(size=(side, side))
            found.append(
                fit.ApertureSample(
                    scene=f"s{scene}",
                    view=f"s{scene}",
                    roughness=r,
                    truth=truth,
                    mask=np.ones((side, side), bool),
                    occlusion=image,
                    rivals={"same": truth, "none": np.ones_like(truth)},
                )
            )
    return found


@pytest.mark.parametrize("metric", ["dssim", "rmse"])
@pytest.mark.parametrize("u", [0.3, 0.01, 1e-4])
def test_a_planted_aperture_is_found(u, metric):
    found = fit.aperture(samples(u), metric=metric, n_bootstrap=0)
    # RMSE has a kink where it is 0: the spline through tabulated points rounds it off, to a fraction of their distance.
    spacing = math.log(module.KAPPA[1] / module.KAPPA[0])
    assert math.log(-math.log(found.best.u)) == pytest.approx(math.log(-math.log(u)), abs=spacing / 3)
    assert found.best.score < 0.03
    assert not found.best.at_bound
    assert found.exponent == pytest.approx(-math.log2(found.best.u) / 2)
    if u == module.PUBLISHED_U:
        assert found.best.published == pytest.approx(found.best.score, abs=2e-3)
    else:
        assert found.best.published > found.best.score
    assert found.interval is None


def test_roughness_by_roughness():
    planted = {0.4: 0.1, 0.7: 1e-3}
    found = fit.aperture(samples(lambda _, r: planted[r]), n_bootstrap=0)
    for r, u in planted.items():
        assert math.log(-math.log(found.by_roughness[r].u)) == pytest.approx(math.log(-math.log(u)), abs=0.07)
    assert planted[0.7] < found.best.u < planted[0.4]


def test_every_scene_counts_once():
    """More views of one scene do not weigh more than those of another."""
    few = samples(lambda s, _: 0.2 if s == 0 else 1e-3, n_scenes=2)
    many = [one for one in few if one.scene == "s0"] * 5 + [one for one in few if one.scene == "s1"]
    a, b = (fit.aperture(given, n_bootstrap=0) for given in (few, many))
    assert a.best.u == pytest.approx(b.best.u, rel=1e-9)
    assert a.rivals == pytest.approx(b.rivals)


def test_the_interval_holds_what_was_planted_and_grows_with_the_scatter_of_scenes():
    planted = [0.05, 0.02, 0.01, 0.005, 0.002]
    scattered = fit.aperture(samples(lambda s, _: planted[s], n_scenes=5), n_bootstrap=400)
    low, high = scattered.interval
    assert low < 0.01 < high
    alike = fit.aperture(samples(0.01, n_scenes=5, noise=0.02), n_bootstrap=400)
    assert scattered.standard_error > 3 * alike.standard_error
    again = fit.aperture(samples(lambda s, _: planted[s], n_scenes=5), n_bootstrap=400)
    assert again.to_dict() == scattered.to_dict()


def test_scenes_left_out_are_scored_by_the_others():
    found = fit.aperture(samples(lambda s, _: 0.3 if s == 0 else 0.003, n_scenes=3), n_bootstrap=0)
    others = fit.aperture(samples(0.003, n_scenes=3)[2:], n_bootstrap=0)
    assert found.left_out["s0"].u == pytest.approx(others.best.u, rel=1e-9)
    own = fit.aperture(samples(0.3, n_scenes=1), n_bootstrap=0)
    assert found.left_out["s0"].score > own.best.score
    assert found.left_out["s0"].published < found.left_out["s0"].score


def test_rivals_are_scored_like_the_rest():
    found = fit.aperture(samples(0.01), n_bootstrap=0)
    assert found.rivals["same"] == pytest.approx(0, abs=1e-12)
    assert found.rivals["none"] > 0.05


def test_the_end_of_the_search_is_told():
    found = fit.aperture(samples(0.999), n_bootstrap=0)
    assert found.best.at_bound
    assert found.best.u == pytest.approx(math.exp(-module.KAPPA[0]))


def test_plain_values():
    found = fit.aperture(samples(0.01, n_scenes=3), n_bootstrap=50)
    plain = json.loads(json.dumps(found.to_dict()))
    assert plain["best"]["u"] == found.best.u
    assert len(plain["curves"]) == 6
    assert plain["interval"] == list(found.interval)


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"metric": "psnr"}, gtao.ConfigError, "dssim, rmse"),
        ({"n_bootstrap": -1}, gtao.ConfigError, "n_bootstrap"),
    ],
)
def test_bad_options(options, error, words):
    with pytest.raises(error, match=words):
        fit.aperture(samples(0.01, n_scenes=1), **options)


def test_bad_samples():
    with pytest.raises(gtao.FitError, match="nothing to fit"):
        fit.aperture([])
    (one,) = samples(0.01, n_scenes=1, roughness=(0.5,))
    broken = fit.ApertureSample(**{**vars(one), "occlusion": lambda u: np.full((24, 24), np.nan)})
    with pytest.raises(gtao.FitError, match=r"s0 at roughness 0\.5 is not finite"):
        fit.aperture([broken])
