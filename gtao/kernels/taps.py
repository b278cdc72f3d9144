"""What the depth buffer says at a point of the image, by the options that choose how it is read."""

from typing import Any

import drjit as dr

from . import fetch, pyramid

__all__ = ["aim"]

# Where positions are clamped, they stay this many texels inside the frame.
_CLAMP = 2


def _within(value, low, high):
    value = dr.select(value > low, value, low)
    return dr.select(value < high, value, high)


def aim(buffer, px, py, level, k: Any, types, known=True):
    """All that reading depth at the point (px, py) takes but the reading: a function without arguments.

    Many samples may so be aimed first and read then, one gather after the other.

    Args:
        buffer: flat ``view_z``; for the interpolating fetches what :func:`gtao.kernels.fetch.affine_field` made; with a
            pyramid, what :func:`gtao.kernels.pyramid.build` made.
        level: of the pyramid, if there is one.
        k: :class:`gtao.kernels.march_types.Switches`.
        known: where the depth is looked at; elsewhere it may be anything.

    Returns:
        Function that returns ``(z, px, py)``: depth and the point that it belongs to, which is the centre of the texel
        where samples snap, and may lie off the frame where the border replicates.
    """
    width, height = k.width, k.height
    if k.border == "clamp":
        px, py = _within(px, _CLAMP, width - _CLAMP), _within(py, _CLAMP, height - _CLAMP)
    if k.fetch in ("nearest", "floor"):
        return _texel(buffer, px, py, level, k, types, known)
    x, y = px, py
    if k.leaves_frame:
        # Positions may lie off the frame, so the shift between the point and what is read is kept.
        x, y = _within(px, 0, width - 1), _within(py, 0, height - 1)
    if k.fetch == "bilinear" and level is not None:
        return lambda: (pyramid.bilinear_level(buffer, k.pyramid, x, y, level, k.orthographic, types), px, py)
    if k.fetch in ("linear", "bilinear"):

        def interpolated():
            z, tx, ty = fetch.linear(buffer, x, y, width, height, k.orthographic, types)
            return z, tx + (px - x), ty + (py - y)

        return interpolated
    return lambda: (fetch.nearest_of_four(buffer, px, py, width, height, types), px, py)


def _texel(buffer, px, py, level, k: Any, types, known):
    """The fetches of one texel: the one of the point, or the nearest to it in the frame."""
    whole = dr.floor if k.fetch == "floor" else dr.round
    tx, ty = whole(px), whole(py)
    x, y = tx, ty
    if k.leaves_frame:
        x, y = _within(tx, 0, k.width - 1), _within(ty, 0, k.height - 1)
    if level is None:
        number = fetch.texel_index(x, y, k.width, k.height, types, inside=k.leaves_frame)
    else:
        number = pyramid.index(k.pyramid, x, y, level, types, inside=k.leaves_frame)
    point = (tx, ty) if k.snap_to_texel else (px, py)
    return lambda: (dr.gather(types.Float, buffer, number, known), *point)
