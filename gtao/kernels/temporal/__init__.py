"""Temporal accumulation: what of the previous frames a pixel may use, and how much (theory, the temporal filter).

:func:`history_taps` finds the texels in which a surface was seen before, :func:`mix` and :func:`steadiness` what they
say, :func:`low_passed_bounds` and :func:`clamped` how far they may be from the frame at hand.
"""

from .blend import blend, deviation, effective_count
from .clamp import clamped, low_passed_bounds, moved_share
from .reprojection import Crease, HistoryTap, Prediction, depth_weight, history_taps, predicted
from .taps import mix, steadiness
from .turning import turned_harmonics, turned_vector
from .velocity import motion_difference, speed, velocity_weight

__all__ = [
    "Crease",
    "HistoryTap",
    "Prediction",
    "blend",
    "clamped",
    "depth_weight",
    "deviation",
    "effective_count",
    "history_taps",
    "low_passed_bounds",
    "mix",
    "motion_difference",
    "moved_share",
    "predicted",
    "speed",
    "steadiness",
    "turned_harmonics",
    "turned_vector",
    "velocity_weight",
]
