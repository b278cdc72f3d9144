"""Light from afar: environment maps, real spherical harmonics, and what other programs make of them.

NumPy in double precision throughout; coefficients are (n,) or (n, C) with n = (order + 1)², ordered (0, 0), (1, -1),
(1, 0), (1, 1), (2, -2), …, without the Condon-Shortley phase.
"""

from .basis import basis, cosine_kernel, evaluate, project_function
from .environment import EnvironmentMap
from .rotation import axes, rotate, rotation_matrix, to_view

__all__ = [
    "EnvironmentMap",
    "axes",
    "basis",
    "cosine_kernel",
    "evaluate",
    "project_function",
    "rotate",
    "rotation_matrix",
    "to_view",
]
