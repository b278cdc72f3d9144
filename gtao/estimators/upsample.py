"""Image-level driver of the ways from an estimate of a small frame to the size of a larger one."""

from collections.abc import Callable
from typing import Any

import drjit as dr

from gtao.config import BilateralUpsample, BilinearUpsample, NearestDepthUpsample, PlaneAwareUpsample, plain
from gtao.errors import ConfigError, ShapeError
from gtao.gbuffer import GBuffer
from gtao.kernels import filters, resolution
from gtao.results import AmbientOcclusion
from gtao.stages import staged
from gtao.tensors import scalar

from .channels import channels_of, estimate_of, in_a_row, named
from .estimate import check_estimate, check_frame
from .view import view_numbers

__all__ = ["upsample"]

# Distance, in pixels of the larger frame, that two cameras may differ by where they show the same view.
SAME_VIEW = 0.01


def upsample(ao: AmbientOcclusion, g_low: GBuffer, g: GBuffer, method: Any = None) -> AmbientOcclusion:
    """The estimate ``ao`` of a small frame at the size of a larger frame of the same view.

    All channels are interpolated with the same weights. The background is 1 and is never averaged in. Values are not
    clamped.

    Args:
        ao: from :func:`gtao.ambient_occlusion` or what comes after it, of ``g_low``.
        g_low: the small frame, from :func:`gtao.downsample` or rendered at that size.
        g: the frame whose pixels get values. Gradients flow from depth and normals of both frames, and from ``ao``.
        method: a :class:`gtao.PlaneAwareUpsample` (if left out, with its defaults),
            :class:`gtao.BilateralUpsample`, :class:`gtao.NearestDepthUpsample` or :class:`gtao.BilinearUpsample`.

    Returns:
        A new estimate with the same ``config`` and the normals of ``g``; its ``variance`` is None: errors of
        neighbours depend on each other.

    Raises:
        ConfigError: ``method`` is no way to upsample, ``ao`` no estimate or a frame no frame.
        ShapeError: the estimate is not of ``g_low``, or the two frames are not of one view and precision.
    """
    method = PlaneAwareUpsample() if method is None else method
    weigh = _METHODS.get(type(method))
    if weigh is None:
        choices = ", ".join(f"gtao.{kind.__name__}" for kind in _METHODS)
        raise ConfigError(f"the method must be one of {choices}, got {type(method).__name__}")
    check_frame(g)
    check_estimate(ao, g_low)
    T = g.types
    cells = _cells(g_low, g)
    found = channels_of(ao, T)
    channels = in_a_row(found)
    # Nothing there: visible, without a direction.
    otherwise = tuple(1 if n == 1 else 0 for n in (len(arrays) for arrays in found.values()) for _ in range(n))
    guides, numbers, weights = weigh(cells, g_low, g, method)
    surface = g.mask.array

    def stage(images, numbers):
        texels, shares = weights(images[len(channels) :], numbers)
        values = tuple(image.around for image in images[: len(channels)])
        result = resolution.mean(shares, texels, values, otherwise, T)
        return tuple(dr.select(surface, v, o) for v, o in zip(result, otherwise, strict=True))

    dr.eval(channels, guides)
    result = staged(stage, channels + guides, numbers, lanes=dr.width(surface))
    dr.eval(result)
    return estimate_of(named(result, found), ao, g)


def _cells(g_low: GBuffer, g: GBuffer):
    """Where the pixels of ``g`` lie in ``g_low``.

    Raises:
        ShapeError: they are not of one view.
    """
    if g.types.Float is not g_low.types.Float:
        raise ShapeError("the two frames must both be single or both be double precision")
    large, small = g.camera, g_low.camera
    pairs = [(plain(getattr(small, name)), plain(getattr(large, name))) for name in ("fx", "fy", "cx", "cy")]
    scale = [a / b for a, b in pairs[:2]]
    offset = [a - k * b for k, (a, b) in zip(scale, pairs[2:], strict=True)]
    # What the small frame shows, in pixels of the larger one, holds all of that.
    inside = all(
        -o / k <= SAME_VIEW and (n - o) / k >= m - SAME_VIEW
        for o, k, n, m in zip(offset, scale, (small.width, small.height), (large.width, large.height), strict=True)
    )
    if small.kind != large.kind or not inside or max(scale) > 1:
        raise ShapeError(
            f"the estimate's frame {small} must be a smaller one of the view of {large}, as gtao.downsample makes it"
        )
    Float = g.types.Float
    scale, offset = ([scalar(v, Float) for v in values] for values in (scale, offset))
    return resolution.Cells.of(g.shape, g_low.shape, scale, offset, g.types)


def _bilinear(cells, g_low, g, method):
    def weights(images, numbers):
        (small,) = images
        texels = cells.nearest()
        return texels, resolution.bilinear(small.around, texels, cells.types)

    return (g_low.view_z.array,), (), weights


def _by_depth(weigh):
    """Methods of a threshold of depth."""

    def prepare(cells, g_low, g, method):
        def weights(images, numbers):
            own, small = images
            texels = cells.nearest()
            return texels, weigh(own.own, small.around, texels, *numbers, cells.types)

        return (g.view_z.array, g_low.view_z.array), (method.threshold,), weights

    return prepare


def _plane_aware(cells, g_low, g, method):
    def weights(images, numbers):
        z, n, small_z, small_n = (image.around for image in images)
        orthographic = g.camera.is_orthographic
        views = numbers[2:7], numbers[7:]
        view, small_view = (filters.View(*view, orthographic=orthographic) for view in views)
        own, small = resolution.Surface(z, n, view), resolution.Surface(small_z, small_n, small_view)
        return resolution.plane_aware(cells, own, small, *numbers[:2])

    frames = g, g_low
    guides = tuple(image for f in frames for image in (f.view_z.array, f.normals_to_be_normalised()[0]))
    return guides, (method.tolerance, method.angle, *view_numbers(g.camera), *view_numbers(g_low.camera)), weights


# What prepares (images, numbers, function of these to texels and weights) for each class.
_METHODS: dict[type, Callable[..., Any]] = {
    BilinearUpsample: _bilinear,
    NearestDepthUpsample: _by_depth(resolution.nearest_depth),
    BilateralUpsample: _by_depth(resolution.bilateral),
    PlaneAwareUpsample: _plane_aware,
}
