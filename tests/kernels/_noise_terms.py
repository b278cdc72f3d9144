"""The terms of a noise pattern as arrays of width one, for calls of the kernel function alone."""

from types import SimpleNamespace

from gtao.estimators.noise_masks import mask_words
from gtao.kernels import noise


def noise_terms(name, frame_index, seed, UInt):
    terms = noise.frame_terms(name, frame_index, seed)
    integers = {key: UInt(value) for key in ("key", "seed", "frame") if (value := getattr(terms, key)) is not None}
    return SimpleNamespace(
        frame_rotation=terms.frame_rotation, frame_offset=terms.frame_offset, mask=mask_words(UInt), **integers
    )
