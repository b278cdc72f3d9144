"""Noise for slices and steps: masks of blue noise, the patterns' numbers and spectra, and what they do to estimates.

NumPy; the numbers of the patterns and the estimates come from the kernels themselves.
"""

from .laboratory import Deviation, dense_limit, estimate_with, variance
from .movements import MOVEMENTS
from .sequences import sequence_values, values
from .spectrum import Spectrum, spectrum
from .void_and_cluster import blue_noise_mask, void_and_cluster

__all__ = [
    "MOVEMENTS",
    "Deviation",
    "Spectrum",
    "blue_noise_mask",
    "dense_limit",
    "estimate_with",
    "sequence_values",
    "spectrum",
    "values",
    "variance",
    "void_and_cluster",
]
