"""The recommended preset against XeGTAO, from ``fits/occlusion``."""

from .markdown import table

OURS = "recommended"


def views(rows, rival):
    body = []
    for row in rows:
        cells = [f"{row[key]:.4f}" for key in (OURS, rival)]
        body.append([row["view"], *cells, f"{row[OURS] / row[rival] - 1:+.0%}", *equal(row, rival)])
    taps = [key.removeprefix(f"{rival}, ") for key in rows[0] if key.startswith(f"{rival}, ")]
    return table(["view", f"`{OURS}`", f"`{rival}`", "change", *taps], body)


def equal(row, rival):
    """Changes at equal numbers of samples."""
    keys = [key for key in row if key.startswith(f"{rival}, ")]
    return [f"{row[key.replace(rival, OURS)] / row[key] - 1:+.0%}" for key in keys]


def verdict(summary):
    return (
        f"lower on {summary['n_won']} of {summary['n_views']} views, by {1 - summary['ratio_of_means']:.0%} in the mean"
        f" RMSE; the view with the least gain is {summary['worst_view']} ({summary['worst_ratio'] - 1:+.0%})"
    )


def section(record):
    numbers, config = record["numbers"], record["config"]
    rival = config["rival"]
    chosen = ", ".join(f"{name.replace('_', ' ')} {value:g}" for name, value in numbers["chosen"].items())
    text = f"""## The recommended preset

`gtao.Pipeline.recommended(radius)` against `{rival}`, both denoised, both against ray-traced truth, without its noise.
One set of numbers serves all scenes. They were chosen on the embedded ones alone: {chosen}, with lengths in
units of the radius. The last columns compare the two at equal numbers of samples per pixel, XeGTAO's with its three
steps per side, ours with nine.

Embedded scenes, every camera: {verdict(numbers["embedded_summary"])}.

{views(numbers["embedded"], rival)}
"""
    if "held_out" in numbers:
        text += f"""
Scenes that took no part in the choice: {verdict(numbers["held_out_summary"])}.

{views(numbers["held_out"], rival)}
"""
    return text
