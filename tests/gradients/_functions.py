"""Both modes of a function from named arrays and numbers to an image, against differences in float64.

A function takes a dictionary of Dr.Jit tensors and floats of width 1, some of them attached, and returns a tensor.
"""

import drjit as dr
import numpy as np
from oracles import gradients as oracle

from gtao import backend

#: Of the derivatives at random pixels, those that may lie at a kink, where differences do not agree with each other.
KINKS = 0.01
#: A smaller derivative changes no digit of an image whose input moves by as little as differences do.
NEGLIGIBLE = 1e-11


def native(value, single=False):
    """A Dr.Jit tensor of an array, or a Dr.Jit float of a number."""
    Float = backend.default_float()
    Float = Float if single else dr.float64_array_t(Float)
    if np.ndim(value) == 0:
        return dr.opaque(Float, float(value))
    return dr.tensor_t(Float)(np.ascontiguousarray(value, dtype=np.float32 if single else np.float64))


def image(f, values):
    return f({name: native(value) for name, value in values.items()}).numpy()


def differences(f, values, name, direction=1.0) -> oracle.Derivative:
    """Derivative of the image where ``values[name]`` moves along a direction."""
    scale = max(float(np.abs(np.where(np.isfinite(values[name]), values[name], 0.0)).max()), 1.0)
    return oracle.derivative(lambda t: image(f, values | {name: values[name] + t * direction}), scale=scale)


def pullback(f, values, weights, names=None, single=False):
    """Gradients of the weighted sum of the image with respect to the inputs ``names`` (all)."""
    inputs = {name: native(value, single) for name, value in values.items()}
    attached = {name: inputs[name] for name in (names or values)}
    dr.enable_grad(attached)
    result = f(inputs).array
    dr.backward(dr.sum(result * type(result)(np.ravel(weights))))
    return {name: as_numpy(dr.grad(value)) for name, value in attached.items()}


def pushforward(f, values, directions):
    """The image's derivative where the inputs move along directions, all at once."""
    inputs = {name: native(value) for name, value in values.items()}
    dr.enable_grad([inputs[name] for name in directions])
    result = f(inputs)
    for name, direction in directions.items():
        variable = inputs[name].array if dr.is_tensor_v(inputs[name]) else inputs[name]
        dr.set_grad(variable, type(variable)(np.ravel(np.asarray(direction, float))))
        dr.enqueue(dr.ADMode.Forward, variable)
    dr.traverse(dr.ADMode.Forward)
    return dr.grad(result).numpy()


def as_numpy(value):
    array = value.numpy()
    return array if dr.is_tensor_v(value) else float(array[0])


def check(f, values, name, directions=(1.0,), seed=5):
    """Reverse and forward mode along directions of one input, wherever differences say what is right.

    Returns:
        The derivatives of the image that were compared.
    """
    directions = list(directions)
    found = [differences(f, values, name, direction) for direction in directions]
    resolved = np.array([d.resolved for d in found])
    assert np.mean(~resolved) <= KINKS, f"kinks in {100 * np.mean(~resolved):.1f} % of the derivatives by {name}"
    missed = []
    for d, direction in zip(found, directions, strict=True):
        forward = pushforward(f, values, {name: direction})
        missed += oracle.disagreements(np.where(np.abs(forward) < NEGLIGIBLE, 0.0, forward), d)
        # A loss that every resolved pixel counts in, each with a weight of its own.
        weights = np.random.default_rng(seed).standard_normal(d.value.shape) * d.resolved
        gradient = pullback(f, values, weights, (name,))[name]
        missed += oracle.disagreements(np.asarray(np.sum(gradient * direction)), d.weighted(weights))
    assert not missed, f"{name}: " + "\n".join(missed[:10])
    # Where rounding hides a derivative, the comparison says nothing.
    said = [np.abs(d.value) > 1e3 * d.noise for d in found]
    assert np.any(said, axis=tuple(range(1, np.ndim(said)))).mean() > 0.5, f"{name} moves nothing"
    return found


def check_single_precision(f, values, names, shape, share, tolerance):
    """Gradients in single precision are those in double, but for a share of the elements that stand at kinks.

    Args:
        shape: of the image, whose random sum is differentiated.
        share: of the elements, in [0, 1], that must agree.
        tolerance: of their differences, over the largest derivative by the same input.
    """
    w = np.random.default_rng(2).standard_normal(shape)
    want, got = (pullback(f, values, w, names, single) for single in (False, True))
    for k in names:
        difference = np.abs(np.asarray(got[k]) - want[k])
        assert np.quantile(difference, share) < tolerance * np.abs(want[k]).max(), k


def unit_moves(mask, count, seed, normal=None):
    """Directions that move the value of one random pixel of a mask, or its unit normal along a random tangent."""
    rng = np.random.default_rng(seed)
    for i, j in rng.permutation(np.argwhere(mask))[:count]:
        if normal is None:
            direction = np.zeros(mask.shape)
            direction[i, j] = 1.0
        else:
            direction = np.zeros(normal.shape)
            direction[i, j] = np.cross(normal[i, j], rng.standard_normal(3))
        yield direction
