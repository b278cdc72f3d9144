"""The package's side of every comparison: callables that make an estimate, or an estimate and its gradients."""

import drjit as dr

import gtao

from .work import FRAME_INDEX

__all__ = [
    "bands",
    "directions",
    "estimate",
    "estimate_new_frame",
    "frozen_estimate",
    "frozen_fused",
    "frozen_gradient",
    "fused",
    "gradient",
    "gradient_step",
    "image",
    "loss",
]


def image(g, method):
    """The visibility as a NumPy array."""
    return gtao.ambient_occlusion(g, method, frame_index=FRAME_INDEX).visibility.numpy()


def estimate(g, method):
    """One estimate, as a user calls it."""

    def run():
        dr.eval(gtao.ambient_occlusion(g, method, frame_index=FRAME_INDEX).visibility)

    return run


def directions(g, method, tensors=False):
    """One estimate with everything that the method gives, in planes or as tensors."""

    def run():
        ao = gtao.ambient_occlusion(g, method, frame_index=FRAME_INDEX)
        name = "visibility_sh" if method.directional else "mean_direction"
        dr.eval(ao.visibility, getattr(ao, name) if tensors else ao.planes(name).arrays)

    return run


def estimate_new_frame(g, method, validate=False):
    """One estimate on a frame that has just come: its construction included, with or without a look at all values."""

    def run():
        dr.eval(_visibility(g.view_z, g.normal_v, g.camera, method, validate))

    return run


def _visibility(view_z, normal_v, camera, method, validate=False):
    g = gtao.GBuffer(view_z, normal_v, camera, validate=validate)
    return gtao.ambient_occlusion(g, method, frame_index=FRAME_INDEX).visibility.array


def loss(visibility):
    """The mean of (visibility - 1/2)²."""
    return dr.mean(dr.square(visibility - 0.5))


def gradient_step(view_z, normal_v, camera, method):
    """The loss and its gradients by depth and normals, evaluated: what one step of an optimiser needs."""
    view_z, normal_v = type(view_z)(view_z), type(normal_v)(normal_v)
    dr.enable_grad(view_z, normal_v)
    result = loss(_visibility(view_z, normal_v, camera, method))
    dr.backward(result)
    results = dr.detach(result), dr.grad(view_z), dr.grad(normal_v)
    dr.eval(results)
    return results


def gradient(g, method):
    """An estimate and the gradients of an arbitrary loss, by ordinary reverse mode."""

    def run():
        gradient_step(g.view_z, g.normal_v, g.camera, method)

    return run


def _term(g):
    """What a pixel adds to :func:`loss`."""
    share = 1 / (g.shape[0] * g.shape[1])
    return lambda visibility: dr.square(visibility - 0.5) * share


def fused(g, method):
    """The same in one launch, for losses that look at each pixel on its own."""

    def run():
        return gtao.value_and_gradient(_term(g), g, method, frame_index=FRAME_INDEX)

    return run


def bands(g, method):
    """One estimate, a megapixel at a time."""

    def run():
        dr.eval(gtao.ambient_occlusion(g, method, frame_index=FRAME_INDEX, max_pixels=1 << 20).visibility)

    return run


def frozen_estimate(g, method):
    """:func:`estimate_new_frame` as a recorded sequence of launches, which leaves the tracing out."""

    @dr.freeze
    def recorded(view_z, normal_v):
        return _visibility(view_z, normal_v, g.camera, method)

    def run():
        dr.eval(recorded(g.view_z, g.normal_v))

    return run


def frozen_gradient(g, method):
    """:func:`gradient` as a recorded sequence of launches."""

    @dr.freeze
    def step(view_z, normal_v):
        return gradient_step(view_z, normal_v, g.camera, method)

    def run():
        dr.eval(step(g.view_z, g.normal_v))

    return run


def frozen_fused(g, method):
    """:func:`fused` as a recorded sequence of launches."""

    @dr.freeze
    def step(view_z, normal_v):
        frame = gtao.GBuffer(view_z, normal_v, g.camera, validate=False)
        found = gtao.value_and_gradient(_term(g), frame, method, frame_index=FRAME_INDEX)
        return found.value, found.view_z, found.normal_v

    def run():
        dr.eval(step(g.view_z, g.normal_v))

    return run
