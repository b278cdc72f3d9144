"""What a temporal filter remembers of the frames so far."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from .backend import types_of
from .planes import Planes

__all__ = ["CHANNELS", "Contents", "History"]

#: Names of what is accumulated, those of :class:`gtao.AmbientOcclusion`, with their numbers of channels.
CHANNELS = {"visibility": 1, "mean_direction": 3, "visibility_sh": 9, "unshaped": 1}


@dataclass(frozen=True, kw_only=True)
class Contents:
    """One state of a history: flat arrays, evaluated and without gradients.

    Attributes:
        channels: tuples of arrays by names of ``CHANNELS``.
        count: effective number of frames in each pixel, 0 where there is nothing to go on from.
        deviation: mean deviation of the visibility of a pixel's frames from its history, or None.
        view_z: depth of the last frame.
        normal: x, y and z of its normals, or None where the filter looks at none.
        motion: x and y of its motion in pixels, or None where nothing moved.
        camera: its camera, in plain numbers.
        view_to_world: its pose, or None.
    """

    channels: dict[str, tuple[Any, ...]]
    count: Any
    deviation: Any
    view_z: Any
    normal: tuple[Any, Any, Any] | None
    motion: tuple[Any, Any] | None
    camera: Any
    view_to_world: tuple[tuple[float, ...], ...] | None


class History:
    """State of a :class:`gtao.TemporalFilter`, empty at first; each step changes it in place.

    Files: :func:`gtao.io.write_history` and :func:`gtao.io.read_history`. What a step after them gives is the same to
    the bit.

    Attributes:
        frame_index: number of frames taken, which is the index of the next one.
        contents: :class:`Contents`, or None while it is empty. Replaced by steps, never changed: ``copy.copy`` of a
            history is a state to come back to.
    """

    def __init__(self) -> None:
        self.frame_index = 0
        self.contents: Contents | None = None

    def reset(self) -> None:
        """Forget everything, as after a cut or a change of the size of frames."""
        self.__init__()

    def take(self, contents: Contents) -> None:
        """Replace the contents by those of one frame more."""
        self.contents, self.frame_index = contents, self.frame_index + 1

    @property
    def is_empty(self) -> bool:
        return self.contents is None

    @property
    def shape(self) -> tuple[int, int] | None:
        """(H, W) of the frames, or None."""
        return None if self.contents is None else self.contents.camera.shape

    @property
    def camera(self) -> Any:
        """Camera of the last frame, or None."""
        return None if self.contents is None else self.contents.camera

    @property
    def view_to_world(self) -> tuple[tuple[float, ...], ...] | None:
        """Pose of the last frame, or None."""
        return None if self.contents is None else self.contents.view_to_world

    @property
    def visibility(self) -> Any:
        """(H, W) accumulated visibility, or None."""
        return self._image("visibility")

    @property
    def mean_direction(self) -> Any:
        """(H, W, 3) accumulated mean direction in the last view frame, or None."""
        return self._image("mean_direction")

    @property
    def visibility_sh(self) -> Any:
        """(H, W, 9) accumulated harmonics in the last view frame, or None."""
        return self._image("visibility_sh")

    @property
    def unshaped(self) -> Any:
        """(H, W) accumulated visibility that belongs to the directions, or None."""
        return self._image("unshaped")

    @property
    def count(self) -> Any:
        """(H, W) effective number of frames in each pixel: whose plain mean would be as steady. Or None."""
        return None if self.contents is None else self._plane(self.contents.count)

    @property
    def deviation(self) -> Any:
        """(H, W) mean deviation of a pixel's frames from its history, or None: empty, or the filter needs none."""
        return (
            None if self.contents is None or self.contents.deviation is None else self._plane(self.contents.deviation)
        )

    @property
    def view_z(self) -> Any:
        """(H, W) depth of the last frame, or None."""
        return None if self.contents is None else self._plane(self.contents.view_z)

    @property
    def motion(self) -> Any:
        """(H, W, 2) motion of the last frame in pixels, or None: empty, or nothing moved."""
        if self.contents is None or self.contents.motion is None:
            return None
        return Planes(self.contents.motion, self.contents.camera.shape).tensor()

    def _image(self, name: str) -> Any:
        if self.contents is None or name not in self.contents.channels:
            return None
        arrays = self.contents.channels[name]
        return self._plane(arrays[0]) if CHANNELS[name] == 1 else Planes(arrays, self.contents.camera.shape).tensor()

    def _plane(self, array: Any) -> Any:
        assert self.shape is not None
        # Its own memory: nobody may write into the history through it.
        return types_of(type(array)).Tensor(dr.opaque(array), self.shape)

    def __repr__(self) -> str:
        if self.contents is None:
            return "History(empty)"
        height, width = self.contents.camera.shape
        return f"History({width}x{height}, {', '.join(self.contents.channels)}, frame_index={self.frame_index})"
