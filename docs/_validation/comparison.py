"""All named methods on all embedded scenes, from ``references/comparison``."""

import itertools
import math

from .markdown import folded, table

#: Groups of methods that are not at equal numbers of samples.
DEFAULTS, LIMITS = "own defaults", "limits of one depth layer"
FAITHFUL, DENSE = "gtao", "gtao, dense"
#: Methods whose error budgets are shown.
BUDGETED = ("gtao", "recommended", "xegtao-high")


def rows_of(scene, group):
    return {row["method"]: row for row in scene["methods"] if row["group"] == group}


def groups(scenes):
    first = next(iter(scenes.values()))
    return [
        group for group in dict.fromkeys(row["group"] for row in first["methods"]) if group not in (DEFAULTS, LIMITS)
    ]


def by_method(scenes, group, metric):
    """Method -> value per scene, the lowest mean first."""
    tables = [rows_of(scene, group) for scene in scenes.values()]
    values = {name: [rows[name][metric] for rows in tables] for name in tables[0]}
    return dict(sorted(values.items(), key=lambda item: sum(item[1])))


def matrix(scenes, group, metric, extra=()):
    """One row per method and one column per scene, the lowest of each scene in bold."""
    values = by_method(scenes, group, metric)
    lowest = [min(column) for column in zip(*values.values(), strict=True)]
    body = []
    for name, row in values.items():
        cells = [f"**{v:.3f}**" if v == low else f"{v:.3f}" for v, low in zip(row, lowest, strict=True)]
        body.append([f"`{name}`", f"{sum(row) / len(row):.3f}", *cells])
    for title, row in extra:
        body.append([title, f"{sum(row) / len(row):.3f}", *(f"{v:.3f}" for v in row)])
    return table(["method", "mean", *scenes], body)


def defaults(scenes):
    limits = [scene["limit_rmse"] for scene in scenes.values()]
    noise = [scene["noise"] for scene in scenes.values()]
    extra = [("*limit of one depth layer*", limits), ("*noise of the truth*", noise)]
    return matrix(scenes, DEFAULTS, "corrected_rmse", extra)


def equal_taps(scenes):
    parts = []
    for group in groups(scenes):
        closest = [name for name, scene in scenes.items() if winner(scene, group) == FAITHFUL]
        noise = [scene["truths"]["noise_of_rays"] for scene in scenes.values()]
        floor = [("*noise of the height field*", noise)]
        parts.append(
            f"### {group}\n\n`{FAITHFUL}` is the closest of all on {len(closest)} of {len(scenes)} scenes.\n\n"
            f"{matrix(scenes, group, 'field_rmse', floor)}\n"
        )
    return "\n".join([*parts, *exceptions(scenes)]).rstrip()


def winner(scene, group):
    rows = rows_of(scene, group)
    return min(rows, key=lambda name: rows[name]["field_rmse"])


def exceptions(scenes):
    """Where another method is closer to the height field, and what makes it so."""
    notes = [f"- {name}, {note}" for name, scene in scenes.items() for note in scene["notes"]]
    intro = """Where another method is closer, this names the one of its deviations that helps most when it is alone.
Few steps miss occluders, and estimates are too bright; whatever makes occluders larger than they are hides a part
of that.
"""
    return [intro, *notes] if notes else []


def truths(scenes):
    body = []
    for name, scene in scenes.items():
        t = scene["truths"]
        difference, square = t["difference"], t["mean_square"]
        body.append(
            [
                name,
                f"{t['noise_of_rays']:.4f}",
                f"{t['noise_of_slices']:.4f}",
                f"{difference['value']:+.5f} ± {difference['standard_error']:.5f}",
                f"{1e6 * square['value']:+.1f} ± {1e6 * square['standard_error']:.1f}",
                f"{math.sqrt(max(square['value'], 0)):.4f}",
            ]
        )
    head = ["scene", "noise of rays", "noise of slices", "mean difference", "mean square, 10⁻⁶", "its root"]
    return table(head, body)


def thicknesses(scenes):
    """RMSE by what is taken for the thickness of occluders, the mean over the scenes and single ones, per budget."""
    first = next(iter(scenes.values()))["thickness"]
    parts = []
    for counts in sorted(next(iter(first.values())), key=lambda text: int(text.partition(" ")[0])):
        values = {label: [scene["thickness"][label][counts] for scene in scenes.values()] for label in first}
        lines = sorted(values.items(), key=lambda item: -sum(item[1]))
        body = [[label, f"{sum(row) / len(row):.3f}", *(f"{v:.3f}" for v in row)] for label, row in lines]
        parts.append(f"{counts} slices and steps per side:\n\n{table(['thickness', 'mean', *scenes], body)}")
    return "\n\n".join(parts)


def dense_rmse(scene):
    return rows_of(scene, LIMITS)[DENSE]["corrected_rmse"]


def limits(scenes):
    body = []
    for name, scene in scenes.items():
        limit, dense = scene["limit_rmse"], dense_rmse(scene)
        kind = "solid" if scene["solid"] else "thin"
        body.append([name, kind, f"{limit:.4f}", f"{dense:.4f}", f"{dense / limit - 1:+.1%}"])
    return table(["scene", "", "height field", "dense `gtao`", "difference"], body)


def budget(scenes, method):
    """Mean squares of the steps in 10⁻³, cross terms and total: every row adds up."""
    names = next(iter(scenes.values()))["budgets"][method]["names"]
    lines = {}
    for name, scene in scenes.items():
        b = scene["budgets"][method]
        squares = [b["gram"][i][i] for i in range(len(names))]
        lines[name] = [*squares, b["total"] - sum(squares), b["total"]]
    lines["**mean**"] = [sum(column) / len(lines) for column in zip(*lines.values(), strict=True)]
    body = [
        [name, *(f"{1e3 * v:.2f}" for v in values), f"{math.sqrt(max(values[-1], 0)):.3f}"]
        for name, values in lines.items()
    ]
    return table(["scene", *names, "cross terms", "total", "RMSE"], body)


def walk(scenes, method):
    """RMSE, in the mean over scenes, as the deviations of a method are switched on one after the other."""
    walks = [scene["deviations"][method] for scene in scenes.values()]
    labels = [label for label, _ in walks[0]]
    means = [sum(walk[i][1] for walk in walks) / len(walks) for i in range(len(labels))]
    changes = ["", *(f"{b - a:+.4f}" for a, b in itertools.pairwise(means))]
    body = [[f"`{n}`", f"{m:.4f}", c] for n, m, c in zip(labels, means, changes, strict=True)]
    return table(["switched on", "mean RMSE", "change"], body)


def walks(scenes):
    names = next(iter(scenes.values()))["deviations"]
    return "\n\n".join(folded(name, walk(scenes, name)) for name in names)


def within(scenes, share):
    """On how many solid scenes a dense estimate comes within a share of the height field's error."""
    solid = [scene for scene in scenes.values() if scene["solid"]]
    near = [scene for scene in solid if dense_rmse(scene) <= (1 + share) * scene["limit_rmse"]]
    return f"{len(near)} of {len(solid)}"


def section(record):
    scenes, config = record["numbers"]["scenes"], record["config"]
    budgets = "\n\n".join(f"`{name}`:\n\n{budget(scenes, name)}" for name in BUDGETED)
    return f"""## Every method at its own defaults

RMSE against ray-traced truth of the same reach, with the noise of the truth taken out: the embedded scenes at
{config["resolution"]} pixels, the truth traced at {config["spp"]} rays per pixel. Every method of `gtao methods`
has its own number of samples, its own filter and its own radius conventions, as described on the page
[Departures](departures.md). The lowest of each scene is bold.

{defaults(scenes)}

## The same number of samples for everyone

RMSE against the *height field*, which is all that a depth buffer says without guesses about thickness. Everyone
has the same numbers of slices and steps per side; filters and clamps are off, and of methods that differ in nothing
else the first stands for all. What blurs, or takes occluders for thinner than the height field has them, may still
be closer to the ray-traced truth, but not to what it was given to see: falloffs make occluders fainter than a sharp
radius has them, and `recommended` makes them thin and counts on more steps than these.

{equal_taps(scenes)}

## Two ground truths of a depth buffer

Rays over the hemisphere ({config["n_directions"]} × {config["rays_per_direction"]} per pixel) and dense slices
agree if their difference has no mean and no mean square beyond their noise. Both numbers come with standard
errors over blocks of pixels.

{truths(scenes)}

## How near a dense estimate comes

RMSE against ray-traced truth, without noise, of the height field itself and of `gtao` with 32 slices of 32 steps
per side and interpolated depth. On {within(scenes, 0.1)} solid scenes the estimate is at most 10 % farther from the
truth than the height field is.

{limits(scenes)}

## Where the error comes from

Mean squares of the steps from the truth to the result, {{eq}}`eq-budget`, in units of 10⁻³, noise taken out. With
the cross terms each line adds up to its total. Steps are explained on the page
[](howto/which-method.md#the-error-budget).

{budgets}

## What a guess about thickness is worth

RMSE against ray-traced truth of visibility bitmasks that differ in nothing but what they take for the thickness of
occluders; lengths in units of the radius, no filter. Measured thickness comes from the ray tracer. With several
bodies per pixel it is what every guess aims at; what is left then is behind the known bodies, outside of the frame,
or between samples.

{thicknesses(scenes)}

## What each deviation costs

Methods as deviations from their faithful form, switched on one after the other in the order of the table; RMSE
against ray-traced truth, mean over the scenes. What a deviation brings depends on those before it.

{walks(scenes)}
"""
