"""What noise patterns leave of an estimate's error, from ``references/noise``."""

from .markdown import folded
from .noise_tables import (
    BARE,
    BLUE,
    FILTERS,
    FINE,
    GOLDEN,
    GRADIENT,
    PLANE,
    PRINTED,
    PUBLISHED,
    SPATIAL,
    SPREAD,
    WHITE,
    against_limit,
    by_frames,
    by_slices,
    counted,
    deviation,
    low,
    moved,
    overview,
    sigmas,
)


def bests(numbers, n):
    """The two best patterns with each filter; without one, a single frame has no best."""
    parts = []
    for spatial in FILTERS[n == 1 :]:
        rows = numbers["patterns"][spatial]
        names = sorted(rows, key=lambda name: deviation(rows, name, n))[:2]
        parts.append(f"{spatial}: {' and '.join(f'`{name}` ({deviation(rows, name, n):.4f})' for name in names)}")
    return ";\n  ".join(parts)


def gain(numbers, spatial, n, name):
    """How many times smaller than with white noise."""
    rows = numbers["patterns"][spatial]
    return deviation(rows, WHITE, n) / deviation(rows, name, n)


def gains(numbers, n, name):
    found = [gain(numbers, spatial, n, name) for spatial in FILTERS if spatial != BARE]
    return f"{min(found):.1f} to {max(found):.1f}"


def bias(numbers):
    """Largest bias after 24 frames without a filter, of the patterns that do move."""
    rows = numbers["patterns"][BARE]
    return max((abs(rows[name]["24"]["bias"]), name) for name in rows if name not in ("none", FINE))


def verdict(numbers):
    spatial, plain = numbers["patterns"][SPATIAL], numbers["patterns"][BARE]
    size, name = bias(numbers)
    return f"""\
- **One frame.** Without a filter all patterns are as noisy as `white`, {deviation(plain, WHITE, 1):.3f}: there is one
  direction per pixel. The best two by filter:
  {bests(numbers, 1)}. `{GRADIENT}` is {gains(numbers, 1, GRADIENT)}
  times nearer than `white`, `{BLUE}` {gains(numbers, 1, BLUE)}, `{PUBLISHED}` {gains(numbers, 1, PUBLISHED)} times.
- **24 frames.** The best two by filter: {bests(numbers, 24)}.
  `{GOLDEN}` is {gains(numbers, 24, GOLDEN)} times nearer than
  `white`, `{BLUE}` {gains(numbers, 24, BLUE)}, `{PUBLISHED}` {gains(numbers, 24, PUBLISHED)} times. Both move by the
  golden ratio: how a pattern moves decides about many frames, how it lies in space about few.
- **The slides' filter and their rotations.** The 4×4 filter changes sides from frame to frame. Frames of one parity
  have rotations of one half of the turn, so that either side of the filter knows half of the directions: 24 frames
  leave {deviation(spatial, PUBLISHED, 24):.4f}, after {deviation(spatial, PUBLISHED, 6):.4f} for 6. The same sixths in
  another order, `{SPREAD}`, leave {deviation(spatial, SPREAD, 24):.4f}; `{GOLDEN}`
  {deviation(spatial, GOLDEN, 24):.4f}. Without a filter the order matters little after whole cycles:
  {deviation(plain, PUBLISHED, 24):.4f} and {deviation(plain, SPREAD, 24):.4f}.
- **96 directions** as the smallest change of the tables gives them, `{FINE}`, need the filter for everything: after 24
  frames {deviation(plain, FINE, 24):.3f} without it and {deviation(spatial, FINE, 24):.4f} with it, for a single pixel
  only ever turns by a sixteenth. More directions are not what is missing: `{SPREAD}` has as many.
- **The formula as printed** has 4 directions in space instead of 16, and leaves {deviation(spatial, PRINTED, 1):.4f}
  instead of {deviation(spatial, PUBLISHED, 1):.4f} in one frame with the 4×4 filter,
  {deviation(spatial, PRINTED, 24):.4f} instead of {deviation(spatial, PUBLISHED, 24):.4f} after 24.
- **Bias.** The mean of a pattern that is no random number need not be that of all directions. After 24 frames the
  largest is that of `{name}`, {size:.4f}."""


def section(record):
    numbers, config = record["numbers"], record["config"]
    return f"""\
One slice per pixel and {config["n_steps"]} steps per side, on {len(config["scenes"])} embedded scenes at
{config["resolution"]} pixels. The truth here is the estimator's own dense limit: the mean over all rotations and
offsets with the same number of steps, `gtao.noise.dense_limit`, itself known to {numbers["limit_uncertainty"]:.4f}.
What is compared is therefore noise alone; what dense slices miss of the scene is another matter
([](validation.md)). "Deviation" is the root mean square distance of the mean over frames from the limit, both
filtered alike, over all stretches of so many frames in a cycle of 24; scenes count the same. It is what more frames
would take away. The camera stands still.

`gtao.noise.variance` measures this for any frame, method and filter.

## In short

{verdict(numbers)}

![Deviation against frames, by filter](../references/noise/errors.png)

## A single frame

{overview(numbers, 1)}

## The mean of 24 frames

{overview(numbers, 24)}

{folded("By the number of frames, without a filter", by_frames(numbers, BARE))}

{folded("By the number of frames, with the 4×4 filter", by_frames(numbers, SPATIAL))}

{folded("By the number of frames, with the plane-aware filter", by_frames(numbers, PLANE))}

Filters blur: the distance from the limit that is not filtered has a part that no number of frames takes away, and says
how much a filter costs where there is nothing to gain.

{folded("RMSE against the limit without a filter", against_limit(numbers))}

## More slices

Slices of a pixel are evenly spaced whatever the noise, so that two do more than two frames.

{folded("One frame, 4×4 filter", by_slices(numbers, SPATIAL, 1))}

{folded("Six frames, 4×4 filter", by_slices(numbers, SPATIAL, 6))}

## Directions and positions

Over a cycle of 24 frames, of slices as lines and of {config["n_steps"]} samples per side. The last column is the widest
part of the half turn that a single pixel never looks into.

{counted(numbers)}

## Where the noise lies

Rotations of one frame, and the power of exp(2πi ξ) by frequency, in the mean over 24 frames; black is a thousandth of
that of uncorrelated noise. A filter takes away what lies far from the middle. A pattern of 4×4 pixels has all its power
on multiples of a quarter, which a footprint of four pixels takes away whole, and one that is cut by an edge does not.

![Patterns and their spectra](../references/noise/patterns.png)

![Power against frequency](../references/noise/spectra.png)

Below an eighth of the sampling frequency lies, of what uncorrelated noise has there, {low(numbers, "0.125")}; below a
quarter {low(numbers, "0.25")}.

## How a mask should move

{moved(numbers)}

A still mask gains nothing by time. Moving it across the image, or taking another one, makes the numbers of a single
pixel random. Moving all values alike keeps differences between pixels, and gives every pixel the multiples of the
golden ratio.

The mask is made by `gtao.noise.blue_noise_mask()`, in the package by `python references/noise/run.py --mask`. Below an
eighth, a quarter and three eighths of the sampling frequency it has, for a standard deviation σ of the Gaussian,

{sigmas(numbers)}

of the power of uncorrelated values; σ = 1.5 is Ulichney's.
"""
