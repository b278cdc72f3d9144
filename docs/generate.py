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
    under_light = f"""{NOTICE}

# Directional occlusion under light

Every number on this page comes from {source(paths["lighting"])}.

{lighting.section(records["lighting"])}"""
    glossy = f"""{NOTICE}

# Specular occlusion against traced reflections

Every number on this page comes from {source(paths["specular"])}.

{specular.section(records["specular"])}"""
    filtered = f"""{NOTICE}

# Spatial filters

Every number on this page comes from {source(paths["spatial"])}.

{spatial.section(records["spatial"])}"""
    over_time = f"""{NOTICE}

# Noise over space and time

Every number on this page comes from {source(paths["noise"])}.

{noise.section(records["noise"])}"""
    smaller = f"""{NOTICE}

# Smaller frames

Every number on this page comes from {source(paths["resolution"])}.

{resolution.section(records["resolution"])}"""
    still_image = f"""{NOTICE}

# From one direction per pixel to a still image

Every number on this page comes from {source(paths["temporal"])},
those of the recommended pipeline from
{source(paths["sequences"], " -o DIR")}.

{temporal.section(records["temporal"])}
## The recommended pipeline

{sequences.section(records["sequences"])}
"""
    return {
        "validation.md": validation,
        "noise.md": over_time,
        "directional-occlusion.md": under_light,
        "specular-occlusion.md": glossy,
        "temporal.md": still_image,
        "spatial-filters.md": filtered,
        "resolution.md": smaller,
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
