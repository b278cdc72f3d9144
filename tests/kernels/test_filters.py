"""Filter kernels against loops written from the definitions, in both precisions, and golden weights."""

from types import SimpleNamespace

import numpy as np
import pytest
from oracles import fields, golden
from oracles import filters as oracle

from gtao import backend
from gtao.kernels import filters
from gtao.kernels.filters.bilateral import ramp
from gtao.kernels.filters.footprint import footprint

import drjit as dr  # isort: skip  (after gtao, which chooses the LLVM library)

# Rounding of a weighted mean of values of order one, whose weights divide depth differences by small thresholds.
TOLERANCES = {"float64": 1e-11, "float32": 2e-4}


def rough(orthographic=False, size=13, holes=True):
    """Bumps, a depth step and holes to the background, in a frame that is not square."""
    bumps = fields.gaussians(0.3, 0.4, seed=4)
    if orthographic:
        field = fields.from_above(bumps, size=size)
    else:
        field = fields.in_perspective(bumps, size=size, slope=(0.4, -0.2), stretch=1.3, shift_px=(1.5, -2.0))
    z = field.view_z.copy()
    z[:, size // 2 :] *= 1.15
    if holes:
        z[2:4, 3] = z[-1, -1] = z[0, 5] = np.inf
        z[7:10, 2:5] = np.inf
        z[8, 3] = 4.0  # one surface pixel with no neighbour
    z, n = z[:-2], field.normal_v[:-2]
    return fields.Field(z, n, field.camera | {"height": size - 2}, orthographic)


def lanes(precision, image):
    return precision.Float(np.ascontiguousarray(image).ravel())


def both(flat):
    """The same values as a pixel's own and as its neighbours read them."""
    return filters.Image(flat, flat)


def image(precision, values):
    return both(lanes(precision, values))


def grid_of(precision, field):
    height, width = field.view_z.shape
    return filters.Grid.of(width, height, precision.types)


def values_of(field, seed=3):
    return np.random.default_rng(seed).random(field.view_z.size)


def surface_of(field):
    return np.isfinite(field.view_z).ravel()


@pytest.mark.parametrize("quantised", [True, False])
def test_links_between_neighbours(precision, quantised):
    field = rough()
    want = oracle.edge_links(field.view_z, 0.011, quantised)
    links = filters.depth_edges(image(precision, field.view_z), 0.011, quantised, grid_of(precision, field))
    got = np.stack([np.array(link) for link in links], axis=-1).reshape(want.shape)
    surface = np.isfinite(field.view_z)
    assert ((got == -1) == np.isnan(want))[surface].all()
    # Single precision resolves 1e-7 of a depth, of which a link is 1 / 0.011 times a difference; a value that
    # rounds the other way would be off by a third.
    tolerance = {"float64": 1e-12, "float32": 1e-4}[precision.name]
    assert np.abs(got - want)[surface & ~np.isnan(want).any(axis=-1)].max() < tolerance
    levels = set(np.round(3 * want[surface][~np.isnan(want[surface])], 9))
    assert not quantised or levels == {0.0, 1.0, 2.0, 3.0}


@pytest.mark.parametrize("quantised", [True, False])
@pytest.mark.parametrize("beta", [1.2, 0.24])
def test_edge_aware_pass(precision, quantised, beta):
    field = rough()
    grid, values = grid_of(precision, field), values_of(field)
    links = filters.depth_edges(image(precision, field.view_z), 0.011, quantised, grid)
    taps = filters.edge_taps(tuple(map(both, links)), 0.425, 2.5, 0.5, grid)
    (got,) = filters.weighted_mean(precision.Float(beta), taps, grid, (image(precision, values),))
    weights = oracle.edge_weights(field.view_z, oracle.edge_links(field.view_z, 0.011, quantised), beta)
    want = oracle.average(weights, values)
    assert np.abs(np.array(got) - want)[surface_of(field)].max() < TOLERANCES[precision.name]


@pytest.mark.parametrize(("odd_frame", "planar"), [(False, False), (True, False), (True, True)])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_bilateral_pass(precision, order, odd_frame, planar):
    field = rough()
    grid, values = grid_of(precision, field), values_of(field)
    taps = filters.bilateral_taps(image(precision, field.view_z), 0.1, order, grid, odd_frame, planar)
    (got,) = filters.weighted_mean(precision.Float(1), taps, grid, (image(precision, values),))
    want = oracle.average(oracle.bilateral_weights(field.view_z, 0.1, order, odd_frame, planar), values)
    assert np.abs(np.array(got) - want)[surface_of(field)].max() < TOLERANCES[precision.name]


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("G.bilateral"))
def test_bilateral_weight_golden(precision, inputs, outputs):
    z_c, z_i = precision.Float(inputs["z_c"]), precision.Float(inputs["z_i"])
    slope = inputs["g"][0] * inputs["d"][0] + inputs["g"][1] * inputs["d"][1]
    scale = 1 / (inputs["kappa"] * inputs["z_c"])
    assert ramp(z_i, z_c, scale)[0] == pytest.approx(outputs["w_no_gradient"], abs=precision.tolerance)
    assert ramp(z_i, z_c + slope, scale)[0] == pytest.approx(outputs["w_gradient"], abs=precision.tolerance)


@pytest.mark.parametrize("order", [1, 2])
def test_bilateral_weights_are_full_where_depth_is_a_polynomial_of_that_order(precision, order):
    y, x = np.mgrid[:9, :9]
    z = 5 + 0.3 * x - 0.2 * y + (0.05 * x * x - 0.04 * y * y) * (order == 2)
    grid = filters.Grid.of(9, 9, precision.types)
    taps = filters.bilateral_taps(image(precision, z), 0.1, order, grid)
    for tap in taps:
        inside = (x + tap.dx >= 0) & (x + tap.dx < 9) & (y + tap.dy >= 0) & (y + tap.dy < 9)
        weight = np.array(tap.weight).reshape(9, 9)
        # Depths of up to 10 are rounded, and divided by thresholds of at least 0.3.
        assert weight[inside] == pytest.approx(1.0, abs={"float64": 1e-12, "float32": 1e-5}[precision.name])
        assert not weight[~inside].any()


@pytest.mark.parametrize("order", [1, 2])
def test_planar_weights_are_full_on_a_plane_up_to_its_horizon(precision, order):
    """1 / z = y + 0.3 x - 2 rises from 0 at the horizon, beyond which there is nothing."""
    y, x = np.mgrid[:9, :9]
    rise = y + 0.3 * x - 2
    z = np.where(rise > 0.05, 1 / np.where(rise > 0.05, rise, 1), np.inf)
    grid = filters.Grid.of(9, 9, precision.types)
    for tap in filters.bilateral_taps(image(precision, z), 0.1, order, grid, inverse=True):
        beside = [(x + a, y + b) for a, b in ((tap.dx, tap.dy), (0, 0))]
        full = np.ones_like(z, dtype=bool)
        for u, v in beside:
            inside = (u >= 0) & (u < 9) & (v >= 0) & (v < 9)
            full &= inside & (np.where(inside, v + 0.3 * u - 2, 0) > 0.05)
        # A pixel with a single surface neighbour along an axis, or none, knows no slope.
        known = np.isfinite(np.pad(z, 1, constant_values=np.inf))
        known = (known[1:-1, 2:] | known[1:-1, :-2]) & (known[2:, 1:-1] | known[:-2, 1:-1])
        weight = np.array(tap.weight).reshape(9, 9)
        # Rounding of 1 / z, up to 7, magnified by the reciprocal of 0.05 and the threshold.
        assert weight[full & known] == pytest.approx(1.0, abs={"float64": 1e-11, "float32": 2e-3}[precision.name])


def plane_taps(precision, field, size, tolerance=0.5, view_z=None, odd_frame=False):
    fx, fy = field.scale
    view = filters.View(
        ax=1 / fx,
        bx=(0.5 - field.camera["cx"]) / fx,
        ay=-1 / fy,
        by=(field.camera["cy"] - 0.5) / fy,
        pixel=1 / min(fx, fy),
        orthographic=field.orthographic,
    )
    normal = tuple(image(precision, field.normal_v[..., k]) for k in range(3))
    z = image(precision, field.view_z) if view_z is None else view_z
    return filters.plane_taps(z, normal, size, tolerance, view, grid_of(precision, field), odd_frame)


@pytest.mark.parametrize(("size", "odd_frame"), [(2, True), (4, False), (4, True), (5, False), (5, True)])
@pytest.mark.parametrize("orthographic", [False, True])
def test_plane_aware_pass(precision, size, odd_frame, orthographic):
    field = rough(orthographic)
    grid, values = grid_of(precision, field), values_of(field)
    taps = plane_taps(precision, field, size, odd_frame=odd_frame)
    one, channels = precision.Float(1), (image(precision, values),)
    weights = oracle.plane_weights(field, size, odd_frame=odd_frame)
    height, width = field.view_z.shape
    coordinates = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2)
    mean = oracle.average(weights, values)
    fit = oracle.fitted(weights, values, coordinates, ridge=3.0)
    surface, tolerance = surface_of(field), TOLERANCES[precision.name]
    (got,) = filters.weighted_mean(one, taps, grid, channels)
    assert np.abs(np.array(got) - mean)[surface].max() < tolerance
    (got,) = filters.local_plane(one, taps, grid, channels, ridge=3.0)
    assert np.abs(np.array(got) - fit)[surface].max() < tolerance


def matrix(taps, grid):
    """Weights of the taps as a matrix, without the pixel's own."""
    n = grid.width * grid.height
    weights = np.zeros((n, n))
    for tap in taps:
        index, weight = np.array(tap.index), np.array(tap.weight)
        np.add.at(weights, (np.arange(n), index), weight)
    return weights


def test_pixels_of_a_surface_give_each_other_the_same_plane_weight(precision):
    field = rough()
    weights = matrix(plane_taps(precision, field, 5), grid_of(precision, field))
    # Both see the same two distances; only their rounding differs, relative to a tolerance of half a pixel.
    assert np.abs(weights - weights.T).max() < {"float64": 1e-11, "float32": 1e-3}[precision.name]
    assert (weights[weights > 0] < 1).any()


def test_links_of_xegtao_are_symmetric_but_for_the_leak(precision):
    field = rough()
    grid = grid_of(precision, field)
    links = filters.depth_edges(image(precision, field.view_z), 0.011, False, grid)
    for leak, symmetric in ((0.0, True), (0.5, False)):
        taps = filters.edge_taps(tuple(map(both, links)), 0.425, 2.5, leak, grid)[:4]
        weights = matrix(taps, grid)
        np.fill_diagonal(weights, 0)  # beyond the frame lies the pixel itself
        assert (np.abs(weights - weights.T).max() < 1e-6) == symmetric


@pytest.mark.parametrize("size", [3, 5])
def test_the_linear_fit_reproduces_linear_images_for_a_small_ridge(precision, size):
    field = rough()
    grid = grid_of(precision, field)
    height, width = field.view_z.shape
    y, x = np.mgrid[:height, :width]
    values = (0.2 + 0.03 * x - 0.05 * y).ravel()
    taps = plane_taps(precision, field, size)
    (got,) = filters.local_plane(precision.Float(1), taps, grid, (image(precision, values),), ridge=1e-4)
    weights = matrix(taps, grid)
    # Pixels with a well-conditioned neighbourhood; the ridge of 1e-4 takes 1e-4 of the slopes.
    supported = surface_of(field) & ((weights > 0.1).sum(axis=1) >= 5)
    assert supported.sum() > 30
    assert np.abs(np.array(got) - values)[supported].max() < 2e-3
    (mean,) = filters.weighted_mean(precision.Float(1), taps, grid, (image(precision, values),))
    assert np.abs(np.array(mean) - values)[supported].max() > 1e-2


@pytest.mark.parametrize("odd_frame", [False, True])
@pytest.mark.parametrize("size", range(2, 10))
def test_footprints_cover_every_residue_of_their_period_equally(size, odd_frame):
    period = size if size % 2 == 0 else size - 1
    weight = np.zeros(period)
    for d, w in footprint(size, odd_frame):
        weight[d % period] += w
    assert (weight == 1).all()


@pytest.mark.parametrize("size", range(2, 10))
def test_footprints_of_two_frames_together_are_symmetric(size):
    even, odd = (dict(footprint(size, odd_frame)) for odd_frame in (False, True))
    assert odd == {-d: w for d, w in even.items()}
    assert (even == odd) == (size % 2 == 1)
    # Half a pixel toward positive coordinates, then half a pixel back.
    assert sum(d * w for d, w in even.items()) == (0.5 * size if size % 2 == 0 else 0)


@pytest.mark.parametrize("name", ["edges", "bilateral", "planes"])
def test_weights_have_derivatives(name):
    """With respect to depth: forward mode against central differences, which need double precision."""
    Float = dr.float64_array_t(backend.default_float())
    precision = SimpleNamespace(Float=Float, types=backend.types_of(Float))
    field = rough()
    grid, values = grid_of(precision, field), (image(precision, values_of(field)),)
    direction = np.random.default_rng(8).standard_normal(field.view_z.size)

    def filtered(z):
        if name == "edges":
            links = filters.depth_edges(both(z), 0.05, False, grid)
            taps = filters.edge_taps(tuple(map(both, links)), 0.425, 2.5, 0.5, grid)
        elif name == "bilateral":
            taps = filters.bilateral_taps(both(z), 0.1, 2, grid)
        else:
            taps = plane_taps(precision, field, 4, view_z=both(z))
        return filters.weighted_mean(Float(1), taps, grid, values)[0]

    flat, h = field.view_z.ravel(), 1e-7
    z = Float(flat)
    dr.enable_grad(z)
    dr.set_grad(z, Float(direction))
    got = np.array(dr.forward_to(filtered(z)))
    ends = [np.array(filtered(Float(flat + sign * h * direction))) for sign in (1, -1)]
    want = (ends[0] - ends[1]) / (2 * h)
    surface = surface_of(field)
    assert np.abs(want[surface]).max() > 0.1
    # Rounding of the differences: 1e-16 over 2e-7, and their curvature, 1e-14 times second derivatives.
    assert got[surface] == pytest.approx(want[surface], abs=1e-6, rel=1e-6)
