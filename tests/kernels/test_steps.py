"""Step laws against their definitions, and how the depth buffer is read at the points that they choose."""

import math

import numpy as np
import pytest

import drjit as dr  # isort: skip

from types import SimpleNamespace

from gtao.kernels import fetch, slices, steps, taps

GOLDEN = (math.sqrt(5) - 1) / 2


def law(name, j, xi, n, p, m, reach):
    """Theory, eq. (63), one number at a time."""
    return {
        "strata": m + ((j + xi) / n) ** p * (reach - m),
        "offset": m + ((j + xi) / n) ** p * reach,
        "at_least": max(((j + xi) / (n + 1)) ** p * reach, m * (j + 1)),
        "whole": ((j + 1 + xi) / (n + 1)) ** p * max(reach, m * (n + 1)),
        "beyond": ((j + 1 + xi) / n) ** p * reach,
    }[name]


@pytest.mark.parametrize("name", steps.LAWS)
@pytest.mark.parametrize("exponent", [1.0, 2.0, 1.7])
# A search shorter than the least distances, and one far longer.
@pytest.mark.parametrize("reach", [2.5, 40.0])
def test_laws_are_the_published_ones(precision, name, exponent, reach):
    n, m, xi = 4, 1.3, 0.37
    for j in range(n):
        d = steps.distance(name, j, precision.Float(xi), n, exponent, precision.Float(m), precision.Float(reach))
        expected = law(name, j, xi, n, exponent, m, reach)
        assert np.array(d)[0] == pytest.approx(expected, rel=precision.tolerance)


def test_jitter_of_steps_goes_on_along_the_golden_ratio(precision):
    n, offset = 3, 0.8
    for j in range(n):
        mine = np.array(steps.jitter("step", precision.Float(offset), j, n))[0]
        assert mine == pytest.approx((offset + j * n * GOLDEN) % 1, abs=precision.tolerance)
        assert np.array(steps.jitter("slice", precision.Float(offset), j, n))[0] == pytest.approx(offset)
        assert np.array(steps.jitter("none", precision.Float(offset), j, n))[0] == 0


WIDTH, HEIGHT = 5, 4
BUFFER = 1.0 + np.random.default_rng(4).random((HEIGHT, WIDTH))


def switches(**options):
    defaults = {
        "width": WIDTH,
        "height": HEIGHT,
        "orthographic": False,
        "fetch": "nearest",
        "snap_to_texel": False,
        "border": "replicate",
        "leaves_frame": True,
    }
    return SimpleNamespace(**(defaults | options))


def read(precision, x, y, **options):
    values = precision.Float(BUFFER.ravel())
    k = switches(**options)
    if k.fetch == "bilinear":
        values = abs(fetch.affine_field(values, WIDTH, HEIGHT, 1.0, False, precision.types))
    result = taps.aim(values, precision.Float(x), precision.Float(y), None, k, precision.types)()
    return tuple(float(np.array(v)[0]) for v in result)


def test_truncation_reads_the_texel_up_and_left(precision):
    assert read(precision, 2.9, 1.2, fetch="floor") == pytest.approx((BUFFER[1, 2], 2.9, 1.2), rel=1e-6)


@pytest.mark.parametrize(("x", "y"), [(2.4, 1.7), (2.0, 1.0), (4.0, 3.0)])
def test_nearest_of_four_is_the_least_around_the_point(precision, x, y):
    x0, y0 = math.floor(x), math.floor(y)
    around = BUFFER[y0 : y0 + 2, x0 : x0 + 2]
    assert read(precision, x, y, fetch="nearest_of_four") == pytest.approx((around.min(), x, y), rel=1e-6)


def test_bilinear_interpolates_the_reciprocal_across_any_step(precision):
    x, y, u, v = 1.25, 2.5, 0.25, 0.5
    f = 1 / BUFFER[2:4, 1:3]
    expected = (1 - v) * ((1 - u) * f[0, 0] + u * f[0, 1]) + v * ((1 - u) * f[1, 0] + u * f[1, 1])
    # The steps of this buffer are depth edges to the fetch that looks for them.
    assert read(precision, x, y, fetch="bilinear") == pytest.approx((1 / expected, x, y), rel=1e-6)
    assert read(precision, x, y, fetch="bilinear", border="shorten", leaves_frame=False)[0] == pytest.approx(
        1 / expected, rel=1e-6
    )


def test_a_replicated_border_keeps_the_position_and_reads_the_last_texel(precision):
    assert read(precision, 7.3, -2.6) == pytest.approx((BUFFER[0, 4], 7.3, -2.6), rel=1e-6)
    assert read(precision, 7.3, -2.6, snap_to_texel=True) == pytest.approx((BUFFER[0, 4], 7, -3), rel=1e-6)


def test_a_clamped_border_moves_the_position_in(precision):
    assert read(precision, 7.3, -2.6, border="clamp") == pytest.approx((BUFFER[2, 3], 3, 2), rel=1e-6)


@pytest.mark.parametrize(("P", "N"), [((0.7, -0.4, -1.0), (0.5, 0.3, 0.8)), ((-0.9, 0.2, -1.0), (-0.6, 0.7, 0.4))])
@pytest.mark.parametrize("phi", [0.3, 1.9, 2.8])
def test_unnormalised_measure_is_the_listing(precision, P, N, phi):
    """Axis, projection and angle in the memo's steps, in three dimensions."""
    N, V = np.array(N) / np.linalg.norm(N), -np.array(P) / np.linalg.norm(P)
    direction = np.array([np.cos(phi), np.sin(phi), 0])
    along = direction - (direction @ V) * V
    axis = np.cross(direction, V)
    left = N - axis * (N @ axis)
    angle = np.sign(along @ left) * np.arccos(np.clip((left @ V) / np.linalg.norm(left), -1, 1))
    lanes = precision.lanes
    Float = precision.Float
    frame = slices.frame(
        "screen_unnormalised",
        tuple(Float(float(v)) for v in V),
        tuple(Float(float(v)) for v in N),
        Float(float(N @ V)),
    )
    nT, ux, uy = frame.normal_and_direction(lanes([np.cos(phi)]), lanes([np.sin(phi)]))
    nT = float(np.array(nT)[0])
    assert math.atan2(nT, N @ V) == pytest.approx(angle, abs=10 * precision.tolerance)
    assert math.hypot(nT, N @ V) == pytest.approx(np.linalg.norm(left), rel=10 * precision.tolerance)
    assert (np.array(ux)[0], np.array(uy)[0]) == pytest.approx(direction[:2], abs=1e-6)


def test_listed_azimuths_are_taken_in_order(precision):
    i = dr.arange(dr.uint32_array_t(precision.Float), 3)
    assert np.array(slices.listed((0.1, 0.7, 0.4), i, precision.Float)) == pytest.approx([0.1, 0.7, 0.4])


def test_steps_without_a_common_divisor_are_marched_one_by_one():
    assert [steps.block_length(n) for n in (1, 32, 33, 37, 64)] == [1, 32, 11, 1, 32]
