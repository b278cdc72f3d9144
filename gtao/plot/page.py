"""The page around a report: layout and colours, light and dark."""

import html
from string import Template

__all__ = ["page"]

_STYLE = """
:root { --ink: #1d2329; --muted: #66707c; --paper: #fbfbfa; --card: #ffffff; --line: #e2e5e9; --blue: #0072b2;
  --red: #c1500a; --green: #00795a; --tint: #eaf3f9; --warm: #fbefe6; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e9ed; --muted: #9aa5b1; --paper: #15181c; --card: #1d2126;
  --line: #333a42; --blue: #5cb3e6; --red: #f0904e; --green: #4cc9a0; --tint: #1b2f3d; --warm: #3a2a1e; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); line-height: 1.55;
  font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", sans-serif; }
main { max-width: 60rem; margin: 0 auto; padding: 2.5rem 1.25rem 4rem; }
h1 { font-size: 2rem; line-height: 1.2; margin: 0 0 .25rem; letter-spacing: -.01em; }
h2 { font-size: 1.25rem; margin: 2.75rem 0 .75rem; padding-bottom: .3rem; border-bottom: 1px solid var(--line); }
h3 { font-size: 1rem; margin: 1.5rem 0 .5rem; }
p { margin: .6rem 0; max-width: 46rem; }
a { color: var(--blue); }
.lead { color: var(--muted); margin: 0 0 1.25rem; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(11rem, 1fr)); gap: .75rem; margin: 1rem 0; }
.tile { background: var(--card); border: 1px solid var(--line); border-radius: .6rem; padding: .8rem 1rem; }
.tile b { display: block; font-size: 1.5rem; font-variant-numeric: tabular-nums; }
.tile span { color: var(--muted); font-size: .85rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; margin: .5rem 0 1rem; }
th { text-align: right; color: var(--muted); font-weight: 600; white-space: nowrap; }
td { text-align: right; white-space: nowrap; }
th, td { padding: .3rem .8rem; border-bottom: 1px solid var(--line); }
th:first-child, td:first-child { text-align: left; padding-left: .4rem; }
tr.ours td { background: var(--tint); }
tr.published td { background: var(--warm); }
.good { color: var(--green); font-weight: 600; }
.bad { color: var(--red); font-weight: 600; }
figure { margin: 1.25rem 0; }
img { display: block; max-width: 100%; height: auto; background: #fff; border: 1px solid var(--line);
  border-radius: .6rem; padding: .6rem; }
figcaption { color: var(--muted); font-size: .85rem; margin-top: .4rem; }
details { margin: .75rem 0; border: 1px solid var(--line); border-radius: .6rem; background: var(--card); }
summary { cursor: pointer; padding: .6rem 1rem; font-weight: 600; }
pre { margin: 0; padding: 0 1rem 1rem; overflow-x: auto; font-size: .8rem; line-height: 1.45; }
@media print { details { display: none; } h2 { break-after: avoid; } figure { break-inside: avoid; } }
"""

_PAGE = Template(
    "<!doctype html>\n<html lang=en><head><meta charset=utf-8>"
    '<meta name=viewport content="width=device-width, initial-scale=1">'
    '<meta name=color-scheme content="light dark">'
    f"<title>$title</title><style>{_STYLE}$style</style></head>\n"
    "<body><main><h1>$title</h1>\n$body\n</main>$script</body></html>\n"
)


def page(title: str, body: str, *, style: str = "", script: str = "") -> str:
    """A whole page.

    Args:
        title: Heading, as text.
        body: What comes below it, as HTML.
        style: Further rules.
        script: JavaScript to run at the end.

    Returns:
        HTML.
    """
    return _PAGE.substitute(
        title=html.escape(title), body=body, style=style, script=f"<script>{script}</script>" if script else ""
    )
