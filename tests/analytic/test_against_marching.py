"""The dense estimator against brute-force ray marching of the same height field."""

import numpy as np
import pytest
from analytic import _tables
from analytic._frames import occlusion
from oracles import fields, heightfield
from scipy import ndimage

TARGET = 0.004
"""The oracle's own noise is 0.001 to 0.002; the rest is 32 slices and 128 steps."""


@pytest.mark.parametrize("radius", [np.inf, 0.5], ids=["unlimited", "radius"])
@pytest.mark.parametrize("name", _tables.MARCHED)
def test_smooth_fields(name, radius):
    result = _tables.against_marching(name, radius)
    assert result["mean"] < 0.995
    assert result["rmse"] < TARGET
    # 200 independent pixels average the oracle's noise away.
    assert abs(result["bias"]) < 0.0015


def test_uniform_weighting():
    """Solid-angle weighting counts the grazing directions that the cosine suppresses: noise and error double."""
    result = _tables.against_marching("bumps, tilted, perspective", weighting="uniform")
    assert result["rmse"] < 2 * TARGET
    assert abs(result["bias"]) < 0.003


def test_a_radius_of_a_few_pixels():
    """The sharp cut stays exact when only a handful of texels lie within the radius."""
    result = _tables.against_marching("waves from above", radius=0.15)
    assert 0.9 < result["mean"] < 0.999
    assert result["rmse"] < TARGET


@pytest.mark.parametrize("radius", [np.inf, 0.4], ids=["unlimited", "radius"])
def test_blocks(radius):
    """Vertical walls, nearest fetch without snapping; both sides know the same blocks.

    Pixels that touch a wall are left out: the search begins one pixel away, so a wall half a pixel away is seen too
    far. Elsewhere walls are found within a gap of 56/512 pixels: below 0.002 for walls two pixels away.
    """
    field = fields.blocks(size=40, n_cells=5)
    clear = ndimage.maximum_filter(field.view_z, 3) == ndimage.minimum_filter(field.view_z, 3)
    pixels = np.argwhere(clear)
    pixels = pixels[np.random.default_rng(2).choice(len(pixels), 250, replace=False)]
    truth = heightfield.visibility(field, pixels, n_rays=2304, surface="nearest", radius=radius)
    got = occlusion(field, radius=radius, n_slices=32, n_steps=512, step_exponent=1.0, snap_to_texel=False)
    error = got[pixels[:, 0], pixels[:, 1]] - truth.visibility
    assert truth.visibility.mean() < 0.95
    assert np.sqrt(np.mean(error**2)) < TARGET + 0.002
    assert abs(error.mean()) < 0.002


def test_background_occludes_nothing():
    """Half of the frame is open sky; the other half must not notice a difference to the oracle's."""
    field = _tables.MARCHED["bumps, tilted, perspective"]()
    view_z = field.view_z.copy()
    view_z[:, 20:] = np.inf
    holed = fields.Field(view_z, field.normal_v, field.camera, orthographic=False)
    pixels = np.argwhere(np.isfinite(view_z[:, :18]))[::4]
    truth = heightfield.visibility(holed, pixels, n_rays=2304)
    image = occlusion(holed, **_tables.DENSE)
    assert (image[:, 20:] == 1).all()
    assert np.isfinite(image).all()
    error = image[pixels[:, 0], pixels[:, 1]] - truth.visibility
    assert np.sqrt(np.mean(error**2)) < TARGET
