"""The errors that gtao raises on purpose.

Each also derives from the builtin that a caller would expect, so that ``except ValueError`` keeps working.
"""

__all__ = [
    "BackendError",
    "ConfigError",
    "FitError",
    "GtaoError",
    "ImageError",
    "RecordError",
    "SceneError",
    "ShapeError",
]


class GtaoError(Exception):
    """Base class: catches everything that gtao raises on purpose."""


class ConfigError(GtaoError, ValueError):
    """A parameter is outside its range or contradicts another one."""


class ShapeError(GtaoError, ValueError):
    """An array has the wrong shape, type or values."""


class BackendError(GtaoError, RuntimeError):
    """No usable Dr.Jit backend: neither a GPU nor a suitable LLVM library."""


class SceneError(GtaoError, ValueError):
    """A scene is missing, broken, or does not fit the request."""


class ImageError(GtaoError, OSError):
    """An image file cannot be read or written, or lacks a channel."""


class RecordError(GtaoError, ValueError):
    """A record or coefficient file is not what its schema says."""


class FitError(GtaoError, RuntimeError):
    """A fit has too little data or did not converge."""
