"""The committed errors of tables: what was promised, a row measured again, and the files that are shipped."""

import hashlib
import math
from dataclasses import replace
from pathlib import Path

import pytest

import gtao
from gtao.tables.bake import fitted_texels

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "gtao" / "data" / "tables"


@pytest.fixture(scope="module")
def record():
    return gtao.io.read_record(ROOT / "references" / "tables" / "record.json")


def row(record, kind, axes, size):
    (found,) = [
        entry
        for entry in record["numbers"]["tables"]
        if (entry["kind"], entry["axes"], entry["size"]) == (kind, axes, list(size))
    ]
    return found


# Root mean square errors that were known of tables of 32 texels along every axis, to 5 % for other random places.
@pytest.mark.parametrize(
    ("kind", "axes", "channel", "float_", "bc4"),
    [
        ("cone-cone", "published", "S", 0.0143, 0.0147),
        ("cone-cone", "cosine", "S", 0.0094, 0.0099),
        ("cone-cone", "linear", "S", 0.0031, 0.0047),
        ("cone-cone", "overlap", "S", 0.00062, 0.0007),
        ("cone-lobe", "linear", "S", 0.0038, 0.0069),
        ("brdf-3d", "linear", "S_A", 0.0017, 0.0041),
        ("brdf-4d", "linear", "S_A", 0.0042, 0.0071),
        ("brdf-4d", "cosine", "S_A", 0.0052, 0.0071),
    ],
)
def test_plain_axes_are_as_good_as_was_known(record, kind, axes, channel, float_, bc4):
    size = [32] * (4 if kind == "brdf-4d" else 3)
    entry = row(record, kind, axes, size)
    assert entry["encodings"]["float"][channel]["rms"] <= 1.05 * float_
    assert entry["encodings"]["float"][channel]["rms"] <= entry["sampled"][channel]["rms"]
    assert entry["encodings"]["bc4"][channel]["rms"] <= 1.05 * bc4


def test_default_axes_beat_them_by_far(record):
    for kind, size in (("cone-cone", [32] * 3), ("cone-lobe", [32] * 3), ("brdf-4d", [32] * 4)):
        plain, own = (
            row(record, kind, axes, size)["encodings"]["float"]["S"]["rms"]
            for axes in ("linear", gtao.kernels.table_axes.DEFAULT_AXES[kind])
        )
        assert own < plain / 5
    assert row(record, "cone-cone", "nested", [32] * 3)["encodings"]["float"]["S"]["rms"] < 0.001
    few = row(record, "brdf-4d", "lobe", [16] * 4)["encodings"]["unorm8"]["S"]["rms"]
    assert few < row(record, "brdf-4d", "linear", [32] * 4)["encodings"]["float"]["S"]["rms"]


def test_the_quadrature_converged(record):
    assert max(entry["quadrature_error"] for entry in record["numbers"]["tables"]) < 1e-4


def test_five_coordinates_are_worth_their_texels(record):
    cones = record["numbers"]["cones"]
    for tilt in ("30", "60", "90"):
        four = cones["brdf-4d, lobe, 32x32x32x32"][tilt]["rms"]
        assert cones["brdf-5d, lobe, 8x16x8x8x8"][tilt]["rms"] < 0.5 * four
        assert cones["brdf-5d, lobe, 16x20x12x12x8"][tilt]["rms"] < 0.2 * four


def test_wide_cones_belong_into_tables(record):
    wide = record["numbers"]["apertures"]
    assert wide["table"] < 0.1 * wide["cut"]


def test_open_surfaces_stay_open(record):
    for found in record["numbers"]["open"].values():
        assert -0.01 < found["mean"] <= 0


def test_a_row_is_measured_again(record):
    entry = row(record, "brdf-3d", "lobe", (16, 16, 16))
    table = gtao.tables.bake("brdf-3d", 16, fitted=False)
    table = replace(table, values=fitted_texels(table.values))
    found = gtao.tables.errors(table, record["config"]["n_places"], record["seed"])
    for channel in found.channels:
        kept = entry["encodings"]["float"][channel.name]
        assert channel.rms == pytest.approx(kept["rms"], rel=1e-3)
        assert channel.max == pytest.approx(kept["max"], rel=1e-2)


def test_the_shipped_tables_are_those_of_the_record(record):
    for kind, entry in record["numbers"]["shipped"].items():
        content = (PACKAGE / f"{kind}.npz").read_bytes()
        assert hashlib.sha256(content).hexdigest() == entry["sha256"]
        table = gtao.data.specular.shipped(kind)
        assert math.prod(table.size) * table.n_channels <= 737280
