"""The numbers of a table as texels of a format: integers, half floats, floats, or blocks of BC4."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from gtao.errors import ConfigError, ShapeError

from .bc4 import decode_bc4, encode_bc4

__all__ = ["TABLE_ENCODINGS", "TableEncoding", "decode_texels", "encode_texels", "encoding_of"]

#: Quadrature and float32 leave a number that is 0 or 1 this far outside at most; it is moved back.
_ROUNDING = 1e-6


@dataclass(frozen=True)
class TableEncoding:
    """How the numbers of a table are stored.

    Attributes:
        name: what :func:`gtao.io.write_table` calls it.
        dtype: of what is stored, least significant byte first.
        about: one line for people.
        largest: the integer that stands for 1; 0 where the numbers are stored as they are.
        block: texels along the side of what is stored together.
    """

    name: str
    dtype: str
    about: str
    largest: int = 0
    block: int = 1

    @property
    def unit(self) -> bool:
        """Whether it holds numbers from 0 to 1 only."""
        return self.largest > 0


#: Name -> encoding.
TABLE_ENCODINGS: dict[str, TableEncoding] = {
    e.name: e
    for e in (
        TableEncoding("unorm8", "<u1", "8 bits for 0 to 1", 255),
        TableEncoding("unorm16", "<u2", "16 bits for 0 to 1", 65535),
        TableEncoding("half", "<f2", "half floats"),
        TableEncoding("float", "<f4", "floats"),
        TableEncoding("bc4", "<u1", "blocks of 4x4 texels, 4 bits a number, for 0 to 1", 255, 4),
    )
}


def encoding_of(name: str) -> TableEncoding:
    """The encoding of that name.

    Raises:
        ConfigError: there is none.
    """
    if name not in TABLE_ENCODINGS:
        raise ConfigError(f"encoding must be one of {', '.join(TABLE_ENCODINGS)}, got {name!r}")
    return TABLE_ENCODINGS[name]


def _unit(values: np.ndarray, name: str) -> np.ndarray:
    outside = np.maximum(values - 1, -values)
    if outside.max() > _ROUNDING:
        raise ShapeError(
            f"encoding {name!r} holds numbers from 0 to 1, got {values.min():g} to {values.max():g};"
            " choose 'half' or 'float'"
        )
    return np.clip(values, 0, 1)


def encode_texels(values: Any, name: str) -> np.ndarray:
    """(…, H, W, C) numbers as what is stored of them.

    Returns:
        (…, H, W, C) of the type of the encoding, integers rounded to the nearest; of "bc4" (…, H/4, W/4, 8 C) bytes,
        the channels of a block one after the other, which for two channels is BC5.

    Raises:
        ConfigError: there is no such encoding.
        ShapeError: a number is not finite, not in [0, 1] where the encoding asks for that, or too large for half
            floats; a size is no multiple of 4 with "bc4".
    """
    e = encoding_of(name)
    values = np.asarray(values.numpy() if hasattr(values, "numpy") else values, dtype=np.float64)
    if not np.isfinite(values).all():
        n_bad = np.count_nonzero(~np.isfinite(values))
        raise ShapeError(f"the table is not finite at {n_bad} of its numbers; bake it again")
    if e.unit:
        values = _unit(values, name)
    elif np.abs(values).max() > np.finfo(e.dtype).max:
        raise ShapeError(f"encoding {name!r} holds numbers up to {np.finfo(e.dtype).max:g}, got larger ones")
    if e.block > 1:
        return np.concatenate([encode_bc4(values[..., i]) for i in range(values.shape[-1])], axis=-1)
    return (np.floor(values * e.largest + 0.5) if e.unit else values).astype(e.dtype)


def decode_texels(stored: np.ndarray, name: str) -> np.ndarray:
    """(…, H, W, C) float32 of what :func:`encode_texels` returns, as a sampler of graphics hardware gives it.

    Raises:
        ConfigError: there is no such encoding.
        ShapeError: of "bc4", what is stored are no blocks.
    """
    e = encoding_of(name)
    if e.block > 1:
        if stored.shape[-1] == 0 or stored.shape[-1] % 8:
            raise ShapeError(f"blocks of BC4 have 8 bytes for each channel, got {stored.shape[-1]}")
        channels = np.split(stored, stored.shape[-1] // 8, axis=-1)
        return np.stack([decode_bc4(channel) for channel in channels], axis=-1)
    return (stored / e.largest if e.unit else stored).astype(np.float32)
