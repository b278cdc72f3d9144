"""Packed visibility and directions read back in a shader: HLSL, GLSL, WGSL and C."""

from collections.abc import Callable

from gtao._version import __version__

from .codecs import Packing, sh_scales
from .directions import check_weighting
from .languages import language_of
from .octahedral import levels
from .packing import packing
from .packing_harmonics import harmonics
from .statements import Writer

__all__ = ["packing_code"]


def _octahedron(w: Writer, u: str, v: str) -> list[str]:
    """From the square to (x, y, z) and its ``scale``; ``fold`` is positive below the equator only."""
    one, zero = w.number(1), w.number(0)

    def unfolded(name: str) -> str:
        # name - sign(name) fold, without a sign: fold is never more than |name|.
        return f"{w.L.max(f'{name} - fold', zero)} + {w.L.min(f'{name} + fold', zero)}"

    return [
        w.let("u", u),
        w.let("v", v),
        w.let("z", f"{one} - {w.L.call('absolute', 'u')} - {w.L.call('absolute', 'v')}"),
        w.let("fold", w.L.max(f"{zero} - z", zero)),
        w.let("x", unfolded("u")),
        w.let("y", unfolded("v")),
        w.normalised(),
    ]


def _grid(w: Writer, i: int, n_bits: int) -> str:
    """A coordinate of the square, of a texel whose largest integer reads as 1."""
    return f"{w.read('texel', i)} * {w.number((2**n_bits - 1) / levels(n_bits))} - {w.number(1)}"


def _scaled(w: Writer, scale: str, last: str) -> list[str]:
    return w.result(*(f"{axis} * {scale}" for axis in "xyz"), last)


def _rgba8(w: Writer, weighting: str) -> list[str]:
    axes = [w.let(axis, f"{w.read('texel', i)} * {w.number(2)} - {w.number(1)}") for i, axis in enumerate("xyz")]
    return [*axes, w.normalised(), *_scaled(w, "scale", w.read("texel", 3))]


def _octahedral(n_bits: int) -> Callable[[Writer, str], list[str]]:
    def write(w: Writer, weighting: str) -> list[str]:
        square = _octahedron(w, _grid(w, 0, n_bits), _grid(w, 1, n_bits))
        return [*square, *_scaled(w, "scale", w.read("texel", 2))]

    return write


def _octahedral12(w: Writer, weighting: str) -> list[str]:
    def byte(i: int) -> str:
        return w.L.call("floor", f"{w.read('texel', i)} * {w.number(255)} + {w.number(0.5)}")

    step, one = w.number(1 / levels(12)), w.number(1)
    return [
        w.let("r", byte(0)),
        w.let("g", byte(1)),
        w.let("b", byte(2)),
        w.let("high", w.L.call("floor", f"g * {w.number(1 / 16)}")),
        *_octahedron(
            w,
            f"(r * {w.number(16)} + high) * {step} - {one}",
            f"((g - high * {w.number(16)}) * {w.number(256)} + b) * {step} - {one}",
        ),
        *_scaled(w, "scale", w.read("texel", 3)),
    ]


def _moments8(w: Writer, weighting: str) -> list[str]:
    length = w.let("length_of_mean", f"{w.read('texel', 2)} * {w.read('texel', 3)}")
    square = _octahedron(w, _grid(w, 0, 8), _grid(w, 1, 8))
    return [length, *square, *_scaled(w, "scale * length_of_mean", w.read("texel", 3))]


def _sh16(w: Writer, weighting: str) -> list[str]:
    zeroth, first = sh_scales(weighting)
    return w.result(*(f"sh[{i}] * {w.number(first)}" for i in (3, 1, 2)), f"sh[0] * {w.number(zeroth)}")


_WRITERS: dict[str, Callable[[Writer, str], list[str]]] = {
    "rgba8": _rgba8,
    "octahedral8": _octahedral(8),
    "octahedral12": _octahedral12,
    "octahedral16": _octahedral(16),
    "moments8": _moments8,
    "sh16": _sh16,
}

#: Packings of mean direction and visibility, from which the nine coefficients follow as far as they can.
_MOMENTS = ("moments8", "zh16")


def _comment(p: Packing, weighting: str) -> list[str]:
    inputs = "sh:      the nine numbers" if p.name == "sh16" else "texel:  "
    stored = {
        "rgba8": "the texel as sampled, 0 to 1; linear filtering is fine",
        "sh16": "as stored; linear filtering is fine",
        "zh16": "mean direction and visibility, the texel as it is; linear filtering is fine",
    }.get(p.name, "the texel as sampled, 0 to 1, not filtered: neighbours across a fold of the octahedron do not mix")
    whole = p.needs != "bent_normal"
    vector = "the mean direction, whose length carries the cone" if whole else "the unit bent normal"
    open_length = "2/3" if weighting == "cosine" else "1/2"
    lines = [
        f"Ambient visibility and its directions from the packing {p.name}:",
        f"{p.about}.",
        "",
        f"{inputs} {stored}" if p.name != "zh16" else f"moments: {stored}",
    ]
    if p.name != "zh16":
        lines.append(f"returns: xyz = {vector}, w = visibility, 1 = open")
    lines.append("Frame:   view, +x right, +y up, +z toward the camera; negate z where +z is forward.")
    if whole:
        lines.append(f"The mean direction has {weighting} weighting: its length is {open_length} in the open.")
    lines.append(f"Written by gtao {__version__}.")
    return [f"// {line}".rstrip() for line in lines]


def packing_code(name: str, language: str = "hlsl", weighting: str = "cosine") -> str:
    """A documented function ``UnpackRgba8(texel)``, ``UnpackOctahedral12(texel)`` … that reads a packing back.

    It takes the texel as a sampler gives it (for "sh16" the nine coefficients) and returns the bent normal, or the
    mean direction where the packing stores it, and visibility, as four numbers; in C (C99 and C++) it fills an array.
    With "moments8" and "zh16" comes ``VisibilityHarmonics(moments)``, which makes nine coefficients of the visible
    hemisphere out of the mean direction and visibility: those of bands 0 and 1 are the stored ones, band 2 is that of a
    cone of the same mean direction. Nothing else is needed for "zh16", whose texel already is what the others return.
    Coefficients are in the order and the signs of :attr:`gtao.AmbientOcclusion.visibility_sh`.

    Args:
        name: a key of :data:`gtao.io.PACKINGS`.
        language: "hlsl", "glsl", "wgsl" or "c".
        weighting: "cosine" or "uniform", as of the estimate; matters where the mean direction or coefficients are
            stored.

    Raises:
        ConfigError: the packing, the language or the weighting is unknown.
    """
    p = packing(name)
    w = Writer(language)
    language_of(language)
    check_weighting(weighting)
    lines = _comment(p, weighting)
    if language == "c":
        lines += ["", "#include <math.h>"]
    if name in _WRITERS:
        given = {"sh": "nine"} if name == "sh16" else {"texel": "four"}
        lines += w.function(f"Unpack{name.capitalize()}", "four", given, _WRITERS[name](w, weighting))
    if name in _MOMENTS:
        lines += w.function("VisibilityHarmonics", "nine", {"moments": "four"}, harmonics(w, weighting))
    return "\n".join(lines) + "\n"
