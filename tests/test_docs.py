"""The documentation builds without a warning, its examples run, its links lead somewhere."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(path for path in DOCS.rglob("*.md") if "_build" not in path.parts)
TEXTS = [ROOT / "README.md", *PAGES]

_FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"(?<!!)\[[^\]]*\]\(([^)\s]+)\)|!\[[^\]]*\]\(([^)\s]+)\)")
_CITATION = re.compile(r"theory,\s+eqs?\.\s+\((\d+)\)", re.IGNORECASE)


def _examples(path):
    """(first line, code) of every Python block."""
    text = path.read_text(encoding="utf-8")
    return [
        (text.count("\n", 0, block.start(2)) + 1, block[2]) for block in _FENCE.finditer(text) if block[1] == "python"
    ]


def _name(path):
    return str(path.relative_to(ROOT))


@pytest.mark.slow
def test_builds_without_a_warning(tmp_path):
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", str(DOCS), str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "theory.html").is_file()


@pytest.mark.slow
@pytest.mark.parametrize("path", [path for path in TEXTS if _examples(path)], ids=_name)
def test_examples_run(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    namespace = {"__name__": "__example__"}
    for line, code in _examples(path):
        # Blank lines in front make a traceback show the line of the page.
        exec(compile("\n" * (line - 1) + code, str(path), "exec"), namespace)


@pytest.mark.parametrize("path", TEXTS, ids=_name)
def test_links_to_files_exist(path):
    text = _FENCE.sub("", path.read_text(encoding="utf-8"))
    targets = [first or second for first, second in _LINK.findall(text)]
    for target in targets:
        file = target.partition("#")[0]
        if file and "://" not in file:
            assert (path.parent / file).exists(), f"{_name(path)} links to {target}"


def test_equations_that_docstrings_cite_exist():
    labels = re.findall(r"^\$\$ \(([\w-]+)\)$", (DOCS / "theory.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert len(labels) == len(set(labels)) > 40
    for path in (ROOT / "gtao").rglob("*.py"):
        for number in _CITATION.findall(path.read_text(encoding="utf-8")):
            assert 1 <= int(number) <= len(labels), f"{_name(path)} cites equation {number} of {len(labels)}"


def test_command_reference_lists_every_command():
    """The directive reads the command line through Typer's own objects, whose shape it relies on."""
    sys.path.insert(0, str(DOCS / "_ext"))
    try:
        import commands
    finally:
        sys.path.remove(str(DOCS / "_ext"))
    text = "\n".join(section.astext() for section in commands.Commands.run(None))
    for word in ("gtao doctor", "gtao refit [SCENES …] [options]", "--bounces", "Default: 4.", "IN.exr", "--set"):
        assert word in text
