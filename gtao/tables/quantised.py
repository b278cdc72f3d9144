"""Tables as they come back from the encodings of files."""

from dataclasses import replace

from gtao.data.specular import SpecularTable

__all__ = ["quantised"]


def quantised(table: SpecularTable, encoding: str) -> SpecularTable:
    """The same table with the values that an encoding keeps: "unorm8", "unorm16", "half", "float" or "bc4".

    Raises:
        ConfigError: there is no such encoding.
        ShapeError: values are not finite, or not in [0, 1] where the encoding asks for that; sides are no multiples of
            4 with "bc4".
    """
    from gtao.io.table_texels import decode_texels, encode_texels

    values = decode_texels(encode_texels(table.values, encoding), encoding)
    return replace(table, values=values, settings={**table.settings, "encoding": encoding})
