"""Where the points of an image were in the frame before, and meters whose state can be kept."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from gtao.errors import ShapeError

__all__ = ["Resumable", "image_of", "mask_of", "motion_of", "other_pixel", "previous_pixels", "together"]


class Resumable:
    """Base of what is measured frame by frame: its state is its attributes, numbers and arrays, or None."""

    def state(self) -> dict[str, np.ndarray]:
        """All that is remembered, as arrays that :func:`numpy.savez` writes and :meth:`from_state` takes back."""
        return {name: np.asarray(value) for name, value in vars(self).items() if value is not None}

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Self:
        """What went on measuring where :meth:`state` was taken.

        Raises:
            ShapeError: a name that such a meter does not have.
        """
        meter = cls()
        unknown = set(state) - set(vars(meter))
        if unknown:
            raise ShapeError(f"no state of {cls.__name__}: it has no {', '.join(sorted(unknown))}")
        for name, value in state.items():
            array = np.array(value)
            setattr(meter, name, array if array.ndim else array.item())
        return meter


def image_of(name: str, values: ArrayLike, shape: tuple[int, ...] | None = None) -> np.ndarray:
    """Values as a float64 (H, W) image, of a given shape if there is one.

    Raises:
        ShapeError: it has another shape.
    """
    image = np.asarray(values, dtype=np.float64)
    if image.ndim != 2 or (shape is not None and image.shape != shape):
        raise ShapeError(f"{name} must have the shape {shape or '(H, W)'}, got {image.shape}")
    return image


def mask_of(name: str, values: ArrayLike | None, shape: tuple[int, ...], default: bool = True) -> np.ndarray:
    """A mask as a bool (H, W) image, all of it ``default`` if left out.

    Raises:
        ShapeError: it has another shape.
    """
    if values is None:
        return np.full(shape, default)
    mask = np.asarray(values).astype(bool)
    if mask.shape != shape:
        raise ShapeError(f"{name} must have the shape {shape} of the image, got {mask.shape}")
    return mask


def motion_of(values: ArrayLike | None, shape: tuple[int, ...]) -> np.ndarray | None:
    """Pixels right and down from the previous frame, (H, W, 2) float64; None where nothing moves at all.

    Raises:
        ShapeError: it is no (H, W, 2) or (H, W, 3).
    """
    if values is None:
        return None
    motion = np.asarray(values, dtype=np.float64)
    if motion.shape not in ((*shape, 2), (*shape, 3)):
        raise ShapeError(f"motion must have the shape {(*shape, 2)} or {(*shape, 3)}, got {motion.shape}")
    return motion[..., :2] if motion[..., :2].any() else None


def previous_pixels(motion: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Row and column of the previous frame's pixel nearest to where each point was, and whether it lay in the frame.

    Rows and columns outside of the frame are those of the nearest pixel in it.
    """
    height, width = motion.shape[:2]
    y, x = np.mgrid[:height, :width]
    # Pixel centres lie at half-integers, so that indices differ by the motion as positions do.
    column, row = x - motion[..., 0], y - motion[..., 1]
    inside = (column >= -0.5) & (column < width - 0.5) & (row >= -0.5) & (row < height - 0.5)
    rows = np.clip(np.floor(np.clip(row, -1, height) + 0.5), 0, height - 1).astype(np.intp)
    columns = np.clip(np.floor(np.clip(column, -1, width) + 0.5), 0, width - 1).astype(np.intp)
    return rows, columns, inside


def other_pixel(rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Where the pixels of :func:`previous_pixels` are not those themselves."""
    y, x = np.indices(rows.shape)
    return (rows != y) | (columns != x)


def together(*series: Iterable[Any] | None) -> Iterator[tuple[Any, ...]]:
    """What the series that are given say of each frame.

    Raises:
        ShapeError: one is shorter than the others.
    """
    given = [iter(s) for s in series if s is not None]
    end = object()
    while True:
        frame = tuple(next(s, end) for s in given)
        if all(value is end for value in frame):
            return
        if any(value is end for value in frame):
            raise ShapeError("there must be as many truths, variances and other images as frames")
        yield frame
