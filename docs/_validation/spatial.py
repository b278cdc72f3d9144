"""What spatial filters leave of the noise and what they blur, from ``references/spatial``."""

from .markdown import table

NONE, FIRST, SECOND = "bilateral, none", "bilateral, first", "bilateral, second"
PLANAR, PLANES = "bilateral, planar first", "plane-aware"
ONE, THREE = "edge-aware, 1 pass", "edge-aware, 3 passes"
#: In the order of the tables.
FILTERS = (
    NONE,
    FIRST,
    SECOND,
    PLANAR,
    "bilateral, planar second",
    ONE,
    "edge-aware, 2 passes",
    THREE,
    PLANES,
    "plane-aware, mean of 4×4",
)
UNFILTERED = "none"
FLOOR, SPHERES, EAVES = "grazing floor", "spheres", "eaves"


def slopes(numbers):
    return [name for name in numbers["errors"] if name.startswith("slope")]


def steps(numbers):
    return sorted((n for n in numbers["errors"] if n.startswith("step")), key=lambda n: float(n.split()[1]))


def analytic(numbers):
    """Frames of planes and spheres in the order of the page."""
    return [*steps(numbers), *slopes(numbers), FLOOR, "floor and wall", SPHERES]


def errors(numbers, names, key):
    """A table of one of the errors: filters by frames."""
    found = [numbers["errors"][frame] for frame in names]
    rows = [[name, *(f"{frame[name][key]:.4f}" for frame in found)] for name in FILTERS]
    if key in found[0][UNFILTERED]:
        rows.insert(0, ["no filter", *(f"{frame[UNFILTERED][key]:.4f}" for frame in found)])
    return table(["filter", *names], rows)


def leaks(numbers):
    """The largest error of an image of two values, beside the edge and farther away."""
    frames = [*steps(numbers), EAVES]
    rows = []
    for name in FILTERS:
        found = [numbers["leaks"][frame][name] for frame in frames]
        rows.append([name, *(f"{e['largest']:.2f}, {e['clear']:.2f}" for e in found)])
    return table(["filter", *frames], rows)


def horizon(numbers):
    rows = [[n, *(f"{taps[f]:.1f}" for f in (NONE, FIRST, SECOND, PLANAR))] for n, taps in numbers["horizon"].items()]
    rows.sort(key=lambda row: int(row[0]))
    return table(["rows below the horizon", NONE, FIRST, SECOND, PLANAR], rows)


def costs(numbers):
    found = numbers["costs"]
    rows = [[f, f"{found[f]:.0f}", f"{found[f] / found['estimate']:.2f}"] for f in ("estimate", *FILTERS)]
    return table(["", "ns per pixel", "share of the estimate"], rows)


def total(numbers, frame, name):
    return numbers["errors"][frame][name]["total"]


def by_derivatives(numbers, frame):
    none, first, second = (total(numbers, frame, name) for name in (NONE, FIRST, SECOND))
    return f"{none:.3f}, {first:.3f} and {second:.3f}"


def gained_and_lost(numbers, scenes):
    """Scenes by whether second derivatives lessen the error of first ones, in words."""
    change = {s: total(numbers, s, SECOND) / total(numbers, s, FIRST) - 1 for s in scenes}
    helped = [s for s in scenes if change[s] < -0.005]
    hurt = sorted((s for s in scenes if change[s] > 0.005), key=lambda s: -change[s])
    same = [s for s in scenes if s not in helped and s not in hurt]

    def listed(names):
        return ", ".join(f"`{s}` {100 * change[s]:+.0f} %" for s in names) if names else "none"

    return f"more error: {listed(hurt)}; less: {listed(helped)}; within half a percent: {len(same)} of {len(scenes)}"


def best(numbers, frame):
    found = {f: e["total"] for f, e in numbers["errors"][frame].items() if f != UNFILTERED}
    return min(found, key=found.__getitem__)


def plane_aware(numbers, scenes):
    """Where the plane-aware filter blurs least, and where it leaves more noise than others, in words."""

    def least(frame):
        found = {f: e["blur"] for f, e in numbers["errors"][frame].items() if f != UNFILTERED}
        return min(found, key=found.__getitem__)

    def excess(frame):
        rows = numbers["errors"][frame]
        return rows[PLANES]["blur"] / rows[least(frame)]["blur"]

    def noisier(frame):
        rows = numbers["errors"][frame]
        others = [f for f in FILTERS if f != ONE and not f.startswith(PLANES)]
        return all(rows[PLANES]["noise"] > rows[f]["noise"] for f in others)

    frames = analytic(numbers)
    worst = max(frames, key=excess)
    rows = numbers["errors"][worst]
    first = sum(least(s) == PLANES for s in scenes)
    alone = sum(least(f) == PLANES for f in frames)
    return f"""The plane-aware filter blurs least in {first} of {len(scenes)}
  scenes, and in {alone} of the {len(frames)} frames of planes and spheres: farthest from it in "{worst}", with
  {rows[PLANES]["blur"]:.4f} against {rows[least(worst)]["blur"]:.4f} ({least(worst)}). In
  {sum(map(noisier, scenes))} of {len(scenes)} scenes it leaves more noise than all bilateral filters and two or more
  edge-aware passes"""


def in_short(numbers, scenes, config):
    steep, (small, *large) = slopes(numbers)[-2], steps(numbers)
    left, taps = numbers["errors"][steep], numbers["horizon"]["2"]
    # Rows where second derivatives let at least one tap more count than first ones.
    helped = [int(n) for n, row in numbers["horizon"].items() if row[SECOND] - row[FIRST] >= 1]
    full = max(row[FIRST] for row in numbers["horizon"].values())
    filters = config["filters"]
    widest = max(e["largest"] for name in large for e in numbers["leaks"][name].values())
    round_ = numbers["errors"][SPHERES]
    worst = max(scenes, key=lambda s: total(numbers, s, SECOND) / total(numbers, s, NONE))
    shares = {name: numbers["costs"][name] / numbers["costs"][FIRST] for name in FILTERS}
    wins = ", ".join(f"`{s}` ({best(numbers, s)})" for s in scenes)
    return f"""\
- **Edges**: nothing crosses a step of depth of {large[0].split()[1]} % or more (at most {widest:.0e}, rounding). A
  step of {small.split()[1]} % is below the bilateral filter's threshold of {100 * filters[FIRST]["threshold"]:g} %,
  and leaks within its footprint, never farther; links and planes stop at it.
- **Slopes**: without derivatives a slope of {steep.split()[1]} keeps an error of {left[NONE]["total"]:.3f}; first
  derivatives leave {left[FIRST]["total"]:.3f}, second ones {left[SECOND]["total"]:.3f}. Nearly all taps count already
  with the first ({left[FIRST]["taps"]:.1f} of {full:.0f}), but not all alike, so that the pattern does not cancel:
  {left[FIRST]["pattern"]:.4f} and {left[SECOND]["pattern"]:.4f} of it are left.
- **Planes are linear in 1 / depth.** First derivatives of that leave {left[PLANAR]["total"]:.3f}
  (pattern {left[PLANAR]["pattern"]:.4f}), as little as a filter that knows the normals, at {shares[PLANAR]:.2f} of the
  cost of the same derivatives of depth; second derivatives have nothing to add on planes.
- **A grazing floor** has errors of {by_derivatives(numbers, FLOOR)} by none, first and second derivatives,
  and {total(numbers, FLOOR, PLANAR):.3f} by planar ones. Second derivatives let at least one tap more count up to
  {max(helped)} rows below the horizon: two rows below it {taps[NONE]:.0f}, {taps[FIRST]:.0f},
  {taps[SECOND]:.0f} and, planar, {taps[PLANAR]:.0f} taps count.
- **Curved surfaces**: on spheres {by_derivatives(numbers, SPHERES)}. Second derivatives take noise away
  ({round_[FIRST]["noise"]:.3f} to {round_[SECOND]["noise"]:.3f}) and add blur ({round_[FIRST]["blur"]:.3f} to
  {round_[SECOND]["blur"]:.3f}): a prediction that bends reaches more surfaces.
- **Where they hurt**: second against first derivatives in scenes: {gained_and_lost(numbers, scenes)}. Small things lie
  close to each other in depth, and each further derivative finds more that fit it. In `{worst}` the three have errors
  of {by_derivatives(numbers, worst)}.
- **No filter wins everywhere.** Least error in scenes: {wins}. {plane_aware(numbers, scenes)}:
  where surfaces are curved, its tolerance of {filters[PLANES]["tolerance"]:g} pixels takes taps away."""


def section(record):
    numbers, config = record["numbers"], record["config"]
    scenes, device = list(config["scenes"]), record["device"]
    return f"""\
One slice of {config["n_steps"]} samples per side and pixel, noise `{config["noise"]}`, errors over
{config["n_frames"]} frames of it. Filters are linear in the image, so the error of a filtered
estimate is the sum of two: what filtering changes of the noise-free image
(*blur*), and what is left of the *noise*; *total* has both. The noise-free image is the mean of {config["n_dense"]}
frames that cover directions and offsets evenly. The *pattern* is the part of the noise that changes from pixel to
pixel, which the eye sees as banding or dither: the noise less its mean over a period of the pattern. All are root mean
squares over the pixels that show a surface.

The bilateral filter is `gtao.SpatialFilter` with its `derivatives`; "planar" has `planar=True`. The edge-aware filter
is `gtao.EdgeAwareFilter`, the plane-aware one `gtao.PlaneAwareFilter`.

## In short

{in_short(numbers, scenes, config)}

## Leaks

Largest change of an image that is 1 on the near side of an edge and 0 on the far one: anywhere, and in pixels
whose centre is more than {config["clear"]} pixels away from the edge. The eaves are a slope up to its edge, and a wall
where the slope would go on to: what a prediction is fooled by.

{leaks(numbers)}

## Total error

{errors(numbers, analytic(numbers), "total")}

{errors(numbers, scenes, "total")}

![Errors of the first frame: grey none, white too bright, black too dark](../references/spatial/errors.png)

## Blur

{errors(numbers, analytic(numbers), "blur")}

{errors(numbers, scenes, "blur")}

## Pattern

{errors(numbers, analytic(numbers), "pattern")}

{errors(numbers, scenes, "pattern")}

## Taps near the horizon

Taps that count, (Σ w)² / Σ w², on the grazing floor: by this the filter divides the variance of white noise.

{horizon(numbers)}

## Cost

CPU time per pixel on one thread ({device["processor"]}), beside the estimate's.

{costs(numbers)}
"""
