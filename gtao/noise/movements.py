"""Ways to make a sequence over frames of one mask of blue noise."""

from collections.abc import Callable, Mapping
from functools import cache
from types import MappingProxyType

import numpy as np

from gtao.kernels.noise import GOLDEN

from .void_and_cluster import blue_noise_mask

__all__ = ["MOVEMENTS"]

_GOLDEN = np.array([GOLDEN, np.sqrt(2) - 1])
_G = np.roots([1, 0, -1, -1]).real.max()
#: The R2 sequence in the plane: powers of the inverse plastic number.
_R2 = np.array([1 / _G, 1 / _G**2])

_SIZE = 64


@cache
def _fresh(number: int) -> np.ndarray:
    return blue_noise_mask(_SIZE, seed=1993 + 2 * number) / 65536


def _moved(numbers: np.ndarray) -> np.ndarray:
    return np.mod(_fresh(0) + numbers, 1.0)


def _rolled(frame: int) -> np.ndarray:
    return np.roll(_fresh(0), tuple(np.floor(_SIZE * np.mod(frame * _R2, 1.0)).astype(int)), axis=(0, 1))


#: From the number of a frame to (64, 64, 2) values: the same in every frame ("still"); all of them moved on, rotations
#: by the golden ratio and offsets by √2 - 1 ("golden", what the pattern "blue_noise" does) or both along the R2
#: sequence ("r2"); the tile moved to where R2 says ("shift"); another mask in every frame ("fresh").
MOVEMENTS: Mapping[str, Callable[[int], np.ndarray]] = MappingProxyType(
    {
        "still": lambda frame: _fresh(0),
        "golden": lambda frame: _moved(frame * _GOLDEN),
        "r2": lambda frame: _moved(frame * _R2),
        "shift": _rolled,
        "fresh": _fresh,
    }
)
