"""Tuning finds what the truth was made with, says what it cannot find, and never sees what is held out."""

import json
import math
from dataclasses import replace

import drjit as dr
import numpy as np
import pytest
from fit._views import frame, image, problems

import gtao
from gtao import fit, io
from gtao.config import engines
from gtao.fit.tuning_objective import Objective
from gtao.fit.tuning_space import Space
from gtao.fit.tuning_spread import scene_draws

#: Options with derivatives: weights of samples, and what happens to the result.
SMOOTH = gtao.GTAO(
    radius=1.0,
    n_slices=2,
    n_steps=4,
    falloff=gtao.LinearFalloff(start=0.3, end=0.9),
    power=1.5,
    length_blend=0.2,
    thin_occluder_compensation=0.5,
)


# --- options and their units ---------------------------------------------------------------------------------------


def test_the_constants_of_xegtao_in_the_units_of_tuning():
    assert fit.continuous(engines.xegtao("high", 0.37)) == pytest.approx(
        {
            "radius": 1.0,
            "radius_multiplier": 1.457,
            "step_exponent": 2.0,
            "min_step_px": 1.3,
            "depth_bias": 1e-5,
            "pyramid.level_offset": 3.3,
            "falloff.end": 1.0,
            "falloff.start": 1 - 0.615,
            "thin_occluder_compensation": 0.0,
            "length_blend": 0.05,
            "power": 2.2,
            "floor": 0.03,
            "spatial.beta": 1.2,
            "spatial.edge_threshold": 0.011,
            "spatial.diagonal_weight": 0.425,
            "spatial.leak_threshold": 2.5,
            "spatial.leak_strength": 0.5,
        }
    )


@pytest.mark.parametrize("name", [n for n in gtao.config.NAMED if n not in ("gtao", "bitmask")])
def test_presets_scale_to_another_radius_as_they_are_defined(name):
    """Every length of a preset is a multiple of its radius, so that scaling one gives the other, but for rounding."""
    make = gtao.config.NAMED[name].make

    def numbers(config):
        return {k: numbers(v) if isinstance(v, dict) else v for k, v in config.items()}

    def flat(config):
        for value in config.values():
            yield from flat(value) if isinstance(value, dict) else [value]

    scaled, made = (tuple(flat(m.to_dict())) for m in (fit.at_radius(make(0.7), 2.6), make(2.6)))
    for a, b in zip(scaled, made, strict=True):
        assert a == (pytest.approx(b, rel=1e-12) if isinstance(b, float) else b)


def test_shares_follow_what_they_are_shares_of():
    method = engines.xegtao("high", 1.0)
    wider = fit.with_continuous(method, {"radius_multiplier": 2.0}, radius=3.0).occlusion
    assert wider.search_radius == pytest.approx(6.0)
    assert (wider.falloff.start, wider.falloff.end) == pytest.approx((0.385 * 6, 6))
    shorter = fit.with_continuous(method, {"falloff.end": 0.5, "falloff.start": 0.1, "spatial.beta": 2.0}, radius=3.0)
    assert shorter.occlusion.falloff.end == pytest.approx(0.5 * 1.457 * 3)
    assert shorter.occlusion.falloff.start == pytest.approx(0.05 * 1.457 * 3)
    assert shorter.spatial.beta == 2.0
    thick = gtao.VisibilityBitmask(
        radius=2.0, thickness=gtao.ContinuityThickness(continuing=2.0, isolated=0.5, gap=0.4)
    )
    changed = fit.with_continuous(thick, {"thickness.continuing": 0.5}, radius=4.0).thickness
    assert (changed.continuing, changed.isolated, changed.gap) == pytest.approx((2.0, 0.5, 0.8))


def test_lengths_without_a_finite_radius_are_scene_units():
    method = gtao.GTAO(falloff=gtao.LinearFalloff(start=1.0, end=4.0))
    assert fit.continuous(method)["falloff.end"] == 4.0
    assert fit.with_continuous(method, {"falloff.end": 3.0}).falloff == gtao.LinearFalloff(start=0.75, end=3.0)
    with pytest.raises(gtao.ConfigError, match="no finite radius"):
        fit.at_radius(method, 2.0)


def test_discrete_options_are_replaced_at_any_depth():
    changed = fit.with_options(engines.xegtao(), {"n_steps": 7, "pyramid.filter": "min", "spatial.passes": 2})
    assert (changed.occlusion.n_steps, changed.occlusion.pyramid.filter, changed.spatial.passes) == (7, "min", 2)
    assert fit.with_options(changed, {"pyramid": None}).occlusion.pyramid is None
    for options, words in (
        ({"n_step": 3}, "GTAO has no option 'n_step'"),
        ({"thickness.blend": 0.1}, "thickness of GTAO is None"),
        ({"n_steps": 0}, "n_steps must be an integer"),
    ):
        with pytest.raises(gtao.ConfigError, match=words):
            fit.with_options(engines.xegtao(), options)


def test_coordinates_and_values_are_inverse_and_reach_their_bounds():
    space = Space(SMOOTH, dict.fromkeys(p for p in fit.continuous(SMOOTH) if p != "floor") | {"power": (0.5, 3.0)})
    for i, p in enumerate(space.parameters):
        for u, value in ((space.lower[i], p.low), (space.upper[i], p.high), (space.start[i], p.start)):
            # Bounds exactly: other options' ranges rest on them.
            assert p.value(float(u)) == (value if value in (p.low, p.high) else pytest.approx(value, rel=1e-12))
    assert space.build(list(space.start), 1.0).power == pytest.approx(1.5)


# --- what is minimised ---------------------------------------------------------------------------------------------


def test_the_loss_is_the_weighted_mean_squared_error_over_surfaces():
    generator = np.random.default_rng(3)
    views, expected, weights = [], [], (1.0, 2.5)
    for k, radius in enumerate((0.4, 0.9)):
        g = frame(k)
        surface = np.isfinite(g.view_z.numpy())
        truth = np.where(surface, generator.uniform(size=g.shape), np.nan)
        views.append(fit.Problem(name=str(k), g=g, truth=truth, radius=radius, weight=weights[k]))
        errors = [(image(g, fit.at_radius(SMOOTH, radius), f) - truth)[surface] for f in (0, 3)]
        expected.append(np.mean(np.square(errors)))
    space = Space(SMOOTH, {"power": None})
    objective = Objective(views, space, (0, 3))
    # Estimates are in single precision, sums in double.
    assert objective.losses(space.start) == pytest.approx(expected, rel=1e-5)
    assert objective.loss(space.start) == pytest.approx(np.average(expected, weights=weights), rel=1e-5)
    assert objective.n_evaluations == 2


#: With the weighted pyramid, which the falloff steers too, and a filter; with exact arc cosines, which have no steps.
XEGTAO = fit.with_options(
    engines.xegtao("high", 1.0),
    {"arccosine": "exact", "thin_occluder_compensation": 0.4, "spatial.quantised_edges": False},
)


@pytest.mark.parametrize("method", [SMOOTH, XEGTAO], ids=["estimator", "pipeline"])
def test_gradients_are_those_of_the_loss_in_coordinates(method):
    """In double precision, and of options that move no sample: there is no jump for the differences to cross."""
    paths = ["power", "length_blend", "thin_occluder_compensation", "falloff.start"]
    if isinstance(method, gtao.Pipeline):
        paths += ["spatial.beta", "spatial.edge_threshold"]
    views = problems(fit.with_continuous(method, {"power": 1.1, "falloff.start": 0.1}), dtype=np.float64)
    views[1] = replace(views[1], weight=3.0)
    space = Space(method, dict.fromkeys(paths))
    objective = Objective(views, space, (0, 1))
    loss, gradient = objective.loss_and_gradient(space.start, range(len(paths)))
    assert loss == pytest.approx(objective.loss(space.start), rel=1e-12)
    h = 1e-5
    for i in range(len(paths)):
        d = np.eye(len(paths))[i] * h
        difference = (objective.loss(space.start + d) - objective.loss(space.start - d)) / (2 * h)
        # The differences' own error is of the order h² and 1e-16/h.
        assert gradient[i] == pytest.approx(difference, rel=1e-5)
        assert objective.loss_and_gradient(space.start, (i,))[1] == pytest.approx(gradient[[i]], rel=1e-9)


def test_derivatives_of_options_in_scene_units():
    """Against differences of what is built: shares follow, and lengths go by the radius of the view."""
    space = Space(XEGTAO, dict.fromkeys(["radius_multiplier", "falloff.start", "power", "falloff.end"]))
    point, h = space.start - 0.1, 1e-6
    for i in range(4):
        d = np.eye(4)[i] * h
        found = space.derivatives(point, i, 0.7)
        up, down = (space.options(u, 0.7) for u in (point + d, point - d))
        moved = {path: (up[path] - down[path]) / (2 * h) for path in up if up[path] != down[path]}
        assert found == pytest.approx(moved, rel=1e-8)
    assert set(space.derivatives(point, 0, 0.7)) == {"radius_multiplier", "falloff.end", "falloff.start"}


def test_no_evaluation_compiles_a_kernel_of_its_own():
    space = Space(XEGTAO, dict.fromkeys(["radius_multiplier", "step_exponent", "power", "falloff.start"]))
    objective = Objective(problems(XEGTAO, n_scenes=1, radii=(0.5,)), space)
    compiled = []
    for k in range(4):
        point = space.start + 0.01 * k
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
            objective.loss(point)
            objective.loss_and_gradient(point, (2, 3))
            large = [kernel for kernel in dr.kernel_history((dr.KernelType.JIT,)) if kernel["size"] > 1]
        compiled.append(sum(not kernel["cache_hit"] for kernel in large))
    # The second may still meet memory that is aligned otherwise.
    assert compiled[2:] == [0, 0]


def test_derivatives_that_do_not_exist_or_miss_the_jumps_are_not_used():
    """Where samples snap to texels nothing tells the loss's change with their distances, and it is never called 0."""
    method = replace(SMOOTH, step_exponent=1.4, step_law="offset")
    paths = ("step_exponent", "power", "min_step_px", "radius_multiplier", "length_blend")
    space = Space(method, dict.fromkeys(paths))
    objective = Objective(problems(replace(method, power=1.0, length_blend=0.0)), space)
    assert [paths[i] for i in objective.differentiable(space.start)] == ["power", "length_blend"]
    with pytest.raises(gtao.ConfigError):
        objective.loss_and_gradient(space.start, (0,))


def test_a_derivative_that_misses_the_jumps_is_right_between_them_and_not_used():
    """One sample per side, which moves with the end of the falloff and takes its weight along."""
    falloff = gtao.LinearFalloff(start=0.8, end=0.9)
    method = replace(SMOOTH, power=1.0, n_steps=1, min_step_px=4.0, step_law="beyond", falloff=falloff)
    views = problems(fit.with_continuous(method, {"falloff.end": 0.7}), n_scenes=4, dtype=np.float64)
    space = Space(method, {"falloff.end": None})
    objective = Objective(views, space)
    h = 1e-7
    between = (objective.loss(space.start + h) - objective.loss(space.start - h)) / (2 * h)
    _, slope = objective.loss_and_gradient(space.start, (0,))
    assert slope == pytest.approx(between, rel=1e-5)
    assert slope != pytest.approx(objective.difference(space.start, 0), rel=0.2)
    assert objective.differentiable(space.start) == ()


# --- recovery ------------------------------------------------------------------------------------------------------


def test_gradients_recover_what_the_truth_was_made_with():
    target = {"power": 1.2, "falloff.start": 0.5, "length_blend": 0.4}
    result = fit.tune(problems(fit.with_continuous(SMOOTH, target)), SMOOTH, target.keys())
    # Single precision: the loss is flat below 1e-7 of an image, and its root in the coordinates.
    assert result.values == pytest.approx(target, abs=2e-3)
    assert {p.by for p in result.parameters} == {"gradient"}
    assert result.loss < 1e-3 * result.start_loss
    assert result.converged
    assert result.method.power == result.values["power"]


def test_differences_recover_what_has_no_derivative():
    target = {"step_exponent": 1.5, "radius_multiplier": 1.3}
    start = replace(SMOOTH, falloff=gtao.NoCut(), thin_occluder_compensation=0.0)
    result = fit.tune(problems(fit.with_continuous(start, target), n_scenes=4), start, target.keys())
    # The last step is half a percent, and samples cross into other texels in jumps.
    assert result.values == pytest.approx(target, rel=0.03)
    assert {p.by for p in result.parameters} == {"differences"}
    assert result.loss < 0.02 * result.start_loss


def test_both_kinds_are_recovered_together():
    target = {"power": 1.1, "step_exponent": 1.7, "falloff.start": 0.1}
    result = fit.tune(problems(fit.with_continuous(SMOOTH, target), n_scenes=4), SMOOTH, target.keys())
    assert result.values["step_exponent"] == pytest.approx(1.7, rel=0.03)
    assert result.values["power"] == pytest.approx(1.1, rel=0.03)
    assert result.values["falloff.start"] == pytest.approx(0.1, abs=0.03)
    assert [p.by for p in result.parameters] == ["gradient", "differences", "gradient"]
    assert {kind for _, _, kind in result.history} == {"start", "descent", "search"}
    losses = [loss for _, loss, _ in result.history]
    assert losses == sorted(losses, reverse=True)


def test_options_that_make_up_for_each_other_are_moved_together():
    """A falloff that begins early wants a long search: one after the other they end far from where they should."""
    start = replace(SMOOTH, power=1.0, falloff=gtao.LinearFalloff(start=0.3, end=1.0))
    target = {"radius_multiplier": 2.0, "falloff.start": 0.1, "power": 1.5}
    result = fit.tune(problems(fit.with_continuous(start, target), n_scenes=4), start, list(target))
    assert result.values == pytest.approx(target, rel=0.03)
    assert result.loss < 1e-3 * result.start_loss


def test_an_optimum_at_a_bound_is_reached_and_said():
    truth = replace(SMOOTH, length_blend=0.0, power=3.0)
    result = fit.tune(problems(truth), SMOOTH, {"length_blend": None, "power": (1.0, 2.0)}, n_bootstrap=0)
    assert result.values["power"] == 2.0
    assert result.parameters[1].at_bound


def test_noise_frames_are_all_fitted():
    target = {"power": 1.2}
    views = problems(fit.with_continuous(SMOOTH, target), frames=(2,))
    assert fit.tune(views, SMOOTH, ["power"], frames=(2,)).loss < 1e-9
    assert fit.tune(views, SMOOTH, ["power"], frames=(0, 2)).loss > 1e-5


def test_the_best_combination_of_discrete_options_wins():
    target = replace(SMOOTH, n_steps=3, power=1.2)
    search = {"n_steps": (2, 3, 4), "horizon_start": ("nadir", "tangent")}
    result = fit.tune(problems(target), SMOOTH, ["power"], search=search)
    assert result.choice["n_steps"] == result.method.n_steps == 3
    assert result.values["power"] == pytest.approx(1.2, abs=2e-3)
    assert [c.loss for c in result.candidates] == sorted(c.loss for c in result.candidates)
    assert len(result.candidates) == 6
    cheap = fit.tune(problems(target), SMOOTH, ["power"], search=search, max_taps=8)
    assert cheap.choice["n_steps"] == 2
    assert {c.taps for c in cheap.candidates} == {8}


def test_combinations_are_tuned_in_what_they_have():
    search = {"falloff": (SMOOTH.falloff, gtao.QuadraticFalloff(end=0.9), gtao.NoCut())}
    target = replace(SMOOTH, falloff=gtao.QuadraticFalloff(end=0.9), power=1.2)
    result = fit.tune(problems(target), SMOOTH, ["power", "falloff.start"], search=search, max_rounds=2)
    assert {tuple(c.values) for c in result.candidates} == {("power",), ("power", "falloff.start")}
    assert isinstance(result.method.falloff, gtao.QuadraticFalloff)
    assert [p.path for p in result.parameters] == ["power"]


# --- what is held out ----------------------------------------------------------------------------------------------


def disturbed(views, scene):
    """The same with another truth for one scene."""
    return [replace(p, truth=1 - np.asarray(p.truth)) if p.scene == scene else p for p in views]


def test_held_out_scenes_and_left_out_folds_are_never_seen():
    views = problems(replace(SMOOTH, power=1.2), n_scenes=4, radii=(0.6,))
    options = {"held_out": ["scene 3"], "folds": 3, "max_rounds": 2}
    before = fit.tune(views, SMOOTH, ["power"], **options)
    hidden = fit.tune(disturbed(views, "scene 3"), SMOOTH, ["power"], **options)
    assert hidden.values == before.values
    assert sorted(s for f in before.folds for s in f.left_out) == ["scene 0", "scene 1", "scene 2"]
    for scene in ("scene 0", "scene 2"):
        after = fit.tune(disturbed(views, scene), SMOOTH, ["power"], **options)
        assert after.values != before.values
        for a, b in zip(after.folds, before.folds, strict=True):
            assert (a.values == b.values) == (scene in b.left_out)


def test_every_view_is_scored_by_a_tuning_that_did_not_see_it():
    powers = (1.0, 1.2, 1.4, 2.0)
    views = [
        replace(p, truth=image(p.g, replace(fit.at_radius(SMOOTH, p.radius), power=power)))
        for p, power in zip(problems(SMOOTH, n_scenes=4, radii=(0.6,)), powers, strict=True)
    ]
    result = fit.tune(
        views, SMOOTH, ["power"], held_out=["scene 3"], folds=3, rivals={"plain": replace(SMOOTH, power=1.0)}
    )
    scores = result.scores
    assert scores.held_out.tolist() == [False, False, False, True]
    used = {scene: f.values["power"] for f in result.folds for scene in f.left_out}
    used["scene 3"] = result.values["power"]
    for label, power in (
        ("unseen", [used[p.scene] for p in views]),
        ("tuned", [result.values["power"]] * 4),
        ("start", [1.5] * 4),
        ("plain", [1.0] * 4),
    ):
        for i, p in enumerate(views):
            surface = p.g.mask.numpy().astype(bool)
            error = image(p.g, replace(fit.at_radius(SMOOTH, p.radius), power=power[i])) - p.truth
            # The truth of a view may be what is scored, which leaves the rounding of the estimate.
            assert scores.rmse[label][i] == pytest.approx(np.sqrt(np.mean(error[surface] ** 2)), rel=1e-4, abs=1e-6)
    assert scores.unfiltered is None
    kept = scores.summary("plain", held_out=False)
    ours, theirs = scores.rmse["unseen"][:3], scores.rmse["plain"][:3]
    assert kept["n_views"] == 3
    assert kept["wins"] == int((ours < theirs).sum())
    assert kept["ratio"] == pytest.approx(np.sqrt(np.mean(ours**2) / np.mean(theirs**2)))
    assert kept["difference"] == pytest.approx(np.mean(ours - theirs))
    assert kept["standard_error"] == pytest.approx(np.std(ours - theirs, ddof=1) / math.sqrt(3))
    assert scores.summary("plain", held_out=True)["n_views"] == 1


def test_errors_are_without_the_noise_of_the_truth_and_with_or_without_the_filter():
    pipeline = gtao.Pipeline(occlusion=SMOOTH, spatial=gtao.PlaneAwareFilter(), clamp=False)
    generator = np.random.default_rng(0)
    views = [
        replace(p, truth=p.truth + 0.1 * generator.standard_normal(p.g.shape), variance=np.full(p.g.shape, 0.01))
        for p in problems(SMOOTH, n_scenes=2)
    ]
    result = fit.tune(views, pipeline, ["power"], max_rounds=1)
    assert np.isnan(result.scores.rmse["unseen"]).all()
    assert result.scores.summary("start", held_out=False) == {}
    for p, with_filter, without in zip(
        views, result.scores.rmse["start"], result.scores.unfiltered["start"], strict=True
    ):
        surface = p.g.mask.numpy().astype(bool)
        for found, method in ((with_filter, pipeline), (without, replace(pipeline, spatial=None))):
            error = (image(p.g, fit.at_radius(method, p.radius)) - p.truth)[surface]
            assert found == pytest.approx(math.sqrt(max(np.mean(error**2) - 0.01, 0)), rel=1e-3, abs=1e-6)


# --- spread --------------------------------------------------------------------------------------------------------


def test_the_linearised_bootstrap_is_exact_for_quadratic_losses():
    """Scenes with optima of their own and one curvature: a sample's optimum is the mean of its scenes' optima."""
    generator = np.random.default_rng(1)
    optima = generator.normal(0, 0.05, (7, 3))
    a = generator.normal(size=(3, 3))
    curvature = a @ a.T + 3 * np.eye(3)

    def losses(u):
        d = u - optima
        return np.einsum("si,ij,sj->s", d, curvature, d)

    bounds = np.full(3, -1.0), np.full(3, 1.0)
    draws = scene_draws(losses, optima.mean(axis=0), bounds, 200, seed=5)
    counts = gtao.evaluate.bootstrap_counts(7, 200, 5)
    assert draws == pytest.approx(counts @ optima / 7, abs=1e-12)
    # About what was found, also where a search stopped short of the optimum.
    found = optima.mean(axis=0) + 0.1
    assert scene_draws(losses, found, bounds, 200, seed=5) - found == pytest.approx(draws - (found - 0.1), abs=1e-12)


def test_draws_stay_within_bounds_and_at_them():
    def losses(u):
        return np.array([(u[0] - 2) ** 2, (u[0] - 1) ** 2, u[0] ** 2]) + (u[1] - 1.5) ** 2

    draws = scene_draws(losses, np.array([0.9, 1.0]), (np.zeros(2), np.ones(2)), 100, 0)
    assert (draws[:, 1] == 1).all()
    assert draws[:, 0].min() >= 0
    assert draws[:, 0].max() == 1


def test_standard_errors_say_how_much_scenes_differ():
    powers = (1.0, 1.2, 1.4, 1.6, 1.1, 1.5)
    views = [
        replace(p, truth=image(p.g, replace(fit.at_radius(SMOOTH, p.radius), power=power)))
        for p, power in zip(problems(SMOOTH, n_scenes=6, radii=(0.6,)), powers, strict=True)
    ]
    result = fit.tune(views, SMOOTH, ["power"], n_bootstrap=500)
    (p,) = result.parameters
    # Views weigh by how much they hold of what a power changes, else it would be the error of the mean, 0.09.
    assert 0.05 < p.standard_error < 0.2
    assert p.interval[0] < 1.3 < p.interval[1]
    same = fit.tune(problems(replace(SMOOTH, power=1.2), n_scenes=3), SMOOTH, ["power"], n_bootstrap=100)
    assert same.parameters[0].standard_error < 1e-3


# --- what a record holds, and what is refused ----------------------------------------------------------------------


def test_a_result_becomes_plain_json():
    result = fit.tune(
        problems(SMOOTH, radii=(0.6,)),
        gtao.Pipeline(occlusion=SMOOTH),
        ["power"],
        search={"pyramid": (None, gtao.DepthPyramid(filter="min"))},
        max_rounds=1,
    )
    described = json.loads(io.pretty_json(result.to_dict()))
    assert described["parameters"]["power"]["value"] == result.values["power"]
    assert described["scores"]["rmse"]["unseen"] == [None, None]
    assert gtao.method_from_dict(described["method"]) == result.method
    assert {c["choice"]["pyramid"] is None for c in described["candidates"]} == {True, False}


def test_bad_problems_in_words():
    g = frame(0)
    truth = np.full(g.shape, 0.5)
    empty = gtao.GBuffer(np.full((8, 8), np.inf, np.float32), None, gtao.PerspectiveCamera(8, 8, 1.0))
    for error, words, options in (
        (gtao.ShapeError, r"truth of problem 'a' has shape \(3, 4\), its frame", {"truth": np.zeros((3, 4))}),
        (gtao.ShapeError, "truth of problem 'a' is not finite", {"truth": np.full(g.shape, np.nan)}),
        (gtao.ShapeError, "variance of problem 'a' has shape", {"variance": np.zeros(4)}),
        (gtao.ShapeError, "no pixel of problem 'a' shows a surface", {"g": empty, "truth": np.zeros((8, 8))}),
        (gtao.ConfigError, "weight of problem 'a' must be positive", {"weight": 0.0}),
        (gtao.ConfigError, "radius of problem 'a' must be positive and finite, got inf", {"radius": math.inf}),
        (gtao.ConfigError, "g of problem 'a' must be a gtao.GBuffer", {"g": truth}),
    ):
        with pytest.raises(error, match=words):
            fit.Problem(**({"name": "a", "g": g, "truth": truth} | options))


@pytest.mark.parametrize(
    ("words", "changes"),
    [
        ("nothing to tune", {"parameters": ()}),
        ("must be a sequence of names, got the string 'power'", {"parameters": "power"}),
        ("'n_steps' cannot be tuned here; choose from radius, radius_multiplier", {"parameters": ["n_steps"]}),
        ("'thickness.depth' cannot be tuned", {"parameters": ["thickness.depth"]}),
        ("bounds of power must be None or .low, high., got 1.2", {"parameters": {"power": 1.2}}),
        ("bounds of power must be finite and increasing", {"parameters": {"power": (2.0, 1.0)}}),
        ("and the lower one positive, got 0", {"parameters": {"power": (0.0, 1.0)}}),
        ("power starts at 1.5, outside of its bounds 2 and 3", {"parameters": {"power": (2.0, 3.0)}}),
        ("power cannot be both tuned and searched", {"search": {"power": (1.0, 2.0)}}),
        ("search of n_steps needs a list of values", {"search": {"n_steps": "2,3"}}),
        ("n_steps must be an integer", {"search": {"n_steps": (2, 0)}}),
        ("no combination reads at most 4 depth samples per pixel; the least is 16", {"max_taps": 4}),
        ("only methods that march slices", {"method": gtao.HeightfieldRayMarch(radius=1.0)}),
        ("no finite radius to scale", {"method": gtao.GTAO()}),
        ("no problem is of scene attic", {"held_out": ["attic"]}),
        ("no scene to tune on", {"held_out": ["scene 0", "scene 1"]}),
        ("folds must be 0 .none. or from 2 to the number of scenes, 2, got 3", {"folds": 3}),
        ("folds must be", {"folds": 1}),
        ("n_bootstrap must be 0", {"n_bootstrap": 1}),
        ("needs at least 3 scenes, got 2", {"n_bootstrap": 100}),
        ("at least one noise frame", {"frames": ()}),
        ("max_rounds must be at least 1", {"max_rounds": 0}),
        ("a rival cannot be called tuned", {"rivals": {"tuned": SMOOTH}}),
    ],
)
def test_bad_input_in_words(words, changes):
    given = {"method": SMOOTH, "parameters": ["power"]} | changes
    with pytest.raises(gtao.ConfigError, match=words):
        fit.tune(problems(SMOOTH, radii=(0.6,)), **given)


def test_problems_given_twice():
    views = problems(SMOOTH, radii=(0.6,))
    with pytest.raises(gtao.ConfigError, match=r"problems given more than once: 0, 0\.6"):
        fit.tune([*views, views[0]], SMOOTH, ["power"])
