"""An unoccluded plane is fully visible: at any tilt, anywhere in a 100 degree field of view."""

import numpy as np
import pytest
from analytic import _tables
from analytic._frames import occlusion
from oracles import fields

TARGET = 1e-3
"""What 16 slices must achieve: the slice sum is within 1e-4 up to 82 degrees, the rest is float32's depth."""


@pytest.mark.parametrize("tilt", _tables.TILTS)
@pytest.mark.parametrize("noise", ["spatial_4x4", "none"])
def test_exact_measure_sees_the_whole_hemisphere(tilt, noise):
    values = _tables.open_plane(tilt, fetch="linear", noise=noise)
    assert np.abs(values - 1).max() <= TARGET


@pytest.mark.parametrize("tilt", _tables.TILTS)
def test_every_single_pixel_is_open(tilt):
    for field in _tables.open_planes(tilt):
        assert np.abs(occlusion(field, n_slices=16, n_steps=8, fetch="linear") - 1).max() <= TARGET


def test_few_slices_scatter_about_one_without_bias():
    """With 4 slices single pixels are off by ± 2 % at 80 degrees, their mean over the noise tile is not."""
    values = occlusion(fields.tilted_plane(np.radians(80), 0.3, size=16), n_slices=4, n_steps=4, fetch="linear")
    assert 0.01 < np.abs(values - 1).max() < 0.03
    assert values.mean() == pytest.approx(1.0, abs=TARGET)


@pytest.mark.parametrize("tilt", _tables.TILTS)
def test_uniform_weighting_is_one_in_every_slice(tilt):
    """Each clamped open slice covers the same solid angle, so a single slice is already exact.

    Rounding of depth tilts a sample by up to 2^-24 f per pixel of distance (2.4e-5 here), on either side of one slice.
    """
    for n_slices in (1, 16):
        for field in _tables.open_planes(tilt):
            values = occlusion(field, n_slices=n_slices, n_steps=8, fetch="linear", weighting="uniform")
            assert np.abs(values - 1).max() < 3e-4


@pytest.mark.parametrize("distance", [1e-3, 1.0, 1e5])
def test_the_unit_of_length_does_not_matter(distance):
    field = fields.tilted_plane(1.0, 2.0, (0.6, -0.3), distance=distance)
    values = occlusion(field, n_slices=16, n_steps=16, fetch="linear", radius=0.1 * distance)
    assert np.abs(values - 1).max() <= TARGET


def test_orthographic_plane():
    plane = fields.from_above(lambda x, y: (1.5 * x - 2 * y, 1.5 + 0 * x, -2 + 0 * x), size=16)
    values = occlusion(plane, n_slices=16, n_steps=16, fetch="linear")
    assert np.abs(values - 1).max() <= TARGET


@pytest.mark.parametrize("tilt", _tables.TILTS)
def test_published_measure_has_the_error_that_theory_says(tilt):
    """Image-uniform slices are biased off the axis, as quadrature of the same sum predicts.

    The prediction uses 64 slices at fixed azimuths, the estimator 16 rotated ones: both sums converge geometrically,
    with ratio tan²(χ/2) <= 0.33 per slice at χ <= 60 degrees from the axis.
    """
    got = _tables.open_plane(tilt, fetch="linear", slice_measure="screen")
    assert got == pytest.approx(_tables.open_plane_published(tilt), abs=TARGET)
    if tilt >= 40:
        assert np.abs(got - 1).max() > 0.05
        assert got.min() < 1 < got.max()


@pytest.mark.parametrize("tilt", _tables.TILTS[1:])
def test_nearest_texels_darken_tilted_planes(tilt):
    """A snapped sample leaves its slice, an unsnapped one its plane; either can only raise a horizon.

    Each samples a horizon that is never below the tangent plane, so the error is one-sided. Its size is a record of
    what the cheap fetch costs, here with the first steps one pixel long.
    """
    snapped = _tables.open_plane(tilt, fetch="nearest", snap_to_texel=True)
    unsnapped = _tables.open_plane(tilt, fetch="nearest", snap_to_texel=False)
    for values in (snapped, unsnapped):
        assert values.max() < 1 - 1e-3
        assert values.min() > 0.85
    if tilt <= 40:
        assert snapped.mean() > unsnapped.mean()
