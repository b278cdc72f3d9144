"""Run the benchmarks: ``python -m tests.bench [SECTION …]``, all sections by default.

Each section is a process of its own and prints ratios from interleaved runs on one thread. Their numbers become one
record with what was measured on which machine, and figures, in the output directory. Nothing is asserted, because
seconds depend on the machine. Studies, which measure other things than the estimator, run by name only.
"""

import argparse
import importlib.metadata
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import gtao

from .harness import figures, goals, reference, work
from .harness.options import REFERENCE_VARIABLE, ROOT, add_arguments
from .harness.table import show

HERE = Path(__file__).parent
SECTIONS = (
    "forward",
    "gradient",
    "methods",
    "directions",
    "pyramid",
    "pipeline",
    "growth",
    "threads",
    "overhead",
    "startup",
    "memory",
    "device",
)
STUDIES = ("hbao_vs_ray_march", "refit_cost", "transport_vs_path")
FORWARDED = ("reference", "clock", "bandwidth")


def arguments():
    parser = argparse.ArgumentParser(prog="python -m tests.bench", description=__doc__.partition("\n")[0])
    names = f"sections: {', '.join(SECTIONS)}; studies: {', '.join(STUDIES)}"
    parser.add_argument("names", nargs="*", metavar="NAME", help=names)
    add_arguments(parser)
    parser.add_argument("-o", "--output", type=Path, default=Path("out/bench"), help="directory of record and figures")
    options = parser.parse_args()
    unknown = sorted(set(options.names) - set(SECTIONS) - set(STUDIES))
    if unknown:
        parser.error(f"no benchmark {', '.join(unknown)}; {names}")
    return options


def run(name, words):
    """The numbers of a section, measured by a process of its own; None if it failed, which it has then said."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "numbers.json")
        command = [sys.executable, "-m", f"tests.bench.{name}", *words, "--json", str(path)]
        if subprocess.run(command, cwd=ROOT).returncode:
            return None
        return json.loads(path.read_text(encoding="utf-8"))


def versions():
    """Of the frameworks that are compared with."""
    found = {}
    for name in ("numba", "torch"):
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found[name] = None
    return found


def record(numbers, options):
    """The record of all numbers, and the files of the directory beside it."""
    directory = options.reference or os.environ.get(REFERENCE_VARIABLE)
    sources = [Path(directory, name) for name in reference.SOURCES] if directory else []
    config = {"quick": options.quick, "sections": list(numbers), "clock": options.clock, "threads": 1}
    origin = gtao.io.provenance(["python", "-m", "tests.bench", *sys.argv[1:]], seed=work.SEED, config=config)
    origin["versions"] |= versions()
    origin["device"]["load"] = os.getloadavg()[0]
    outputs = [gtao.io.file_entry(path, options.output) for path in sorted(options.output.glob("*.png"))]
    inputs = [gtao.io.file_entry(path) for path in sources if path.is_file()]
    return origin | {"kind": "performance", "inputs": inputs, "outputs": outputs, "numbers": numbers}


def main():
    options = arguments()
    words = ["--quick"] if options.quick else []
    for name in FORWARDED:
        if getattr(options, name) is not None:
            words.append(f"--{name}={getattr(options, name)}")
    numbers, failed = {}, []
    for name in options.names or SECTIONS:
        print(f"\n== {name}", flush=True)
        if name in STUDIES:
            subprocess.run([sys.executable, HERE / f"{name}.py"], check=True)
        elif (measured := run(name, words)) is None:
            failed.append(name)
        else:
            numbers[name] = measured
    if numbers:
        numbers["goals"] = goals.check(numbers)
        show("goals", goals.HEAD, goals.rows(numbers["goals"]))
        options.output.mkdir(parents=True, exist_ok=True)
        if "growth" in numbers:
            figures.save(figures.growth(numbers["growth"]), options.output / "growth.png")
        path = options.output / "record.json"
        gtao.io.write_record(path, record(numbers, options), overwrite=True)
        print(f"\n{path}")
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
