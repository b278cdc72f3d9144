"""The depth pyramid against an oracle that goes texel by texel, and how its levels are chosen and read."""

import numpy as np
import pytest
from oracles import pyramids

from gtao import backend
from gtao.kernels import pyramid

import drjit as dr  # isort: skip  (after gtao, which chooses the LLVM library)

SIZES = [(1, 1), (2, 2), (16, 16), (7, 5), (1, 9), (33, 17), (20, 31)]


def depth(width, height, holes=True):
    rng = np.random.default_rng(width * 100 + height)
    z = rng.uniform(1, 4, (height, width))
    if holes:
        z[rng.random((height, width)) < 0.15] = np.inf
    return z


def built(precision, z, n_levels, name, start=0.4, end=1.2):
    height, width = z.shape
    table = pyramid.Table.of(width, height, n_levels)
    Float = precision.Float
    buffer = pyramid.build(Float(z.ravel()), table, name, Float(start), Float(end), precision.types)
    return buffer, table


@pytest.mark.parametrize("name", sorted(pyramid.FILTERS))
@pytest.mark.parametrize("size", SIZES)
def test_levels(precision, name, size):
    z = depth(*size)
    buffer, table = built(precision, z, 5, name)
    want = pyramids.levels(z, 5, name, 0.4, 1.2)
    assert table.size == dr.width(buffer) == sum(image.size for image in want)
    got = np.array(buffer)
    for k, image in enumerate(want):
        part = got[table.offsets[k] :][: image.size].reshape(image.shape)
        assert (np.isinf(part) == np.isinf(image)).all()
        surface = np.isfinite(image)
        # Means of four, four times over; least and greatest are exact.
        tolerance = {"float64": 1e-14, "float32": 2e-6}[precision.name]
        assert np.abs(part[surface] - image[surface]).max(initial=0) < tolerance


def test_a_thin_near_thing_disappears_from_the_weighted_levels_only(precision):
    z = np.full((8, 8), 5.0)
    z[:, 3] = 2.0
    lowest = {}
    for name in pyramid.FILTERS:
        buffer, table = built(precision, z, 2, name)
        lowest[name] = np.array(buffer)[table.offsets[1] :].min()
    # Of reciprocals 1/5 and 1/2 the mean is 0.35.
    harmonic = 1 / 0.35
    assert lowest == pytest.approx(
        {"weighted": 5.0, "max": 5.0, "min": 2.0, "average": 3.5, "harmonic": harmonic, "rotated_grid": 2.0}
    )


def test_constant_depth_stays(precision):
    z = np.full((9, 13), 2.5)
    for name in pyramid.FILTERS:
        buffer, _ = built(precision, z, 4, name)
        assert np.array(buffer) == pytest.approx(2.5, abs=1e-6)


@pytest.mark.parametrize("size", SIZES)
def test_every_pixel_reads_the_texel_that_contains_it(precision, size):
    width, height = size
    z = depth(width, height, holes=False)
    buffer, table = built(precision, z, 4, "max")
    want = pyramids.levels(z, 4, "max")
    y, x = (v.ravel().astype(np.float64) for v in np.mgrid[:height, :width])
    for k in range(4):
        lanes = precision.types.UInt(np.full(x.size, k, dtype=np.uint32))
        got = pyramid.fetch_level(buffer, table, precision.Float(x), precision.Float(y), lanes, precision.types)
        expected = want[k][(y // 2**k).astype(int), (x // 2**k).astype(int)]
        assert np.array(got) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("size", [(16, 16), (7, 5), (33, 17)])
def test_interpolation_inside_a_level(precision, orthographic, size):
    width, height = size
    z = depth(width, height, holes=False)
    buffer, table = built(precision, z, 4, "max")
    images = pyramids.levels(z, 4, "max")
    rng = np.random.default_rng(2)
    x, y = rng.uniform(0, width - 1, 50), rng.uniform(0, height - 1, 50)
    x[0], y[0], x[1], y[1] = 0, 0, width - 1, height - 1
    for k in range(4):
        image = images[k] if orthographic else 1 / images[k]
        expected = []
        for u, v in zip((x + 0.5) / 2**k - 0.5, (y + 0.5) / 2**k - 0.5, strict=True):
            u, v = np.clip(u, 0, image.shape[1] - 1), np.clip(v, 0, image.shape[0] - 1)
            j = min(int(v), max(image.shape[0] - 2, 0))
            rows = [np.interp(u, np.arange(image.shape[1]), image[row]) for row in (j, min(j + 1, image.shape[0] - 1))]
            expected.append(rows[0] + (v - j) * (rows[1] - rows[0]))
        lanes = precision.types.UInt(np.full(x.size, k, dtype=np.uint32))
        points = precision.Float(x), precision.Float(y)
        got = np.array(pyramid.bilinear_level(buffer, table, *points, lanes, orthographic, precision.types))
        assert (got if orthographic else 1 / got) == pytest.approx(np.array(expected), rel=2e-6)


def test_no_wild_address_for_coordinates_that_are_no_numbers(precision):
    z = depth(8, 8)
    buffer, table = built(precision, z, 3, "min")
    x = precision.Float([np.nan, -1.0, 1e9])
    got = pyramid.fetch_level(buffer, table, x, x, precision.types.UInt(2), precision.types)
    assert set(np.array(got)) <= set(np.array(buffer))


@pytest.mark.parametrize("offset", [-1.0, 0.0, 2.5, 3.3])
def test_level_of_a_distance(precision, offset):
    """clamp(log2 d - offset), then to the nearest: what a sampler does that filters neither texels nor levels."""
    table = pyramid.Table.of(4096, 4096, 5)
    d = np.concatenate([np.geomspace(0.01, 1e5, 4001), [0.0]])
    want = np.clip(np.log2(np.maximum(d, 1e-9)) - offset, 0, 4)
    got = np.array(pyramid.level(precision.Float(d), precision.Float(2 ** (0.5 - offset)), table, precision.types))
    decided = np.abs(want % 1 - 0.5) > 1e-5  # else rounding decides
    assert np.array_equal(got[decided], np.floor(want + 0.5)[decided].astype(int))
    assert decided.sum() > 3900
    assert set(got) == set(range(5))


def test_derivatives_pass_through_the_levels():
    Float = dr.float64_array_t(backend.default_float())
    types = backend.types_of(Float)
    z = depth(9, 6)
    rng = np.random.default_rng(3)
    for name in pyramid.FILTERS:
        table = pyramid.Table.of(9, 6, 4)
        direction = rng.standard_normal(z.size)

        def flat(values, name=name, table=table):
            return pyramid.build(values, table, name, Float(0.4), Float(1.2), types)

        values = Float(z.ravel())
        dr.enable_grad(values)
        dr.set_grad(values, Float(direction))
        got = np.array(dr.forward_to(flat(values)))
        h = 1e-7
        ends = [np.array(flat(Float(z.ravel() + sign * h * direction))) for sign in (1, -1)]
        surface = np.isfinite(ends[0])
        want = (ends[0][surface] - ends[1][surface]) / (2 * h)
        assert got[surface] == pytest.approx(want, abs=1e-6)
