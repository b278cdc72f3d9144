"""Sphinx configuration: ``make docs`` builds without network and fails on any warning."""

import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

from gtao._version import __version__

project = "gtao"
author = "The gtao authors"
project_copyright = author
version = release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "commands",
]

exclude_patterns = ["_build", "_ext", "_validation", "generated"]
source_suffix = {".md": "markdown"}

myst_enable_extensions = ["amsmath", "attrs_inline", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
myst_dmath_double_inline = True

# Optional frameworks: the pages read the same with and without them.
autodoc_mock_imports = ["jax", "torch"]
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True

html_theme = "furo"
html_title = f"gtao {release}"
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}

_BAR = re.compile(r"(?<![`\\])\|")
_LITERAL = re.compile(r"(``.*?``|:\w+:`.*?`)")


def _escape_bars(app, what, name, obj, options, lines):
    """|n_p| is a length in this project, never one of reStructuredText's substitutions."""
    for i, line in enumerate(lines):
        parts = _LITERAL.split(line)
        parts[::2] = (_BAR.sub(r"\\|", part) for part in parts[::2])
        lines[i] = "".join(parts)


def setup(app):
    app.connect("autodoc-process-docstring", _escape_bars)
