"""A loss of the visibility and its gradients in one launch."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr

from gtao.errors import ConfigError, ShapeError
from gtao.gbuffer import GBuffer

from .envelope import fused
from .occlusion import ambient_occlusion

__all__ = ["ValueAndGradient", "value_and_gradient"]


@dataclass(frozen=True)
class ValueAndGradient:
    """What :func:`value_and_gradient` returns, evaluated and without gradients of its own.

    Attributes:
        value: the loss summed over pixels, a float of width 1.
        visibility: (H, W) tensor.
        view_z: (H, W) gradient of the value by the depth of each pixel; 0 on the background.
        normal_v: (H, W, 3) gradient by the normals; None where they were derived from the depth, whose gradient then
            holds their share.
    """

    value: Any
    visibility: Any
    view_z: Any
    normal_v: Any


def value_and_gradient(
    loss: Callable[[Any], Any], g: GBuffer, method: Any = None, *, frame_index: int = 0
) -> ValueAndGradient:
    """A loss of the visibility of every pixel, summed, and its gradients by depth and normals.

    The same as ``dr.backward(dr.sum(loss(visibility)))``, but the estimate, the loss and the gradients share one launch
    for up to four slices, so that the search is not stored and nothing is read twice. That needs a loss that looks at
    each pixel on its own.

    Args:
        loss: function of the (H, W) visibility to a tensor of the same shape, made of elementwise operations.
        g: the frame; what it carries of gradients is not touched.
        method: as for :func:`gtao.ambient_occlusion`. Options that carry gradients receive theirs.
        frame_index: position in the temporal noise sequence, at least 0.

    Raises:
        ConfigError: as by :func:`gtao.ambient_occlusion`, or ``loss`` does not depend on the visibility.
        ShapeError: ``loss`` returns no tensor of the frame's shape.
    """
    if not isinstance(g, GBuffer):
        raise ConfigError(f"g must be a gtao.GBuffer, got {type(g).__name__}")
    if not callable(loss):
        raise ConfigError(f"loss must be a function of the visibility, got {type(loss).__name__}")
    frame, terms, total = g.attached(), [], []
    if not dr.grad_enabled(frame.view_z):
        raise ConfigError("gradients are suspended here (dr.suspend_grad)")

    def add_up():
        # As soon as they are there, to be rid of an image.
        total.extend(dr.sum(image) for image in terms)
        terms.clear()

    with fused(add_up):
        visibility = ambient_occlusion(frame, method, frame_index=frame_index).visibility
        image = loss(visibility)
        if not dr.is_array_v(image) or not dr.is_tensor_v(image) or tuple(image.shape) != g.shape:
            raise ShapeError(
                f"the loss must be a tensor of the frame's shape {g.shape}, one number for each pixel, got"
                f" {type(image).__name__} of shape {tuple(getattr(image, 'shape', ()))}; sums are taken here"
            )
        if not dr.grad_enabled(image):
            raise ConfigError("the loss does not depend on the visibility, or was detached from it")
        terms.append(dr.detach(image.array))
        visibility = dr.detach(visibility)
        # Scheduled, they are part of the launch that the gradients make.
        dr.schedule(terms, visibility)
        dr.set_grad(image, 1)
        dr.enqueue(dr.ADMode.Backward, image)
        del image
        dr.traverse(dr.ADMode.Backward)
        gradients = tuple(None if a is None else dr.grad(a) for a in frame.attached_inputs())
        dr.eval(terms, visibility, gradients)
        add_up()
    view_z, normal_v = gradients
    return ValueAndGradient(total[0], visibility, view_z, normal_v)
