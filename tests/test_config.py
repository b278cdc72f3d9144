"""Configurations: what they refuse, what they become as plain values, what options on a command line make of them."""

import json
import math
from dataclasses import fields, replace

import pytest

import gtao
from gtao.config import NAMED, deviations, faithful, named, with_budget
from gtao.workflows.options import pipeline_from_options

FALLOFF = gtao.LinearFalloff(start=0.2, end=0.5)

EXAMPLES = [
    gtao.GTAO(),
    gtao.GTAO(radius=0.5, falloff=FALLOFF, thickness=gtao.RunningThickness(blend=0.1), power=2.2, floor=0.03),
    gtao.GTAO(radius=0.5, falloff=gtao.QuadraticFalloff(end=0.5, strength=2.0), thickness=gtao.DepthCut(depth=1.0)),
    gtao.HBAO(radius=0.5, n_directions=6),
    gtao.VisibilityBitmask(radius=0.5, thickness=gtao.ConstantThickness(thickness=0.1), n_sectors=64),
    gtao.VisibilityBitmask(radius=0.5, thickness=gtao.LinearThickness(slope=0.1), falloff=gtao.NoCut()),
    gtao.VisibilityBitmask(thickness=gtao.MeasuredThickness(), falloff=None),
    gtao.Pipeline(occlusion=gtao.HBAO(radius=2.0), clamp=False),
]


@pytest.mark.parametrize("config", EXAMPLES, ids=lambda c: type(c).__name__)
def test_plain_values_and_back(config):
    plain = config.to_dict()
    assert plain["type"] == type(config).__name__
    assert gtao.method_from_dict(json.loads(json.dumps(plain))) == config


def test_infinity_as_records_write_it():
    assert gtao.method_from_dict({"radius": "inf", "ceiling": "inf"}) == gtao.GTAO()


@pytest.mark.parametrize("name", NAMED)
def test_named_methods_survive_the_round_trip_and_scale_with_the_radius(name):
    pipeline = named(name, 0.5)
    assert gtao.method_from_dict(pipeline.to_dict()) == pipeline
    assert pipeline.occlusion.radius == 0.5
    assert named(name).occlusion.radius == NAMED[name].default_radius
    # A scene in other units gets the same method: every length doubles, nothing else changes.
    lengths = {"radius", "start", "end", "thickness", "depth", "continuing", "isolated", "gap", "effect_radius"}
    small, large = pipeline.to_dict(), named(name, 1.0).to_dict()

    def compare(a, b, key=""):
        if isinstance(a, dict):
            assert a.keys() == b.keys()
            for k in a:
                compare(a[k], b[k], k)
        elif key in lengths and isinstance(a, float):
            assert b == pytest.approx(2 * a)
        else:
            assert a == b, key

    compare(small, large)


def test_unknown_names_are_errors_in_words():
    with pytest.raises(gtao.ConfigError, match="method must be one of gtao, published"):
        named("gtaoo")
    with pytest.raises(gtao.ConfigError, match="unknown method 'HBAOO'"):
        gtao.method_from_dict({"type": "HBAOO"})
    with pytest.raises(gtao.ConfigError, match="LinearFalloff also needs end"):
        gtao.method_from_dict({"falloff": {"start": 0.1}})


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: gtao.GTAO(radius_multiplier=0.0), "radius_multiplier must be positive"),
        (lambda: gtao.GTAO(depth_bias=0.5), r"depth_bias must lie in \[0, 0.1\]"),
        (lambda: gtao.GTAO(min_step_px=0.1), "min_step_px must lie in"),
        (lambda: gtao.GTAO(min_step_px=4.0, max_radius_px=2.0), "max_radius_px must be at least 4"),
        (lambda: gtao.GTAO(length_blend=1.5), r"length_blend must lie in \[0, 1\]"),
        (lambda: gtao.GTAO(power=0.0), "power must be positive"),
        (lambda: gtao.GTAO(floor=-0.1), r"floor must lie in \[0, 1\]"),
        (lambda: gtao.GTAO(falloff=0.5), "falloff must be None or one of LinearFalloff"),
        (lambda: gtao.GTAO(thickness=gtao.MeasuredThickness()), "thickness must be None or one of RunningThickness"),
        (lambda: gtao.GTAO(radius=1.0, thickness=gtao.RunningThickness(blend=0.1)), "thickness needs a falloff"),
        (lambda: gtao.GTAO(radius=0.1, falloff=FALLOFF), "falloff end 0.5 lies beyond"),
        (lambda: gtao.HBAO(radius=1.0, n_directions=5), "n_directions must be even"),
        (lambda: gtao.HBAO(), "attenuation needs a finite radius"),
        (lambda: gtao.VisibilityBitmask(n_sectors=48), "n_sectors above 32 must be a multiple of 32"),
        (lambda: gtao.VisibilityBitmask(radius=1.0, zenith="optical_axis"), "zenith='optical_axis' needs a falloff"),
        (lambda: gtao.VisibilityBitmask(n_sectors=3), "n_sectors must be an integer from 4 to 128"),
        (lambda: gtao.ConstantThickness(thickness=0.0), "thickness must be positive"),
        (lambda: gtao.RunningThickness(blend=1.1), "thickness blend must lie in"),
        (lambda: gtao.QuadraticFalloff(end=1.0, strength=0.0), "falloff strength must be positive"),
        (lambda: gtao.SampleCut(end=math.nan), "falloff end must be positive"),
        (lambda: gtao.Pipeline(clamp=1), "clamp must be True or False"),
    ],
)
def test_out_of_range(make, message):
    with pytest.raises(gtao.ConfigError, match=message):
        make()


def test_budgets_count_both_sides_of_every_slice():
    assert with_budget(named("gtao", 1.0), 3, 4).occlusion == replace(
        named("gtao", 1.0).occlusion, n_slices=3, n_steps=4
    )
    hbao = with_budget(named("hbao", 1.0), 3, 4).occlusion
    assert (hbao.n_directions, hbao.n_slices, hbao.n_steps) == (6, 3, 4)


def test_deviations_are_what_differs_and_nothing_else():
    method = gtao.GTAO.as_published(1.0)
    found = {d.option: (d.value, d.faithful) for d in deviations(method)}
    assert found == {
        "slice_measure": ("screen", "view"),
        "step_exponent": (1.0, 1.25),
        "falloff": (gtao.LinearFalloff(start=0.75, end=1.0), None),
    }
    clean = faithful(method)
    assert clean == gtao.GTAO(radius=1.0, n_slices=1, n_steps=8)
    assert deviations(clean) == ()


@pytest.mark.parametrize("name", [name for name in NAMED if hasattr(named(name, 1.0).occlusion, "n_slices")])
def test_deviations_can_be_switched_on_one_by_one(name):
    method = named(name, 1.0).occlusion
    partial = faithful(method)
    for d in deviations(method):
        partial = replace(partial, **{d.option: d.value})
        assert d.option in d.label
    assert partial == method


def test_options_reach_every_part():
    made = pipeline_from_options(
        "gtao", ["radius=0.5", "falloff.start=0.1", "falloff.end=0.4", "clamp=true", "n_slices=7"]
    )
    assert made.clamp is True
    assert made.occlusion == gtao.GTAO(radius=0.5, n_slices=7, falloff=gtao.LinearFalloff(start=0.1, end=0.4))
    assert pipeline_from_options("published", ["falloff=none"], radius=2.0).occlusion.falloff is None
    chosen = pipeline_from_options("gtao", ["radius=1", "falloff.type=SampleCut", "falloff.end=0.4"])
    assert chosen.occlusion.falloff == gtao.SampleCut(end=0.4)
    thick = pipeline_from_options("bitmask", ["thickness.slope=0.5"])
    assert thick.occlusion.thickness == gtao.LinearThickness(slope=0.5)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["falloff.foo=1"], "no falloff has the options foo; choose falloff.type from LinearFalloff"),
        (["falloff=3"], "falloff has options of its own"),
        (["falloff.type=Linear"], "choose falloff.type from"),
        (["clamp=maybe"], "clamp must be true or false"),
        (["n_slices.x=1"], "n_slices has no options of its own"),
        (["occlusion=1"], "there is no option 'occlusion'"),
        (["a.b.c=1"], "there is no option 'a.b.c'"),
    ],
)
def test_bad_options(settings, message):
    with pytest.raises(gtao.ConfigError, match=message):
        pipeline_from_options("gtao", settings)


def test_every_option_is_documented():
    for config in EXAMPLES:
        for f in fields(config):
            assert f"{f.name}" in (type(config).__doc__ or ""), f"{type(config).__name__}.{f.name}"
