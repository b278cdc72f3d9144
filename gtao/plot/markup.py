"""Pieces of the HTML reports: sections, tables, figures with everything inside."""

import base64
import html
import json
from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

from .style import png_bytes

__all__ = ["data_uri", "folded", "html_table", "image", "json_block", "paragraph", "repeating", "section", "tiles"]

#: Pixels of the page per inch of a figure: the widest just fill the column.
_PIXELS_PER_INCH = 92


def section(title: str, *parts: str, anchor: str = "") -> str:
    """A section with its heading; parts are HTML, the title is text."""
    attribute = f" id='{html.escape(anchor)}'" if anchor else ""
    return f"<section{attribute}><h2>{html.escape(title)}</h2>{''.join(parts)}</section>"


def paragraph(text: str) -> str:
    """Text as a paragraph; nothing for no text."""
    return f"<p>{html.escape(text)}</p>" if text else ""


def tiles(cells: Sequence[tuple[str, str]]) -> str:
    """Large numbers with a name below each: (number, name), both HTML."""
    inside = "".join(f"<div class=tile><b>{value}</b><span>{name}</span></div>" for value, name in cells)
    return f"<div class=tiles>{inside}</div>"


def html_table(head: Sequence[str], rows: Sequence[Sequence[str]], marks: Sequence[str] | None = None) -> str:
    """A table whose cells are HTML; ``marks`` are the classes of the rows."""
    marks = marks or [""] * len(rows)
    body = "".join(
        f"<tr class='{mark}'>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>"
        for row, mark in zip(rows, marks, strict=True)
    )
    return f"<div class=scroll><table><tr>{''.join(f'<th>{h}</th>' for h in head)}</tr>{body}</table></div>"


def data_uri(png: bytes) -> str:
    """A PNG file as the source of an image."""
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"


def image(figure: Figure, caption: str) -> str:
    """A figure with its caption, which is text."""
    text = html.escape(caption)
    width = round(_PIXELS_PER_INCH * figure.get_figwidth())
    source = data_uri(png_bytes(figure, dpi=130))
    return f'<figure><img alt="{text}" width={width} src="{source}"><figcaption>{text}</figcaption></figure>'


def folded(summary: str, text: str | None) -> str:
    """Preformatted text behind its heading; nothing for no text."""
    if not text:
        return ""
    return f"<details><summary>{html.escape(summary)}</summary><pre>{html.escape(text)}</pre></details>"


def json_block(record: Mapping[str, Any] | None) -> str:
    """A record, folded."""
    return folded("Record", json.dumps(record, indent=2, default=str)) if record else ""


def repeating(command: str, versions: Mapping[str, str], record: Mapping[str, Any] | None) -> str:
    """The section on how to repeat a run; nothing where nothing is known of it."""
    parts = [f"<div class=scroll><pre>{html.escape(command)}</pre></div>"] if command else []
    if versions:
        rows = [[html.escape(name), html.escape(version)] for name, version in versions.items()]
        parts.append(html_table(["", "version"], rows))
    parts.append(json_block(record))
    return section("How to repeat it", *parts) if any(parts) else ""
