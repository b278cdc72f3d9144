"""What kernels know of a camera."""

from typing import Any

__all__ = ["view_numbers"]


def view_numbers(camera: Any) -> tuple[Any, ...]:
    """The numbers of a :class:`gtao.kernels.filters.View`, in its order; their gradients stay."""
    fx, fy = camera.fx, camera.fy
    return 1 / fx, (0.5 - camera.cx) / fx, -1 / fy, (camera.cy - 0.5) / fy, 1 / min(fx, fy)
