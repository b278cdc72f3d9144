"""Tables that come with the package: small, as good as promised, and what baking them again gives."""

from pathlib import Path

import numpy as np
import pytest

import gtao
from gtao.data.specular import SHIPPED, shipped
from gtao.kernels.table_axes import AXES, DEFAULT_AXES
from gtao.tables.bake import fitted_texels, values_at

FOLDER = Path(gtao.__file__).parent / "data" / "tables"
#: Root mean square errors, as the record of references/tables has them, with 10 % for the few samples here.
RMS = {"cone-cone": 1.8e-4, "brdf-4d": 0.0008, "brdf-5d": 0.0015, "environment-brdf": 4e-5}
CODES = {"cone-cone": 65535, "brdf-4d": 255, "brdf-5d": 255, "environment-brdf": 65535}


def test_they_are_there_and_small():
    files = sorted(FOLDER.iterdir())
    assert [file.stem for file in files] == sorted(SHIPPED)
    assert sum(file.stat().st_size for file in files) < 1.5e6


@pytest.mark.parametrize("kind", SHIPPED)
def test_texels_are_those_of_the_quadrature(kind):
    """Some of them are computed again: the same integers, but for rounding that another processor does otherwise."""
    table = shipped(kind)
    axes = AXES[kind, table.axes]
    assert table.axes == DEFAULT_AXES[kind]
    found, stored = [], []
    for middle in np.random.default_rng(7).integers(1, np.array(table.size) - 1, (40, len(table.size))):
        # Texels are fitted to three values along every axis.
        places = np.stack(np.meshgrid(*(m + np.arange(-1, 2) for m in middle), indexing="ij"), axis=-1)
        unit = [places[..., i].ravel() / (n - 1) for i, n in enumerate(table.size)]
        values = values_at(axes, unit).values.reshape(*places.shape[:-1], -1)
        found.append(fitted_texels(values)[(1,) * len(middle)].astype(np.float32))
        stored.append(table.values[tuple(middle[::-1])])
    codes = [np.floor(np.float64(x) * CODES[kind] + 0.5) for x in (found, stored)]
    assert np.abs(codes[0] - codes[1]).max() <= 1
    assert np.mean(codes[0] == codes[1]) > 0.97


@pytest.mark.parametrize("kind", SHIPPED)
def test_their_errors_are_what_the_record_says(kind):
    assert gtao.tables.errors(shipped(kind), 4000, seed=2).channels[0].rms < 1.1 * RMS[kind]


def test_read_once():
    assert shipped("brdf-4d") is shipped("brdf-4d")


def test_others_are_refused():
    with pytest.raises(gtao.ConfigError, match="no table 'brdf-3d' is shipped"):
        shipped("brdf-3d")
