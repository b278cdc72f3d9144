"""What an estimate holds, as flat arrays by name, and an estimate of such arrays."""

from collections.abc import Iterable
from itertools import chain, islice
from typing import Any

from gtao.gbuffer import GBuffer
from gtao.history import CHANNELS
from gtao.planes import Planes
from gtao.results import AmbientOcclusion

__all__ = ["Channels", "channels_of", "estimate_of", "in_a_row", "named"]

#: Flat arrays by the names of ``CHANNELS``.
Channels = dict[str, tuple[Any, ...]]


def channels_of(ao: AmbientOcclusion, T: Any) -> Channels:
    """Flat arrays of what an estimate holds, in the precision of the array types ``T``."""
    found: Channels = {}
    for name in CHANNELS:
        if name in ("mean_direction", "visibility_sh"):
            planes = ao.planes(name)
            arrays = None if planes is None else planes.arrays
        else:
            image = getattr(ao, name)
            arrays = None if image is None else (image.array,)
        if arrays is not None:
            found[name] = tuple(map(T.Float, arrays))
    return found


def in_a_row(channels: Channels) -> tuple[Any, ...]:
    """All arrays, one after the other."""
    return tuple(chain.from_iterable(channels.values()))


def named(arrays: Iterable[Any], like: Channels) -> Channels:
    """Arrays in a row under the names of others."""
    each = iter(arrays)
    return {name: tuple(islice(each, len(of_name))) for name, of_name in like.items()}


def estimate_of(channels: Channels, ao: AmbientOcclusion, g: GBuffer) -> AmbientOcclusion:
    """The arrays as an estimate of frame ``g``, made with the configuration of ``ao``; its variance is None.

    Its normals are those of ``ao``, or of the frame where that is of another size.
    """
    T, images = g.types, {}
    for name, arrays in channels.items():
        images[name] = T.Tensor(arrays[0], g.shape) if CHANNELS[name] == 1 else Planes(arrays, g.shape)
    same = ao.normal_v is None or tuple(ao.visibility.shape) == g.shape
    return AmbientOcclusion(**images, normal_v=ao.normal_v if same else g.normal_v, config=ao.config)
