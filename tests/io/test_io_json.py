"""Canonical JSON: one text per value, infinities as words, no NaN."""

import json
import math
from dataclasses import dataclass

import numpy as np
import pytest

import gtao
from gtao.errors import RecordError
from gtao.io.jsontext import canonical_json, plain, pretty_json, read_json, with_infinities


@dataclass(frozen=True)
class Option:
    size: int = 3
    limit: float = math.inf


def test_canonical_text_does_not_depend_on_order():
    assert canonical_json({"b": 1, "a": [True, None, "ü"]}) == '{"a":[true,null,"ü"],"b":1}'
    assert canonical_json({"a": [True, None, "ü"], "b": 1}) == canonical_json({"b": 1, "a": (True, None, "ü")})


def test_numbers_are_plain_and_exact():
    values = {"f": np.float32(0.1), "i": np.int64(7), "b": np.bool_(True), "a": np.array([[1, 2]], np.uint16)}
    parsed = json.loads(canonical_json(values))
    assert parsed == {"f": float(np.float32(0.1)), "i": 7, "b": True, "a": [[1, 2]]}
    assert parsed["b"] is True
    third = 1 / 3
    assert json.loads(canonical_json(third)) == third


def test_infinities_are_words_and_come_back():
    assert plain([math.inf, -math.inf, np.float32(np.inf)]) == ["inf", "-inf", "inf"]
    assert with_infinities({"a": ["inf", {"b": "-inf"}], "c": "information"}) == {
        "a": [math.inf, {"b": -math.inf}],
        "c": "information",
    }


@pytest.mark.parametrize("method", [gtao.GTAO(), gtao.GTAO.as_published(radius=2.0)])
def test_configurations_survive(method):
    assert gtao.method_from_dict(with_infinities(json.loads(canonical_json(method)))) == method


def test_dataclasses_name_their_type():
    assert plain(Option()) == {"type": "Option", "size": 3, "limit": "inf"}


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ({"a": [1, math.nan]}, r"value\.a\[1\] is NaN"),
        ({"a": np.array([np.nan])}, r"value\.a\[0\] is NaN"),
        ({1: 2}, "has the key 1; keys must be strings"),
        ({"a": object()}, r"value\.a is a object, which a record cannot hold"),
        ({"a": {1, 2}}, r"value\.a is a set"),
        ({"a": Option}, r"value\.a is a type"),
    ],
)
def test_what_json_cannot_hold_is_named(value, message):
    with pytest.raises(RecordError, match=message):
        canonical_json(value)


def test_pretty_text_is_sorted_and_ends_a_line(tmp_path):
    text = pretty_json({"b": 1, "a": 2})
    assert text == '{\n  "a": 2,\n  "b": 1\n}\n'
    (tmp_path / "a.json").write_text(text)
    assert read_json(tmp_path / "a.json", "thing") == {"a": 2, "b": 1}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no thing at .*; check the path"),
        (b"", "is not a thing"),
        (b'{"a": 1', "is not a thing"),
        (b'{"a": NaN}', "it holds NaN, which is not JSON"),
        (b"\xff\xfe\x00", "it is not text"),
        (b"[" * 100_000, "is not a thing"),
    ],
)
def test_unreadable_json_is_one_line(tmp_path, content, message):
    path = tmp_path / "a.json"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(RecordError, match=message) as caught:
        read_json(path, "thing")
    assert "\n" not in str(caught.value)


def test_a_folder_is_no_json(tmp_path):
    with pytest.raises(RecordError, match="cannot read thing"):
        read_json(tmp_path, "thing")
