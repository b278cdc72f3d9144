"""The documentation builds without a warning, its examples run, its links lead somewhere."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(path for path in DOCS.rglob("*.md") if "_build" not in path.parts)
TEXTS = [ROOT / "README.md", *PAGES]

_FENCE = re.compile(r"^```([^\n`]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
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
    for framework in ("torch", "jax"):
        imported = any(f"import {framework}\n" in code for _, code in _examples(path))
        if imported and importlib.util.find_spec(framework) is None:
            pytest.skip(f"{framework} is not installed: pip install 'gtao[{framework}]'")
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


def _harmonics(tilt, n):
    """a_k of the theory page, k = 1…n: what an open surface's slices hold beside their mean."""
    k, t = np.arange(1, n + 1), np.tan(tilt / 2)
    return k, (-1.0) ** (k - 1) * np.sin(tilt) * t ** (2 * k - 1) * (1 / (2 * k - 1) - t**2 / (2 * k + 1))


@pytest.mark.parametrize("tilt", [0.2, 1.0, 1.4])
@pytest.mark.parametrize("n_slices", [1, 2, 3, 8])
def test_error_of_few_slices_is_what_the_theory_says(tilt, n_slices):
    phi = 0.37 + np.arange(n_slices) * np.pi / n_slices
    value = np.cos(tilt) + np.sin(tilt) * np.cos(phi) * np.arctan(np.tan(tilt) * np.cos(phi))
    k, a = _harmonics(tilt, 400)
    kept = k % n_slices == 0
    predicted = np.sum(a[kept] * np.cos(2 * k[kept] * phi[0]))
    # The series is cut where its terms, below tan(0.7)^800, have vanished in float64.
    assert np.mean(value) - 1 == pytest.approx(predicted, abs=1e-12)


@pytest.mark.parametrize(("off_axis", "tilt", "azimuth"), [(0.5, 1.0, 0.3), (0.85, 1.4, 1.2), (1.1, 0.6, 0.0)])
def test_bias_of_slices_even_in_the_image_is_what_the_theory_says(off_axis, tilt, azimuth):
    V = np.array([np.sin(off_axis), 0, np.cos(off_axis)])
    radial, across = np.array([np.cos(off_axis), 0, -np.sin(off_axis)]), np.array([0, 1, 0])
    N = np.cos(tilt) * V + np.sin(tilt) * (np.cos(azimuth) * radial + np.sin(azimuth) * across)
    # The trapezoidal rule converges geometrically on a smooth periodic function: 2000 slices are exact.
    phi = np.arange(2000) * np.pi / 2000
    D = np.stack([np.cos(phi), np.sin(phi), np.zeros_like(phi)], axis=1)
    T = D - (D @ V)[:, None] * V
    T /= np.linalg.norm(T, axis=1, keepdims=True)
    n_T = T @ N
    mean = np.mean(N @ V + np.arctan2(n_T, N @ V) * n_T)
    k, a = _harmonics(tilt, 400)
    q = np.tan(off_axis / 2) ** 2
    predicted = np.sum((-q) ** k * a * np.cos(2 * k * azimuth))
    assert mean - 1 == pytest.approx(predicted, abs=1e-12)
