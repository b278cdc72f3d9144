"""Image-level drivers: a G-buffer and a configuration in, a result out."""

from .denoise import denoise
from .multibounce import multibounce
from .occlusion import ambient_occlusion
from .value_and_gradient import ValueAndGradient, value_and_gradient

__all__ = ["ValueAndGradient", "ambient_occlusion", "denoise", "multibounce", "value_and_gradient"]
