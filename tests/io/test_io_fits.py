"""Coefficient files: the same bits back, and one line for what is not one."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

import gtao
from gtao.data.multibounce import FORM_PARAMETERS
from gtao.errors import RecordError
from gtao.io import fit_from_dict, fit_to_dict, read_fit, write_fit


def fit(form="four_parameter", **changes):
    n = len(FORM_PARAMETERS[form])
    rng = np.random.default_rng(4)
    values = {
        "form": form,
        "coefficients": tuple(float(v) for v in rng.normal(size=n)),
        "bounces": 4.0,
        "source": "a record",
        "standard_errors": tuple(float(v) for v in rng.random(n)),
        "intervals": tuple((float(a) - 1, float(a)) for a in rng.random(n)),
        "level": 0.95,
    }
    return gtao.MultibounceFit(**{**values, **changes})


@pytest.mark.parametrize("form", [f for f, names in FORM_PARAMETERS.items() if names])
def test_every_form_comes_back_bit_for_bit(tmp_path, form):
    original = fit(form)
    write_fit(tmp_path / "c.json", original)
    assert read_fit(tmp_path / "c.json") == original


@pytest.mark.parametrize("original", [gtao.JIMENEZ2016, gtao.SPHERE, fit(bounces=math.inf), fit(intervals=None)])
def test_what_is_unknown_stays_unknown(tmp_path, original):
    write_fit(tmp_path / "c.json", original)
    assert read_fit(tmp_path / "c.json") == original
    assert "Infinity" not in (tmp_path / "c.json").read_text()


def test_the_file_is_made_for_people():
    entry = json.loads(json.dumps(fit_to_dict(gtao.JIMENEZ2016)))
    assert entry["coefficients"]["a1"]["value"] == 2.0404
    assert entry["kind"] == "gtao.multibounce"


def test_a_read_fit_works():
    V, rho = np.full((2, 2), 0.5, np.float32), np.full((2, 2, 3), 0.5, np.float32)
    got = gtao.multibounce(V, rho, fit=fit_from_dict(fit_to_dict(gtao.JIMENEZ2016)))
    assert np.array(got) == pytest.approx(0.6809625, abs=1e-6)


def changed(**changes):
    data = json.loads(json.dumps(fit_to_dict(fit())))
    for path, value in changes.items():
        *parents, last = path.split("__")
        place = data
        for key in parents:
            place = place[key]
        if value is ...:
            del place[last]
        else:
            place[last] = value
    return data


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ([], "not multi-bounce coefficients: 'kind' must be 'gtao.multibounce'"),
        (changed(kind="x"), "'kind' must be"),
        (changed(schema=2), "coefficients have schema 2, this gtao knows 1"),
        (changed(form="cubic"), "unknown form 'cubic'; known are linear_cubic"),
        (changed(form="linear_cubic"), "has coefficients a1, a0, b1, b0, c1, c0, got k0, k1, k2, k3"),
        (changed(form=3), "'form' must be a string, got 3"),
        (changed(source=...), "'source' must be a string, got None"),
        (changed(coefficients=[1, 2]), "'coefficients' must be an object of objects"),
        (changed(coefficients__k2=...), "got k0, k1, k3"),
        (changed(coefficients__k2__value="1"), "coefficient k2 must be a number, got '1'"),
        (changed(coefficients__k2__value=True), "coefficient k2 must be a number, got True"),
        (changed(coefficients__k2__value="inf"), "coefficients must be finite"),
        (changed(coefficients__k2__standard_error=...), "standard errors must be given for all coefficients or"),
        (changed(coefficients__k2__interval=[1]), r"the interval of k2 must be \[low, high\], got \[1\]"),
        (changed(coefficients__k2__interval=[1, "x"]), "interval must be a number, got 'x'"),
        (changed(bounces="many"), "bounces must be a number, got 'many'"),
        (changed(bounces=0), "bounces must be at least 1"),
        (changed(level=None), "intervals need a confidence level"),
        (changed(level=95), "intervals need a confidence level"),
    ],
)
def test_wrong_files(tmp_path, data, message):
    path = tmp_path / "c.json"
    path.write_text(json.dumps(data))
    with pytest.raises(RecordError, match=message) as caught:
        read_fit(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_missing_file(tmp_path):
    with pytest.raises(RecordError, match=r"no coefficient file at .*c\.json; check the path"):
        read_fit(tmp_path / "c.json")


def test_nan_is_not_written(tmp_path):
    with pytest.raises(RecordError, match="is NaN"):
        write_fit(tmp_path / "c.json", fit(standard_errors=(0.1, math.nan, 0.1, 0.1)))
    assert list(tmp_path.iterdir()) == []


def test_a_record_of_a_refit_holds_its_fit():
    folder = Path(__file__).parents[2] / "fits" / "multibounce" / "2026-11"
    stored = gtao.io.read_fit(folder / "coefficients.json")
    found = gtao.io.fit_of_record(gtao.io.read_record(folder / "record.json"))
    for name in ("form", "coefficients", "bounces", "standard_errors", "intervals", "level"):
        assert getattr(found, name) == getattr(stored, name)
    with pytest.raises(gtao.RecordError, match="no whole multi-bounce fit"):
        gtao.io.fit_of_record({"numbers": {"fit": {}}})
