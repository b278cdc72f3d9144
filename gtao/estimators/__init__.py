"""Image-level drivers: a G-buffer and a configuration in, a result out."""

from .denoise import denoise
from .multibounce import multibounce
from .occlusion import ambient_occlusion

__all__ = ["ambient_occlusion", "denoise", "multibounce"]
