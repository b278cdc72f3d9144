"""What the eye's rays go through behind the first surface: where each body begins and ends."""

from itertools import pairwise
from typing import Any

import drjit as dr

from .errors import ShapeError
from .tensors import to_tensor, window

__all__ = ["DepthLayers"]


class DepthLayers:
    """The bodies along the ray of every pixel, from front to back: body k fills ``front[k]`` to ``back[k]``.

    Both are distances along the optical axis (``view_z``), taken where the pixel's own ray enters and leaves; times
    the length of ``((x_px - cx) / fx, (y_px - cy) / fy, 1)`` a difference of them is a length along the ray of a
    pinhole camera. A sheet is a body with ``front == back``. A body that the ray never leaves has an infinite back,
    and a body that is not there an infinite front as well.

    Args:
        front: (K, H, W) where body k begins, in scene units, positive; NumPy, PyTorch, JAX or Dr.Jit arrays.
        back: (K, H, W) where it ends.
        validate: look at every value; with False the caller vouches for them, see :class:`gtao.GBuffer`.

    Raises:
        ShapeError: a shape or type is wrong, a number is NaN or not positive, a body ends before it begins or begins
            before the one in front of it ends.
        BackendError: there is no usable Dr.Jit backend.
    """

    def __init__(self, front: Any, back: Any, *, validate: bool = True):
        shape = tuple(getattr(front, "shape", ()))
        if len(shape) != 3 or shape[0] < 1:
            raise ShapeError(f"front must have shape (layers, height, width) with a layer at least, got {shape}")
        self.shape: tuple[int, int, int] = (int(shape[0]), int(shape[1]), int(shape[2]))
        self.front = to_tensor(front, "front", self.shape)
        self.back = to_tensor(back, "back", self.shape)
        if type(self.front) is not type(self.back):
            raise ShapeError("front and back must both be single or both be double precision")
        if validate:
            self._check()

    @property
    def n_layers(self) -> int:
        """K: bodies kept per pixel; what lies behind them is not known."""
        return self.shape[0]

    @property
    def thickness(self):
        """(H, W) extent of the first body in ``view_z``: 0 on sheets and on the background, inf if never left."""
        n = self.shape[1] * self.shape[2]
        index = dr.arange(dr.uint32_array_t(dr.leaf_t(self.front)), n)
        front, back = (dr.gather(type(t.array), t.array, index) for t in (self.front, self.back))
        surface = dr.isfinite(front)
        return type(self.front)(dr.select(surface, back - dr.select(surface, front, 0), 0), self.shape[1:])

    def crop(self, x0: int, y0: int, width: int, height: int) -> "DepthLayers":
        """The layers of a window whose top left pixel is ``(x0, y0)``; it must lie within the frame.

        Raises:
            ShapeError: it does not.
        """
        parts = (window(t, x0, y0, width, height, axis=1) for t in (self.front, self.back))
        return DepthLayers(*parts, validate=False)

    def _check(self) -> None:
        n = self.shape[1] * self.shape[2]
        pixel = dr.arange(dr.uint32_array_t(dr.leaf_t(self.front)), n)
        arrays = [dr.detach(t.array) for t in (self.front, self.back)]
        ordered = [dr.gather(type(a), a, pixel + k * n) for k in range(self.n_layers) for a in arrays]
        # Positive and in order; what exactly is wrong is found out only if anything is.
        wrong = ~(ordered[0] > 0)
        for a, b in pairwise(ordered):
            wrong |= ~(a <= b)
        if dr.any(wrong):
            self._explain(ordered)

    def _explain(self, ordered) -> None:
        for name, tensor in (("front", self.front), ("back", self.back)):
            n_bad = dr.count(~(tensor.array > 0))[0]
            if n_bad:
                raise ShapeError(
                    f"{name} must be positive distances, inf where there is no body, but {n_bad} are not (NaN, 0 or"
                    " less)"
                )
        for i, (a, b) in enumerate(pairwise(ordered)):
            n_bad = dr.count(a > b)[0]
            if n_bad:
                where = f"layer {i // 2} ends before it begins" if i % 2 == 0 else f"layer {i // 2 + 1} begins before"
                where += "" if i % 2 == 0 else f" layer {i // 2} ends"
                raise ShapeError(f"{where} at {n_bad} pixels; sort the layers from front to back and join overlaps")

    def __repr__(self) -> str:
        k, height, width = self.shape
        return f"DepthLayers({width}x{height}, {k} layer{'s' if k > 1 else ''})"
