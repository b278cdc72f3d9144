"""Every golden value is used: by its prefix and by the name of each of its outputs, in the text of the tests."""

import re
from pathlib import Path

import pytest
from oracles import golden

TESTS = Path(__file__).parents[1]
_LOADED = re.compile(r"golden\.cases\(\s*\"([\w.]+)\"")

TEXTS = {path: path.read_text(encoding="utf-8") for path in sorted(TESTS.rglob("test_*.py"))}
#: What begins so belongs to a kernel, which must meet it in both precisions.
KERNELS = (
    "A",
    "B",
    "C.alpha_match",
    "C.clipped_cone",
    "C.sh_basis",
    "C.zh",
    "D",
    "E.aperture",
    "E.caps",
    "E.cone_lobe",
    "E.full_brdf",
    "F",
)


def loaders(prefix):
    return {path: text for path, text in TEXTS.items() if prefix in _LOADED.findall(text)}


def test_every_prefix_in_the_tests_exists():
    used = {prefix for text in TEXTS.values() for prefix in _LOADED.findall(text)}
    assert used <= set(golden.prefixes())


@pytest.mark.parametrize("prefix", sorted(golden.prefixes()))
def test_every_output_is_compared(prefix):
    texts = loaders(prefix)
    if prefix.startswith(KERNELS):
        texts = {path: text for path, text in texts.items() if path.parent.name == "kernels" and "precision" in text}
    missing = {name for name in golden.prefixes()[prefix] if not any(f'"{name}"' in text for text in texts.values())}
    assert not missing, f"{prefix}: no test reads {sorted(missing)}"
