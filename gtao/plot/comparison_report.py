"""The report of a comparison: one HTML file with everything in it."""

import html
import math
from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure

from .comparing import budget_overviews, figure_name, scene_figure, shown_methods
from .comparison import Comparison, SceneComparison
from .comparison_tables import TABLE_STYLE, Row, scene_table, settings_table, summary_rows, summary_table
from .markup import html_table, image, json_block, paragraph, section, tiles
from .page import page
from .viewer import VIEWER_SCRIPT, VIEWER_STYLE, viewer
from .words import number

__all__ = ["compare_report"]

_CAPTIONS = {
    "budget": "What the error is made of. Coloured: the mean square of each step from the truth to the estimate. "
    "Hatched: what their cross terms take away or add, up to the total at the black line.",
    "budget_maps": "The same steps as maps, on one scale: blue darkens, red brightens.",
    "samples": "Error against depth samples per pixel.",
    "time": "Error against time, of the kernels alone: down and to the left is better.",
    "deviations": "The deviations of each renderer from the published estimator, switched on one after the other.",
    "strata": "Error by circumstance. Below each bin, its share of the pixels.",
}

#: Figures that stand two in a row.
_NARROW = ("budget", "budget_maps", "samples", "time")

#: Images of methods on a page, a quarter of a megabyte each at 512x512; and on a scene, however many there are.
_IMAGES, _FEWEST_IMAGES = 80, 4

_STYLE = """
.columns { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(34rem, 100%), 1fr)); gap: 0 1.5rem; }
pre.command { padding: .8rem 1rem; background: var(--card); border: 1px solid var(--line); border-radius: .6rem; }
"""

_ERRORS_NOTE = "Errors are those of the visibility of all pixels that show a surface, against rays of the same reach."
_NOISE_NOTE = (
    "The RMSE contains the noise of the truth itself, which is printed with each scene; “no noise” has it taken out."
)


def compare_report(comparison: Comparison, *, figures: Mapping[str, Figure] | None = None) -> str:
    """The report as one HTML page.

    Args:
        comparison: What was measured.
        figures: From :func:`comparison_figures`; what is missing is drawn.

    Returns:
        HTML with its images, styles and script inside; it needs no network, and reads well without the script. With
        many scenes it shows the images of the best methods only, so that a browser can hold it.
    """
    drawn = {} if figures is None else figures
    sections = [_headline(comparison), _overview(comparison, drawn)]
    n_images = max(_FEWEST_IMAGES, _IMAGES // len(comparison.scenes))
    sections += [_scene(scene, drawn, n_images, f"scene-{i}") for i, scene in enumerate(comparison.scenes)]
    sections.append(_repeat(comparison))
    return page(comparison.title, "\n".join(sections), style=VIEWER_STYLE + TABLE_STYLE + _STYLE, script=VIEWER_SCRIPT)


def _headline(comparison: Comparison) -> str:
    tables, cells = [], []
    for group in comparison.groups():
        rows = summary_rows(comparison, group)
        tables.append((f"<h3>{html.escape(group)}</h3>" if group else "") + summary_table(comparison, rows))
        cells.append(_tile(rows[0], group, len(comparison.scenes)))
    n_methods = len({m.name for scene in comparison.scenes for m in scene.methods})
    n_scenes = len(comparison.scenes)
    noisy = any(scene.noise for scene in comparison.scenes)
    note = f"{_ERRORS_NOTE} {_NOISE_NOTE}" if noisy else _ERRORS_NOTE
    lead = f"{n_methods} method{'s' * (n_methods != 1)} on {n_scenes} scene{'s' * (n_scenes != 1)}"
    links = " · ".join(f"<a href='#scene-{i}'>{html.escape(s.name)}</a>" for i, s in enumerate(comparison.scenes))
    return (
        f"<section><p class=lead>{lead}: {links}</p>{tiles(cells)}{''.join(map(paragraph, comparison.notes))}"
        f"{paragraph(note)}{''.join(tables)}</section>"
    )


def _tile(best: Row, group: str, n_scenes: int) -> tuple[str, str]:
    where = f", {html.escape(group)}" if group else ""
    wins = f", first on {best.lowest} of {n_scenes} scenes" if n_scenes > 1 else ""
    return f"{best.rmse:.4f}", f"lowest RMSE{where}:<br><strong>{html.escape(best.label)}</strong>{wins}"


def _overview(comparison: Comparison, drawn: Mapping[str, Figure]) -> str:
    """Budgets over all scenes, where there are several scenes."""
    known = {name: drawn[name] for name in drawn if name.startswith("budget_")}
    figures = [image(figure, "Error budget, all scenes") for figure in (known or budget_overviews(comparison)).values()]
    if not figures:
        return ""
    return section("Where the error comes from", paragraph(_CAPTIONS["budget"]), _columns(figures))


def _scene(scene: SceneComparison, drawn: Mapping[str, Figure], n_images: int, anchor: str) -> str:
    facts = ["occluders at any distance" if math.isinf(scene.radius) else f"occluders within {scene.radius:g}"]
    if scene.noise is not None:
        facts.append(f"noise of the truth {scene.noise:.4f}")
    if scene.limit_rmse is not None:
        facts.append(f"limit of one depth layer {scene.limit_rmse:.4f} (tick on the bars)")
    parts = [f"<p class=lead>{' · '.join(facts)}</p>", *map(paragraph, scene.notes), _viewer(scene, n_images)]
    parts.append(scene_table(scene))
    figures = {}
    for kind, caption in _CAPTIONS.items():
        figure = drawn.get(figure_name(scene.name, kind)) or scene_figure(scene, kind)
        if figure is not None:
            figures[kind] = image(figure, caption)
    narrow = [figures.pop(kind) for kind in _NARROW if kind in figures]
    return section(scene.name, *parts, _columns(narrow), *figures.values(), anchor=anchor)


def _viewer(scene: SceneComparison, n_images: int) -> str:
    methods = shown_methods(scene)
    if not methods:
        return ""
    # Ours first, then by error; what is kept stays sorted by error alone.
    kept = sorted(methods, key=lambda label: not methods[label].ours)[:n_images]
    shown = {label: m for label, m in methods.items() if label in kept}
    captions = {label: f"RMSE {m.metrics['rmse']:.4f}" + _bias(m.metrics.get("bias")) for label, m in shown.items()}
    pictures = {label: m.visibility for label, m in shown.items()}
    note = "" if len(shown) == len(methods) else f"The {len(shown)} best of {len(methods)} methods that have an image."
    return viewer(scene.truth, pictures, mask=scene.mask, captions=captions, ours=kept[0]) + paragraph(note)


def _columns(figures: Sequence[str]) -> str:
    """Two figures in a row, where the window is wide enough."""
    return f"<div class=columns>{''.join(figures)}</div>" if figures else ""


def _bias(value: float | None) -> str:
    return "" if value is None else f", bias {number(value, '+.4f')}"


def _repeat(comparison: Comparison) -> str:
    parts = []
    if comparison.command:
        parts.append(f"<div class=scroll><pre class=command>{html.escape(comparison.command)}</pre></div>")
    if comparison.versions:
        rows = [[html.escape(name), html.escape(version)] for name, version in comparison.versions.items()]
        parts.append(html_table(["", "version"], rows))
    settings = settings_table(comparison)
    if settings:
        words = f"Settings of the methods, on {html.escape(comparison.scenes[0].name)}"
        parts.append(f"<details><summary>{words}</summary>{settings}</details>")
    parts.append(json_block(comparison.record))
    return section("How to repeat it", *parts) if any(parts) else ""
