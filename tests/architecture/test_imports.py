"""What importing gtao loads, and what it must not."""

import subprocess
import sys

HEAVY = ("mitsuba", "numpy", "scipy", "matplotlib", "OpenEXR", "typer", "rich")


def loaded_after(code):
    script = f"{code}\nimport sys\nprint(*[m for m in {HEAVY} if m in sys.modules])"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(run.stdout.split())


def test_the_core_is_light():
    assert loaded_after("import gtao") == set()


def test_io_and_fit_load_no_renderer():
    assert "mitsuba" not in loaded_after("import gtao.io, gtao.fit, gtao.evaluate")


def test_plot_loads_no_renderer():
    assert "mitsuba" not in loaded_after("import gtao.plot")


def test_the_command_line_answers_help_without_the_renderer():
    assert "mitsuba" not in loaded_after("import gtao.cli")
