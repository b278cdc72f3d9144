"""Options whose derivative is zero everywhere: nobody may take it for an optimum."""

import math
from typing import Any

from gtao.config import DepthCut, LinearFalloff, QuadraticFalloff, SampleCut, plain
from gtao.errors import ConfigError
from gtao.kernels.march_types import Switches

from .attached import attached_numbers

__all__ = ["refuse_what_has_no_derivative"]


def refuse_what_has_no_derivative(method: Any, switches: Switches) -> None:
    """Look for options that carry gradients but change the result in jumps only, or not at all.

    Args:
        method: a configuration derived from :class:`gtao.config.SliceMethod`.
        switches: what they became.

    Raises:
        ConfigError: there are some.
    """
    attached = set(attached_numbers(method))
    if attached and (refused := sorted(_refused(method, switches, attached))):
        raise ConfigError(
            f"{' and '.join(refused)} of this method {'has' if len(refused) == 1 else 'have'} no derivative: the result"
            " changes in jumps or not at all; detach what is listed, or choose an interpolating fetch if it moves"
            " samples"
        )


def _refused(method: Any, switches: Switches, attached: set[str]) -> set[str]:
    refused = attached & (_in_jumps(method, switches) | _without_effect(method))
    # One number for both: its derivative is that of the falloff, to which the search has nothing to add.
    shared = {"radius", "falloff.end"} <= attached and _one(method.radius, method.falloff.end)
    return refused - {"radius"} if shared and "falloff.end" not in refused else refused


def _one(a: Any, b: Any) -> bool:
    """Whether two numbers that carry gradients are the same variable."""
    return type(a) is type(b) and a.index_ad == b.index_ad


def _in_jumps(method: Any, switches: Switches) -> set[str]:
    """Options that only decide whether a sample counts, or which texel it is."""
    falloff, names = getattr(method, "falloff", None), {"pyramid.level_offset"}
    fades = getattr(method, "small_radius_fade", False)
    if isinstance(getattr(method, "thickness", None), DepthCut):
        names.add("thickness.depth")
    if switches.fixes_samples:
        names |= {"step_exponent", "min_step_px", "max_radius_px", "max_radius_share"}
        if (falloff is not None and not fades) or getattr(method, "attenuation", "") == "none":
            # The exact cut, HBAO's attenuation and the fade know the radius; otherwise it only says how far to search.
            names |= {"radius", "radius_multiplier"}
    if isinstance(falloff, SampleCut) and (switches.fixes_samples or plain(falloff.end) > plain(method.search_radius)):
        names.add("falloff.end")
    return names


def _without_effect(method: Any) -> set[str]:
    """Options that nothing looks at, or only to see whether a sample counts."""
    falloff, names = getattr(method, "falloff", None), set()
    infinite = math.isinf(plain(method.search_radius))
    shadowed = plain(getattr(falloff, "end", math.inf)) < plain(method.search_radius)
    if infinite or (shadowed and not getattr(method, "small_radius_fade", False)):
        names |= {"radius", "radius_multiplier"}
    if not isinstance(falloff, LinearFalloff | QuadraticFalloff):
        names.add("thin_occluder_compensation")
    if method.step_law == "beyond":
        names.add("min_step_px")
    return names
