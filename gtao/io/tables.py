"""Tables of specular occlusion as files: arrays, images, volume textures, and bytes with a description."""

import hashlib
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gtao._version import __version__
from gtao.data.specular import SpecularTable
from gtao.errors import ConfigError, GtaoError, ImageError, ShapeError
from gtao.kernels.table_axes import AXES

from .jsontext import plain, with_infinities
from .table_files import CONTAINERS, Container, dds_format, sidecar
from .table_texels import decode_texels, encode_texels, encoding_of

__all__ = ["read_table", "table_files", "table_manifest", "write_table"]

#: Version of the description of a table.
SCHEMA = 1

_AXIS_LETTERS = "xyzwv"


def _container(path: Path) -> Container:
    suffix = path.suffix.lower()
    if suffix not in CONTAINERS:
        raise ImageError(f"{path} is no kind of table; give a name that ends in one of {', '.join(CONTAINERS)}")
    return CONTAINERS[suffix]


def _channels(table: SpecularTable) -> tuple[str, ...]:
    if table.n_channels == 1:
        return ("S",)
    return ("A", "B") if table.kind == "environment-brdf" else ("S_A", "S_B")


def _slice(n_axes: int) -> str:
    """Index of a slice of the volume that the axes beyond the second make."""
    text = _AXIS_LETTERS[n_axes - 1]
    for letter in reversed(_AXIS_LETTERS[2 : n_axes - 1]):
        text = f"{letter} + n_{letter} * {text if len(text) == 1 else f'({text})'}"
    return text


def _layout(table: SpecularTable, encoding: str) -> dict[str, Any]:
    e, n_axes = encoding_of(encoding), len(table.size)
    letters = ", ".join(_AXIS_LETTERS[:n_axes])
    within = "blocks of 4x4 texels" if e.block > 1 else "texels"
    layout = {
        "dtype": np.dtype(e.dtype).str,
        "byte_order": "little",
        "order": f"{within} in the order of {letters}, x fastest, the channels of each side by side",
        "dds_format": dds_format(encoding, table.n_channels),
    }
    if e.unit:
        layout["one"] = e.largest
    if n_axes > 2:
        layout["slice"] = _slice(n_axes)
    return layout


def table_manifest(table: SpecularTable, encoding: str) -> dict[str, Any]:
    """What is written beside the texels of a table, for people and programs.

    Returns:
        ``kind``, ``axes``; ``coordinates``: names of what the coordinates stand for, x first, where they are known;
        ``size``: texels along x, y …; ``channels``; ``encoding`` and ``layout`` of the numbers; ``mapping``: formulas
        from coordinates in [0, 1] to where a sampler is to be asked; ``settings``, ``source``, ``made_by``.
    """
    axes = AXES.get((table.kind, table.axes))
    return {
        "schema": SCHEMA,
        "kind": table.kind,
        "axes": table.axes,
        "coordinates": None if axes is None else list(axes.names),
        "size": list(table.size),
        "channels": list(_channels(table)),
        "encoding": encoding,
        "layout": _layout(table, encoding),
        "mapping": {
            "texel": "texel i of n along an axis stands for the coordinate c = i / (n - 1)",
            "sample": "u = (c * (n - 1) + 0.5) / n",
        },
        "settings": plain(table.settings, "settings of the table"),
        "source": table.source,
        "made_by": f"gtao {__version__}",
    }


def write_table(path: str | os.PathLike, table: SpecularTable, encoding: str | None = None) -> None:
    """Write a table, whole or not at all; the same table gives the same bytes.

    The suffix says how. What the format has no place for — kind, axes, size, layout, settings, source, check sum —
    goes into a description (JSON) beside the file, named like it with ``.json`` appended; :func:`read_table` needs
    both.

    ==============  ============================================================================  ====================
    suffix          content                                                                       description
    ==============  ============================================================================  ====================
    ``.npy``        array (…, n_y, n_x, C)                                                        beside it
    ``.npz``        the same array, compressed                                                    inside
    ``.exr``        slices of n_x by n_y texels below each other, channels R and G                header
    ``.dds``        texture with header DX10: a plane, a volume of depth n_z, or for four axes    beside it
                    of depth n_z n_w, slice z + n_z w
    ``.raw .bin``   the texels in the order of the array, least significant byte first            beside it
    ==============  ============================================================================  ====================

    Encodings: "float" (all), "half" (all), "unorm16", "unorm8" (all but EXR), "bc4" (DDS and raw). One channel with
    "bc4" is BC4_UNORM, two are BC5_UNORM: a pair of BC4 blocks in one texture.

    Args:
        path: the file; its folder is made.
        table: the table.
        encoding: how to store the numbers; by default "half" in DDS, "float" elsewhere.

    Raises:
        ConfigError: there is no such encoding, or the file cannot hold it.
        ShapeError: a number is not finite, or not in [0, 1] though the encoding asks for that; sides are no multiples
            of 4 with "bc4"; Direct3D allows no texture of that size.
        ImageError: the suffix is unknown, or the file cannot be written.
        RecordError: the settings hold what JSON cannot.
    """
    path = Path(path)
    container, encoding = _how(path, encoding)
    texels = encode_texels(table.values, encoding)
    digest = hashlib.sha256(texels.tobytes()).hexdigest()
    container.write(path, texels, {**table_manifest(table, encoding), "sha256": digest})


def table_files(path: str | os.PathLike, size: Sequence[int], encoding: str | None = None) -> tuple[Path, ...]:
    """The files that :func:`write_table` would write for a table of a size: the table, and a description beside it.

    Raises:
        ConfigError, ShapeError, ImageError: as it would, as far as the size tells.
    """
    path = Path(path)
    container, encoding = _how(path, encoding)
    block = encoding_of(encoding).block
    if any(n % block for n in size[:2]):
        raise ShapeError(f"encoding {encoding!r} needs sides that are multiples of {block}, got {size[0]}x{size[1]}")
    return (path, sidecar(path)) if container.beside else (path,)


def _how(path: Path, encoding: str | None) -> tuple[Container, str]:
    """The kind of file, and the encoding that it is to have."""
    container = _container(path)
    encoding = container.encodings[0] if encoding is None else encoding_of(encoding).name
    if encoding not in container.encodings:
        fitting = ", ".join(container.encodings)
        raise ConfigError(f"{path.suffix} files hold the encodings {fitting}, got {encoding!r}")
    return container, encoding


def _text(told: Mapping[str, Any], name: str) -> str:
    if not isinstance(told[name], str):
        raise TypeError(f"its {name} is no text")
    return told[name]


def _table(data: bytes, told: Any) -> SpecularTable:
    """The table of bytes and their description; ValueError, KeyError or TypeError where they do not fit."""
    if not isinstance(told, dict):
        raise TypeError("it says nothing about a table")
    if told["schema"] != SCHEMA:
        raise ValueError(f"its description has schema {told['schema']!r}, this gtao knows {SCHEMA}")
    e = encoding_of(_text(told, "encoding"))
    n_x, n_y, *outer = (int(n) for n in told["size"])
    n_channels = len(told["channels"])
    shape = (*outer[::-1], n_y // e.block, n_x // e.block, n_channels * (8 if e.block > 1 else 1))
    n_bytes = int(np.prod(shape)) * np.dtype(e.dtype).itemsize
    if len(data) != n_bytes:
        raise ValueError(f"it holds {len(data)} bytes of texels, not {n_bytes}")
    if hashlib.sha256(data).hexdigest() != told["sha256"]:
        raise ValueError("its texels are not those that its description belongs to")
    values = decode_texels(np.frombuffer(data, e.dtype).reshape(shape), e.name)
    settings = with_infinities(told["settings"])
    if not isinstance(settings, dict):
        raise TypeError("its settings are no object")
    return SpecularTable(
        kind=_text(told, "kind"),
        axes=_text(told, "axes"),
        values=values,
        settings=settings,
        source=_text(told, "source"),
    )


def read_table(path: str | os.PathLike) -> SpecularTable:
    """Read what :func:`write_table` wrote; the values are float32 as a sampler of graphics hardware gives them.

    Raises:
        ImageError: the suffix is unknown; the file or its description is missing, damaged, or not of the other.
    """
    path = Path(path)
    data, told = _container(path).read(path)
    try:
        return _table(data, told)
    except KeyError as cause:
        reason = f"its description lacks {cause}"
    except (ValueError, TypeError, GtaoError) as cause:
        reason = str(cause)
    raise ImageError(f"cannot read {path}: {reason}; write the table again")
