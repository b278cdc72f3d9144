"""What the project claims of the published pipeline, on the record that the documentation shows."""

from pathlib import Path

import pytest

import gtao

PATH = Path(__file__).parents[1] / "references" / "temporal" / "record.json"


@pytest.fixture(scope="module")
def numbers():
    return gtao.io.read_record(PATH)["numbers"]


def test_a_cycle_of_frames_errs_hardly_more_than_one_frame_with_as_many_directions(numbers):
    for row in numbers["still"].values():
        assert row["variants"]["published"]["truth"]["24"] <= 1.15 * row["singles"]["half resolution"]["truth"]


def test_nothing_drifts(numbers):
    for row in numbers["still"].values():
        bias = row["cycles"]["published"]
        assert abs(bias["mean"][-1]) < 0.002
        assert abs(bias["last"][-1] - bias["last"][1]) < 1e-4


def test_the_clamp_keeps_ghosts_out_where_the_neighbourhood_is_calm(numbers):
    rows = numbers["ghosts"]["passing_object"]["pipelines"]
    lag = {name: row["ghosting"]["lag"] for name, row in rows.items()}
    energy = {name: row["ghosting"]["energy"] for name, row in rows.items()}
    assert lag["clamp, closed window"] < lag["published"] < 0.5 * lag["no clamp"] < 0.5 * lag["no clamp, no depth test"]
    assert energy["published"] < 0.5 * energy["no clamp"]
    assert lag["no spatial filter"] > 2 * lag["published"]


def test_the_window_trades_ghosts_for_flicker(numbers):
    for rows in numbers["windows"].values():
        widths = sorted(rows, key=float)
        flicker = [rows[w]["flicker"]["deviation"] for w in widths]
        lag = [rows[w]["ghosting"]["lag"] for w in widths]
        assert flicker == sorted(flicker, reverse=True)
        assert lag == sorted(lag)
