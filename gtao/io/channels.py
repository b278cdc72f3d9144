"""Which channels of an EXR image are depth, normals and albedo, and what their names say about them."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gtao.errors import ImageError

__all__ = ["Found", "Triple", "find_channels"]

_MAIN_LAYERS = {"", "rgba", "rgb"}
_DEPTH_WORDS = {"depth", "z", "zdepth"}
_NORMAL_WORDS = {"n", "nn", "ns", "ng", "normal", "normals", "sh_normal", "geo_normal"}
_ALBEDO_WORDS = {"albedo", "diffcol"}

Triple = tuple[str, str, str]


@dataclass(frozen=True)
class Found:
    """The channels of a G-buffer by name.

    Attributes:
        depth: the depth channel.
        ray_t: True if the name says "along the ray from the near plane" (Mitsuba), else it is along the axis.
        normals: the three channels of the normal, or None if they are not wanted.
        world: True if the normals are in world space, False if in view space, None if nothing tells.
        flip: normals may point away from the camera and shall be turned.
        albedo: red, green, blue of the diffuse albedo, or None.
    """

    depth: str
    ray_t: bool
    normals: Triple | None
    world: bool | None
    flip: bool
    albedo: Triple | None


def _layer(name: str) -> str:
    return name.rpartition(".")[0]


def _last(name: str) -> str:
    return name.rpartition(".")[2]


def _word(layer: str) -> str:
    return _last(layer).lower()


def _listing(names: Sequence[str]) -> str:
    shown = ", ".join(names[:24])
    return shown if len(names) <= 24 else f"{shown} and {len(names) - 24} more"


def _triples(names: Sequence[str], components: str) -> dict[str, Triple]:
    """Layer -> its three channels, for every layer that has all three components in either case."""
    by_layer: dict[str, dict[str, str]] = {}
    for name in names:
        by_layer.setdefault(_layer(name), {})[_last(name).upper()] = name
    return {
        layer: (found[components[0]], found[components[1]], found[components[2]])
        for layer, found in by_layer.items()
        if all(c in found for c in components)
    }


def _depth_candidates(names: Sequence[str]) -> list[str]:
    vectors = _triples(names, "XYZ")
    candidates = []
    for name in names:
        layer, last = _layer(name), _last(name)
        texture = f"{layer}.S" in names or f"{layer}.s" in names
        if (
            (last in ("Z", "z") and layer not in vectors)
            or (last == "T" and layer and not texture)
            or (last in ("V", "Y") and _word(layer) in _DEPTH_WORDS)
            or (not layer and (last.lower() == "depth" or (last == "V" and len(names) == 1)))
        ):
            candidates.append(name)
    return candidates


def _choose_depth(path: Any, names: Sequence[str], wanted: str | None) -> str:
    if wanted is not None:
        if wanted not in names:
            raise ImageError(f"{path} has no channel {wanted!r}; it has {_listing(names)}")
        return wanted
    candidates = _depth_candidates(names)
    # A bare Z is the format's own name for the depth of the main image; a layer called depth comes next.
    for preferred in (
        [c for c in candidates if _last(c) in ("Z", "z") and _layer(c).lower() in _MAIN_LAYERS],
        [c for c in candidates if _word(_layer(c)) in _DEPTH_WORDS],
    ):
        if len(preferred) == 1:
            return preferred[0]
    if not candidates:
        raise ImageError(f"{path} has no depth channel; it has {_listing(names)}; name one with depth_channel")
    if len(candidates) > 1:
        raise ImageError(
            f"{path} has several depth channels: {_listing(candidates)}; choose with layer or depth_channel"
        )
    return candidates[0]


def _choose_normals(
    path: Any, names: Sequence[str], wanted: str | None, looks_unit: Callable[[Triple], bool]
) -> Triple:
    vectors = _triples(names, "XYZ")
    named = {**_triples(names, "RGB"), **vectors}
    if wanted is not None:
        if wanted not in named:
            raise ImageError(f"{path} has no layer {wanted!r} with X Y Z or R G B; it has {_listing(names)}")
        return named[wanted]
    candidates = {layer: triple for layer, triple in named.items() if _word(layer) in _NORMAL_WORDS}
    if not candidates:
        candidates = {layer: triple for layer, triple in vectors.items() if looks_unit(triple)}
    if len(candidates) > 1:
        layers = _listing(sorted(candidates))
        raise ImageError(f"{path} has several layers of normals: {layers}; choose with layer or normal_layer")
    if not candidates:
        raise ImageError(
            f"{path} has no normals; its channels are {_listing(names)}; name their layer with normal_layer,"
            " or derive them from depth with normals='derive' (--derive-normals)"
        )
    return next(iter(candidates.values()))


def _choose_albedo(names: Sequence[str]) -> Triple | None:
    """Optional, so several candidates are none."""
    found = [t for layer, t in _triples(names, "RGB").items() if _word(layer) in _ALBEDO_WORDS]
    return found[0] if len(found) == 1 else None


def find_channels(
    path: Any,
    names: Sequence[str],
    attributes: Mapping[str, Any],
    looks_unit: Callable[[Triple], bool],
    *,
    layer: str | None = None,
    depth_channel: str | None = None,
    normal_layer: str | None = None,
    want_normals: bool = True,
) -> Found:
    """Find depth, normals and albedo by the names that gtao, Mitsuba, Blender and Nuke give them.

    Args:
        path: the file, for errors.
        names: all channel names.
        attributes: strings and numbers of the header; they tell who wrote the file.
        looks_unit: whether three channels look like unit vectors; asked if no layer is named after normals.
        layer: look only at channels whose name begins with this layer.
        depth_channel: the depth channel, instead of searching.
        normal_layer: the layer that holds the normals, instead of searching.
        want_normals: False ignores normals.

    Raises:
        ImageError: depth or wanted normals are missing, or there are several candidates, which are named.
    """
    if layer is not None:
        inside = [name for name in names if name.startswith(f"{layer}.")]
        if not inside:
            raise ImageError(f"{path} has no layer {layer!r}; it has {_listing(names)}")
    else:
        inside = list(names)
    depth = _choose_depth(path, names if depth_channel is not None else inside, depth_channel)
    normals = None
    if want_normals:
        normals = _choose_normals(path, names if normal_layer is not None else inside, normal_layer, looks_unit)
    own = "gtao" in attributes
    blender = "BlenderMultiChannel" in attributes or re.search(r"(^|\.)Depth\.[ZV]$", depth) is not None
    mitsuba = str(attributes.get("generatedBy", "")).startswith("Mitsuba") or _last(depth) == "T"
    return Found(
        depth=depth,
        ray_t=_last(depth) == "T",
        normals=normals,
        world=False if own else True if blender or mitsuba else None,
        flip=mitsuba and not own,
        albedo=_choose_albedo(inside),
    )
