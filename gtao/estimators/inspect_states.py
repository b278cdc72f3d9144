"""What an accumulator's states say, in plain numbers of one pixel."""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from gtao.kernels.accumulators import Sectors

__all__ = ["HorizonStates", "SectorStates", "number", "pair", "states_of", "vector"]


def number(value: Any, lane: int) -> float:
    """A number of one pixel; what all pixels share has one element, or is no array at all."""
    if not dr.is_array_v(value):
        return float(value)
    return float(value[lane if dr.width(value) > 1 else 0])


def pair(values: Any, lane: int) -> tuple[float, float]:
    """Two of them."""
    first, second = values
    return number(first, lane), number(second, lane)


def vector(values: Any, lane: int) -> tuple[float, float, float]:
    """Three of them."""
    x, y, z = values
    return number(x, lane), number(y, lane), number(z, lane)


@dataclass(frozen=True)
class HorizonStates:
    """Of accumulators that keep horizons."""

    accumulator: Any

    def after(self, before: Any, after: Any, side: int, sample: Any, sl: Any) -> Any:
        """What a sample did, not evaluated yet: the arc that it blocks alone, the horizon before it and after it."""
        a = self.accumulator
        alone = a.add(a.begin(sl), side, sample, sl)
        return a.ends(alone, sl)[side], a.ends(before, sl)[side][0], a.ends(after, sl)[side][0]

    def sample(self, did: Any, lane: int) -> dict[str, Any]:
        """Fields of an :class:`gtao.estimators.inspect_types.InspectedSample`; ``wins`` if it raised the horizon."""
        (front, back), before, after = pair(did[0], lane), number(did[1], lane), number(did[2], lane)
        return {
            "blocks": ((front, back),) if front > back else (),
            "horizon": after,
            "closes": (),
            "wins": after > before,
        }

    def slice(self, state: Any, sl: Any, lane: int) -> dict[str, Any]:
        """Fields of an :class:`gtao.estimators.inspect_types.InspectedSlice`."""
        first, second = self.accumulator.ends(state, sl)
        return {"horizons": (pair(first, lane), pair(second, lane)), "open_sectors": None}

    def winners(self, raised: list[Any]) -> list[Any]:
        """Of the samples that raised the horizon of a side the highest one."""
        highest = max((s.blocks[0][0] for s in raised if s.blocks), default=None)
        return [s for s in raised if s.blocks and s.blocks[0][0] == highest][:1]


@dataclass(frozen=True)
class SectorStates:
    """Of accumulators that close sectors."""

    accumulator: Sectors

    def after(self, before: Any, after: Any, side: int, sample: Any, sl: Any) -> Any:
        """What a sample did, not evaluated yet: its arcs, and the masks of the slice before it and after it."""
        a = self.accumulator
        return a.arcs(before, side, sample, sl), a.closed(before, sl), a.closed(after, sl)

    def sample(self, did: Any, lane: int) -> dict[str, Any]:
        arcs, before, after = did
        closes = tuple(sorted(self._numbers(after, lane) - self._numbers(before, lane)))
        blocks = tuple(pair(arc, lane) for arc in arcs)
        return {
            "blocks": tuple((front, back) for front, back in blocks if front > back),
            "horizon": None,
            "closes": closes,
            "wins": bool(closes),
        }

    def slice(self, state: Any, sl: Any, lane: int) -> dict[str, Any]:
        closed = self._numbers(self.accumulator.closed(state, sl), lane)
        return {"horizons": None, "open_sectors": tuple(k not in closed for k in range(self.accumulator.n_sectors))}

    def winners(self, raised: list[Any]) -> list[Any]:
        """All that closed any sector."""
        return raised

    def _numbers(self, words: Any, lane: int) -> set[int]:
        """Numbers of the sectors whose bits are set."""
        bits = [int(number(word, lane)) for word in words]
        return {32 * k + bit for k, word in enumerate(bits) for bit in range(32) if word >> bit & 1}


def states_of(accumulator: Any) -> HorizonStates | SectorStates:
    """What reads the states of an accumulator."""
    return SectorStates(accumulator) if isinstance(accumulator, Sectors) else HorizonStates(accumulator)
