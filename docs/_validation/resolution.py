"""Half and quarter resolution, from ``references/resolution``."""

import gtao

from .markdown import table

WAYS = ("bilinear", "nearest depth", "bilateral", "plane-aware")
CHOICES = ("nearest", "farthest", "checkerboard", "first")
PLACES = ("texel", "centre")
THRESHOLDS = {
    "nearest depth": gtao.NearestDepthUpsample().threshold,
    "bilateral": gtao.BilateralUpsample().threshold,
}
PUBLISHED, DEFAULT = "nearest, texel", "checkerboard, centre"
PIPELINES = {
    "dense": "8 slices, 16 steps per side, no noise",
    "1 × 8, filtered": "1 slice, 8 steps per side, plane-aware filter at the small size",
    "recommended": "`gtao.Pipeline.recommended(radius)`, its filter at the small size",
}
SIDES = {"2": "half", "4": "quarter"}


def errors(rows, against):
    """A table of frames and ways; the least of each column and of all in bold."""
    least = min(rows[frame][way][against] for frame in rows for way in WAYS)
    body = []
    for choice in CHOICES:
        for place in PLACES:
            row = [rows[f"{choice}, {place}"][way][against] for way in WAYS]
            body.append([f"{choice}, {place}", *(f"**{v:.4f}**" if v == least else f"{v:.4f}" for v in row)])
    return table(["frame", *WAYS], body)


def every_pipeline(numbers):
    body = []
    for name, about in PIPELINES.items():
        entry = numbers["mean"][name]
        for factor, side in SIDES.items():
            rows = entry["frames"][factor]
            cells = [rows[PUBLISHED]["bilateral"], rows[PUBLISHED]["plane-aware"], rows[DEFAULT]["plane-aware"]]
            body.append(
                [about if factor == "2" else "", side]
                + [f"{c['full']:.4f}" for c in cells]
                + [f"{entry['truth']:.4f}", *(f"{c['truth']:.4f}" for c in cells)]
            )
    ways = ["nearest, bilateral", "nearest, plane-aware", "defaults"]
    head = ["estimate", "side", *(f"{w}" for w in ways), "truth: full size", *(f"truth: {w}" for w in ways)]
    return table(head, body)


def planes(numbers):
    frames = [f"{choice}, {place}" for choice in ("nearest", "checkerboard") for place in PLACES]
    body = [
        [f"{tilt}°", f"{entry['full']:.4f}", *(f"{entry[factor][f]:.4f}" for factor in SIDES for f in frames)]
        for tilt, entry in sorted(numbers["planes"].items(), key=lambda item: float(item[0]))
    ]
    return table(["tilt", "full size", *(f"{side}: {f}" for side in SIDES.values() for f in frames)], body)


def tolerances(numbers):
    tried = numbers["mean"]["dense"]["tried"]
    angles = ("0.25", "0.5", "1", "any")
    lengths = sorted(
        {name.removeprefix("plane-aware ").partition(",")[0] for name in tried["2"] if name.startswith("plane")},
        key=float,
    )
    body = [
        [t, *(f"{tried[factor][f'plane-aware {t}, {a}']:.4f}" for factor in SIDES for a in angles)] for t in lengths
    ]
    return table(["tolerance", *(f"{side}, angle {a}" for side in SIDES.values() for a in angles)], body)


def thresholds(numbers):
    entry = numbers["mean"]["dense"]
    body = []
    for way in ("nearest depth", "bilateral"):
        shares = {f"{THRESHOLDS[way]:g}": None} | {
            n.rpartition(" ")[2]: n for n in entry["tried"]["2"] if n.startswith(way)
        }
        for share in sorted(shares, key=float):
            name = shares[share]
            values = [
                entry["frames"][f][DEFAULT][way]["full"] if name is None else entry["tried"][f][name] for f in SIDES
            ]
            body.append([way, share, *(f"{v:.4f}" for v in values)])
    return table(["", "threshold", *SIDES.values()], body)


def scenes(numbers):
    body = []
    for name, entry in numbers["scenes"].items():
        row = [name]
        for kind in ("dense", "recommended"):
            found = entry[kind]
            row += [f"{found[f]['full']:.3f} ({found[f]['bias']:+.3f})" for f in SIDES]
            row += [f"{found['truth']:.3f}", *(f"{found[f]['truth']:.3f}" for f in SIDES)]
        body.append(row)
    head = ["scene"]
    for kind in ("dense", "recommended"):
        head += [f"{kind}, {s}" for s in SIDES.values()] + [f"truth: {s}" for s in ("full", *SIDES.values())]
    return table(head, body)


def costs(numbers):
    cost = numbers["cost"]
    ms, kernels = cost["ms"], cost["kernels"]
    counts = [name.removeprefix("full, ") for name in ms if name.startswith("full, ")]
    body = [[f"estimate at full size, {c}", f"{ms[f'full, {c}']:.1f}", str(kernels[f"full, {c}"]), ""] for c in counts]
    for factor, side in SIDES.items():
        body.append([f"to a {side}", f"{ms[f'down, {factor}']:.1f}", str(kernels[f"down, {factor}"]), ""])
        for way in WAYS:
            key = f"up, {factor}, {way}"
            body.append([f"back from a {side}, {way}", f"{ms[key]:.1f}", str(kernels[key]), ""])
        for c in counts:
            key = f"all, {factor}, {c}"
            share = f"{ms[key] / ms[f'full, {c}']:.2f}"
            body.append([f"all of it at a {side}, {c}", f"{ms[key]:.1f}", str(kernels[key]), share])
    return table(["", "CPU ms", "kernels", "of the full size"], body)


def verdict(numbers):
    dense = numbers["mean"]["dense"]
    rows = {factor: dense["frames"][factor] for factor in SIDES}
    steep = max(numbers["planes"], key=float)
    saw = numbers["planes"][steep]
    recommended = numbers["mean"]["recommended"]
    ms = numbers["cost"]["ms"]

    def both(frame, way, against="full"):
        return " and ".join(f"{rows[f][frame][way][against]:.4f}" for f in SIDES)

    best = " and ".join(f"{recommended['frames'][f][DEFAULT]['plane-aware']['truth']:.4f}" for f in SIDES)
    nearest = " and ".join(f"{recommended['frames'][f][PUBLISHED]['plane-aware']['truth']:.4f}" for f in SIDES)
    share = " and ".join(f"{100 * ms[f'all, {f}, 3 × 8'] / ms['full, 3 × 8']:.0f} %" for f in SIDES)
    return f"""\
- **The way back matters most.** Against the full-size estimate, at half and quarter sides of the frame, bilinear
  interpolation is off by {both(PUBLISHED, "bilinear")}, the texel nearest in depth by
  {both(PUBLISHED, "nearest depth")}, bilateral weights by {both(PUBLISHED, "bilateral")}, tangent planes by
  {both(PUBLISHED, "plane-aware")}: all from the nearest pixels, as the slides have them.
- **A checkerboard at the centres is the best frame**, with {both(DEFAULT, "plane-aware")}: both sides of every edge are
  among the four texels around a pixel. It needs the centres: with the depths of the pixels themselves it is off by
  {both("checkerboard, texel", "plane-aware")}, and an open plane tilted by {steep}° reads
  {saw["2"]["checkerboard, texel"]:.3f} and {saw["4"]["checkerboard, texel"]:.3f} instead of 1.
- **Against the truth** the recommended pipeline goes from {recommended["truth"]:.4f} at full size to {best}; from the
  nearest pixels to {nearest}.
- **Cost** of three slices of 8 steps with the way there and back, of that at full size: {share}."""


def section(record):
    numbers, config = record["numbers"], record["config"]
    dense = numbers["mean"]["dense"]["frames"]
    width, height = numbers["cost"]["size"]
    return f"""\
An estimate at half the width and height costs a quarter of one at full size. `gtao.downsample` makes the smaller frame
and `gtao.upsample` brings its estimate back, with every channel:

```python
import gtao

g = gtao.render.gbuffer(gtao.render.load_scene("arcade", resolution=64))
small = gtao.downsample(g, gtao.Downsample(factor=2))
ao = gtao.ambient_occlusion(small, gtao.GTAO(radius=1.0, bent_normal=True))
full = gtao.upsample(ao, small, g)
assert full.bent_normal.shape == (*g.shape, 3)
```

Both are differentiable in depth, normals and options, run inside `dr.freeze`, and are one kernel each. What they
compute is derived in [Theory](theory.md#smaller-frames). This page measures every choice on {len(config["scenes"])}
embedded scenes at {config["resolution"]} pixels; truth has {config["spp"]} rays per pixel. Numbers are root mean square
errors over surface pixels, the mean of the scenes. In a frame's name comes first which pixel of a block stands for it,
then whether its depth is that of the pixel ("texel") or was moved along its tangent plane to the block's centre
("centre").

## In short

{verdict(numbers)}

The defaults of `gtao.Downsample` and `gtao.upsample` follow: a checkerboard at the centres, and the plane-aware way
back. What games do is `gtao.Downsample(choice="nearest", place="texel")` with `gtao.BilateralUpsample()`.

![The same small frame, a quarter of the sides, brought back in four ways](../references/resolution/ways.png)

## Every frame and every way back

Dense slices without noise, against the same at full size. At half the sides:

{errors(dense["2"], "full")}

At a quarter:

{errors(dense["4"], "full")}

Against ray-traced truth, of which the full-size estimate misses {numbers["mean"]["dense"]["truth"]:.4f}. Slices take
everything for endlessly thick, so that frames which lose thin things in front may come closer to it by being wrong
twice. At half the sides:

{errors(dense["2"], "truth")}

At a quarter:

{errors(dense["4"], "truth")}

## With noise and filters

Against the full-size result of the same pipeline, and against the truth. "Nearest" is the nearest pixel with its own
depth, and "defaults" the checkerboard at the centres with the plane-aware way back. Noise that the filter leaves is in
all of them, and at full size it is other noise.

{every_pipeline(numbers)}

## Open planes

What should be 1, seen by 32 slices that read depth without error on planes. The nearest pixel of every block lies on
the same side of it, and the plane stays one, half a pixel away. Nearest and farthest in turn make a sawtooth of it.

{planes(numbers)}

## Options

The plane-aware way back of the default frame, dense slices, against the full size. Tolerances are in small pixels,
angles in radians; each halves a weight:

{tolerances(numbers)}

And the ways by depth alone, thresholds as shares of the depth:

{thresholds(numbers)}

## Scene by scene

The defaults against the full-size result of the same pipeline, with the bias in brackets, and the errors of all three
against the truth:

{scenes(numbers)}

## Cost

A frame of {width}×{height}, made anew in every round; least CPU time of one thread. The last column is the whole way,
down, estimate, and up by planes, over the estimate at full size.

{costs(numbers)}
"""
