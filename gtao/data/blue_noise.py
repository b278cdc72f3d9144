"""The mask of blue noise that the pattern "blue_noise" reads, made by ``gtao.noise.blue_noise_mask()``."""

import sys
from array import array
from functools import cache
from pathlib import Path

__all__ = ["MASK_FILE", "mask_values"]

#: A NumPy array of shape (64, 64, 2), 16-bit unsigned integers in units of 2⁻¹⁶: rows, columns, rotation and offset.
MASK_FILE = Path(__file__).parent / "noise" / "blue-noise.npy"

_N_VALUES = 64 * 64 * 2


@cache
def mask_values() -> array:
    """The values of the mask in the order of the file, read without NumPy."""
    values = array("H", MASK_FILE.read_bytes()[-2 * _N_VALUES :])
    if sys.byteorder == "big":
        values.byteswap()
    return values
