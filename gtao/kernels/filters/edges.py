"""The 3×3 filter of XeGTAO (Strugar and Mccalla 2021): links to the four neighbours, diagonals through them."""

import drjit as dr

from .grid import Tap

__all__ = ["depth_edges", "edge_taps"]

LEFT, RIGHT, TOP, BOTTOM = (-1, 0), (1, 0), (0, -1), (0, 1)
SIDES = (LEFT, RIGHT, TOP, BOTTOM)
# Slopes of links: fully open up to 0.25 thresholds, closed from 1.25 on.
CLOSED = 1.25
# Open, half-open and closed links in two bits: the largest of four codes is reached from 0.86 of an open link.
CODES, CODE_SCALE = 3, 2.9
# Where the background stands for the depth of a neighbour, in depths of the pixel: closed by any threshold.
FAR = 1e3


def _saturate(x):
    return dr.select(x > 0, dr.select(x < 1, x, 1), 0)


def depth_edges(view_z, threshold, quantised, grid):
    """How open the link of every pixel to its left, right, top and bottom neighbour is; theory, the edge-aware filter.

    Args:
        view_z: :class:`Image` of flat depth, inf on the background.
        threshold: step of depth, as a share of the pixel's depth, that counts as an edge.
        quantised: round to four levels, as stored in two bits.

    Returns:
        Four flat arrays in [0, 1], 1 = open; -1 where the neighbour is background. Beyond the frame lies the pixel
        itself.
    """
    centre = dr.select(dr.isfinite(view_z.own), view_z.own, 1)
    steps, background = [], []
    for side in SIDES:
        z = grid.gather(view_z, grid.clamped(*side))
        background.append(~dr.isfinite(z))
        steps.append(dr.select(background[-1], FAR * centre, z) - centre)
    left, right, top, bottom = steps
    slope_x, slope_y = 0.5 * (right - left), 0.5 * (bottom - top)
    # A step that the slope across the pixel explains is no edge.
    explained = (left + slope_x, right - slope_x, top + slope_y, bottom - slope_y)
    scale = 1 / (centre * threshold)
    links = []
    for step, rest, behind in zip(steps, explained, background, strict=True):
        a, b = abs(step), abs(rest)
        link = _saturate(CLOSED - dr.select(a < b, a, b) * scale)
        if quantised:
            link = dr.round(link * CODE_SCALE) * (1 / CODES)
        links.append(dr.select(behind, -1, link))
    return tuple(links)


def edge_taps(links, diagonal, leak_threshold, leak_strength, grid):
    """Taps of one pass: four neighbours by their links from both ends, four diagonals by the two ways that lead there.

    Args:
        links: an :class:`Image` of each of what :func:`depth_edges` returned.
        diagonal: weight of a diagonal per way.
        leak_threshold: number of closed links from which isolated pixels are let in some of their neighbours.
        leak_strength: what is added to every link when all four are closed; never to those to the background.
    """
    left, right, top, bottom = range(4)
    opposite = (right, left, bottom, top)
    index = [grid.clamped(*side) for side in SIDES]

    def seen_from(side, link):
        """A link of the neighbour on ``side``."""
        value = grid.gather(links[link], index[side])
        return dr.select(value > 0, value, 0)

    both = [dr.select(links[s].own > 0, links[s].own, 0) * seen_from(s, opposite[s]) for s in range(4)]
    closed = 4 - (both[0] + both[1] + both[2] + both[3])
    leak = _saturate(closed - leak_threshold) * (leak_strength / (4 - leak_threshold))
    both = [dr.select(links[s].own < 0, 0, _saturate(both[s] + leak)) for s in range(4)]
    taps = [Tap(index[s], *SIDES[s], both[s]) for s in range(4)]
    for a, b in ((left, top), (top, right), (bottom, left), (right, bottom)):
        dx, dy = SIDES[a][0] + SIDES[b][0], SIDES[a][1] + SIDES[b][1]
        weight = diagonal * dr.fma(both[a], seen_from(a, b), both[b] * seen_from(b, a))
        taps.append(Tap(grid.clamped(dx, dy), dx, dy, weight))
    return taps
