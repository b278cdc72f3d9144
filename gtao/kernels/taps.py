"""What the depth buffer says at a point of the image, by the options that choose how it is read."""

from typing import Any

import drjit as dr

from . import fetch, pyramid

__all__ = ["centre_depth", "read"]

# Where positions are clamped, they stay this many texels inside the frame.
_CLAMP = 2


def _within(value, low, high):
    return dr.select(value > low, dr.select(value < high, value, high), low)


def read(buffer, px, py, level, k: Any, types):
    """Depth at the point (px, py) and the point that it belongs to.

    Args:
        buffer: flat ``view_z``; for the interpolating fetches what :func:`gtao.kernels.fetch.affine_field` made; with a
            pyramid, what :func:`gtao.kernels.pyramid.build` made.
        level: of the pyramid, if there is one.
        k: :class:`gtao.kernels.march.Switches`.

    Returns:
        ``(z, px, py)``: the point is the centre of the texel where samples snap, and may lie off the frame where the
        border replicates.
    """
    width, height = k.width, k.height
    if k.border == "clamp":
        px, py = _within(px, _CLAMP, width - _CLAMP), _within(py, _CLAMP, height - _CLAMP)
    x, y = px, py
    if k.leaves_frame:
        # Positions may snap off the frame too, so the shift between the point and what is read is kept.
        x, y = _within(px, 0, width - 1), _within(py, 0, height - 1)
    if k.fetch == "bilinear" and level is not None:
        return pyramid.bilinear_level(buffer, k.pyramid, x, y, level, k.orthographic, types), px, py
    if k.fetch in ("linear", "bilinear"):
        z, tx, ty = fetch.linear(buffer, x, y, width, height, k.orthographic, types)
        return z, tx + (px - x), ty + (py - y)
    if k.fetch == "nearest_of_four":
        return fetch.nearest_of_four(buffer, px, py, width, height, types), px, py
    if k.fetch == "floor":
        x, y = dr.floor(x), dr.floor(y)
    if level is None:
        z, tx, ty = fetch.nearest(buffer, x, y, width, height, types)
    else:
        tx, ty = dr.round(x), dr.round(y)
        z = pyramid.fetch_level(buffer, k.pyramid, tx, ty, level, types)
    if k.snap_to_texel:
        return (z, dr.round(px), dr.round(py)) if k.leaves_frame else (z, tx, ty)
    return z, px, py


def centre_depth(view_z, x, y, k: Any, types):
    """Depth of the shaded point: its own texel, but for the fetch that takes the nearest of four."""
    if k.fetch != "nearest_of_four":
        return view_z
    return fetch.nearest_of_four(view_z, x, y, k.width, k.height, types)
