"""Derivatives of the levels of a depth pyramid, against central differences of an oracle that knows no Dr.Jit."""

import numpy as np
import pytest
from oracles import pyramids

from gtao import backend
from gtao.kernels import pyramid

import drjit as dr  # isort: skip  (after gtao, which chooses the LLVM library)

# Weights of 0, of 1, and between, on every level.
START, END = 0.1, 2.2
#: Rows in pieces of four and not, even and odd sides; one launch, two, three.
FRAMES = [((12, 8), 3), ((9, 6), 4), ((20, 21), 5), ((33, 17), 6), ((3, 2), 2)]
every_frame = pytest.mark.parametrize(("size", "n_levels"), FRAMES, ids=lambda v: str(v).replace(", ", "x"))
every_filter = pytest.mark.parametrize("name", sorted(pyramid.FILTERS))
# Truncation at this step and rounding are both below 1e-8: depths are of order 1, and no filter curves faster.
STEP, TOLERANCE = 1e-6, 1e-7


@pytest.fixture(scope="module")
def Float():
    return dr.float64_array_t(backend.default_float())


def depth(width, height):
    rng = np.random.default_rng(width * 100 + height)
    z = rng.uniform(1, 4, (height, width))
    # Few, because of a texel of the weighted levels nothing is left as soon as there is one.
    z.flat[rng.choice(z.size, 1 + z.size // 100, replace=False)] = np.inf
    return z


class Case:
    """Depth and the two bounds, their random directions, and the derivative of all levels along these."""

    def __init__(self, size, n_levels, name, moved=("z", "start", "end")):
        self.table = pyramid.Table.of(*size, n_levels)
        self.name = name
        rng = np.random.default_rng(3)
        z = depth(*size)
        self.values = {"z": z, "start": START, "end": END}
        directions = {"z": rng.standard_normal(z.shape), "start": rng.standard_normal(), "end": rng.standard_normal()}
        self.directions = {k: v if k in moved else 0 * v for k, v in directions.items()}
        ends = [self._oracle(sign * STEP) for sign in (1, -1)]
        self.surface = np.isfinite(ends[0])
        self.derivative = (ends[0][self.surface] - ends[1][self.surface]) / (2 * STEP)
        self.weights = np.where(self.surface, rng.standard_normal(self.surface.shape), 0.0)

    def _oracle(self, t):
        z, start, end = (self.values[k] + t * self.directions[k] for k in ("z", "start", "end"))
        return pyramids.packed(pyramids.levels(z, self.table.n_levels, self.name, start, end), self.table)

    def inputs(self, Float, attached=("z", "start", "end")):
        arrays = {name: Float(np.ravel(value)) for name, value in self.values.items()}
        dr.enable_grad([arrays[name] for name in attached])
        return arrays

    def levels(self, Float, arrays):
        types = backend.types_of(Float)
        return pyramid.build(arrays["z"], self.table, self.name, arrays["start"], arrays["end"], types)


@every_filter
@every_frame
def test_forward_mode(Float, name, size, n_levels):
    case = Case(size, n_levels, name)
    arrays = case.inputs(Float)
    levels = case.levels(Float, arrays)
    for key, direction in case.directions.items():
        dr.set_grad(arrays[key], Float(np.ravel(direction)))
    dr.enqueue(dr.ADMode.Forward, *arrays.values())
    dr.traverse(dr.ADMode.Forward)
    got = np.array(dr.grad(levels))
    assert np.abs(got[case.surface] - case.derivative).max() < TOLERANCE
    assert np.isfinite(got).all()


@every_filter
@every_frame
def test_reverse_mode(Float, name, size, n_levels):
    """The gradient of a weighted sum of all texels along the direction is the weighted sum of their derivatives."""
    case = Case(size, n_levels, name)
    arrays = case.inputs(Float)
    levels = case.levels(Float, arrays)
    weighted = dr.select(Float(case.weights) != 0, levels, 0) * Float(case.weights)
    dr.backward(dr.sum(weighted))
    gradient = {key: np.array(dr.grad(array)) for key, array in arrays.items()}
    assert all(np.isfinite(g).all() for g in gradient.values())
    got = sum((gradient[key] * np.ravel(direction)).sum() for key, direction in case.directions.items())
    want = (case.weights[case.surface] * case.derivative).sum()
    # A sum of as many terms as there are texels.
    assert got == pytest.approx(want, abs=TOLERANCE * case.table.size**0.5)
    if name == "weighted" and min(size) > 2:
        assert abs(gradient["start"][0]) > 1e-3
        assert abs(gradient["end"][0]) > 1e-3


def test_every_texel_of_the_gradient(Float):
    """Pixel by pixel, so that no error hides in a sum."""
    case = Case((9, 6), 4, "weighted")
    arrays = case.inputs(Float, attached=("z",))
    levels = case.levels(Float, arrays)
    dr.backward(dr.sum(dr.select(Float(case.weights) != 0, levels, 0) * Float(case.weights)))
    gradient = np.array(dr.grad(arrays["z"])).reshape(6, 9)
    z = case.values["z"]

    def loss(view_z):
        images = pyramids.levels(view_z, 4, "weighted", START, END)
        return (pyramids.packed(images, case.table)[case.surface] * case.weights[case.surface]).sum()

    for y, x in np.argwhere(np.isfinite(z)):
        move = np.zeros_like(z)
        move[y, x] = STEP
        assert gradient[y, x] == pytest.approx((loss(z + move) - loss(z - move)) / (2 * STEP), abs=TOLERANCE)
    assert (gradient[np.isinf(z)] == 0).all()


@pytest.mark.parametrize("attached", ["z", "start", "end"])
def test_each_input_alone(Float, attached):
    case = Case((20, 21), 5, "weighted", moved=(attached,))
    arrays = case.inputs(Float, attached=(attached,))
    levels = case.levels(Float, arrays)
    dr.backward(dr.sum(dr.select(Float(case.weights) != 0, levels, 0) * Float(case.weights)))
    got = (np.array(dr.grad(arrays[attached])) * np.ravel(case.directions[attached])).sum()
    assert got == pytest.approx((case.weights[case.surface] * case.derivative).sum(), abs=TOLERANCE * 30)


def test_what_goes_to_one_pixel_of_equal_depth(Float):
    """Of equal depths the last one is the least and the greatest: a subgradient, and nothing is lost or doubled."""
    types = backend.types_of(Float)
    for name in ("min", "max"):
        table = pyramid.Table.of(4, 4, 3)
        z = Float(np.full(16, 2.0))
        dr.enable_grad(z)
        top = dr.gather(Float, pyramid.build(z, table, name, z, z, types), dr.uint32_array_t(Float)(table.offsets[-1]))
        dr.backward(top)
        assert sorted(np.array(dr.grad(z))) == [0.0] * 15 + [1.0]


def test_background_has_no_derivative(Float):
    """Nor does it make others infinite: of sixteen pixels one is a surface."""
    types, table = backend.types_of(Float), pyramid.Table.of(4, 4, 3)
    values = np.full(16, np.inf)
    values[5] = 3.0
    for name, expected in {"min": 1.0, "average": 1.0, "harmonic": 16.0, "weighted": 0.0}.items():
        z = Float(values)
        dr.enable_grad(z)
        buffer = pyramid.build(z, table, name, Float(START), Float(END), types)
        dr.backward(dr.gather(Float, buffer, dr.uint32_array_t(Float)(table.offsets[-1])))
        gradient = np.array(dr.grad(z))
        assert gradient[5] == pytest.approx(expected), name
        assert (np.delete(gradient, 5) == 0).all()
