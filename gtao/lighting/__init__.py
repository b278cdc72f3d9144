"""Light from afar: environment maps, real spherical harmonics, and what other programs make of them.

NumPy in double precision throughout; coefficients are (n,) or (n, C) with n = (order + 1)², ordered (0, 0), (1, -1),
(1, 0), (1, 1), (2, -2), …, without the Condon-Shortley phase.
"""

from .basis import basis, cosine_kernel, evaluate, project_function
from .conventions import CONVENTIONS, Convention, convert
from .environment import EnvironmentMap
from .lights import ZonalLight, constant, disc, gradient_sky, von_mises_fisher
from .prefilter import PrefilteredEnvironment, prefilter
from .quality import energy, fit_quality
from .rotation import axes, rotate, rotation_matrix, to_view
from .windowing import WINDOWS, minimum, non_negative, window, window_factors

__all__ = [
    "CONVENTIONS",
    "WINDOWS",
    "Convention",
    "EnvironmentMap",
    "PrefilteredEnvironment",
    "ZonalLight",
    "axes",
    "basis",
    "constant",
    "convert",
    "cosine_kernel",
    "disc",
    "energy",
    "evaluate",
    "fit_quality",
    "gradient_sky",
    "minimum",
    "non_negative",
    "prefilter",
    "project_function",
    "rotate",
    "rotation_matrix",
    "to_view",
    "von_mises_fisher",
    "window",
    "window_factors",
]
