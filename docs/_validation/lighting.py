"""All methods of irradiance under light from afar, from ``references/lighting``."""

from gtao.workflows.lighting.methods import DENSE, DENSE_COUNTS, GAME, GAME_COUNTS, OURS, TRACED, TWINS

from .markdown import credits, folded, pictures, table

SOURCES = (TRACED, DENSE, GAME)
SMOOTH, SHARP, WINDOWED = "order 2", "all bands", "all bands, windowed"
LIMITS = "exact visibility, light cut"
#: The first of ours, exact where light has no bands above 2.
EXACT = "slice-moments"

#: Method -> what it is in `gtao.irradiance`, and what stands for visibility times cosine.
METHODS = {
    "slice-moments": ("SliceMoments()", "the slices' own harmonics"),
    "slice-moments-4": ("SliceMoments(order=4)", "the same, and bands 3 and 4 of `moment-zh-4`"),
    "moment-zh": ("MomentZH()", "zonal, from visibility and mean direction"),
    "moment-zh-4": ("MomentZH(order=4)", "the same with bands 3 and 4"),
    "cone-seed": ("ConeSH()", "cone times cosine about the bent normal (ATVI-TR-19-01)"),
    "cone-matched": ('ConeSH(aperture="matched")', "the same, aperture matched to the visibility"),
    "cone-matched-4": ('ConeSH(aperture="matched", order=4)', "the same with bands 3 and 4"),
    "clipped-cone-seed": ('ClippedCone(aperture="seed")', "cone cut by the true tangent plane, published aperture"),
    "clipped-cone": ("ClippedCone()", "the same, aperture matched to the visibility"),
    "clipped-cone-4": ("ClippedCone(order=4)", "the same with bands 3 and 4"),
    "triple-product": ("TripleProduct()", "light, cone and cosine, each cut to order 2 (Snyder 2006)"),
    "triple-product-4": ("TripleProduct(order=4)", "the same, cut to order 4"),
    "bent-normal": ("BentNormalIrradiance(order=4)", "visibility times an open surface along the bent normal"),
    "bent-normal-average-horizon": (
        "BentNormalIrradiance(order=4)",
        'the same with the directions of `bent_normal="average_horizon"`',
    ),
    "occlusion": ("OcclusionTimesIrradiance(order=4)", "visibility times an open surface"),
    "unoccluded": ("OcclusionTimesIrradiance(order=4)", "the same with a visibility of 1"),
}


def rmse_of(numbers, light, cut, source):
    return {name: row["rmse"] for name, row in numbers["standings"][light][cut][source].items()}


def told_apart(names, cut):
    """Without the methods that are another one of them under the cut."""
    return [name for name in names if cut != SMOOTH or TWINS.get(name) not in names]


def sorted_means(numbers, cut, source):
    means = numbers["means"][cut][source]
    return sorted(told_apart(means, cut), key=means.__getitem__)


def bold(values, shown="{:.3f}"):
    """The lowest in bold, None as a dash."""
    least = min(v for v in values if v is not None)
    texts = ["–" if v is None else shown.format(v) for v in values]
    return [f"**{text}**" if v == least else text for v, text in zip(values, texts, strict=True)]


def overview(numbers):
    """Mean over light and frames: a row per method, a column per cut and source."""
    columns = [(cut, source) for cut in (SMOOTH, SHARP) for source in SOURCES]
    means = numbers["means"]
    names = sorted(means[SMOOTH][DENSE], key=lambda name: means[SMOOTH][DENSE][name])
    cells = []
    for cut, source in columns:
        shown = sorted_means(numbers, cut, source)
        cells.append(bold([means[cut][source][name] if name in shown else None for name in names]))
    body = [[f"`{name}`", *(column[i] for column in cells)] for i, name in enumerate(names)]
    return table(["method", *(f"{cut}: {source}" for cut, source in columns)], body)


def ranks(numbers):
    """Mean rank over light and views, and pairs of the two with the lowest error: a row per method."""
    columns = [(cut, source) for cut in (SMOOTH, SHARP) for source in SOURCES]
    names = list(METHODS)
    cells = []
    for cut, source in columns:
        found = [numbers["standings"][light][cut][source] for light in numbers["order"]]
        weights = [frames_of(numbers, light) for light in numbers["order"]]
        means = {
            name: sum(rows[name]["rank"] * n for rows, n in zip(found, weights, strict=True)) / sum(weights)
            for name in told_apart(found[0], cut)
        }
        wins = {name: sum(rows[name]["wins"] for rows in found) for name in means}
        shown = bold([means.get(name) for name in names], "{:.1f}")
        cells.append([f"{text} ({wins[n]})" if n in wins else text for n, text in zip(names, shown, strict=True)])
    pairs = sum(frames_of(numbers, light) for light in numbers["order"])
    body = [[f"`{name}`", *(column[i] for column in cells)] for i, name in enumerate(names)]
    text = table(["method", *(f"{cut}: {source}" for cut, source in columns)], body)
    return f"Mean rank, and in how many of {pairs} pairs of a view and a light no other error is as low:\n\n{text}"


def matrix(numbers, cut, source):
    """A row per method and a column per light."""
    means = numbers["means"][cut][source]
    names = sorted_means(numbers, cut, source)
    columns = [bold([means[name] for name in names])]
    for light in numbers["order"]:
        found = rmse_of(numbers, light, cut, source)
        columns.append(bold([found[name] for name in names]))
    body = [[f"`{name}`", *(column[i] for column in columns)] for i, name in enumerate(names)]
    return table(["method", "mean", *numbers["order"]], body)


def matrices(numbers, cut):
    first, *others = SOURCES
    shown = f"Given {first}:\n\n{matrix(numbers, cut, first)}"
    return "\n\n".join([shown, *(folded(f"Given {source}", matrix(numbers, cut, source)) for source in others)])


def winners(numbers, cut):
    """Light by light: the method with the lowest mean, and where those with the slices' harmonics stand."""
    body = []
    ours = [name for name in OURS if name in numbers["means"][cut][DENSE]]
    for light in numbers["order"]:
        for source in SOURCES:
            rows = numbers["standings"][light][cut][source]
            order = sorted(told_apart(rows, cut), key=lambda name: rows[name]["rmse"])
            best = order[0]
            n = frames_of(numbers, light)
            body.append(
                [
                    light,
                    source,
                    f"`{best}`",
                    f"{rows[best]['rmse']:.3f}",
                    f"{rows[best]['wins']} of {n}",
                    *(f"{order.index(name) + 1} ({rows[name]['rmse']:.3f})" for name in ours),
                ]
            )
    head = ["light", "given", "lowest mean", "RMSE", "first on", *(f"place of `{name}` (RMSE)" for name in ours)]
    return table(head, body)


def frames_of(numbers, light):
    return numbers["frames"][light]


def truncation(numbers):
    body = []
    for light in numbers["order"]:
        limits = rmse_of(numbers, light, SHARP, LIMITS)
        noise = numbers["noise"][light][SHARP]
        body.append([light, *(f"{limits[cut]:.3f}" for cut in ("order 2", "order 4")), f"{noise:.4f}"])
    return table(["light", "cut to order 2", "cut to order 4", "noise of the truth"], body)


def count_of(numbers, cut, source):
    """Method -> kinds of light under which it has the lowest mean, the most frequent first."""
    found = {}
    for light in numbers["order"]:
        values = rmse_of(numbers, light, cut, source)
        best = min(told_apart(values, cut), key=values.__getitem__)
        found[best] = found.get(best, 0) + 1
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def tally(numbers, cut, source):
    parts = [f"`{name}` under {n}" for name, n in count_of(numbers, cut, source).items()]
    return f"{', '.join(parts)} of {len(numbers['order'])} kinds of light"


def ranking(numbers, cut, source, n=3):
    means = numbers["means"][cut][source]
    names = sorted_means(numbers, cut, source)
    parts = [f"`{name}` {means[name]:.3f}" for name in names[:n]]
    tails = [f"; `{o}` is number {names.index(o) + 1} with {means[o]:.3f}" for o in OURS if o in names[n:]]
    return ", ".join(parts) + "".join(tails)


def unoccluded(numbers, cut, source):
    """In how many pairs of a view and a light no occlusion at all has the lowest error."""
    wins = sum(numbers["standings"][light][cut][source]["unoccluded"]["wins"] for light in numbers["order"])
    return f"{wins} of {sum(frames_of(numbers, light) for light in numbers['order'])}"


def price(numbers, source):
    """The best method with a window beside the best without."""
    with_, without = (sorted_means(numbers, cut, source)[0] for cut in (WINDOWED, SHARP))
    means = numbers["means"]
    return f"`{with_}` {means[WINDOWED][source][with_]:.3f} against `{without}` {means[SHARP][source][without]:.3f}"


def verdict(numbers):
    means = numbers["means"]
    exact = means[SMOOTH][TRACED][EXACT]
    noise = sum(numbers["noise"][light][SMOOTH] for light in numbers["order"]) / len(numbers["order"])
    second = next(name for name in sorted_means(numbers, SMOOTH, TRACED) if name not in OURS)
    costs = [rmse_of(numbers, light, SHARP, LIMITS)["order 2"] for light in numbers["order"]]
    return f"""\
- **Smooth light** (no bands above 2), exact visibility: `{EXACT}` misses the truth by {exact:.4f} of the mean
  irradiance, which is what is left of the rays' noise of {noise:.3f}; the best of the others, `{second}`, by
  {means[SMOOTH][TRACED][second]:.3f}.
- **Smooth light, from the depth buffer**: the error of the visibility, the same for all, comes on top of theirs.
  Dense slices: {ranking(numbers, SMOOTH, DENSE)}. Few slices, filtered: {ranking(numbers, SMOOTH, GAME)}.
- **Light as it is**: cutting it to order 2 alone costs {min(costs):.3f} to {max(costs):.3f}, and `{EXACT}` pays that
  in full; `slice-moments-4` guesses bands 3 and 4 from visibility and mean direction.
  Exact visibility: {ranking(numbers, SHARP, TRACED)}. Dense slices: {ranking(numbers, SHARP, DENSE)}.
  Few slices, filtered: {ranking(numbers, SHARP, GAME)}.
- **Who has the lowest mean under light as it is**: given exact visibility {tally(numbers, SHARP, TRACED)};
  given dense slices {tally(numbers, SHARP, DENSE)}; given few slices {tally(numbers, SHARP, GAME)}.
- **No occlusion at all** (`unoccluded`) has the lowest error of all in {unoccluded(numbers, SHARP, DENSE)} pairs of a
  view and a light, given dense slices and light as it is; given few slices in {unoccluded(numbers, SHARP, GAME)}.
- **Through a window** that leaves no negative radiance, dense slices: {ranking(numbers, WINDOWED, DENSE)}; few slices,
  filtered: {ranking(numbers, WINDOWED, GAME)}. That is what a window costs: the best with it against the best without,
  dense slices: {price(numbers, DENSE)}; few slices, filtered: {price(numbers, GAME)}."""


def twins(numbers):
    """Which methods are left out under smooth light, in words; nothing where none are."""
    means = numbers["means"][SMOOTH][DENSE]
    names = [f"`{name}`" for name in means if TWINS.get(name) in means]
    if not names:
        return ""
    return f"{', '.join(names)} are here what they are without bands 3 and 4, and left out."


def explained():
    return table(
        ["method", "`gtao.irradiance` with", "stands for visibility × cosine"],
        [[f"`{name}`", f"`{call}`", words] for name, (call, words) in METHODS.items()],
    )


def section(record):
    numbers, config = record["numbers"], record["config"]
    views = [entry for entry in record["inputs"] if "frame" in entry]
    embedded = [entry for entry in views if entry["path"].startswith("embedded:")]
    files = [entry for entry in record["inputs"] if "light" in entry]
    notes = "\n".join(f"- {note}" for note in numbers["notes"])
    left_out = f"\n{notes}\n" if notes else ""
    return f"""\
`gtao compare-lighting` traces the irradiance of every pixel under a light from afar, seen directly through whatever
stands within the radius, and compares every method of `gtao.irradiance` with it. Here on {len(views)} views,
{len(embedded)} of them of embedded scenes, under {len(numbers["order"])} kinds of light, {len(files)} of them
photographed, at {config["resolution"]} pixels with {config["spp"]} rays per pixel. From each view to the next the light
turns by {config["turn"]:g}°.

Errors are root mean squares over the pixels and colour channels, relative to the mean irradiance of the view under the
whole light, without the noise of the rays; means are over views and kinds of light. Two things are kept apart:

- *What the method is given.* Ray-traced visibility isolates the method; dense slices
  ({DENSE_COUNTS[0]} slices, {DENSE_COUNTS[1]} steps per side) add what a depth buffer cannot know; few slices
  ({GAME_COUNTS[0]} × {GAME_COUNTS[1]}) and a filter are what a game has.
- *What the light holds.* Under "{SMOOTH}" light and truth are cut to bands 0 to 2, so that no method is blamed for what
  nine coefficients cannot hold; under "{SHARP}" the truth sees all of the light, and methods the bands that they take.
  "{WINDOWED}" differs from that in what methods are given: their bands of the light through the widest window that
  leaves no negative radiance.

## In short

{verdict(numbers)}

![Error of every method, under light cut to few bands and as it is](../references/lighting/methods.png)

{overview(numbers)}

A few views with little light weigh much in a mean of relative errors; ranks do not care.

{folded("By rank", ranks(numbers))}

## The methods

{explained()}

Estimates are not clamped: under light that was cut they may be negative. The last four take bands 3 and 4 of an open
surface's irradiance, which holds next to nothing of them.

## Smooth light

Light and truth cut to order 2. A method is off by what it assumes about the shape of visibility. {twins(numbers)}

{matrices(numbers, SMOOTH)}

## Light as it is

{matrices(numbers, SHARP)}

### Who wins

By mean over the views; "first on" counts single views.

{winners(numbers, SHARP)}

## Light through a window

{matrices(numbers, WINDOWED)}

## What the cut of the light costs

Exact visibility, light cut to few bands, against the whole light. A method that stops at the same band is better than
this where what it assumes about visibility happens to make up for bands that are missing.

{truncation(numbers)}
{left_out}
## Pictures

Radiance of the diffuse surfaces, and errors relative to its mean, given dense slices.

{pictures(record, "lighting", ("methods.png",))}

## Maps and scenes of others

None of these files is part of the project.

{credits(record)}
"""
