"""Write ``validation.md`` and the tables in ``generated`` from the records in ``references`` and ``fits``: no number on
these pages is typed.

python docs/generate.py            # rewrites the pages
python docs/generate.py --check    # fails when a page is not what the records say
"""

import argparse
import sys
from pathlib import Path

from _validation import (
    aperture,
    comparison,
    estimator,
    lighting,
    methods,
    multibounce,
    noise,
    packing,
    performance,
    preset,
    resolution,
    sequences,
    shading,
    spatial,
    specular,
    tables,
    temporal,
)

import gtao

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
NOTICE = "<!-- Written by docs/generate.py from records; do not edit. -->"


def newest(kind):
    """The newest fit of a kind."""
    return sorted((ROOT / "fits" / kind).glob("*/record.json"))[-1]


def source(path, options=""):
    """Where numbers come from, and the command that replays it."""
    folder = path.parent.relative_to(ROOT).as_posix()
    return f"`{folder}/record.json` (`python {folder}/run.py{options}`)"


def _page(title, where, text):
    return f"{NOTICE}\n\n# {title}\n\nEvery number on this page comes from {where}.\n\n{text}"


def pages():
    """File name -> text."""
    paths = {
        name: ROOT / "references" / name / "record.json"
        for name in (
            "validation",
            "comparison",
            "lighting",
            "noise",
            "packing",
            "performance",
            "resolution",
            "shading",
            "spatial",
            "specular",
            "tables",
            "temporal",
        )
    }
    paths |= {kind: newest(kind) for kind in ("aperture", "occlusion", "multibounce")}
    paths["sequences"] = newest("temporal")
    paths["pipeline"] = paths["performance"].parent / "pipeline" / "record.json"
    records = {name: gtao.io.read_record(path) for name, path in paths.items()}
    validation = f"""{NOTICE}

# Validation

Every number on this page comes from a record that a command replays:

- the estimator against its oracles, the first five sections: {source(paths["validation"])};
- the comparison of methods: {source(paths["comparison"])};
- the recommended preset: {source(paths["occlusion"], " -o DIR")};
- the multi-bounce fit: {source(paths["multibounce"], " -o DIR")}.

{estimator.section(records["validation"])}
{comparison.section(records["comparison"])}
{preset.section(records["occlusion"])}
{multibounce.section(records["multibounce"])}"""
    recommended = sequences.section(records["sequences"])
    over_time = f"{temporal.section(records['temporal'])}\n## The recommended pipeline\n\n{recommended}\n"
    searched = f",\nthose of the recommended pipeline from\n{source(paths['sequences'], ' -o DIR')}"

    def page(title, name, module):
        return _page(title, source(paths[name]), module.section(records[name]))

    return {
        "validation.md": validation,
        "noise.md": page("Noise over space and time", "noise", noise),
        "directional-occlusion.md": page("Directional occlusion under light", "lighting", lighting),
        "specular-occlusion.md": page("Specular occlusion against traced reflections", "specular", specular),
        "temporal.md": _page(
            "From one direction per pixel to a still image", source(paths["temporal"]) + searched, over_time
        ),
        "spatial-filters.md": page("Spatial filters", "spatial", spatial),
        "resolution.md": page("Smaller frames", "resolution", resolution),
        "generated/aperture.md": f"{NOTICE}\n\n{aperture.section(records['aperture'])}",
        "generated/performance.md": f"{NOTICE}\n\n{performance.section(records['performance'], records['pipeline'])}",
        "generated/packing.md": f"{NOTICE}\n\n{packing.section(records['packing'])}",
        "generated/shading.md": f"{NOTICE}\n\n{shading.section(records['shading'])}",
        "generated/tables.md": f"{NOTICE}\n\n{tables.section(records['tables'])}",
        "generated/methods.md": f"{NOTICE}\n\n{methods.section(records['comparison'])}\n",
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="compare only")
    options = parser.parse_args()
    for name, text in pages().items():
        path = DOCS / name
        if not options.check:
            path.parent.mkdir(exist_ok=True)
            gtao.io.write_text(path, text)
        elif not path.exists() or path.read_text() != text:
            sys.exit(f"{name} is not what the records say; run python docs/generate.py")


if __name__ == "__main__":
    main()
