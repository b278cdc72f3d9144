"""Options of all sections, and how a section runs, prints and hands on what it measured."""

import argparse
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import drjit as dr

import gtao

from . import clock
from .table import show

__all__ = ["CHILD", "REFERENCE_VARIABLE", "ROOT", "Options", "add_arguments", "child", "run_section"]

#: First word of a section that is started to measure one case.
CHILD = "--child"

#: Where ``python -m tests.bench`` finds itself.
ROOT = Path(__file__).resolve().parents[3]

#: Names the directory with hand-written C++ of the same estimator; see :mod:`.reference`.
REFERENCE_VARIABLE = "GTAO_BENCH_REFERENCE"


@dataclass(frozen=True)
class Options:
    """What a section may do.

    Attributes:
        quick: small frames and few rounds.
        reference: directory of hand-written C++, if any.
        clock: "cpu" or "kernels".
        rounds, budget_s: of every comparison; a budget in seconds.
        bandwidth: of the memory in bytes per second; measured if None.
    """

    quick: bool
    reference: Path | None
    clock: str
    rounds: int
    budget_s: float
    bandwidth: float | None

    @property
    def on_host(self):
        """Whether implementations for the CPU can be compared with."""
        return self.clock == "cpu"

    @classmethod
    def of(cls, parsed):
        reference = parsed.reference or os.environ.get(REFERENCE_VARIABLE)
        fallback = "kernels" if gtao.backend.report().cuda else "cpu"
        return cls(
            quick=parsed.quick,
            reference=Path(reference) if reference else None,
            clock=parsed.clock or fallback,
            rounds=5 if parsed.quick else 15,
            budget_s=3.0 if parsed.quick else 12.0,
            bandwidth=None if parsed.bandwidth is None else 1e9 * parsed.bandwidth,
        )


def add_arguments(parser):
    """The options that :meth:`Options.of` reads."""
    parser.add_argument("--quick", action="store_true", help="small frames, few rounds: about two minutes for all")
    parser.add_argument(
        "--reference",
        metavar="DIR",
        help=f"hand-written C++ of the same estimator to compare with (default: ${REFERENCE_VARIABLE})",
    )
    parser.add_argument(
        "--clock",
        choices=[name for name in clock.CLOCKS if name != "wall"],
        help="CPU time or the time of kernels (default: kernels where there is a CUDA device)",
    )
    parser.add_argument("--bandwidth", type=float, metavar="GB/s", help="of the memory (default: measured)")


def run_section(measure, tables, doc):
    """Measure, print, and write JSON where asked.

    Args:
        measure: Options -> plain values.
        tables: what ``measure`` returned -> triples of title, head and rows.
        doc: the section's docstring.
    """
    parser = argparse.ArgumentParser(description=doc.partition("\n")[0])
    add_arguments(parser)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the numbers there")
    parsed = parser.parse_args()
    dr.set_thread_count(1)
    numbers = measure(Options.of(parsed))
    for title, head, rows in tables(numbers):
        show(title, head, rows)
    if parsed.json:
        parsed.json.write_text(json.dumps(numbers), encoding="utf-8")


def child(section, *words, environment=None):
    """The values that a section prints when it is started as a process of its own with ``--child`` and these words.

    Raises:
        subprocess.CalledProcessError: it failed.
    """
    command = [sys.executable, "-m", f"tests.bench.{section}", CHILD, *words]
    more = os.environ | (environment or {})
    done = subprocess.run(command, cwd=ROOT, env=more, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])
