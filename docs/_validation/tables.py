"""Errors of tables of specular occlusion, from ``references/tables``."""

import math

from .markdown import folded, table

#: Kind -> channel that counts, and what its coordinates leave out.
CHANNELS = {
    "cone-cone": "S",
    "cone-lobe": "S",
    "brdf-3d": "S",
    "brdf-4d": "S",
    "brdf-5d": "S",
    "environment-brdf": "A",
}
ENCODINGS = {"float": "float", "unorm8": "8 bits", "bc4": "BC4"}


def number(x):
    """Two significant digits without an exponent."""
    if x == 0:
        return "0"
    return f"{x:.{max(0, 1 - math.floor(math.log10(x)))}f}"


def size_of(entry):
    sides = entry["size"]
    return f"{sides[0]}{'²³⁴⁵'[len(sides) - 2]}" if len(set(sides)) == 1 else "×".join(map(str, sides))


def numbers_of(entry):
    n = math.prod(entry["size"])
    channels = 1 if entry["kind"].startswith("cone") else 2
    return f"{n * channels / 1000:.0f}k"


def overview(entries):
    body = []
    for entry in entries:
        channel = CHANNELS[entry["kind"]]
        found = {name: entry["encodings"][name][channel] for name in ENCODINGS}
        whole = found["float"]
        body.append(
            [
                f"`{entry['kind']}`",
                entry["axes"],
                size_of(entry),
                numbers_of(entry),
                *(number(whole[key]) for key in ("rms", "p99", "max")),
                *(number(found[name]["rms"]) for name in ("unorm8", "bc4")),
                *(number(entry[name][channel]["rms"]) for name in ("sampled", "smooth")),
                f"{entry['cpu_seconds']:.1f}",
            ]
        )
    head = [
        "table",
        "axes",
        "texels",
        "numbers",
        "RMS",
        "99 %",
        "largest",
        "8 bits",
        "BC4",
        "samples",
        "smooth",
        "CPU s",
    ]
    return table(head, body)


def degrees(name, value):
    if name in ("alpha_v", "beta", "theta_o", "chi"):
        return f"{name} {math.degrees(value):.1f}°"
    return f"{name} {value:.3g}"


def worst(entries):
    """Where every table is worst."""
    body = []
    for entry in entries:
        where = entry["encodings"]["float"][CHANNELS[entry["kind"]]]["where"]
        place = ", ".join(degrees(*item) for item in where.items() if item[0] not in ("table", "truth"))
        row = [f"`{entry['kind']}`", entry["axes"], size_of(entry), place]
        body.append([*row, f"{where['table']:.3f}", f"{where['truth']:.3f}"])
    return table(["table", "axes", "texels", "worst at", "table says", "truth"], body)


def channels(entries):
    """The ratios by themselves."""
    body = []
    for entry in entries:
        found = entry["encodings"]["float"]
        for name in ("S_A", "S_B", "B"):
            if name in found:
                row = [f"`{entry['kind']}`", entry["axes"], size_of(entry), name]
                body.append([*row, *(number(found[name][key]) for key in ("rms", "p99", "max"))])
    return table(["table", "axes", "texels", "channel", "RMS", "99 %", "largest"], body)


def cones(found):
    """Of the default axes; on others the error of the texels comes on top."""
    found = {name: rows for name, rows in found.items() if ", lobe, " in name or ", nested, " in name}
    tilts = list(next(iter(found.values())))
    body = [
        [name, *(cell for tilt in tilts for cell in (number(rows[tilt]["rms"]), number(rows[tilt]["max"])))]
        for name, rows in found.items()
    ]
    head = ["table", *(word for tilt in tilts for word in (f"{tilt}°: RMS", f"{tilt}°: largest"))]
    return table(head, body)


def shipped(found):
    body = [
        [f"`{kind}`", entry["encoding"], f"{entry['bytes'] / 1000:.0f} kB", f"`{entry['sha256'][:12]}…`"]
        for kind, entry in found.items()
    ]
    return table(["table", "encoding", "file", "SHA-256"], body)


def section(record):
    numbers, config = record["numbers"], record["config"]
    entries = numbers["tables"]
    wide = numbers["apertures"]
    four, five = (numbers["open"][kind] for kind in ("brdf-4d", "brdf-5d"))
    error = max(entry["quadrature_error"] for entry in entries)
    return f"""\
Looked up at {config["n_places"]} random places, against quadrature whose own estimated error is at most {error:.0e}.
Visibility is uniform, microfacet width α uniform in [0.03, 1], β uniform in [0°, 90°]; of tables with four and five
coordinates the reflected direction and the cone's axis are anywhere above the surface. "smooth": perceptual roughness
uniform in [0.1, 1] instead, which asks more of narrow lobes; "samples": texels that are the function's own values, not
fitted ones ({{eq}}`eq-table-fit`). Of two channels together: S at F0 = 0.04; of `environment-brdf`: A.
From `references/tables/record.json` (`python references/tables/run.py`).

{overview(entries)}

{folded("Where tables are worst", worst(entries))}

{folded("Channels by themselves", channels(entries))}

**What a kind leaves out** counts when tables stand for the reflection of the light in a cone whose axis leans away from
the normal by up to 30°, 60° or 90°, in any direction; S at F0 = 0.04, floats:

{cones(numbers["cones"])}

**Cones wider than a hemisphere.** Where cones are matched to cosine-weighted visibility, uniform in [0, 1], and lean up
to 60° from the normal, {wide["share"]:.0%} of them are wider than 90°. A table that ended there would be off by
{number(wide["cut"])} (RMS over all; {number(wide["cut, wide"])} over the wide ones), the one that comes with the
package by {number(wide["table"])} ({number(wide["table, wide"])}).

**Open surfaces**, whose cone is the hemisphere, are where tables err to one side. On average over roughness in [0.1, 1]
and all views S is below 1 by {number(-four["mean"])} (RMS {number(four["rms"])}) in the package's table with four
coordinates, and by {number(-five["mean"])} ({number(five["rms"])}) in that with five.

**What comes with the package**, remade bit by bit by the same command:

{shipped(numbers["shipped"])}
"""
