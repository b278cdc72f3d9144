"""What the noise patterns read beside the frame's two numbers, as arrays."""

from functools import cache
from typing import Any

import drjit as dr

from gtao.data.blue_noise import mask_values
from gtao.kernels import noise
from gtao.kernels.noise_mask import constant_table

__all__ = ["noise_inputs", "packed"]


def noise_inputs(name: str, terms: noise.FrameTerms, UInt: type) -> dict[str, Any]:
    """Integers of width one and, for the patterns that read it, the mask that comes with the package.

    Args:
        name: of the pattern.
        terms: from :func:`gtao.kernels.noise.frame_terms`.
        UInt: type of the arrays.
    """
    integers = {key: getattr(terms, key) for key in ("key", "seed", "frame")}
    inputs = {key: dr.opaque(UInt, value) for key, value in integers.items() if value is not None}
    if name in noise.MASKED:
        # What was made before cannot be used inside dr.freeze, where nobody named it as an input.
        inputs["mask"] = _mask(UInt) if dr.flag(dr.JitFlag.FreezingScope) else _kept_mask(UInt)
    return inputs


def packed(values: Any) -> list[int]:
    """The words of a mask: of two numbers of 16 bits the first in the lower half."""
    return [low | high << 16 for low, high in zip(values[::2], values[1::2], strict=True)]


def _mask(UInt: type) -> Any:
    words = constant_table(packed(mask_values()), UInt)
    dr.eval(words)
    return words


@cache
def _kept_mask(UInt: type) -> Any:
    return _mask(UInt)
