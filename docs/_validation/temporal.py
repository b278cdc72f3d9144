"""The production pipeline over time, from ``references/temporal``."""

from .markdown import folded, table

PUBLISHED, SINGLE, CLOSED, OPEN = "published", "half resolution", "clamp, closed window", "clamp, open window"
NO_CLAMP, NO_SPATIAL, NO_TEMPORAL = "no clamp", "no spatial filter", "no temporal filter"
SMALL = "window of small speeds"
CYCLE = 24
#: What is promised: the ratio of errors and the bias after a cycle.
RATIO, BIAS = 1.15, 0.002


def mean(values):
    values = list(values)
    return sum(values) / len(values)


def at(curve, k):
    """Value of a curve after k frames."""
    return curve[str(k)]


def within(value, limit):
    return "within" if value <= limit else "beyond"


def ratio(row):
    """Error after a cycle over that of a single frame with 96 directions."""
    return at(row["variants"][PUBLISHED]["truth"], CYCLE) / row["singles"][SINGLE]["truth"]


def over_scenes(rows, pick):
    return mean(pick(row) for row in rows.values())


def settled(still):
    """Every scene: how errors fall, and what is left."""
    body = []
    for scene, row in still.items():
        ours, limit = row["variants"][PUBLISHED], row["variants"][PUBLISHED]["limit"]
        cycles = row["cycles"][PUBLISHED]
        body.append(
            [
                scene,
                *(f"{at(ours['truth'], k):.4f}" for k in (1, 6, CYCLE)),
                f"{row['singles'][SINGLE]['truth']:.4f}",
                f"{row['singles'][SINGLE + ', filtered']['truth']:.4f}",
                f"{ratio(row):.3f}",
                f"{at(limit['rmse'], 1):.4f}",
                f"{at(limit['rmse'], CYCLE):.4f}",
                f"{at(limit['bias'], CYCLE):+.4f}",
                f"{cycles['mean'][-1]:+.4f}",
                f"{cycles['last'][-1] - cycles['last'][0]:+.5f}",
            ]
        )
    head = ["scene", "1 frame", "6", "24", "96 directions", "filtered", "ratio", "limit: 1 frame", "24"]
    return table([*head, "bias", "mean bias", "drift"], body)


def stages(still):
    """What every stage buys, means over the scenes."""
    names = list(next(iter(still.values()))["variants"])
    body = []
    for name in [PUBLISHED, *(n for n in names if n != PUBLISHED)]:
        rows = [row["variants"][name] for row in still.values()]
        body.append(
            [
                name,
                *(f"{mean(at(r['truth'], k) for r in rows):.4f}" for k in (1, CYCLE)),
                *(f"{mean(at(r['limit']['rmse'], k) for r in rows):.4f}" for k in (1, CYCLE)),
                f"{mean(abs(at(r['limit']['bias'], CYCLE)) for r in rows):.4f}",
                f"{mean(r['flicker'] for r in rows):.4f}",
            ]
        )
    head = ["pipeline", "to truth: 1 frame", "24 frames", "to its limit: 1 frame", "24 frames", "bias", "flicker"]
    return table(head, body)


def floors(still):
    """Errors that no number of frames takes away."""
    body = []
    for scene, row in still.items():
        limits, filtered = row["limits"], row["filtered limit"]
        body.append(
            [
                scene,
                f"{limits['limit']['truth']:.4f}",
                f"{limits['limit']['bias to truth']:+.4f}",
                f"{limits['all samples']['truth']:.4f}",
                f"{limits['all samples']['bias to limit']:+.4f}",
                f"{limits['jittered']['bias to limit']:+.4f}",
                f"{filtered['limit']:.4f}",
                f"{filtered['bias']:+.4f}",
            ]
        )
    head = ["scene", "limit to truth", "bias to truth", "128 samples to truth", "128 samples", "even offsets"]
    return table([*head, "filters", "bias of filters"], body)


def patterns(numbers):
    """Noise patterns, means over the scenes."""
    first = next(iter(numbers.values()))
    body = []
    for name in first[NO_CLAMP]:
        cells = [f"`{name}`"]
        for clamp in ("clamp", NO_CLAMP):
            rows = [by_clamp[clamp][name] for by_clamp in numbers.values()]
            cells += [f"{mean(at(r['jittered']['rmse'], k) for r in rows):.4f}" for k in (1, 6, CYCLE)]
            cells.append(f"{mean(r['flicker'] for r in rows):.4f}")
        body.append(cells)
    head = ["pattern", "1 frame", "6", "24", "flicker", "no clamp: 1 frame", "6", "24", "flicker"]
    return table(head, body)


def number(value, form):
    return "–" if value is None else format(value, form)


def ghosts(entry):
    """One animation: every pipeline."""
    body = []
    for name, row in entry["pipelines"].items():
        ghost, flicker = row["ghosting"], row["flicker"]
        cells = [name, number(ghost["energy"], "+.5f"), number(ghost["elsewhere"], "+.5f")]
        cells += [number(ghost[key], "+.4f") for key in ("lag", "behind", "ahead")]
        cells += [number(flicker[key], ".4f") for key in ("deviation", "step")]
        cells.append(f"{mean(row['rmse']):.4f}")
        body.append(cells)
    head = ["pipeline", "energy", "elsewhere", "lag", "behind", "ahead", "flicker", "step", "RMSE"]
    return table(head, body)


def window_table(numbers):
    widths = sorted(next(iter(numbers.values())), key=float)
    body = []
    for width in widths:
        cells = [width]
        for row in numbers.values():
            ghost, flicker = row[width]["ghosting"], row[width]["flicker"]
            cells += [f"{ghost['energy']:+.5f}", f"{ghost['lag']:+.4f}", f"{flicker['deviation']:.4f}"]
        body.append(cells)
    head = ["window", *(f"{name}: {what}" for name in numbers for what in ("energy", "lag", "flicker"))]
    return table(head, body)


def convergence(entry):
    found = {name: row.get("convergence") for name, row in entry["pipelines"].items()}
    return ", ".join(f"{'never' if n is None else n} ({name})" for name, n in found.items())


def verdict(numbers):
    still, moving = numbers["still"], numbers["ghosts"]
    ratios = {scene: ratio(row) for scene, row in still.items()}
    worst = max(ratios, key=ratios.__getitem__)
    biases = {scene: at(row["variants"][PUBLISHED]["limit"]["bias"], CYCLE) for scene, row in still.items()}
    means = {scene: row["cycles"][PUBLISHED]["mean"][-1] for scene, row in still.items()}
    most, mean_most = (max(map(abs, values.values())) for values in (biases, means))
    without = max(abs(at(row["variants"][NO_CLAMP]["limit"]["bias"], CYCLE)) for row in still.values())
    cycles = max(
        abs(row["cycles"][PUBLISHED]["last"][-1] - row["cycles"][PUBLISHED]["last"][1]) for row in still.values()
    )
    n_cycles = len(next(iter(still.values()))["cycles"][PUBLISHED]["last"])

    def flickers(name):
        return over_scenes(still, lambda row: row["variants"][name]["flicker"])

    def to_limit(name, k=CYCLE):
        return over_scenes(still, lambda row: at(row["variants"][name]["limit"]["rmse"], k))

    passing = {name: row["ghosting"] for name, row in moving["passing_object"]["pipelines"].items()}
    calm = {name: row["flicker"]["deviation"] for name, row in moving["passing_object"]["pipelines"].items()}
    turning = {name: row["flicker"]["step"] for name, row in moving["fast_rotation"]["pipelines"].items()}
    return f"""\
- **A still image after {CYCLE} frames** errs {min(ratios.values()):.2f} to {ratios[worst]:.2f} times (`{worst}`) as
  much against the truth as a single half-resolution frame with 96 directions per pixel, {within(ratios[worst], RATIO)}
  the {RATIO} that such a pipeline has to keep. Most of either error is that of the depth buffer and of eight samples.
- **Bias** against the same estimator's dense limit is at most {most:.4f} in frame {CYCLE} and {mean_most:.4f} in the
  mean over a cycle, {within(most, BIAS)} {BIAS}; without the clamp {without:.4f}. From the second cycle to cycle
  {n_cycles}, it moves by {cycles:.5f} at most: nothing drifts.
- **The 4×4 filter** is what is left of the error to that limit: {to_limit(PUBLISHED):.3f} in the mean, and
  {to_limit(NO_SPATIAL):.3f} without it, after {CYCLE} frames. In one frame it takes {to_limit(NO_SPATIAL, 1):.3f} down
  to {to_limit(PUBLISHED, 1):.3f}.
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
    size = config["ghosts"]
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
resolution, as it is and through the same spatial filter; the ratio is that of 24 frames to the former. The "limit" is
what the estimator with the very same eight samples and four offsets is the mean of, over 96 directions, brought back
to full size in the same way: it has neither noise nor filter. Bias is against it in frame {CYCLE} and in the mean over
the last of {len(next(iter(still.values()))["cycles"][PUBLISHED]["last"])} cycles; drift is what the first changes by
from the first cycle to the last.

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
