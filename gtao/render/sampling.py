"""Stratified random points without state: Owen-scrambled Sobol' pairs, padded over bounces.

Every (pixel, batch, bounce) has its own random scramble of the first two Sobol' dimensions, visited in its
own scrambled order, so the points of one pixel and bounce are a randomised (0, 2)-sequence: each is uniform
in the unit square, any aligned power of two of them is stratified, and different pixels, batches and bounces
are independent. The scramble is the hash of Laine and Karras (2011), in the arrangement of Burley (2020).
"""

from typing import Any

import drjit as dr
import mitsuba as mi

from gtao.errors import ConfigError

__all__ = ["batch_key", "check_sampling", "point", "stream_key"]

_WORD = 0xFFFFFFFF
_GOLDEN = 0x9E3779B9  # 2^32 over the golden ratio: spreads consecutive integers
_PASCAL = ((1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F), (8, 0x00FF00FF), (16, 0x0000FFFF))


def check_sampling(spp: int, n_batches: int, seed: int) -> None:
    """Raise ConfigError unless ``spp`` divides into two batches or more and the seed is not negative."""
    for name, value, least in (("spp", spp, 1), ("n_batches", n_batches, 2), ("seed", seed, 0)):
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise ConfigError(f"{name} must be an integer of at least {least}, got {value!r}")
    if spp % n_batches:
        raise ConfigError(f"spp must be a multiple of n_batches ({n_batches}), got {spp}")


def _mix(h: Any) -> Any:
    """Bijective 32-bit hash with full avalanche, for Python integers and Dr.Jit arrays alike."""
    h = h ^ (h >> 16)
    h = (h * 0x7FEB352D) & _WORD
    h = h ^ (h >> 15)
    h = (h * 0x846CA68B) & _WORD
    return h ^ (h >> 16)


def batch_key(seed: int, batch: int) -> int:
    """32-bit key of one batch; all bits of the seed count."""
    key = _mix((batch + 1) * _GOLDEN & _WORD)
    while True:
        key = _mix(key ^ (seed & _WORD))
        seed >>= 32
        if not seed:
            return key
        key = (key + _GOLDEN) & _WORD


def stream_key(batch: Any, pixel: Any) -> Any:
    """Key of one pixel within a batch."""
    return _mix(_mix(pixel * _GOLDEN) ^ batch)


def _scramble(bits: Any, seed: Any) -> Any:
    """Owen scramble of numbers in reversed bit order: each bit is flipped by a hash of the lower ones."""
    bits = bits ^ (bits * 0x3D20ADEA)
    bits = bits + seed
    bits = bits * ((seed >> 16) | 1)
    bits = bits ^ (bits * 0x05526C56)
    return bits ^ (bits * 0x53A22864)


def point(stream: Any, bounce: Any, index: Any) -> Any:
    """Point number ``index`` of a pixel's stream at a bounce, as Point2f in [0, 1)^2."""
    order = _mix(stream + bounce * _GOLDEN)
    first = _mix(order + _GOLDEN)
    second = _mix(first + _GOLDEN)
    i = dr.brev(_scramble(dr.brev(index), order))
    # Sobol's second generator matrix is Pascal's triangle mod 2, a Kronecker power; the first is the
    # identity.
    j = i
    for shift, mask in _PASCAL:
        j = j ^ ((j >> shift) & mask)
    x, y = dr.brev(_scramble(i, first)), dr.brev(_scramble(j, second))
    return mi.Point2f(mi.Float(x >> 8), mi.Float(y >> 8)) * 2**-24
