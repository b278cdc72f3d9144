"""Motion of a scene in which only the camera moves."""

from typing import Any

import drjit as dr

from gtao.camera import OrthographicCamera, PerspectiveCamera
from gtao.camera.pose import Pose, pose_of, previous_from_view
from gtao.config import plain
from gtao.errors import ConfigError, ShapeError
from gtao.gbuffer import GBuffer
from gtao.kernels import motion
from gtao.planes import Planes
from gtao.tensors import scalar

from .estimate import check_frame

__all__ = ["camera_motion", "still_motion"]


def camera_motion(g: GBuffer, camera: Any, view_to_world: Any) -> Any:
    """Motion from the previous frame to ``g`` where nothing but the camera moves (theory, eq. (176)).

    Args:
        g: the frame, with its own ``view_to_world``.
        camera: the previous frame's camera.
        view_to_world: 4x4 rigid matrix, where that one stood.

    Returns:
        (H, W, 3) tensor for ``motion`` of :class:`gtao.GBuffer`: pixels to the right, pixels down, change of ``view_z``
        in scene units. Points that were not in front of the previous camera get a motion that leads out of every frame
        (2²⁰ pixels). 0 exactly where neither camera nor pose differ. Without gradients.

    Raises:
        ConfigError: ``g`` is no frame or has no pose, or ``camera`` is no camera.
        ShapeError: the previous camera has another size, or ``view_to_world`` is no rigid matrix.
    """
    check_frame(g)
    if not isinstance(camera, PerspectiveCamera | OrthographicCamera):
        raise ConfigError(f"camera must be a PerspectiveCamera or OrthographicCamera, got {type(camera).__name__}")
    if g.view_to_world is None:
        raise ConfigError("g has no pose; make the frame with view_to_world=, or give its motion itself")
    if camera.shape != g.shape:
        raise ShapeError(
            f"the previous camera is {camera.width}x{camera.height}, the frame {g.shape[1]}x{g.shape[0]}; motion is in"
            " pixels of one size"
        )
    moved, T = still_motion(g, camera, pose_of("view_to_world", view_to_world)), g.types
    if moved is None:
        return T.Tensor(dr.zeros(T.Float, 3 * dr.width(g.view_z.array)), (*g.shape, 3))
    result = Planes(moved, g.shape).tensor()
    dr.eval(result)
    return result


def still_motion(g: GBuffer, camera: Any, previous: Pose) -> tuple[Any, ...] | None:
    """The three channels of :func:`camera_motion`, flat and not evaluated yet; None where nothing moves."""
    T = g.types
    if previous == g.view_to_world and _numbers(camera) == _numbers(g.camera):
        return None

    def view(c: Any) -> motion.View:
        return motion.View(*(scalar(value, T.Float) for value in _numbers(c)), orthographic=c.is_orthographic)

    rows = [[scalar(value, T.Float) for value in row] for row in previous_from_view(previous, g.view_to_world)]
    index = dr.arange(T.UInt, dr.width(g.view_z.array))
    y = index // g.camera.width
    x, y = T.Float(index - y * g.camera.width) + 0.5, T.Float(y) + 0.5
    return motion.motion(x, y, dr.detach(g.view_z.array), view(g.camera), view(camera), rows)


def _numbers(camera: Any) -> tuple[float, ...]:
    return tuple(plain(getattr(camera, name)) for name in ("fx", "fy", "cx", "cy"))
