"""The mask of blue noise that comes with the package, as the kernels read it."""

from functools import cache
from typing import Any

import drjit as dr

from gtao.data.blue_noise import mask_values
from gtao.kernels.noise_mask import constant_table

__all__ = ["mask_words"]


def mask_words(UInt: type) -> Any:
    """The words of the mask, an array of its own: made once, but inside ``dr.freeze`` in every recording."""
    return _made(UInt) if dr.flag(dr.JitFlag.FreezingScope) else _kept(UInt)


def _made(UInt: type) -> Any:
    values = mask_values()
    words = constant_table([low | high << 16 for low, high in zip(values[::2], values[1::2], strict=True)], UInt)
    dr.eval(words)
    return words


@cache
def _kept(UInt: type) -> Any:
    return _made(UInt)
