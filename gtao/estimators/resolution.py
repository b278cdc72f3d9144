"""Image-level drivers of smaller frames: a frame to a smaller one, and its estimate back to the size of the first."""

from collections.abc import Callable
from typing import Any

import drjit as dr

from gtao.config import (
    BilateralUpsample,
    BilinearUpsample,
    Downsample,
    NearestDepthUpsample,
    PlaneAwareUpsample,
    plain,
)
from gtao.errors import ConfigError, ShapeError
from gtao.gbuffer import GBuffer
from gtao.kernels import filters, resolution
from gtao.layers import DepthLayers
from gtao.planes import Planes
from gtao.results import AmbientOcclusion
from gtao.stages import staged
from gtao.tensors import scalar

from .estimate import check_estimate, check_frame

__all__ = ["downsample", "upsample"]

# Distance, in pixels of the larger frame, that two cameras may differ by where they show the same view.
SAME_VIEW = 0.01

#: Texels and their weights, from depth and normals of both frames (images) and numbers.
Weigh = Callable[[Any, Any], tuple[list[Any], list[Any]]]


def downsample(g: GBuffer, how: Downsample) -> GBuffer:
    """A smaller frame of the same view: one pixel of every block stands for it, with all that is known of it.

    Sides that ``factor`` does not divide are rounded up; the last blocks are smaller. A block is background only where
    all of its pixels are.

    Args:
        g: the frame. Gradients flow to its depth, normals and camera; which pixels are chosen has none.
        how: factor, choice and place.

    Returns:
        A frame with :meth:`camera.reduced(factor) <gtao.PerspectiveCamera.reduced>`. Its motion is in its own pixels;
        its layers move with its depth, in proportion. Its values are not looked at again.

    Raises:
        ConfigError: ``how`` is no :class:`gtao.Downsample` or ``g`` no frame.
    """
    check_frame(g)
    if not isinstance(how, Downsample):
        raise ConfigError(f"how must be a gtao.Downsample, got {type(how).__name__}")
    T, (height, width) = g.types, g.shape
    blocks = resolution.Blocks.of(width, height, how.factor, T)
    x, y = blocks.chosen(g.view_z.array, how.choice)
    index = blocks.index(x, y)

    def stage(images, numbers):
        depth, normal = images
        z = dr.gather(T.Float, depth.around, index)
        n = [dr.gather(T.Float, normal.around, 3 * index + axis) for axis in range(3)]
        if how.place == "centre":
            view = filters.View(*numbers, orthographic=g.camera.is_orthographic)
            z = resolution.at_centre(z, n, T.Float(x), T.Float(y), blocks.centre(), view)
        return z, dr.ravel(T.Array3(*n))

    numbers = _view(g.camera) if how.place == "centre" else ()
    images = g.view_z.array, g.normals_to_be_normalised()[0]
    z, n = staged(stage, images, numbers, lanes=dr.width(index))
    camera = g.camera.reduced(how.factor)
    albedo = None if g.albedo is None else _read(g.albedo, index)
    motion = None if g.motion is None else _read(g.motion, index, (1 / how.factor, 1 / how.factor, 1.0))
    moved = None if g.layers is None else _moved(g, g.layers, index, z)
    # All in one kernel.
    dr.eval(z, n, albedo, motion, moved)

    def tensor(flat, *channels):
        return None if flat is None else T.Tensor(flat, (*camera.shape, *channels))

    result = GBuffer(
        tensor(z),
        tensor(n, 3),
        camera,
        tensor(albedo, 3),
        tensor(motion, None if g.motion is None else g.motion.shape[2]),
        None if moved is None else _layers(moved, camera.shape, T),
        view_to_world=g.view_to_world,
        validate=False,
    )
    result.normals_derived = g.normals_derived
    return result


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
    unshaped = () if ao.unshaped is None else (T.Float(ao.unshaped.array),)
    images = {name: planes for name in ("mean_direction", "visibility_sh") if (planes := ao.planes(name)) is not None}
    open_channels = (T.Float(ao.visibility.array), *unshaped)
    channels = open_channels + tuple(T.Float(a) for planes in images.values() for a in planes.arrays)
    otherwise = [1] * len(open_channels) + [0] * (len(channels) - len(open_channels))
    guides, numbers, weights = weigh(cells, g_low, g, method)
    surface = g.mask.array

    def stage(images, numbers):
        texels, shares = weights(images[len(channels) :], numbers)
        values = (image.around for image in images[: len(channels)])
        result = resolution.mean(shares, texels, tuple(values), otherwise, T)
        return tuple(dr.select(surface, v, o) for v, o in zip(result, otherwise, strict=True))

    dr.eval(channels, guides)
    result = staged(stage, channels + guides, numbers, lanes=dr.width(surface))
    dr.eval(result)
    visibility, *rest = result
    plain_visibility = rest.pop(0) if unshaped else None
    for name, planes in images.items():
        n = len(planes.arrays)
        images[name], rest = Planes(tuple(rest[:n]), g.shape), rest[n:]
    return AmbientOcclusion(
        visibility=T.Tensor(visibility, g.shape),
        **images,
        normal_v=None if ao.normal_v is None else g.normal_v,
        unshaped=None if plain_visibility is None else T.Tensor(plain_visibility, g.shape),
        config=ao.config,
    )


def _read(image: Any, index: Any, scale: tuple[float, ...] | None = None):
    """The pixels ``index`` of a tensor (H, W, C), flat, each channel times its scale."""
    n, Float = image.shape[2], type(image.array)
    channels = [dr.gather(Float, image.array, n * index + c) for c in range(n)]
    if scale is not None:
        channels = [c * s for c, s in zip(channels, scale, strict=False)]
    return dr.ravel(dr.replace_shape_t(Float, (n, -1))(*channels))


def _moved(g: GBuffer, layers: DepthLayers, index: Any, z: Any):
    """Begin and end of every layer at the pixels ``index``, flat, moved in proportion to where the depth is now z."""
    T, n = g.types, g.shape[0] * g.shape[1]
    before = dr.gather(T.Float, g.view_z.array, index)
    ratio = dr.select(dr.isfinite(before), z / before, 1)
    lane = dr.arange(T.UInt, layers.n_layers * dr.width(index))
    k = lane // dr.width(index)
    lane -= k * dr.width(index)
    pixel, share = k * n + dr.gather(T.UInt, index, lane), dr.gather(T.Float, ratio, lane)
    return tuple(dr.gather(T.Float, t.array, pixel) * share for t in (layers.front, layers.back))


def _layers(flat: Any, shape: tuple[int, int], T: Any) -> DepthLayers:
    n = dr.width(flat) // (shape[0] * shape[1])
    return DepthLayers(*(T.Tensor(t, (n, *shape)) for t in flat), validate=False)


def _view(camera: Any) -> tuple[Any, ...]:
    """The numbers of a :class:`gtao.kernels.filters.View`."""
    fx, fy = camera.fx, camera.fy
    return 1 / fx, (0.5 - camera.cx) / fx, -1 / fy, (camera.cy - 0.5) / fy, 1 / min(fx, fy)


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
        tolerance, views = numbers[0], (numbers[1:6], numbers[6:])
        view, small_view = (filters.View(*view, orthographic=orthographic) for view in views)
        own, small = resolution.Surface(z, n, view), resolution.Surface(small_z, small_n, small_view)
        return resolution.planes(cells, own, small, tolerance)

    frames = g, g_low
    guides = tuple(image for f in frames for image in (f.view_z.array, f.normals_to_be_normalised()[0]))
    return guides, (method.tolerance, *_view(g.camera), *_view(g_low.camera)), weights


# What prepares (images, numbers, function of these to texels and weights) for each class.
_METHODS: dict[type, Callable[..., Any]] = {
    BilinearUpsample: _bilinear,
    NearestDepthUpsample: _by_depth(resolution.nearest_depth),
    BilateralUpsample: _by_depth(resolution.bilateral),
    PlaneAwareUpsample: _plane_aware,
}
