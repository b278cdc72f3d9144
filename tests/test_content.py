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

RECORDS = [*sorted(ROOT.glob("fits/*/*/record.json")), ROOT / "references" / "validation" / "record.json"]


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


def test_the_validation_page_says_what_the_records_say():
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
