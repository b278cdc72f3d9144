"""Kernels of smaller frames against loops written from the definitions, in both precisions."""

import numpy as np
import pytest
from oracles import fields
from oracles import resolution as oracle

from gtao.kernels import filters, resolution

import drjit as dr  # isort: skip  (after gtao, which chooses the LLVM library)

CHOICES = ("nearest", "farthest", "checkerboard", "first")
# Rounding of depths near 4 and of differences of them; in single precision 1e-7 of a depth is 1e-5 of a pixel width.
TOLERANCES = {"float64": 1e-12, "float32": 2e-6}
WEIGHT_TOLERANCES = {"float64": 1e-9, "float32": 5e-4}


def rough(orthographic=False, shape=(13, 18)):
    """Bumps, a depth step, thin holes and a block of background, in a frame of odd sides that is not square."""
    bumps = fields.gaussians(0.3, 0.4, seed=4)
    size = max(shape)
    if orthographic:
        field = fields.from_above(bumps, size=size)
    else:
        field = fields.in_perspective(bumps, size=size, slope=(0.4, -0.2), stretch=1.3, shift_px=(1.5, -2.0))
    z, n = field.view_z[: shape[0], : shape[1]].copy(), field.normal_v[: shape[0], : shape[1]].copy()
    z[:, shape[1] // 2 :] *= 1.15
    z[2, 3:9] = z[-1, -1] = z[0, 5] = np.inf
    z[8:13, 0:5] = np.inf
    z[9, 2] = 4.0  # one surface pixel in a block of background
    # Normals that face away, and one that is edge-on.
    n[4, 4] = -n[4, 4]
    n[6, 6] = [1, 0, 0]
    camera = field.camera | {"height": shape[0], "width": shape[1]}
    if orthographic:
        camera["view_height"] = field.camera["view_height"] * shape[0] / size
    return fields.Field(z, n, camera, orthographic)


def lanes(precision, image):
    return precision.Float(np.ascontiguousarray(image).ravel())


def view_of(precision, field):
    (fx, fy), cx, cy = field.scale, field.camera["cx"], field.camera["cy"]
    numbers = (1 / fx, (0.5 - cx) / fx, -1 / fy, (cy - 0.5) / fy, 1 / min(fx, fy))
    return filters.View(*(precision.Float(v) for v in numbers), orthographic=field.orthographic)


@pytest.mark.parametrize("factor", [2, 4])
@pytest.mark.parametrize("choice", CHOICES)
@pytest.mark.parametrize("shape", [(13, 18), (12, 16), (5, 3), (1, 1)])
def test_the_chosen_pixel(precision, factor, choice, shape):
    z = np.random.default_rng(1).choice([1.0, 2.0, 3.0, np.inf], shape)
    want = oracle.chosen(z, factor, choice)
    blocks = resolution.Blocks.of(shape[1], shape[0], factor, precision.types)
    found = blocks.chosen(lanes(precision, z), choice)
    for index, name in zip(found, (choice, "nearest", "farthest"), strict=True):
        got = np.stack(np.divmod(np.array(index), shape[1]), axis=-1).reshape(want.shape)
        assert np.array_equal(got, oracle.chosen(z, factor, name))


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("factor", [2, 4])
@pytest.mark.parametrize("choice", CHOICES)
def test_depth_at_the_centre_of_a_block(precision, orthographic, factor, choice):
    field = rough(orthographic)
    want = oracle.downsampled(field, factor, choice, "centre").view_z
    blocks = resolution.Blocks.of(*field.view_z.shape[::-1], factor, precision.types)
    found = blocks.chosen(lanes(precision, field.view_z), choice)
    z, *bounds = (dr.gather(precision.Float, lanes(precision, field.view_z), index) for index in found)
    n = [dr.gather(precision.Float, lanes(precision, field.normal_v[..., k]), found[0]) for k in range(3)]
    got = resolution.at_centre(z, n, found[0], blocks, bounds, view_of(precision, field))
    got = np.array(got).reshape(want.shape)
    surface = np.isfinite(want)
    assert (np.isfinite(got) == surface).all()
    # A slope of s multiplies what single precision makes of a position by s; here up to 5.
    assert np.abs(got[surface] / want[surface] - 1).max() < 5 * TOLERANCES[precision.name]
    moved = want[surface] - oracle.downsampled(field, factor, choice, "texel").view_z[surface]
    assert np.abs(moved).max() > 0.01


def cells_of(precision, field, small):
    scale = [a / b for a, b in zip(small.scale, field.scale, strict=True)]
    offset = [small.camera[k] - s * field.camera[k] for k, s in zip(("cx", "cy"), scale, strict=True)]
    numbers = ([precision.Float(v) for v in values] for values in (scale, offset))
    return resolution.Cells.of(field.view_z.shape, small.view_z.shape, *numbers, precision.types)


def weights_of(precision, field, small, method, threshold, angle):
    cells = cells_of(precision, field, small)
    texels = cells.nearest()
    z, small_z = lanes(precision, field.view_z), lanes(precision, small.view_z)
    if method == "bilinear":
        weights = resolution.bilinear(small_z, texels, precision.types)
    elif method in ("nearest_depth", "bilateral"):
        weigh = getattr(resolution, method)
        weights = weigh(z, small_z, texels, precision.Float(threshold), precision.types)
    else:
        own = resolution.Surface(z, lanes(precision, field.normal_v), view_of(precision, field))
        other = resolution.Surface(small_z, lanes(precision, small.normal_v), view_of(precision, small))
        texels, weights = resolution.plane_aware(cells, own, other, precision.Float(threshold), precision.Float(angle))
    matrix = np.zeros((field.view_z.size, small.view_z.size))
    for t, w in zip(texels, weights, strict=True):
        np.add.at(matrix, (np.arange(len(matrix)), np.array(t.index)), np.broadcast_to(np.array(w), len(matrix)))
    return matrix


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("factor", [2, 4])
@pytest.mark.parametrize(
    ("method", "threshold", "angle"),
    [
        ("bilinear", None, None),
        ("nearest_depth", 0.05, None),
        ("bilateral", 0.05, None),
        ("planes", 0.5, 3.0),
        ("planes", 0.02, 0.3),
    ],
)
@pytest.mark.parametrize(("choice", "place"), [("nearest", "centre"), ("farthest", "texel")])
def test_weights(precision, orthographic, factor, method, threshold, angle, choice, place):
    field = rough(orthographic)
    small = oracle.downsampled(field, factor, choice, place)
    want = oracle.upsampling(field, small, method, threshold, angle)
    got = weights_of(precision, field, small, method, threshold, angle)
    surface = np.isfinite(field.view_z).ravel()
    # Every pixel of a surface gets a value.
    assert (want.sum(axis=1)[surface] > 0).all()
    want, got = (w[surface] / w[surface].sum(axis=1, keepdims=True) for w in (want, got))
    wrong = np.abs(got - want).max(axis=1)
    # Single precision may take another one of two texels that are equally near.
    allowed = 0 if precision.name == "float64" else 0.02 * len(wrong)
    assert np.sum(wrong > WEIGHT_TOLERANCES[precision.name]) <= allowed


def test_the_wider_footprint_is_looked_at(precision):
    """Otherwise the weights above would say nothing of it."""
    field = rough()
    small = oracle.downsampled(field, 2, "farthest", "texel")
    weights = oracle.upsampling(field, small, "planes", 0.02)
    beyond = 0
    for k in np.flatnonzero(np.isfinite(field.view_z)):
        y, x = divmod(int(k), field.view_z.shape[1])
        near = {(j, i) for j, i, _ in oracle.texels(small.view_z.shape, (x + 0.5) / 2, (y + 0.5) / 2)}
        taken = {divmod(int(t), small.view_z.shape[1]) for t in np.flatnonzero(weights[k])}
        beyond += bool(taken - near)
    assert beyond > 5


def test_the_mean_of_nothing(precision):
    cells = resolution.Cells.of((1, 1), (1, 1), [precision.Float(1)] * 2, [precision.Float(0)] * 2, precision.types)
    texels = cells.nearest()
    weights = [precision.Float(0)] * 4
    values = precision.Float(0.3), precision.Float(0.4)
    got = resolution.mean(weights, texels, values, (1, 0), precision.types)
    assert [v[0] for v in got] == [1.0, 0.0]
