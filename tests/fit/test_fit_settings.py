"""Weightings do what they say; what makes no sense is refused in one line."""

import math

import numpy as np
import pytest
from fit import _synthetic as synthetic

from gtao import fit
from gtao.errors import ConfigError, FitError, GtaoError
from gtao.fit import FitSettings, Samples, multibounce

SMALL, LARGE = synthetic.spread(1, 150, a=0.7, b=2.0), synthetic.spread(2, 450, a=2.0)


def transports():
    return [("small", synthetic.transport(SMALL, 64, 8, 1)), ("large", synthetic.transport(LARGE, 64, 8, 2))]


def coefficients(pairs=None, weights=None, **kwargs):
    s = Samples.from_transports(transports() if pairs is None else pairs, weights=weights)
    return multibounce(s, n_bootstrap=0, **kwargs).fit.coefficients


def test_pixel_weighting_is_that_of_one_big_scene():
    a, b = (t for _, t in transports())
    both = synthetic._pack(
        np.concatenate(
            [
                np.concatenate([a.escaped, a.remaining[:, None]], axis=1),
                np.concatenate([b.escaped, b.remaining[:, None]], axis=1),
            ],
            axis=2,
        ),
        64,
        None,
    )
    for form in ("linear_cubic", "one_parameter"):
        assert coefficients(form=form, weighting="pixel") == pytest.approx(
            coefficients([("both", both)], form=form), abs=1e-8
        )
        assert coefficients(form=form, weighting="pixel") != pytest.approx(coefficients(form=form), abs=1e-3)


def test_a_weight_of_two_is_the_scene_twice():
    doubled = [*transports(), ("again", transports()[0][1])]
    for weighting in ("scene", "pixel"):
        assert coefficients(weights={"small": 2}, weighting=weighting) == pytest.approx(
            coefficients(doubled, weighting=weighting), abs=1e-9
        )


def test_uniform_weighting_forgets_how_often_a_visibility_comes_up():
    # The same law; in one scene dark pixels are three times as many, in the other bright ones.
    dark = np.concatenate([np.linspace(0, 0.5, 300, endpoint=False), np.linspace(0.5, 1, 100)])
    found = []
    for V in (dark, 1 - dark):
        shares = np.array([V, (1 - V) * (0.3 + 0.6 * np.sin(6 * V) ** 2)])
        pairs = [("a", synthetic.exact(shares))]
        found.append([coefficients(pairs, bounces=2, weighting=w)[0] for w in ("uniform", "scene")])
    (flat, plain), (flat_too, plain_too) = found
    # What is left is where in its bin a visibility lies.
    assert abs(flat - flat_too) < 0.1 * abs(plain - plain_too)


def test_screen_space_visibility_is_what_the_fit_then_maps():
    # An estimator that says V² has its own V' as a function of it: a fit on it must find the law in √.
    V = np.linspace(0.05, 1, 400)
    s = Samples.from_transports(
        [("a", synthetic.exact(synthetic.four_parameter(np.sqrt(V), (0.6, 0.0, 0.0, 0.0))))], regressors={"a": V}
    )
    result = multibounce(s, bounces=2, n_bootstrap=0, form="four_parameter", albedos=(0.3, 0.6))
    W = np.sqrt(V)
    assert result.naive == pytest.approx(result.fit.coefficients, abs=1e-9)
    # By least squares on the regressor, written out.
    rows, right = [], []
    for p in (0.3, 0.6):
        rows.append(np.array([p * V * (1 - V), p * V**2 * (1 - V), p**2 * V * (1 - V), p**2 * V**2 * (1 - V)]).T)
        right.append(W + p * 0.6 * W * (1 - W) - V)
    expected = np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=None)[0]
    assert result.fit.coefficients == pytest.approx(expected, abs=1e-4)


def test_labels():
    assert FitSettings().label == "linear cubic, f(1) = 1"
    assert FitSettings(constraints=(), procedure="two-step").label == "linear cubic, free, two-step"
    everything = FitSettings(form="four_parameter", constraints=("energy", "monotone", "above_visibility"))
    assert everything.label == "four parameters, f ≥ V, monotone, energy bound"


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"form": "sphere"}, "'sphere' has no coefficients"),
        ({"form": "spline"}, "unknown form 'spline'"),
        ({"bounces": 1}, "bounces must be 2, 3, … or inf, got 1"),
        ({"bounces": 2.5}, "bounces must be 2"),
        ({"bounces": math.nan}, "bounces must be 2"),
        ({"bounces": 9}, "bounces is 9 but only 8 were counted"),
        ({"albedos": ()}, "at least one"),
        ({"albedos": (0.0, 0.5)}, r"strictly between 0 and 1, got \[0.0, 0.5\]"),
        ({"albedos": (0.5, 1.0)}, "strictly between"),
        ({"albedos": (0.5, math.nan)}, "strictly between"),
        ({"albedos": (0.5, 0.5)}, "must differ"),
        ({"albedos": (0.5,)}, "needs at least 2 albedos"),
        ({"procedure": "three-step"}, "unknown procedure 'three-step'; choose one of joint, two-step"),
        ({"procedure": "two-step", "form": "four_parameter"}, "fits 'linear_cubic' only"),
        ({"procedure": "two-step", "constraints": ("monotone",)}, "cannot hold monotone"),
        ({"constraints": "monotone"}, "tuple of names"),
        ({"constraints": ("convex",)}, "unknown constraint 'convex'; choose from zero_at_zero"),
        ({"weighting": "area"}, "unknown weighting 'area'; choose one of scene, pixel, uniform"),
        ({"n_bootstrap": -1}, r"n_bootstrap must be 0 \(none\) or at least 2, got -1"),
        ({"n_bootstrap": 1}, "at least 2"),
        ({"level": 1.0, "n_bootstrap": 0}, r"level must lie in \(0, 1\), got 1.0"),
    ],
)
def test_refusals(kwargs, message):
    s = Samples.from_transports(transports())
    with pytest.raises(ConfigError, match=message) as caught:
        multibounce(s, **kwargs)
    assert isinstance(caught.value, GtaoError)
    assert "\n" not in str(caught.value)


def test_one_albedo_is_enough_for_one_parameter():
    assert len(coefficients(form="one_parameter", albedos=(0.5,))) == 1


@pytest.mark.parametrize("form", sorted(fit.forms.FITTED_FORMS))
def test_degenerate_data(form):
    # Wide open everywhere: every curve passes through (1, 1).
    t = synthetic.exact(np.array([np.ones(100), np.zeros(100)]))
    with pytest.raises(FitError, match="the data do not determine the coefficients"):
        multibounce(Samples.from_transports([("open", t)]), form=form, bounces=2)


def test_too_few_batches_for_a_fit():
    t = synthetic.transport(SMALL, 64, 4, 0)
    with pytest.raises(FitError, match="'small' has 4 batches"):
        multibounce(Samples.from_transports([("small", t)]))


def test_a_scene_too_small_for_blocks():
    t = synthetic.transport(SMALL, 64, 8, 0, width=1)
    tiny = synthetic._pack(np.concatenate([t.escaped, t.remaining[:, None]], axis=1)[:, :, :1], 64, 1)
    with pytest.raises(FitError, match=r"do not determine|too small to be cut"):
        multibounce(Samples.from_transports([("tiny", tiny)]), form="one_parameter")
