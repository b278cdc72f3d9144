"""Bake tables of every kind on all axes, measure their errors in every encoding, and write ``record.json``.

    python references/tables/run.py             # a quarter of an hour on two cores
    python references/tables/run.py --quick -o out/tables

``docs/generate.py`` makes the tables of the page *Tables of specular occlusion* of it. The tables that come with the
package, in ``gtao/data/tables``, are written too, the same bytes every time; with ``--quick`` into the output.
"""

import argparse
import math
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import gtao
from gtao.data.specular import SHIPPED
from gtao.kernels.cones import matched_aperture
from gtao.kernels.table_axes import ARGUMENTS
from gtao.tables.bake import fitted_texels
from gtao.tables.configurations import configurations
from gtao.tables.errors import F0, look_up
from gtao.tables.lanes import lanes, numbers
from gtao.tables.values import value_of

HERE = Path(__file__).resolve().parent
PACKAGE = Path(gtao.__file__).parent / "data" / "tables"

N_PLACES, SEED = 20000, 0
#: Kind, axes, sizes. The last two of a texture's axes have to be multiples of 4 for blocks.
TABLES = [
    ("cone-cone", "published", (16, 32)),
    ("cone-cone", "cosine", (16, 32)),
    ("cone-cone", "linear", (16, 32)),
    ("cone-cone", "overlap", (16, 32)),
    ("cone-cone", "nested", (16, 32)),
    ("cone-lobe", "linear", (16, 32)),
    ("cone-lobe", "lobe", (16, 32)),
    ("brdf-3d", "linear", (16, 32)),
    ("brdf-3d", "lobe", (16, 32)),
    ("brdf-4d", "cosine", (16, 32)),
    ("brdf-4d", "linear", (16, 32)),
    ("brdf-4d", "lobe", (16, (24, 24, 16, 16), 32)),
    ("brdf-5d", "linear", ((16, 20, 12, 12, 8),)),
    ("brdf-5d", "lobe", ((8, 16, 8, 8, 8), (16, 20, 12, 12, 8), 16)),
    ("environment-brdf", "cosine", (32, 64)),
    ("environment-brdf", "root", (32, 64)),
]
ENCODINGS = ("float", "unorm16", "unorm8", "bc4")
#: Of the package, on the default axes.
PACKED = {
    "cone-cone": (32, "unorm16"),
    "brdf-4d": ((24, 24, 16, 16), "unorm8"),
    "brdf-5d": ((16, 20, 12, 12, 8), "unorm8"),
    "environment-brdf": (64, "unorm16"),
}
#: What the kinds leave out, against the reflection of the light in a cone anywhere: degrees from the normal.
TILTS = (30, 60, 90)
QUICK = {"cone-cone": (8,), "cone-lobe": (8,), "brdf-3d": (8,), "brdf-4d": (4,), "brdf-5d": (4,)}


def rounded(value):
    """Numbers to four digits, which is more than they are worth."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    return float(f"{value:.4g}") if isinstance(value, float) else value


def found(table, n, where=False, **options):
    """Channel -> errors, and where they are largest."""
    channels = gtao.tables.errors(table, n, SEED, **options).to_dict()["channels"]
    kept = ("rms", "p99", "max", "where") if where else ("rms", "p99", "max")
    return {channel["name"]: rounded({key: channel[key] for key in kept}) for channel in channels}


def measured(table, n):
    entry = {"size": list(table.size), "quadrature_error": table.settings["quadrature_error"], "encodings": {}}
    for encoding in ENCODINGS:
        stored = gtao.tables.quantised(table, encoding)
        entry["encodings"][encoding] = found(stored, n, where=encoding == "float")
    return entry | {"smooth": found(table, n, uniform="roughness")}


def size_text(table):
    return "x".join(map(str, table.size))


def against_cones(tables, n):
    """Table -> tilt -> errors of S."""
    return {
        kind: {str(tilt): found(table, n, against="cone", tilt=math.radians(tilt))["S"] for tilt in TILTS}
        for kind, table in tables.items()
    }


def apertures(table, n):
    """What a table ending at hemispheres would miss of cones matched to visibility above a tilted tangent plane.

    Visibility is uniform, the axis up to 60 degrees from the normal. RMS of S at F0 = 0.04 over all cones and over
    those wider than a hemisphere; "table" is the error of looking the whole cone up.
    """
    places = dict(configurations("brdf-5d", n, SEED, uniform="alpha", tilt=math.pi / 3))
    along, up = np.cos(places["beta"]), np.sin(places["beta"]) * np.cos(places["chi"])
    cos_n = np.clip(along * np.cos(places["theta_o"]) + up * np.sin(places["theta_o"]), 0, 1)
    visibility = np.random.default_rng(SEED + 1).random(n)
    cosine = matched_aperture(*lanes(visibility, cos_n, np.sqrt(1 - cos_n**2)))
    places["alpha_v"] = np.arccos(np.clip(numbers(cosine, like=visibility), -1, 1))
    wide = places["alpha_v"] > 0.5 * math.pi
    terms = gtao.tables.hemisphere_terms(places["alpha"], places["theta_o"]).values * (F0, 1)
    weights = terms / terms.sum(axis=1, keepdims=True)
    whole = value_of("brdf-5d", tuple(places.values())).values
    cut = value_of(
        "brdf-5d", tuple((places | {"alpha_v": np.minimum(places["alpha_v"], 0.5 * math.pi)}).values())
    ).values

    def rms(values, chosen):
        return float(np.sqrt(np.mean(np.sum((values - whole) * weights, axis=1)[chosen] ** 2)))

    read = look_up(table, places)
    everywhere = np.ones(n, bool)
    return rounded(
        {"share": float(wide.mean()), "cut": rms(cut, everywhere), "cut, wide": rms(cut, wide)}
        | {"table": rms(read, everywhere), "table, wide": rms(read, wide)}
    )


def open_surfaces(table, n):
    """S - 1 of open surfaces at F0 = 0.04, whose cone is the hemisphere: mean, RMS and least."""
    places = dict(configurations("brdf-5d", n, SEED, uniform="roughness", tilt=1.0))
    places |= {"alpha_v": np.full(n, 0.5 * math.pi), "beta": places["theta_o"], "chi": np.zeros(n)}
    terms = gtao.tables.hemisphere_terms(places["alpha"], places["theta_o"]).values * (F0, 1)
    read = look_up(table, {name: places[name] for name in ARGUMENTS[table.kind]})
    less = np.sum(read * terms, axis=1) / np.sum(terms, axis=1) - 1
    return rounded({"mean": float(less.mean()), "rms": float(np.sqrt(np.mean(less**2))), "least": float(less.min())})


def shipped(folder):
    """Bake and write the tables of the package: name, bytes and hash of their files, with what is in them."""
    entries = {}
    for kind in SHIPPED:
        size, encoding = PACKED[kind]
        path = folder / f"{kind}.npz"
        gtao.io.write_table(path, gtao.tables.bake(kind, size), encoding)
        entries[kind] = gtao.io.file_entry(path, folder) | {"encoding": encoding}
    return entries


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=HERE, help="directory for the record")
    parser.add_argument("--quick", action="store_true", help="small tables, to see every part run")
    options = parser.parse_args()
    n = 500 if options.quick else N_PLACES
    packed = shipped(options.output if options.quick else PACKAGE)
    entries, best = [], {}
    for kind, axes, sizes in TABLES:
        for size in QUICK.get(kind, (8,)) if options.quick else sizes:
            started = time.process_time()
            sampled = gtao.tables.bake(kind, size, axes, fitted=False)
            seconds = time.process_time() - started
            table = replace(sampled, values=fitted_texels(sampled.values))
            entry = {"kind": kind, "axes": axes, "cpu_seconds": round(seconds, 2), "sampled": found(sampled, n)}
            entry |= measured(table, n)
            entries.append(entry)
            print(f"{table}: {seconds:.1f} s, {entry['encodings']['float']}", file=sys.stderr, flush=True)
            if kind != "environment-brdf":
                best[f"{kind}, {axes}, {size_text(table)}"] = table
    record = gtao.io.provenance(["python", "references/tables/run.py"], seed=SEED, config={"n_places": n})
    results = {"tables": entries, "shipped": packed, "cones": against_cones(best, n)}
    results["open"] = {kind: open_surfaces(gtao.data.specular.shipped(kind), n) for kind in ("brdf-4d", "brdf-5d")}
    results["apertures"] = apertures(gtao.data.specular.shipped("brdf-5d"), n)
    record |= {"kind": "errors of tables", "inputs": [], "outputs": [], "numbers": results}
    gtao.io.write_record(options.output / "record.json", record, overwrite=True)


if __name__ == "__main__":
    main()
