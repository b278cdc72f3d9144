"""Tables of specular occlusion looked up in a shader: HLSL, GLSL, WGSL and C."""

import re

from gtao._version import __version__
from gtao.config import ConeTable
from gtao.data.specular import SpecularTable
from gtao.errors import ConfigError

from .languages import language_of
from .statements import Writer
from .table_code_axes import COORDINATES, SCALES
from .table_code_geometry import Geometry
from .table_code_texels import AXES, lookup_in_c, sampled, texture_kind

__all__ = ["table_code"]

#: One default for a frame and for a shader.
DEFAULT_APERTURE = ConeTable().aperture

_GIVEN = {
    "normal": "direction",
    "view": "direction",
    "bent_normal": "direction",
    "visibility": "number",
    "roughness": "number",
}
_APERTURES = {
    ("seed", "cosine"): "cos a = sqrt(1 - visibility)",
    ("tilted", "cosine"): "sin(a)^2 = visibility / dot(normal, bent normal)",
    ("seed", "uniform"): "cos a = 1 - visibility",
    ("tilted", "uniform"): "cos a = 1 - visibility",
}


def _name(table: SpecularTable) -> str:
    """ConeConeOcclusion, Brdf4dOcclusion, Brdf4dShares, EnvironmentBrdf …"""
    kind = "".join(word.capitalize() for word in table.kind.split("-"))
    if table.kind == "environment-brdf":
        return kind
    return f"{kind}{'Occlusion' if table.n_channels == 1 else 'Shares'}"


def _comment(table: SpecularTable, aperture: str, weighting: str, language: str) -> list[str]:
    size = "x".join(map(str, table.size))
    environment = table.kind == "environment-brdf"
    lines = [f"Table {table.kind} of {size} texels, axes {table.axes}."]
    if language == "c":
        lines.append("table:       the texels, x fastest, channels side by side")
    elif len(table.size) < 3:
        lines.append("table:       the texture, filtered linearly, clamped at its edges, without mipmaps")
    else:
        lines.append("table:       the volume, filtered linearly, clamped at its edges, without mipmaps")
    lines.append("normal:      unit; all directions in one frame, whichever")
    lines.append("view:        unit, from the surface to the viewer")
    if not environment:
        lines += [
            "bent_normal: unit",
            f"visibility:  0 to 1, 1 = open, {weighting} weighting; the half angle a of its cone:",
            f"             {_APERTURES[aperture, weighting]}",
        ]
    lines.append("roughness:   perceptual, 0 to 1; the microfacet width is its square")
    if environment:
        lines.append("returns:     A and B: of a white dome the surface reflects f0 A + B")
    elif table.n_channels == 1:
        lines.append("returns:     specular occlusion, 1 = open")
    else:
        lines.append("returns:     the shares of A and B that are left; see the functions below")
    if table.source:
        lines.append(f"Source: {table.source}")
    lines.append(f"Written by gtao {__version__}.")
    return [f"// {line}" for line in lines]


def _lookup(w: Writer, table: SpecularTable, g: Geometry, name: str) -> list[str]:
    """The body: coordinates, texels, and what they are multiplied by."""
    at = table.kind, table.axes
    coordinates = [w.clamped(c) for c in COORDINATES[at](g)]
    factors = [] if table.kind == "environment-brdf" else [_seen(w, g)]
    factors += [SCALES[at](g)] if at in SCALES else []
    letters = AXES[: len(coordinates)]
    lines = [*g.lines, *(w.let(letter, c) for letter, c in zip(letters, coordinates, strict=True))]
    if w.language == "c":
        lines.append(f"const float unit[{len(letters)}] = {{{', '.join(letters)}}};")
        values = [f"{name}Texels(table, unit, {i})" for i in range(table.n_channels)]
    else:
        more, value = sampled(w, table)
        lines, values = [*lines, *more], [value]
    if factors:
        lines.append(w.let("scale", " * ".join(factors)))
        values = [f"scale * ({value})" for value in values]
    return [*lines, *w.result(*values)]


def _seen(w: Writer, g: Geometry) -> str:
    """0 where nothing is visible: there is no bent normal then, and no cone that could be looked up."""
    return w.L.select(f"{g.visible} > {w.number(0)}", w.number(1), w.number(0))


def _used(given: dict[str, str], body: list[str]) -> dict[str, str]:
    """The parameters that a body reads."""
    words = set(re.findall(r"\w+", " ".join(body)))
    return {name: kind for name, kind in given.items() if name in words}


def _shaded(w: Writer) -> list[str]:
    """What becomes of the shares of A and B."""
    (a, b), (s, t) = ((w.read(name, 0), w.read(name, 1)) for name in ("environment", "shares"))
    given = {"shares": "pair", "environment": "pair", "f0": "colour"}
    kept = [w.let("a", f"{a} * {s}"), w.let("b", f"{b} * {t}")]
    # A mirror without F0 reflects nothing: what is left of nothing is its limit.
    whole = w.let("whole", f"{b} + {w.number(1e-20)}")
    limited = [w.let("a", f"{a} * {s}"), whole, w.let("b", f"whole * {t}")]
    seen = f"f0 * a + {w.L.splat.format('b')}"
    return [
        "",
        "// S (f0 A + B): what the surface reflects of a white dome through its visible directions.",
        *w.function("SpecularReflectance", "colour", given, [*kept, f"return {seen};"])[1:],
        "",
        "// S alone, for a renderer that multiplies by its own f0 A + B afterwards; 1 = open.",
        *w.function(
            "SpecularOcclusion",
            "colour",
            given,
            [*limited, f"return ({seen}) / (f0 * {a} + {w.L.splat.format('whole')});"],
        )[1:],
    ]


def table_code(
    table: SpecularTable, language: str = "hlsl", *, aperture: str = DEFAULT_APERTURE, weighting: str = "cosine"
) -> str:
    """Documented functions that look a table up, with the sizes of this one.

    Of a table of one channel ``ConeConeOcclusion(table, normal, view, bent_normal, visibility, roughness)``,
    ``Brdf4dOcclusion`` … return specular occlusion S. Of two channels ``Brdf4dShares`` … return the shares A_V / A and
    B_V / B; with A and B of ``EnvironmentBrdf(table, normal, view, roughness)``, the code of the table
    "environment-brdf", ``SpecularReflectance(shares, environment, f0)`` makes S (F0 A + B) of them without a division,
    and ``SpecularOcclusion`` S itself.

    Texels are aligned with the ends of an axis: a coordinate c is at (c (n - 1) + 1/2) / n. Further axes than three are
    slabs in the depth of the volume, as :func:`write_table` stacks them; two of them, or four, are sampled and mixed.
    The sampler has to filter linearly and clamp. In HLSL and WGSL it follows the texture; C takes the texels as
    floats and interpolates them itself, and its colours are one number.

    Args:
        table: the table; only its kind, axes, size and number of channels matter.
        language: "hlsl", "glsl", "wgsl" or "c".
        aperture: of the cone of visible directions, "seed" or "tilted", as of :class:`gtao.ConeTable`, whose default
            it has.
        weighting: "cosine" or "uniform", of visibility and bent normal.

    Raises:
        ConfigError: an option or the table's axes are unknown.
    """
    w = Writer(language)
    language_of(language)
    if (aperture, weighting) not in _APERTURES:
        raise ConfigError(
            "shader code knows the apertures 'seed' and 'tilted' and the weightings 'cosine' and 'uniform',"
            f" got {aperture!r} and {weighting!r}"
        )
    if (table.kind, table.axes) not in COORDINATES:
        known = ", ".join(repr(axes) for kind, axes in COORDINATES if kind == table.kind)
        raise ConfigError(f"no code for the axes {table.axes!r} of a table {table.kind!r}; there is some for {known}")
    name, environment = _name(table), table.kind == "environment-brdf"
    given = {"table": texture_kind(table), **_GIVEN}
    lines = _comment(table, aperture, weighting, language)
    if language == "c":
        lines += ["", "#include <math.h>", *lookup_in_c(f"{name}Texels", table)]
    body = _lookup(w, table, Geometry(w, aperture, weighting), name)
    returns = "number" if table.n_channels == 1 else "pair"
    lines += w.function(name, returns, _used(given, body), body)
    if table.n_channels == 2 and not environment:
        lines += _shaded(w)
    return "\n".join(lines) + "\n"
