"""Maps and scenes of others: what is known of them, and how pictures of them are kept small. For the runs beside it."""

import json
import sys

from PIL import Image

import gtao

_ASSETS = {
    "author": "Poly Haven",
    "licence": "CC0-1.0",
    "origin": "npm package @pmndrs/assets 1.7.0, which shrank it to 512x512 and compressed it with DWAB",
}
#: What is known of maps that come without a description, by hash.
CREDITS = {
    "82847b3f3e2073d16647be2eb5712dc0f7e37ddc9480a1d45f2270fe8cd048f6": {"title": "city"} | _ASSETS,
    "6fff311b5f3dad0910d8f334a6d9d88218ffd873d72c679ee1b7e4bccfa140e3": {"title": "forest"} | _ASSETS,
    "08038ed9159c24bb732d2218dafa09cef2abaa44f9ce11ec511d87c842d88fad": {"title": "studio"} | _ASSETS,
}


def described(folders):
    """Scenes of folders with ``scenes.json``: source, radius, axis that points up; credits by hash of the file."""
    scenes, credits = {}, dict(CREDITS)
    for folder in folders:
        listing = json.loads((folder / "scenes.json").read_text())
        for entry in listing["scenes"]:
            source = folder / entry["xml"]["default"]
            scenes[entry["id"]] = (str(source), float(entry["ao_radius_hint"]), entry["up_axis"])
            credits[gtao.io.sha256_file(source)] = _credit(entry)
        for entry in listing["hdr"]:
            credits[entry["sha256"]] = _credit(entry)
    return scenes, credits


def _credit(entry):
    source = entry["source"]
    origin = source.get("upstream") or source.get("project")
    return {
        "title": entry["title"],
        "author": entry["author"],
        "licence": entry["licence"]["spdx"],
        "origin": origin,
    }


def measured(study, config_class, settings, lights, found, options, turn):
    """Run a comparison under light into ``options.full``, and print its summary.

    Args:
        study, config_class: of ``gtao.workflows``.
        settings: of the configuration, its scenes those that need no file.
        lights: those that need no file.
        found: scenes of files, as :func:`described` gives them.
        options: with ``maps`` and ``full``.
        turn: degrees by which the light turns from each frame to the next.
    """
    config = config_class(
        **settings | {"scenes": (*settings["scenes"], *(source for source, _, _ in found.values()))},
        environments=(*lights, *map(str, options.maps)),
        radius={name: radius for name, (_, radius, _) in found.items()} or None,
        up={name: up for name, (_, _, up) in found.items()} or None,
        turn=turn,
        all_sensors=True,
    )

    def progress(task, done, total):
        if task == "scenes":
            print(f"{done} of {total} scenes", file=sys.stderr, flush=True)

    print(study(config, options.full, progress=progress).summary())


def credited(inputs, credits):
    """The inputs of a record with what is known of their files."""
    return [entry | credits.get(entry["sha256"], {}) for entry in inputs]


def rounded(value):
    """Numbers to four digits, which is more than they are worth."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    return float(f"{value:.4g}") if isinstance(value, float) else value


def kept_pictures(sources, output):
    """Write pictures (name -> file) in 256 colours into a directory; what a record says of them."""
    for name, source in sources.items():
        with Image.open(source) as image:
            image.convert("RGB").quantize(256).save(output / name, optimize=True)
    return [gtao.io.file_entry(output / name, output) for name in sources]
