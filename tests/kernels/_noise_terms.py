"""The terms of a noise pattern as arrays of width one, for calls of the kernel function alone."""

from types import SimpleNamespace

from gtao.estimators.noise_inputs import noise_inputs
from gtao.kernels import noise


def noise_terms(name, frame_index, seed, UInt):
    terms = noise.frame_terms(name, frame_index, seed)
    inputs = noise_inputs(name, terms, UInt)
    return SimpleNamespace(frame_rotation=terms.frame_rotation, frame_offset=terms.frame_offset, **inputs)
