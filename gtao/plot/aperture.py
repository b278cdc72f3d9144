"""Figures and report of a fit of the reflection cone's aperture. They compute nothing."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from .markup import html_table, image, json_block, paragraph, section, tiles
from .page import page
from .style import INK, MUTED, PUBLISHED, REFIT, new_figure, styled

__all__ = ["aperture_by_roughness", "aperture_curves", "aperture_figures", "aperture_report"]

_CAPTIONS = {
    "curves": "Mean over the scenes in blue, every scene in grey; shaded: the interval of the minimum.",
    "by_roughness": "The best u of each roughness alone, and what it would gain over the published one.",
}


def aperture_figures(result: Any) -> dict[str, Figure]:
    """All figures of a fit by name.

    Args:
        result: A :class:`gtao.fit.ApertureFit`.
    """
    return {"curves": aperture_curves(result), "by_roughness": aperture_by_roughness(result)}


@styled
def aperture_curves(result: Any) -> Figure:
    """Dissimilarity against u, of every scene and in the mean.

    Args:
        result: A :class:`gtao.fit.ApertureFit`.
    """
    figure, grid = new_figure(1, 1, cell=(6.6, 3.6))
    axis = grid[0, 0]
    scenes = dict.fromkeys(scene for scene, _, _ in result.samples)
    rows = [
        np.mean([c for c, (s, _, _) in zip(result.curves, result.samples, strict=True) if s == scene], axis=0)
        for scene in scenes
    ]
    for row in rows:
        axis.plot(result.grid, row, color=MUTED, linewidth=0.7, alpha=0.6)
    axis.plot(result.grid, np.mean(rows, axis=0), color=REFIT, linewidth=2)
    if result.interval is not None:
        axis.axvspan(*result.interval, color=REFIT, alpha=0.15, linewidth=0)
    axis.axvline(result.best.u, color=REFIT, linewidth=1, label=f"fitted, {result.best.u:.3g}")
    axis.axvline(0.01, color=PUBLISHED, linewidth=1, linestyle="--", label="published, 0.01")
    axis.set(xscale="log", xlabel="u", ylabel=f"mean {result.metric.upper()}")
    axis.legend(loc="upper left")
    figure.suptitle("Dissimilarity of specular occlusion by two cones", fontweight="bold")
    return figure


@styled
def aperture_by_roughness(result: Any) -> Figure:
    """The best u of each roughness, and its dissimilarity beside that of the published u.

    Args:
        result: A :class:`gtao.fit.ApertureFit`.
    """
    figure, grid = new_figure(1, 2, cell=(3.6, 3.2))
    roughness = sorted(result.by_roughness)
    found = [result.by_roughness[r] for r in roughness]
    left, right = grid[0]
    left.plot(roughness, [o.u for o in found], "o-", color=REFIT, markersize=4)
    for r, o in zip(roughness, found, strict=True):
        if o.at_bound:
            left.plot(r, o.u, "o", color="white", markeredgecolor=REFIT, markersize=6)
    left.axhline(0.01, color=PUBLISHED, linewidth=1, linestyle="--")
    left.set(yscale="log", xlabel="roughness", ylabel="best u (open: at the end of the search)")
    right.plot(roughness, [o.published for o in found], "s--", color=PUBLISHED, markersize=4, label="u = 0.01")
    right.plot(roughness, [o.score for o in found], "o-", color=REFIT, markersize=4, label="best u")
    right.set(xlabel="roughness", ylabel=f"mean {result.metric.upper()}")
    right.legend()
    figure.suptitle("Roughness by roughness", fontweight="bold", color=INK)
    return figure


def aperture_report(
    result: Any, *, record: Mapping[str, Any] | None = None, figures: Mapping[str, Figure] | None = None
) -> str:
    """The report as one HTML page.

    Args:
        result: A :class:`gtao.fit.ApertureFit`.
        record: Provenance, shown folded.
        figures: From :func:`aperture_figures`, drawn if left out.

    Returns:
        HTML with its images and styles inside.
    """
    drawn = aperture_figures(result) if figures is None else figures
    name = result.metric.upper()
    cells = [
        (f"{result.best.u:.4g}", "fitted u" if not result.best.at_bound else "fitted u, at the end of the search"),
        (f"{result.exponent:.5g}", "k of cos α<sub>s</sub> = 2<sup>−kα²</sup>; published 3.32193"),
        (f"{result.best.score:.5f}", f"mean {name}"),
        (f"{result.best.published:.5f}", f"mean {name}, published u"),
    ]
    if result.interval is not None:
        low, high = result.interval
        cells.insert(1, (f"{low:.3g} … {high:.3g}", f"{result.level:.0%} interval, over scenes"))
    note = (
        "α is the square of the roughness. Intervals come from scenes drawn anew; a scene left out is scored with the "
        "u of the others."
    )
    sections = [
        f"<section>{tiles(cells)}{paragraph(note)}</section>",
        section("All samples", image(drawn["curves"], _CAPTIONS["curves"]), _rivals(result)),
        section("Roughness", image(drawn["by_roughness"], _CAPTIONS["by_roughness"]), _by_roughness(result)),
        section("Scenes left out", _left_out(result)),
        section("Provenance", json_block(record)),
    ]
    return page("Aperture of the reflection cone", "\n".join(sections))


def _rivals(result: Any) -> str:
    rows = [["fitted u", f"{result.best.score:.5f}"], ["published u", f"{result.best.published:.5f}"]]
    rows += [[name, f"{score:.5f}"] for name, score in result.rivals.items()]
    marks = ["ours", "published", *[""] * len(result.rivals)]
    return html_table(["aperture", f"mean {result.metric.upper()}"], rows, marks)


def _row(label: str, o: Any) -> list[str]:
    return [label, f"{o.u:.4g}" + (" (end)" if o.at_bound else ""), f"{o.score:.5f}", f"{o.published:.5f}"]


def _by_roughness(result: Any) -> str:
    rows = [_row(f"{r:g}", o) for r, o in sorted(result.by_roughness.items())]
    return html_table(["roughness", "best u", "its score", "published u"], rows)


def _left_out(result: Any) -> str:
    if not result.left_out:
        return paragraph("There is a single scene.")
    rows = [_row(scene, o) for scene, o in result.left_out.items()]
    return html_table(["scene", "u of the others", "its score here", "published u"], rows)
