"""What tables hold, as functions of their arguments: the truth that texels are made of and compared with."""

from collections.abc import Callable, Mapping

import numpy as np

from gtao.kernels.table_axes_cones import aperture

from .cones import visible_share
from .lanes import lanes, numbers

__all__ = ["value_of"]


def _cone_cone(alpha_v, beta, alpha):
    alpha_s = numbers(aperture(*lanes(alpha)), like=alpha)
    return visible_share(alpha_v, alpha_s, beta)[:, None]


_VALUES: Mapping[str, Callable[..., np.ndarray]] = {"cone-cone": _cone_cone}


def value_of(kind: str) -> Callable[..., np.ndarray]:
    """Function of the arguments of a kind, arrays (n,), to (n, C) values."""
    return _VALUES[kind]
