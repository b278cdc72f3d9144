"""Errors of tables: what was promised of sizes and axes, and that worse tables are found worse."""

from dataclasses import replace

import numpy as np
import pytest
from oracles import golden

import gtao
from gtao.tables.configurations import configurations
from gtao.tables.errors import F0, look_up
from gtao.tables.values import value_of


def test_truth_of_two_cones():
    # Roughness up to 1 has no cones of reflection wider than arccos 0.1.
    for given, expected in golden.cases("E.caps"):
        if 0.01 <= given["alpha_s"] <= np.arccos(0.1):
            alpha = np.sqrt(np.log(np.cos(given["alpha_s"])) / (0.5 * np.log(0.01)))
            found = value_of("cone-cone", tuple(map(np.atleast_1d, (given["alpha_v"], given["beta"], alpha))))
            # The width loses digits where it comes from a cosine near 1.
            assert found.values[0, 0] == pytest.approx(expected["V_s"], abs=1e-9)


def test_truth_of_lobes():
    for given, expected in golden.cases("E.cone_lobe"):
        arguments = tuple(np.atleast_1d(given[name]) for name in ("alpha_v", "beta", "alpha"))
        assert value_of("cone-lobe", arguments).values[0, 0] == pytest.approx(expected["ggx"], abs=1e-9)


def test_truth_of_reflection():
    for given, expected in golden.cases("E.full_brdf"):
        arguments = tuple(np.atleast_1d(given[name]) for name in ("alpha_v", "beta", "alpha", "theta_o", "chi"))
        found = value_of("brdf-5d", arguments).values[0]
        # The quadrature's tolerance.
        assert found[0] == pytest.approx(expected["A_V"] / expected["A"], abs=1e-5)
        assert found[1] == pytest.approx(expected["B_V"] / expected["B"], abs=1e-5)
        if given["chi"] == 0:
            assert value_of("brdf-4d", arguments[:4]).values[0] == pytest.approx(found, abs=1e-5)


def test_truth_of_cones_wider_than_hemispheres():
    """Two ways to the same number: the cone itself, and what it leaves out."""
    arguments = tuple(np.array(x) for x in ([1.7, 2.2, 2.8], [0.9, 2.0, 2.6], [0.4, 0.3, 0.9], [1.1, 0.7, 1.4]))
    chi = np.array([0.6, 2.4, 3.0])
    expected = gtao.tables.cone_shares(*arguments, chi).values
    assert value_of("brdf-5d", (*arguments, chi)).values == pytest.approx(expected, abs=2e-5)
    assert expected.min() < 0.9
    sphere = (np.full(3, np.pi), *arguments[1:], chi)
    assert np.array_equal(value_of("brdf-5d", sphere).values, np.ones((3, 2)))


def test_statistics_are_those_of_the_differences():
    table = gtao.tables.bake("cone-lobe", 6)
    places = configurations("cone-lobe", 3000, 5, uniform="roughness", tilt=1.0)
    given = {name: places[name] for name in ("alpha_v", "beta", "alpha")}
    difference = np.abs(look_up(table, given) - value_of("cone-lobe", tuple(given.values())).values)[:, 0]
    found = gtao.tables.errors(table, 3000, 5, uniform="roughness")["S"]
    assert found.rms == pytest.approx(np.sqrt(np.mean(difference**2)))
    assert found.p99 == pytest.approx(np.percentile(difference, 99))
    assert found.max == difference.max()
    assert found.where["beta"] == given["beta"][difference.argmax()]


def test_places_are_even_over_the_hemisphere():
    n, tilt = 40000, 1.1
    places = configurations("brdf-5d", n, 0, uniform="alpha", tilt=tilt)
    beta, theta_o, chi = (places[name] for name in ("beta", "theta_o", "chi"))
    # Reflected direction, the axis toward the normal and the one across, and with them the cone's axis.
    zero = np.zeros(n)
    r = np.stack([np.sin(theta_o), zero, np.cos(theta_o)])
    e = np.stack([-np.cos(theta_o), zero, np.sin(theta_o)])
    b = np.cos(beta) * r + np.sin(beta) * (np.cos(chi) * e + np.sin(chi) * np.array([[0.0], [1.0], [0.0]]))
    # Means of 40 000 numbers are right within four standard errors, 0.02 of their range at most.
    assert b[2].min() >= np.cos(tilt) - 1e-9
    assert b[2].mean() == pytest.approx(0.5 * (1 + np.cos(tilt)), abs=0.01)
    assert b[:2].mean(axis=1) == pytest.approx([0, 0], abs=0.02)
    assert np.mean(b[0] ** 2) == pytest.approx(np.mean(b[1] ** 2), abs=0.01)
    assert np.cos(theta_o).mean() == pytest.approx(0.5, abs=0.01)
    assert np.corrcoef(b[0], theta_o)[0, 1] == pytest.approx(0, abs=0.02)
    assert places["alpha"].mean() == pytest.approx(0.515, abs=0.01)
    smooth = np.sqrt(configurations("brdf-5d", n, 0, uniform="roughness", tilt=tilt)["alpha"])
    assert smooth.min() > 0.1
    assert smooth.mean() == pytest.approx(0.55, abs=0.01)
    assert (np.sin(places["alpha_v"]) ** 2).mean() == pytest.approx(0.5, abs=0.01)


# Root mean square errors measured at 32³ or 16⁴ texels, with 10 % for the few samples here.
@pytest.mark.parametrize(
    ("kind", "axes", "size", "rms"),
    [
        ("cone-cone", "published", 32, 0.0143),
        ("cone-cone", "cosine", 32, 0.0097),
        ("cone-cone", "linear", 32, 0.0021),
        ("cone-cone", "overlap", 32, 4.5e-4),
        ("cone-cone", "nested", 32, 1.8e-4),
        ("cone-lobe", "linear", 32, 0.0023),
        ("cone-lobe", "lobe", 32, 3.5e-4),
        ("brdf-3d", "linear", 32, 0.0009),
        ("brdf-3d", "lobe", 32, 4.7e-4),
        ("brdf-4d", "lobe", 16, 0.0016),
        ("brdf-5d", "lobe", (10, 12, 8, 8, 6), 0.0045),
        ("environment-brdf", "root", 32, 1.0e-4),
    ],
)
def test_errors_are_what_was_measured(kind, axes, size, rms):
    found = gtao.tables.errors(gtao.tables.bake(kind, size, axes), 4000, seed=1)
    assert found.channels[-1 if kind != "environment-brdf" else 0].rms < 1.1 * rms


def test_the_same_places_from_the_same_seed():
    table = gtao.tables.bake("brdf-4d", 4)
    assert gtao.tables.errors(table, 500, 3).to_dict() == gtao.tables.errors(table, 500, 3).to_dict()
    assert gtao.tables.errors(table, 500, 3)["S"].rms != gtao.tables.errors(table, 500, 4)["S"].rms


def test_an_error_of_the_values_is_found_where_it_is():
    table = gtao.tables.bake("cone-lobe", 32)
    worse = replace(table, values=table.values + np.float32(0.25))
    found = gtao.tables.errors(worse, 2000)["S"]
    assert found.rms == pytest.approx(0.25, abs=0.001)
    assert found.where["table"] - found.where["truth"] == pytest.approx(found.max)
    place = {name: np.array([found.where[name]]) for name in ("alpha_v", "beta", "alpha")}
    assert look_up(worse, place)[0, 0] == found.where["table"]


def test_ratios_are_weighted_by_what_they_reflect():
    """An error of B_V / B counts as much as B does at F0."""
    table = gtao.tables.bake("brdf-3d", 24)
    values = table.values.copy()
    values[..., 1] += np.float32(0.5)
    given = gtao.tables.errors(replace(table, values=values), 400)["S"].where
    terms = gtao.tables.hemisphere_terms(given["alpha"], given["beta"]).values
    share = terms[1] / (F0 * terms[0] + terms[1])
    # The table's own error comes on top.
    assert given["table"] - given["truth"] == pytest.approx(0.5 * share, abs=0.02)


def test_the_whole_cone_counts_what_a_kind_leaves_out():
    """Five coordinates know where the axis is; four assume it, and cones about the normal even more."""
    sizes = {"brdf-5d": (10, 12, 6, 8, 6), "brdf-4d": (10, 12, 6, 8), "brdf-3d": 16, "cone-cone": 16}
    rms = {
        kind: gtao.tables.errors(gtao.tables.bake(kind, size), 3000, against="cone", tilt=0.87)["S"].rms
        for kind, size in sizes.items()
    }
    assert rms["brdf-5d"] < 0.01
    anywhere = gtao.tables.errors(gtao.tables.bake("cone-cone", 4), 200, against="cone")["S"].where
    assert anywhere["chi"] != 0
    assert 0.02 < rms["brdf-4d"] < rms["brdf-3d"]
    assert rms["brdf-4d"] < rms["cone-cone"]


@pytest.mark.parametrize(("encoding", "step"), [("unorm8", 1 / 255), ("unorm16", 1 / 65535), ("half", 2**-11)])
def test_encodings_round_to_the_nearest(encoding, step):
    table = gtao.tables.bake("cone-lobe", 8)
    rounded = gtao.tables.quantised(table, encoding)
    error = np.abs(rounded.values - table.values).max()
    assert 0 < error <= 0.5 * step * 1.001
    assert rounded.settings["encoding"] == encoding
    assert table.settings.get("encoding") is None


def test_blocks_cost_more_than_bytes():
    table = gtao.tables.bake("brdf-4d", (16, 16, 12, 12))
    rms = [gtao.tables.errors(gtao.tables.quantised(table, name), 3000)["S"].rms for name in ("float", "unorm8", "bc4")]
    assert rms[0] < rms[1] < rms[2]


@pytest.mark.parametrize(
    ("options", "word"),
    [({"against": "x"}, "against"), ({"uniform": "x"}, "uniform"), ({"tilt": 0.0}, "tilt"), ({"n": 0}, "n must be")],
)
def test_wrong_options_are_refused(options, word):
    table = gtao.tables.bake("cone-cone", 4)
    with pytest.raises(gtao.ConfigError, match=word):
        gtao.tables.errors(table, **options)


def test_tables_without_a_truth_are_refused():
    with pytest.raises(gtao.ConfigError, match="knows no cones"):
        gtao.tables.errors(gtao.tables.environment_brdf(4), against="cone")
    table = gtao.tables.bake("brdf-3d", 4)
    with pytest.raises(gtao.ConfigError, match="another BRDF"):
        gtao.tables.errors(replace(table, settings={"brdf": "another"}))
