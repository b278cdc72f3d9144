"""Image-level drivers: a G-buffer and a configuration in, a result out."""

from .multibounce import multibounce
from .occlusion import ambient_occlusion

__all__ = ["ambient_occlusion", "multibounce"]
