"""One frame, the numbers that its visibility depends on, and gradients with respect to any of them.

A problem is a function ``build(values) -> (GBuffer, method)`` of a dictionary of numbers and arrays. It is called with
plain ones for differences and with Dr.Jit's for gradients.
"""

import numpy as np
from drjit.llvm.ad import Float64, TensorXf, TensorXf64
from oracles import gradients as oracle

import drjit as dr  # isort: skip

import gtao

HEIGHT, WIDTH = 20, 24
#: Weights of the loss, one for each pixel, so that the adjoint of every one of them counts.
WEIGHTS = np.random.default_rng(11).normal(size=(HEIGHT, WIDTH))
CAMERAS = {
    "perspective": {"fx": 21.0, "fy": 19.0, "cx": 13.3, "cy": 8.6},
    "orthographic": {"view_height": 2.2, "view_width": 2.4, "cx": 13.3, "cy": 8.6},
}


def depth(seed=0):
    """Noise on a slope, with terraces of half a unit, and a hole."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    z = 3 + 0.02 * x + 0.01 * y + 0.12 * rng.random((HEIGHT, WIDTH))
    z += 0.5 * ((x // 7 + y // 6) % 2)
    z[4:8, 15:19] = np.inf
    return z


def normals(seed=1, facing=2.0):
    """Unit normals about the view direction, a few of them seen edge-on or from behind."""
    n = np.random.default_rng(seed).normal((0, 0, facing), 1, (HEIGHT, WIDTH, 3))
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


DEPTH, NORMALS = depth(), normals()
SURFACE = np.isfinite(DEPTH)


def camera(kind, **numbers):
    numbers = CAMERAS[kind] | numbers
    if kind == "orthographic":
        return gtao.OrthographicCamera(WIDTH, HEIGHT, **numbers)
    return gtao.PerspectiveCamera(WIDTH, HEIGHT, **numbers)


def problem(method, kind="perspective", **fixed):
    """``build`` for a fixed method: what varies are ``view_z``, ``normal_v`` and the numbers of the camera."""

    def build(values):
        values = fixed | values
        z, n = values.pop("view_z", DEPTH), values.pop("normal_v", NORMALS)
        return gtao.GBuffer(tensor(z), None if n is None else tensor(n), camera(kind, **values)), method

    return build


def tensor(value, kind=TensorXf64):
    return value if dr.is_tensor_v(value) else kind(own(kind(value).array), np.shape(value))


def own(array):
    """A copy in Dr.Jit's memory: where NumPy's begins is part of the kernels that read it, and not always the same."""
    return dr.opaque(array)


def image(build, values):
    g, method = build(dict(values))
    return gtao.ambient_occlusion(g, method).visibility.numpy()


def attach(values, single=False):
    """The same numbers and arrays as Dr.Jit's, with gradients."""
    attached = {}
    for name, value in values.items():
        if np.ndim(value) == 0:
            Float = Float64 if not single else dr.float32_array_t(Float64)
            attached[name] = dr.opaque(Float, float(value))
        else:
            attached[name] = tensor(value, TensorXf if single else TensorXf64)
        dr.enable_grad(attached[name])
    return attached


def pullback(build, values, weights=WEIGHTS, single=False):
    """Reverse mode: gradients of the weighted sum of the visibility with respect to ``values``."""
    attached = attach(values, single)
    g, method = build(dict(attached))
    visibility = gtao.ambient_occlusion(g, method).visibility.array
    dr.backward(dr.sum(visibility * own(type(visibility)(weights.ravel()))))
    return {name: number(dr.grad(value)) for name, value in attached.items()}


def pushforward(build, values, directions, single=False):
    """Forward mode: the image's derivative along ``directions``, numbers and arrays like ``values``."""
    attached = attach(values, single)
    g, method = build(dict(attached))
    visibility = gtao.ambient_occlusion(g, method).visibility
    for name, value in attached.items():
        value = value.array if dr.is_tensor_v(value) else value
        dr.set_grad(value, own(type(value)(np.ravel(directions[name]))))
        dr.enqueue(dr.ADMode.Forward, value)
    dr.traverse(dr.ADMode.Forward)
    return dr.grad(visibility).numpy()


def number(value):
    array = value.numpy()
    return float(array[0]) if array.ndim < 2 and array.size == 1 else array


def along(build, values, name, direction=1.0, scale=1.0, **options) -> oracle.Derivative:
    """Differences of the image along a direction of one number or array of ``values``."""

    def moved(t):
        return image(build, values | {name: values[name] + t * direction})

    return oracle.derivative(moved, scale=scale, **options)


def tangent(normal, angle):
    """Unit vector at right angles to a unit vector: where it may move without changing its length."""
    a = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    a /= np.linalg.norm(a)
    return np.cos(angle) * a + np.sin(angle) * np.cross(normal, a)


def directions(name, values, count, seed):
    """Directions that move one surface pixel each: its depth by 1, or its normal along a random tangent."""
    rng = np.random.default_rng(seed)
    for i, j in rng.permutation(np.argwhere(SURFACE))[:count]:
        direction = np.zeros_like(values[name])
        direction[i, j] = 1.0 if name == "view_z" else tangent(values[name][i, j], rng.uniform(0, 2 * np.pi))
        yield (int(i), int(j)), direction


def check_pixels(build, values, name, gradient, count, seed=2):
    """Reverse mode at random pixels: within the tolerance, and nearly all of them resolved."""
    found, missed, unresolved = [], [], []
    for pixel, direction in directions(name, values, count, seed):
        d = along(build, values, name, direction, scale=3.0 if name == "view_z" else 1.0).weighted(WEIGHTS)
        missed += report(pixel, np.sum(gradient * direction), d)
        unresolved += [] if d.resolved else [pixel]
        found.append(d)
    assert not missed, "\n".join(missed)
    assert len(unresolved) <= 0.01 * count, f"kinks at {unresolved}"
    return found


def report(where, gradient, found):
    return [f"{where}: {line}" for line in oracle.disagreements(np.asarray(gradient), found)]


def check_numbers(build, values, names=None, unresolved=0.01, **options):
    """Both modes for numbers among ``values``, all attached: every pixel whose differences are resolved, and their sum.

    Args:
        names: the numbers to look at; all of ``values``.
        unresolved: share of pixels that may have a kink.
    """
    zeros = {name: np.zeros(np.shape(value)) for name, value in values.items()}
    result = {}
    for name in values if names is None else names:
        found = along(build, values, name, scale=max(abs(values[name]), 0.1), **options)
        share = np.mean(~found.resolved)
        assert share <= unresolved, f"{name}: {100 * share:.1f} % of the pixels have kinks"
        missed = oracle.disagreements(pushforward(build, values, zeros | {name: 1.0}), found)
        assert not missed, "\n".join([name, *missed[:10]])
        resolved = np.where(found.resolved, WEIGHTS, 0.0)
        missed = report(name, pullback(build, values, resolved)[name], found.weighted(resolved))
        assert not missed, "\n".join(missed)
        result[name] = found
    return result
