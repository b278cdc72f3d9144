"""The production pipeline over time, from ``references/temporal``."""

from .markdown import folded
from .temporal_tables import (
    CYCLE,
    FULL,
    NO_CLAMP,
    PUBLISHED,
    SINGLE,
    at,
    convergence,
    floors,
    ghosts,
    later,
    over_scenes,
    patterns,
    ratio,
    settled,
    stages,
    window_table,
)

CLOSED, OPEN, SMALL = "clamp, closed window", "clamp, open window", "window of small speeds"
NO_SPATIAL, NO_TEMPORAL = "no spatial filter", "no temporal filter"
#: What is promised: the ratio of errors and the bias after a cycle.
RATIO, BIAS = 1.15, 0.002


def within(value, limit):
    return "within" if value < limit else "beyond"


def error(still):
    """Errors after a cycle beside those of single frames, in words."""
    same, full = ({scene: ratio(row, single) for scene, row in still.items()} for single in (SINGLE, FULL))
    worst, worst_full = (max(found, key=found.__getitem__) for found in (same, full))
    singles = still[worst_full]["singles"]
    return f"""\
- **A still image after {CYCLE} frames** errs {min(same.values()):.2f} to {same[worst]:.2f} times (`{worst}`) as much
  against the truth as a single frame of the same half resolution with 96 directions per pixel,
  {within(same[worst], RATIO)} the {RATIO} that such a pipeline has to keep. Beside a single frame of full resolution
  with as many it errs {min(full.values()):.2f} to {full[worst_full]:.2f} times as much (`{worst_full}`),
  {within(full[worst_full], RATIO)} {RATIO}: half resolution alone costs the single frame there a factor of
  {singles[SINGLE]["truth"] / singles[FULL]["truth"]:.2f}. Most of all these errors is that of the depth buffer and of
  eight samples."""


def bias(still):
    """Bias after a cycle, in later ones, and whether it drifts, in words."""
    cycles = [row["cycles"][PUBLISHED] for row in still.values()]
    first = max(abs(at(row["variants"][PUBLISHED]["limit"]["bias"], CYCLE)) for row in still.values())
    worst = max(still, key=lambda scene: abs(later(still[scene])))
    most = abs(later(still[worst]))
    mean = max(abs(found["mean"][-1]) for found in cycles)
    without = max(abs(at(row["variants"][NO_CLAMP]["limit"]["bias"], CYCLE)) for row in still.values())
    lasts = [found["last"] for found in cycles]
    early, rest, end = (
        max(abs(last[b] - last[a]) for last in lasts) for a, b in ((0, 1), (1, len(lasts[0]) - 1), (-2, -1))
    )
    return f"""\
- **Bias** against the same estimator's dense limit is at most {first:.5f} in frame {CYCLE}, {within(first, BIAS)}
  {BIAS}; {most:.5f} (`{worst}`) in the last frames of later cycles, {within(most, BIAS)} it; and {mean:.5f} in the mean
  over the last cycle, {within(mean, BIAS)} it. Without the clamp it is {without:.5f} in frame {CYCLE}. From the first
  cycle to the second the last frame's bias moves by up to {early:.5f}, from there to cycle {len(lasts[0])} by
  {rest:.5f}, and by {end:.0e} in the last of them: it {"settles" if end < early else "drifts"}."""


def verdict(numbers):
    still, moving = numbers["still"], numbers["ghosts"]

    def flickers(name):
        return over_scenes(still, lambda row: row["variants"][name]["flicker"])

    def to_limit(name, k=CYCLE):
        return over_scenes(still, lambda row: at(row["variants"][name]["limit"]["rmse"], k))

    passing = {name: row["ghosting"] for name, row in moving["passing_object"]["pipelines"].items()}
    calm = {name: row["flicker"]["deviation"] for name, row in moving["passing_object"]["pipelines"].items()}
    turning = {name: row["flicker"]["step"] for name, row in moving["fast_rotation"]["pipelines"].items()}
    return f"""\
{error(still)}
{bias(still)}
- **The 4×4 filter** makes most of what is left of the RMSE to that limit: {to_limit(PUBLISHED):.3f} in the mean
  over the scenes, and {to_limit(NO_SPATIAL):.3f} without it, after {CYCLE} frames. In one frame it takes
  {to_limit(NO_SPATIAL, 1):.3f} down to {to_limit(PUBLISHED, 1):.3f}.
- **The temporal filter** takes the flicker of {flickers(NO_TEMPORAL):.3f} down to {flickers(PUBLISHED):.4f}, and
  without the clamp to {flickers(NO_CLAMP):.4f}: a history that is clamped to the neighbourhood of each noisy frame
  keeps part of that noise.
- **Ghosts** of an object that passes over a still floor: the history lags by {passing[NO_CLAMP]["lag"]:.4f} in the
  trail without the clamp and by {passing[PUBLISHED]["lag"]:.4f} with it; the error energy falls from
  {passing[NO_CLAMP]["energy"]:.5f} to {passing[PUBLISHED]["energy"]:.5f}. A noisy neighbourhood spoils the clamp, as
  the slides say: without the spatial filter the lag is {passing[NO_SPATIAL]["lag"]:.4f}.
- **The window** trades ghosts for flicker: closed, the lag is {passing[CLOSED]["lag"]:.4f} and the flicker
  {calm[CLOSED]:.4f}; open everywhere {passing[OPEN]["lag"]:.4f} and {calm[OPEN]:.4f}; opened by velocity
  {passing[PUBLISHED]["lag"]:.4f} and {calm[PUBLISHED]:.4f}. The floor under a passing object does not move, before or
  after: velocities tell of disocclusions, and nothing of shadows that pass.
- **A camera that turns fast** makes velocities differ at the sides of the image where nothing is wrong. With a weight
  that sees it ("{SMALL}"), the image changes by {turning[SMALL]:.3f} from frame to frame along the motion, against
  {turning[OPEN]:.3f} with the window open, {turning[CLOSED]:.3f} with it closed and {turning[NO_TEMPORAL]:.3f} without
  a history: clamping where velocities differ, and not rejecting, keeps most of what the filter is good for."""


def section(record):
    numbers, config = record["numbers"], record["config"]
    still, moving = numbers["still"], numbers["ghosts"]
    size, n_cycles = config["ghosts"], config["still"]["cycles"]
    parts = "\n\n".join(
        folded(f"`{name}`", ghosts(entry)) if name != "passing_object" else f"`{name}`:\n\n{ghosts(entry)}"
        for name, entry in sorted(moving.items(), key=lambda item: item[0] != "passing_object")
    )
    cut = "\n".join(f"- `{name}`: {convergence(entry)}." for name, entry in moving.items() if entry["cut"] is not None)
    return f"""\
`gtao.Pipeline.as_published()` is what Jimenez et al. (2016) describe: half resolution, one direction of eight samples
per pixel, a 4×4 bilateral filter, and exponential accumulation over the frames of a cycle of {CYCLE}. Here it is taken
apart. Errors are root mean squares over the pixels that show a surface, without the noise of the rays of the truth
(`gtao.evaluate.corrected_rmse`). Flicker, ghosting and settling are those of `gtao.evaluate.flicker`,
`gtao.evaluate.ghosting` and `gtao.evaluate.convergence_frames`.

## In short

{verdict(numbers)}

## A camera at rest

Scenes at {config["still"]["resolution"]} pixels. "96 directions" is a single frame with as many per pixel, at half
resolution, as it is and through the same spatial filter; the first ratio is that of {CYCLE} frames to the former.
"Full resolution" is such a single frame without smaller frames in between, unfiltered, and the second ratio that to
it. The "limit" is what the estimator with the very same eight samples and four offsets is the mean of, over 96
directions, brought back to full size in the same way: it has neither noise nor filter. "Bias" is against it in frame
{CYCLE}, "later" the largest in the last frames of the cycles after that, "mean bias" the mean over the last of
{n_cycles} cycles, and "drift" what the bias of a cycle's last frame changes by from the first cycle to the last.

{settled(still)}

![RMSE to the dense limit over the number of frames](../references/temporal/settling-limit.png)

![RMSE to ray-traced truth over the number of frames](../references/temporal/settling-truth.png)

### What each stage buys

Means over the scenes, of magnitudes for the bias; every pipeline against the limit of its own samples,
resolution and upsampling.

{stages(still)}

### What frames cannot mend

Against the truth, the limit itself errs by what one layer of depth knows and eight samples miss. "128 samples" per
side in each direction, which four spatial and four temporal offsets are said to stand for, see occluders that eight
step over: a mean of estimates from few samples is not the estimate from all of them, for a horizon is a maximum.
Offsets of 0, ¼, ½ and ¾ have a mean of ⅜ and draw samples nearer than even ones. "Filters" is the RMSE of the limit
behind the spatial filter.

{floors(still)}

## Noise

The published pipeline with every pattern, means over the scenes, against the limit with even offsets.

{patterns(numbers["patterns"])}

![RMSE to the dense limit over the number of frames, by noise pattern](../references/temporal/patterns.png)

## Ghosts

Embedded animations of {size["frames"]} frames at {size["width"]} × {size["height"]} pixels with {size["spp"]} rays per
pixel and frame. A trail is where the truth has changed within the last {size["trail"]} frames. "Energy" is the mean
squared error in the trail beyond that of the same pipeline with many directions and no past, "elsewhere" the same
outside of it; "lag" is by how much visibility hangs back there, "behind" the mean difference where occlusion has gone,
"ahead" where it has come. "Flicker" is the deviation of pixels at rest outside of trails, "step" the change from frame
to frame along the motion. "Window of small speeds" has the velocity weight fall to 0 at a quarter of a pixel per frame
instead of four.

{parts}

![RMSE of every frame](../references/temporal/moving.png)

Frames after the cut until the image stays within 10 % of its settled distance from the estimate without a past:

{cut}

### The width of the window

The clamp lets history lie beyond the range of the neighbourhood by so many of its widths; here the window is open
everywhere.

{window_table(numbers["windows"])}

![Lag in the trail and flicker over the width of the window](../references/temporal/windows.png)
"""
