"""Trace the reference set and describe it, or check that it can still be reproduced.

    python references/make.py            # writes manifest.json and evidence/visibility.png
    python references/make.py --check    # traces again and compares with manifest.json

The counts themselves are not kept: a minute of tracing remakes them. What is kept says what they were: a hash of the
geometry and camera of every view, a hash of its counts, and the mean light after each of the first bounces.
"""

import argparse
import hashlib
import json
import sys
from pathlib import Path

import gtao

import numpy as np  # isort: skip

HERE = Path(__file__).resolve().parent
MANIFEST = HERE / "manifest.json"
EVIDENCE = HERE / "evidence" / "visibility.png"
#: Bounces whose mean light the manifest lists.
LISTED_BOUNCES = 6
#: Counts traced on another machine may differ in rays that graze an edge; their means may not, by more than this many
#: standard errors. 12 scenes x 6 means: one in a million sets exceeds it by chance.
LIMIT = 6.0


def trace(settings, name):
    scene = gtao.render.load_scene(name, resolution=settings["resolution"])
    arguments = {key: settings[key] for key in ("n_bounces", "spp", "seed", "n_batches", "normals")}
    return gtao.render.fingerprint(scene), gtao.render.transport(scene, **arguments)


def describe(fingerprint, transport):
    """One entry of the manifest."""
    digest = hashlib.sha256()
    for array in (transport.escaped, transport.remaining, transport.pixel):
        digest.update(np.ascontiguousarray(array))
    batches = transport.escaped[:, :LISTED_BOUNCES].mean(axis=2) / (transport.spp // transport.n_batches)
    return {
        "fingerprint": fingerprint,
        "counts_sha256": digest.hexdigest(),
        "n_pixels": int(transport.pixel.size),
        "mean_T": batches.mean(axis=0).tolist(),
        "standard_error": (batches.std(axis=0, ddof=1) / np.sqrt(len(batches))).tolist(),
    }


def picture(images, names):
    figure = gtao.plot.image_row(images, names)
    EVIDENCE.parent.mkdir(exist_ok=True)
    with gtao.io.atomic_path(EVIDENCE) as path:
        figure.savefig(path, format="png", dpi=60, metadata={"Software": None})


def compare(name, old, new):
    """How the new entry stands to the old one, and whether that is acceptable."""
    if new["counts_sha256"] == old["counts_sha256"]:
        return True, "identical"
    if new["n_pixels"] != old["n_pixels"]:
        return False, f"{new['n_pixels']} pixels show a surface, {old['n_pixels']} did"
    error = np.hypot(old["standard_error"], new["standard_error"])
    z = np.abs(np.subtract(new["mean_T"], old["mean_T"])) / error
    where = "geometry differs in its last bits" if new["fingerprint"] != old["fingerprint"] else "same geometry"
    return bool(z.max() < LIMIT), f"other counts, {where}; means differ by {z.max():.1f} standard errors at most"


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="compare with manifest.json, write nothing")
    options = parser.parse_args()
    settings = json.loads((HERE / "set.json").read_text())
    entries, images = {}, []
    for name in settings["scenes"]:
        fingerprint, transport = trace(settings, name)
        entries[name] = describe(fingerprint, transport)
        images.append(transport.visibility)
        print(f"traced {name}", flush=True)
    if not options.check:
        picture(images, settings["scenes"])
        manifest = {"set": settings, "versions": gtao.io.versions(), "views": entries}
        gtao.io.write_text(MANIFEST, json.dumps(manifest, indent=1) + "\n")
        return
    known = json.loads(MANIFEST.read_text())["views"]
    results = {name: compare(name, known[name], entry) for name, entry in entries.items()}
    for name, (good, text) in results.items():
        print(f"{'ok ' if good else 'BAD'} {name}: {text}")
    sys.exit(0 if all(good for good, _ in results.values()) else 1)


if __name__ == "__main__":
    main()
