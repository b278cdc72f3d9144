"""The depth pyramid against an oracle that goes texel by texel, and how its levels are chosen and read."""

import numpy as np
import pytest
from oracles import pyramids

from gtao.kernels import pyramid

# Rows in pieces of four and not, sides that are halved evenly and not, more levels than there are to a single texel.
SIZES = [(1, 1), (2, 2), (16, 16), (7, 5), (1, 9), (33, 17), (20, 31), (36, 40), (62, 4)]
every_size = pytest.mark.parametrize("size", SIZES, ids=lambda size: "x".join(map(str, size)))
every_filter = pytest.mark.parametrize("name", sorted(pyramid.FILTERS))


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


class TestLayout:
    @every_size
    @pytest.mark.parametrize("n_levels", [1, 2, 3, 4, 5, 12])
    def test_no_two_texels_share_a_place(self, size, n_levels):
        table = pyramid.Table.of(*size, n_levels)
        count = np.zeros(table.size, int)
        for k, (width, height) in enumerate(zip(table.widths, table.heights, strict=True)):
            y, x = np.mgrid[:height, :width]
            np.add.at(count, table.offsets[k] + y * (table.stride >> k) + x, 1)
        assert count.max() == count[table.last] == 1
        assert count[table.last + 1 :].sum() == 0
        assert count.sum() == sum(w * h for w, h in zip(table.widths, table.heights, strict=True))

    def test_levels_end_at_a_single_texel(self):
        assert pyramid.Table.of(1, 1, 12).n_levels == 1
        assert pyramid.Table.of(9, 2, 12).n_levels == 5
        assert pyramid.Table.of(8, 8, 12).n_levels == 4
        assert pyramid.Table.of(8, 8, 3).n_levels == 3

    @pytest.mark.parametrize("size", [(64, 48), (1921, 1081), (33, 17), (5, 3)])
    @pytest.mark.parametrize("n_levels", [3, 4, 5, 12])
    def test_threads_find_rows_aligned(self, size, n_levels):
        """Four texels of one level and two of the next, in one piece each."""
        table = pyramid.Table.of(*size, n_levels)
        for k in range(0, table.n_levels - 2, 2):
            for level, side in ((k, 4), (k + 1, 2)):
                assert table.offsets[level] % side == 0
                assert (table.stride >> level) % side == 0

    @pytest.mark.parametrize("size", [(960, 540), (1920, 1080), (3840, 2160), (1921, 1081), (640, 481)])
    def test_little_lies_empty(self, size):
        """A third more than the depth buffer, and no more than the rounding of rows: 16 texels in five levels."""
        table = pyramid.Table.of(*size, 5)
        assert table.size <= (size[0] + 16) * (size[1] + 16) * 4 / 3

    def test_no_levels_no_copy(self, precision):
        z = precision.Float([1.0, 2.0])
        table = pyramid.Table.of(2, 1, 1)
        assert pyramid.build(z, table, "min", z, z, precision.types) is z
        assert (table.size, table.offsets) == (2, (0,))


@every_filter
@every_size
@pytest.mark.parametrize("n_levels", [2, 5, 12])
def test_levels(precision, name, size, n_levels):
    z = depth(*size)
    buffer, table = built(precision, z, n_levels, name)
    want = pyramids.levels(z, table.n_levels, name, 0.4, 1.2)
    # Means of four, a few times over; least and greatest are exact.
    tolerance = {"float64": 1e-14, "float32": 2e-6}[precision.name]
    for part, image in zip(pyramids.unpacked(buffer, table), want, strict=True):
        assert (np.isinf(part) == np.isinf(image)).all()
        surface = np.isfinite(image)
        assert np.abs(part[surface] - image[surface]).max(initial=0) < tolerance


def test_a_thin_near_thing_disappears_from_the_weighted_levels_only(precision):
    z = np.full((8, 8), 5.0)
    z[:, 3] = 2.0
    lowest = {}
    for name in pyramid.FILTERS:
        lowest[name] = pyramids.unpacked(*built(precision, z, 2, name))[1].min()
    # Of reciprocals 1/5 and 1/2 the mean is 0.35.
    harmonic = 1 / 0.35
    assert lowest == pytest.approx(
        {"weighted": 5.0, "max": 5.0, "min": 2.0, "average": 3.5, "harmonic": harmonic, "rotated_grid": 2.0}
    )


def test_constant_depth_stays(precision):
    z = np.full((9, 13), 2.5)
    for name in pyramid.FILTERS:
        for image in pyramids.unpacked(*built(precision, z, 4, name)):
            assert image == pytest.approx(2.5, abs=1e-6)


def scales(precision, k, n):
    """``n`` times the scale of level k."""
    return precision.Float(np.full(n, 2.0**-k))


@every_size
def test_every_pixel_reads_the_texel_that_contains_it(precision, size):
    width, height = size
    z = depth(width, height, holes=False)
    buffer, table = built(precision, z, 4, "max")
    want = pyramids.levels(z, 4, "max")
    y, x = (v.ravel().astype(np.float64) for v in np.mgrid[:height, :width])
    for k in range(table.n_levels):
        points = precision.Float(x), precision.Float(y)
        got = pyramid.fetch_level(buffer, table, *points, scales(precision, k, x.size), precision.types)
        expected = want[k][(y // 2**k).astype(int), (x // 2**k).astype(int)]
        assert np.array(got) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("size", [(3840, 2160), (4000, 3100), (7680, 4320), (16001, 9001)])
@pytest.mark.parametrize("n_levels", [1, 5, 12])
def test_indices_of_large_frames_are_exact(precision, size, n_levels):
    """Beyond 2²⁴ texels the floats of single precision skip numbers; no buffer of that size is needed to see it."""
    table = pyramid.Table.of(*size, n_levels)
    rng = np.random.default_rng(4)
    x, y = (rng.integers(0, side, 2000) for side in size)
    x[:2], y[:2] = (0, size[0] - 1), (0, size[1] - 1)
    for k in range(table.n_levels):
        points = precision.Float(x.astype(float)), precision.Float(y.astype(float))
        got = pyramid.index(table, *points, scales(precision, k, x.size), precision.types)
        assert (np.array(got) == table.offsets[k] + (y >> k) * (table.stride >> k) + (x >> k)).all()


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
    for k in range(table.n_levels):
        image = images[k] if orthographic else 1 / images[k]
        expected = []
        for u, v in zip((x + 0.5) / 2**k - 0.5, (y + 0.5) / 2**k - 0.5, strict=True):
            u, v = np.clip(u, 0, image.shape[1] - 1), np.clip(v, 0, image.shape[0] - 1)
            j = min(int(v), max(image.shape[0] - 2, 0))
            rows = [np.interp(u, np.arange(image.shape[1]), image[row]) for row in (j, min(j + 1, image.shape[0] - 1))]
            expected.append(rows[0] + (v - j) * (rows[1] - rows[0]))
        points = precision.Float(x), precision.Float(y)
        scale = scales(precision, k, x.size)
        got = np.array(pyramid.bilinear_level(buffer, table, *points, scale, orthographic, precision.types))
        assert (got if orthographic else 1 / got) == pytest.approx(np.array(expected), rel=2e-6)


@pytest.mark.parametrize("n_levels", [1, 3])
@pytest.mark.parametrize("size", [(8, 8), (5000, 4000)])
def test_no_wild_address_for_coordinates_that_are_no_numbers(precision, size, n_levels):
    table = pyramid.Table.of(*size, n_levels)
    x = precision.Float([np.nan, np.inf, -np.inf, -1.0, 1e9])
    for k in range(n_levels):
        number = np.array(pyramid.index(table, x, x, scales(precision, k, 5), precision.types))
        # Inside the buffer, and where no coordinates could be meant a texel, no place between the levels.
        assert (number <= table.last).all()
        assert (number[:3] == table.last).all()


@pytest.mark.parametrize("offset", [-1.0, 0.0, 2.5, 3.3])
def test_level_of_a_distance(precision, offset):
    """clamp(log2 d - offset), then to the nearest: what a sampler does that filters neither texels nor levels."""
    table = pyramid.Table.of(4096, 4096, 5)
    d = np.concatenate([np.geomspace(0.01, 1e5, 4001), [0.0]])
    want = np.clip(np.log2(np.maximum(d, 1e-9)) - offset, 0, 4)
    got = np.array(pyramid.level(precision.Float(d), precision.Float(2 ** (0.5 - offset)), table, precision.types))
    decided = np.abs(want % 1 - 0.5) > 1e-5  # else rounding decides
    assert np.array_equal(got[decided], 2 ** -np.floor(want + 0.5)[decided])
    assert decided.sum() > 3900
    assert set(got) == {2.0**-k for k in range(5)}


@pytest.mark.parametrize("distance", [np.inf, np.nan])
def test_the_level_of_no_distance_is_one_that_exists(precision, distance):
    table = pyramid.Table.of(64, 64, 3)
    (got,) = np.array(pyramid.level(precision.Float(distance), precision.Float(1), table, precision.types))
    assert got in (1, 0.25)
