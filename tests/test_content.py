"""What the repository keeps beside the package: references, fits, and the page made of them."""

import hashlib
import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import gtao

ROOT = Path(__file__).parents[1]
FIT = ROOT / "fits" / "multibounce" / "2026-11"
# Packaged constants keep four decimals of the record's numbers.
FOUR_DECIMALS = 0.5e-4

COMPARISON = ROOT / "references" / "comparison" / "record.json"
RECORDS = [*sorted(ROOT.glob("fits/*/*/record.json")), *sorted(ROOT.glob("references/*/record.json"))]


def load(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("path", RECORDS, ids=lambda p: p.parent.name)
def test_records_are_valid_and_their_outputs_unchanged(path):
    record = gtao.io.read_record(path)
    for entry in record["outputs"]:
        content = (path.parent / entry["path"]).read_bytes()
        assert hashlib.sha256(content).hexdigest() == entry["sha256"], entry["path"]


def test_the_packaged_refit_is_that_of_its_record():
    stored = gtao.io.read_fit(FIT / "coefficients.json")
    packaged = gtao.REFIT_2026_11
    assert (packaged.form, packaged.bounces, packaged.level) == (stored.form, stored.bounces, stored.level)
    for name in ("coefficients", "standard_errors", "intervals"):
        assert np.abs(np.subtract(getattr(packaged, name), getattr(stored, name))).max() <= FOUR_DECIMALS


def test_the_fit_was_made_from_the_reference_set():
    manifest = json.loads((ROOT / "references" / "manifest.json").read_text())
    inputs = gtao.io.read_record(FIT / "record.json")["inputs"]
    assert {i["scene"]: i["views"][0] for i in inputs} == {
        name: view["fingerprint"] for name, view in manifest["views"].items()
    }


def test_a_reference_view_can_still_be_reproduced():
    """One view is traced again: identical counts, or means within their standard errors on other machines."""
    make = load(ROOT / "references" / "make.py")
    settings = json.loads((ROOT / "references" / "set.json").read_text())
    known = json.loads((ROOT / "references" / "manifest.json").read_text())["views"]["stairs"]
    good, text = make.compare("stairs", known, make.describe(*make.trace(settings, "stairs")))
    assert good, text


def test_a_changed_view_would_be_noticed():
    make = load(ROOT / "references" / "make.py")
    known = json.loads((ROOT / "references" / "manifest.json").read_text())["views"]["stairs"]
    brighter = known | {"counts_sha256": "0" * 64, "mean_T": [known["mean_T"][0] + 0.01, *known["mean_T"][1:]]}
    assert not make.compare("stairs", known, brighter)[0]
    fewer = known | {"counts_sha256": "0" * 64, "n_pixels": known["n_pixels"] - 1}
    assert not make.compare("stairs", known, fewer)[0]


def test_the_pages_made_of_records_say_what_they_say():
    run = subprocess.run([sys.executable, ROOT / "docs" / "generate.py", "--check"], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr


def test_the_committed_validation_meets_its_promises():
    """The bounds that the project claims, on the record that the documentation shows."""
    numbers = gtao.io.read_record(ROOT / "references" / "validation" / "record.json")["numbers"]
    for row in numbers["planes"]:
        assert abs(row["exact"]["low"] - 1) < 1e-3
        assert abs(row["exact"]["high"] - 1) < 1e-3
    assert max(row["rmse"] for row in numbers["marching"]) < 0.004
    assert max(row["dense_rmse_where_knowable"] for row in numbers["scenes"] if row["solid"]) < 0.010


@pytest.fixture(scope="module")
def comparison():
    return gtao.io.read_record(COMPARISON)["numbers"]["scenes"]


def test_the_committed_comparison_is_of_all_scenes_and_methods(comparison):
    assert set(comparison) == set(gtao.render.scenes.names("procedural"))
    for scene in comparison.values():
        assert {row["method"] for row in scene["methods"]} >= set(gtao.config.NAMED)


def test_the_faithful_estimator_is_closest_to_the_height_field_at_equal_samples(comparison):
    """Or the record says which deviation of the method that is closer helps there."""
    for scene in comparison.values():
        groups = {row["group"] for row in scene["methods"] if row["group"].endswith("taps per pixel")}
        assert len(groups) == 2
        for group in groups:
            errors = {row["method"]: row["field_rmse"] for row in scene["methods"] if row["group"] == group}
            closest = min(errors, key=errors.__getitem__)
            assert closest == "gtao" or any(note.startswith(f"{group}: {closest} ") for note in scene["notes"])


def test_the_recommended_pipeline_beats_xegtao_on_every_scene(comparison):
    gains = []
    for scene in comparison.values():
        errors = {row["method"]: row["rmse"] for row in scene["methods"] if row["group"] == "own defaults"}
        assert errors["recommended"] < errors["xegtao-high"]
        gains.append(1 - errors["recommended"] / errors["xegtao-high"])
    assert np.mean(gains) >= 0.25


def test_the_two_ground_truths_of_a_depth_buffer_agree(comparison):
    # Twelve scenes, two numbers each: 4 standard errors are exceeded by chance once in 600 records.
    for scene in comparison.values():
        for number in (scene["truths"]["difference"], scene["truths"]["mean_square"]):
            assert abs(number["value"]) < 4 * number["standard_error"]


def test_dense_estimates_reach_the_limit_of_one_layer_on_solid_scenes(comparison):
    for scene in comparison.values():
        dense = next(row["corrected_rmse"] for row in scene["methods"] if row["method"] == "gtao, dense")
        assert not scene["solid"] or dense <= 1.1 * scene["limit_rmse"]


def test_error_budgets_add_up_to_the_error_that_was_measured(comparison):
    for scene in comparison.values():
        rows = {row["method"]: row for row in scene["methods"] if row["group"] == "own defaults"}
        for method, budget in scene["budgets"].items():
            assert np.sum(budget["gram"]) == pytest.approx(rows[method]["corrected_rmse"] ** 2, abs=1e-6)


def test_the_defaults_of_smaller_frames_lose_least_of_what_was_measured():
    numbers = gtao.io.read_record(ROOT / "references" / "resolution" / "record.json")["numbers"]
    how = gtao.Downsample()
    for pipeline in ("dense", "recommended"):
        for rows in numbers["mean"][pipeline]["frames"].values():
            errors = {(frame, way): row["full"] for frame, ways in rows.items() for way, row in ways.items()}
            assert min(errors, key=errors.__getitem__) == (f"{how.choice}, {how.place}", "plane-aware")
    for entry in numbers["planes"].values():
        for factor in ("2", "4"):
            assert entry[factor][f"{how.choice}, {how.place}"] == pytest.approx(1, abs=1e-3)
