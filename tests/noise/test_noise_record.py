"""What the committed record of noise says, as the documentation claims it; and that the run works."""

import subprocess
import sys
from pathlib import Path

import pytest

import gtao

ROOT = Path(__file__).parents[2]
RUN = ROOT / "references" / "noise" / "run.py"
FILTERED = ("spatial 4×4", "edge-aware", "edge-aware, 3 passes", "plane-aware")


@pytest.fixture(scope="module")
def numbers():
    return gtao.io.read_record(RUN.parent / "record.json")["numbers"]


def ranked(rows, n):
    return sorted(rows, key=lambda name: rows[name][n]["deviation"])


def test_counts_of_the_slides_and_of_their_tables(numbers):
    found = {name: (row["directions"], row["positions"]) for name, row in numbers["counts"].items()}
    assert found == {
        "spatial_4x4": (48, 32),
        "spatial_4x4_unbracketed": (12, 32),
        "spatial_4x4_fine": (96, 128),
        "spatial_4x4_spread": (96, 128),
    }


@pytest.mark.parametrize("spatial", FILTERED)
def test_gradient_noise_is_best_in_space_and_the_golden_ratio_in_time(numbers, spatial):
    rows = numbers["patterns"][spatial]
    assert all(name.startswith("interleaved_gradient") for name in ranked(rows, "1")[:3])
    assert set(ranked(rows, "24")[:2]) == {"blue_noise", "interleaved_gradient_golden"}


def test_the_order_of_rotations_matters_to_filters_that_change_sides(numbers):
    rows = numbers["patterns"]["spatial 4×4"]
    assert rows["spatial_4x4_spread"]["24"]["deviation"] < 0.7 * rows["spatial_4x4"]["24"]["deviation"]
    assert rows["interleaved_gradient_golden"]["24"]["deviation"] < 0.4 * rows["spatial_4x4"]["24"]["deviation"]


def test_no_pattern_that_moves_is_biased(numbers):
    for name, rows in numbers["patterns"]["no filter"].items():
        if name != "none":
            assert abs(rows["24"]["bias"]) < 0.002


@pytest.mark.slow
def test_the_run_works(tmp_path):
    """Every part of it, on small frames."""
    command = [sys.executable, str(RUN), "--quick", "-o", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    made = gtao.io.read_record(tmp_path / "record.json")
    kept = gtao.io.read_record(RUN.parent / "record.json")
    assert made["numbers"].keys() == kept["numbers"].keys()
    assert made["numbers"]["counts"] == kept["numbers"]["counts"]
    # Spectra and masks do not depend on the frames.
    for name in ("low", "sigmas"):
        for row, limits in kept["numbers"][name].items():
            assert made["numbers"][name][row] == pytest.approx(limits, rel=1e-3)
