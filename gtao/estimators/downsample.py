"""Image-level driver of smaller frames of the same view."""

from typing import Any

import drjit as dr

from gtao.config import Downsample
from gtao.errors import ConfigError
from gtao.gbuffer import GBuffer
from gtao.kernels import filters, resolution
from gtao.layers import DepthLayers
from gtao.stages import staged

from .estimate import check_frame
from .view import view_numbers

__all__ = ["downsample"]


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
    index, *extremes = blocks.chosen(g.view_z.array, how.choice)

    def stage(images, numbers):
        depth, normal = images
        z = dr.gather(T.Float, depth.around, index)
        n = [dr.gather(T.Float, normal.around, 3 * index + axis) for axis in range(3)]
        if how.place == "centre":
            view = filters.View(*numbers, orthographic=g.camera.is_orthographic)
            bounds = [dr.gather(T.Float, depth.around, i) for i in extremes]
            z = resolution.at_centre(z, n, index, blocks, bounds, view)
        return z, dr.ravel(T.Array3(*n))

    numbers = view_numbers(g.camera) if how.place == "centre" else ()
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
