"""Tables of what noise patterns leave of an estimate's error, from ``references/noise``."""

from .markdown import table

PUBLISHED, SPREAD, FINE, PRINTED = (f"spatial_4x4{end}" for end in ("", "_spread", "_fine", "_unbracketed"))
GRADIENT, GOLDEN, BLUE, WHITE = "interleaved_gradient", "interleaved_gradient_golden", "blue_noise", "white"
BARE, SPATIAL, PLANE = "no filter", "spatial 4×4", "plane-aware"
FILTERS = (BARE, SPATIAL, "edge-aware", "edge-aware, 3 passes", PLANE)
#: Pattern -> what it is over space, and over time.
ABOUT = {
    "none": ("the middle of slice and step", "the same"),
    PUBLISHED: ("16 directions, 4 offsets in 4×4 pixels", "the slides' tables, a cycle of 24"),
    PRINTED: ("the slides' formula as printed: 4 directions", "the same tables"),
    FINE: ("as `spatial_4x4`", "sixths of the step between two directions"),
    SPREAD: ("as `spatial_4x4`", "{eq}`eq-noise-spread`"),
    GRADIENT: ("interleaved gradient noise, 4 offsets", "the pattern moves across the image"),
    "interleaved_gradient_cycled": ("the same", "the slides' tables"),
    GOLDEN: ("the same", "golden ratio, √2"),
    "hilbert_r2": ("R2 sequence along a Hilbert curve", "on along the sequence"),
    BLUE: ("void and cluster, 64×64 pixels", "golden ratio, √2, {eq}`eq-noise-blue`"),
    "sobol": ("random", "Owen-scrambled Sobol sequence per pixel, {eq}`eq-noise-owen`"),
    WHITE: ("random", "random"),
}
MOVED = {
    "still": "the same mask in every frame",
    "shift": "the mask moved over the image, to where R2 says",
    "fresh": "another mask in every frame",
    "r2": "all values moved along R2",
    "golden": "rotations moved by the golden ratio, offsets by √2 − 1",
}


def deviation(rows, name, n):
    return rows[name][str(n)]["deviation"]


def best(rows, n):
    """Name of the pattern with the least deviation from the limit after n frames."""
    return min(rows, key=lambda name: deviation(rows, name, n))


def overview(numbers, n):
    body = []
    for name, (space, time) in ABOUT.items():
        cells = []
        for spatial in FILTERS:
            rows = numbers["patterns"][spatial]
            text = f"{deviation(rows, name, n):.4f}"
            cells.append(f"**{text}**" if best(rows, n) == name else text)
        body.append([f"`{name}`", *((space,) if n == 1 else (time,)), *cells])
    return table(["pattern", "over space" if n == 1 else "over time", *FILTERS], body)


def against_limit(numbers):
    """Blur included: what is seen in the image."""
    body = []
    for name in ABOUT:
        rows = [numbers["patterns"][spatial][name] for spatial in FILTERS]
        body.append([f"`{name}`", *(f"{row[n]['rmse']:.4f}" for n in ("1", "24") for row in rows)])
    head = [f"{spatial}, {n}" for n in ("1 frame", "24 frames") for spatial in FILTERS]
    return table(["pattern", *head], body)


def by_frames(numbers, spatial):
    rows = numbers["patterns"][spatial]
    order = sorted(rows[WHITE], key=int)
    return table(
        ["pattern", *order], [[f"`{name}`", *(f"{deviation(rows, name, n):.4f}" for n in order)] for name in ABOUT]
    )


def moved(numbers):
    found = {spatial: numbers["movements"][spatial] for spatial in (BARE, SPATIAL, PLANE)}
    body = [
        [about, *(f"{deviation(rows, name, n):.4f}" for rows in found.values() for n in (1, 6, 24))]
        for name, about in MOVED.items()
    ]
    return table(["mask of blue noise", *(f"{spatial}, {n}" for spatial in found for n in (1, 6, 24))], body)


def counted(numbers):
    body = [
        [f"`{name}`", str(row["directions"]), str(row["positions"]), f"{row['widest_gap']:.1f}°"]
        for name, row in numbers["counts"].items()
    ]
    return table(["pattern", "directions", "sample positions", "widest gap in a pixel"], body)


def by_slices(numbers, spatial, n):
    rows = numbers["slices"]
    order = sorted(rows, key=int)
    body = [
        [f"`{name}`", *(f"{deviation(rows[k][spatial], name, n):.4f}" for k in order)]
        for name in ABOUT
        if name != "none"
    ]
    return table(["pattern", *(f"{k} slices" if k != "1" else "1 slice" for k in order)], body)


def low(numbers, limit):
    names = (BLUE, "hilbert_r2", GRADIENT, "sobol")
    return ", ".join(f"`{name}` {numbers['low'][name][limit]:.2g}" for name in names)


def sigmas(numbers):
    rows = numbers["sigmas"]
    limits = ("0.125", "0.25", "0.375")
    body = [[sigma, *(f"{row[limit]:.2g}" for limit in limits)] for sigma, row in sorted(rows.items())]
    return table(["σ", "1/8", "1/4", "3/8"], body)
