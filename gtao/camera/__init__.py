"""Pinhole and orthographic cameras in the view frame: +x right, +y up, looking along -z.

Pixel coordinates are continuous, (0, 0) is the top left corner of the top left pixel, centres lie at half-integers.
"""

from typing import Any

from gtao.errors import ConfigError

from .orthographic import OrthographicCamera
from .perspective import PerspectiveCamera

__all__ = ["OrthographicCamera", "PerspectiveCamera", "camera_from_dict"]

Camera = PerspectiveCamera | OrthographicCamera


def camera_from_dict(data: dict[str, Any]) -> Camera:
    """The camera that :meth:`PerspectiveCamera.to_dict` or :meth:`OrthographicCamera.to_dict` described.

    Raises:
        ConfigError: the type is unknown or a number is missing or out of range.
    """
    kinds = {c.kind: c for c in (PerspectiveCamera, OrthographicCamera)}
    if not isinstance(data, dict):
        raise ConfigError(f"a camera is described by an object of names and numbers, got {type(data).__name__}")
    data = dict(data)
    kind = data.pop("type", None)
    if not isinstance(kind, str) or kind not in kinds:
        raise ConfigError(f"camera type must be one of {', '.join(kinds)}, got {kind!r}")
    try:
        return kinds[kind](**data)
    except ConfigError:
        raise
    except (TypeError, ValueError, OverflowError) as error:
        raise ConfigError(f"bad {kind} camera: {error}") from None
