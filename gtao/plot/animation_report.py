"""The report of an animation: an HTML page beside its videos, which it plays."""

import html
import math
import re
from collections.abc import Mapping

from matplotlib.figure import Figure

from .animation import AnimatedMethod, AnimationComparison, animation_curves
from .markup import folded, html_table, image, paragraph, repeating, section
from .page import page
from .words import number

__all__ = ["animation_figures", "animation_report"]

_STYLE = """
video, img.video { display: block; width: 100%; height: auto; background: #181818; border: 1px solid var(--line);
  border-radius: .6rem; padding: 0; }
th, td { padding: .3rem .5rem; }
th { white-space: normal; vertical-align: bottom; }
td:first-child { white-space: normal; overflow-wrap: anywhere; min-width: 9rem; }
code { white-space: nowrap; font-size: .9em; }
"""

#: Columns of the table: heading and format.
_COLUMNS = {
    "rmse": ("RMSE", ".4f"),
    "last_rmse": ("RMSE, last quarter", ".4f"),
    "bias": ("bias", "+.4f"),
    "flicker": ("flicker at rest", ".4f"),
    "step": ("flicker, moving", ".4f"),
    "lag": ("lag of ghosts", "+.4f"),
    "convergence": ("frames to converge", ".0f"),
}
_NOTE = (
    "Errors are those of the visibility of all pixels that show a surface, against rays of the same reach, without the "
    "noise of the rays. Flicker is the temporal deviation of pixels at rest, and the change along the motion from one "
    "frame to the next, each without what the truth does. The lag is how far images hang back, on average, where the "
    "truth has changed lately: a ghost as dark as the change was great has a lag of as much. "
)


def animation_figures(comparison: AnimationComparison) -> dict[str, Figure]:
    """All figures by names that can be file names."""
    return {"curves": animation_curves(comparison)}


def animation_report(comparison: AnimationComparison, *, figures: Mapping[str, Figure] | None = None) -> str:
    """The report as one HTML page, which plays the videos that lie beside it.

    Args:
        comparison: What was measured.
        figures: From :func:`animation_figures`; drawn if left out.

    Returns:
        HTML with its figures and styles inside. Videos can be large: they stay files of their own, and the page has to
        lie in their folder.
    """
    drawn = animation_figures(comparison) if figures is None else figures
    radius = "at any distance" if math.isinf(comparison.radius) else f"within {comparison.radius:g}"
    lead = (
        f"{comparison.name}: {comparison.description} · {comparison.n_frames} frames, {comparison.fps:g} per second"
        f" · occluders {radius}"
    )
    parts = [f"<p class=lead>{html.escape(lead)}</p>", *map(_note, comparison.notes), _table(comparison)]
    sections = [f"<section>{''.join(parts)}{paragraph(_NOTE)}</section>"]
    sections.append(section("Frame by frame", image(drawn["curves"], "Against the index of the frame.")))
    scale = f"Ray-traced truth, result and |error|, whose scale ends at {comparison.error_limit:g}."
    sections.append(section("Videos", paragraph(scale), *map(_video, comparison.methods)))
    sections.append(repeating(comparison.command, comparison.versions, comparison.record))
    return page(f"{comparison.title}: {comparison.name}", "\n".join(sections), style=_STYLE)


def _note(text: str) -> str:
    """A paragraph in which names of options stay whole: browsers break lines behind hyphens."""
    marked = re.sub(r"--[a-z][a-z-]*", r"<code>\g<0></code>", html.escape(text))
    return f"<p>{marked}</p>"


def _table(comparison: AnimationComparison) -> str:
    known = [k for k in _COLUMNS if any(m.numbers.get(k) is not None for m in comparison.methods)]
    rows = [
        # Long names break between their options first.
        [html.escape(m.name).replace(",", ",<wbr>"), *(_cell(m.numbers.get(k), _COLUMNS[k][1]) for k in known)]
        for m in comparison.methods
    ]
    return html_table(["method", *(_COLUMNS[k][0] for k in known)], rows)


def _cell(value: float | None, spec: str) -> str:
    return "–" if value is None else number(value, spec)


def _video(method: AnimatedMethod) -> str:
    source, words = html.escape(method.video, quote=True), html.escape(f"Video of {method.name}", quote=True)
    if method.video.endswith(".gif"):
        shown = f'<img class=video alt="{words}" src="{source}">'
    else:
        shown = f'<video controls loop muted playsinline preload=metadata aria-label="{words}" src="{source}"></video>'
    return (
        f"<figure><h3>{html.escape(method.name)}</h3>{shown}<figcaption><a href='{source}'>{source}</a></figcaption>"
        f"</figure>{folded('Settings', method.settings)}"
    )
