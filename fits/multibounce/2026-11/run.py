"""Refit the multi-bounce polynomial on the reference set: the fit that `gtao.REFIT_2026_11` comes from.

    python fits/multibounce/2026-11/run.py -o DIR

Records are not edited. Run into another directory to repeat the fit; everything but time stamps, versions and the
commit must come out as it lies here.
"""

import argparse
import json
from pathlib import Path

import gtao

HERE = Path(__file__).resolve().parent


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="directory for the results")
    options = parser.parse_args()
    if (options.output / "record.json").exists():
        parser.error(f"{options.output} holds a record, and records are not overwritten; choose another directory")
    settings = json.loads((HERE.parents[2] / "references" / "set.json").read_text())
    del settings["description"]
    settings["scenes"] = tuple(settings["scenes"])
    config = gtao.workflows.RefitConfig(**settings)
    print(gtao.workflows.refit(config, options.output).summary())


if __name__ == "__main__":
    main()
