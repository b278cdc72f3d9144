"""Write ``validation.md`` from the records in ``references/`` and ``fits/``: no number on that page is typed.

python docs/generate.py            # rewrites the page
python docs/generate.py --check    # fails when the page is not what the records say
"""

import argparse
import sys
from pathlib import Path

import gtao

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "validation.md"
VALIDATION = ROOT / "references" / "validation" / "record.json"
FITS = ROOT / "fits" / "multibounce"
#: Columns in the order of effort; records sort their keys.
METHODS = ("published settings", "default, 4 × 8", "4 × 8, linear fetch", "dense, 64 × 256")


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def planes(rows):
    variants = [key for key in rows[0] if key != "tilt_degrees"]
    body = [
        [f"{row['tilt_degrees']}°"]
        + [f"{row[v]['mean']:.4f} ({row[v]['low']:.4f} … {row[v]['high']:.4f})" for v in variants]
        for row in rows
    ]
    return table(["tilt", *variants], body)


def marching(rows):
    return table(
        ["height field", "radius", "RMSE", "bias", "noise of the oracle"],
        [[r["field"], str(r["radius"]), f"{r['rmse']:.4f}", f"{r['bias']:+.4f}", f"{r['oracle']:.4f}"] for r in rows],
    )


def truth(rows, methods):
    body = []
    for row in rows:
        errors = [f"{row['errors'][m]['rmse']:.3f} ({row['errors'][m]['bias']:+.3f})" for m in methods]
        noise = f"{row['truth_standard_error']:.4f}"
        body.append([row["scene"], f"{row['radius']:g}", f"{row['mean_visibility']:.3f}", noise, *errors])
    return table(["scene", "radius", "mean", "noise of the truth", *methods], body)


def knowable(rows):
    body = [
        [
            row["scene"],
            "solid" if row["solid"] else "thin",
            f"{row['limit_rmse']:.3f}",
            f"{row['knowable_share']:.0%}",
            f"{row['dense_rmse_where_knowable']:.5f}",
            f"{row['dense_bias_where_knowable']:+.4f}",
        ]
        for row in rows
    ]
    return table(["scene", "", "limit of one layer, RMSE", "share knowable", "dense RMSE there", "bias there"], body)


def normals(rows):
    return table(
        ["scene", "median", "mean", "above 5°"],
        [[r["scene"], f"{r['median']:.3f}°", f"{r['mean']:.2f}°", f"{r['share_above_5_degrees']:.1%}"] for r in rows],
    )


def forms(comparison):
    body = []
    for row in comparison["rows"]:
        left_out = "–" if row["loso_rmse"] is None else f"{row['loso_rmse']:.4f}"
        difference = "–"
        if row["difference"] is not None and row["label"] != "published":
            difference = f"{row['difference']:+.4f} ± {row['difference_error']:.4f}"
        wins = "–" if row["label"] == "published" else f"{row['wins']} of {len(comparison['scenes'])}"
        body.append([row["label"], str(row["n_parameters"]), f"{row['train_rmse']:.4f}", left_out, wins, difference])
    return table(["form", "parameters", "train", "left out", "scenes won", "change per scene"], body)


def coefficients(fit):
    body = []
    for name, value in fit["coefficients"].items():
        low, high = fit["intervals"][name]
        published = gtao.JIMENEZ2016.coefficients[gtao.JIMENEZ2016.names.index(name)]
        error = fit["standard_errors"][name]
        body.append([f"`{name}`", f"{value:.4f}", f"{error:.4f}", f"[{low:.4f}, {high:.4f}]", f"{published:.4f}"])
    return table(["", "value", "standard error", "95 % interval", "published"], body)


def page():
    record = gtao.io.read_record(VALIDATION)
    numbers, config = record["numbers"], record["config"]
    newest = sorted(FITS.glob("*/record.json"))[-1]
    fit = gtao.io.read_record(newest)["numbers"]
    comparison = fit["comparison"]
    return f"""<!-- Written by docs/generate.py from records; do not edit. -->

# Validation

Every number on this page comes from a record that a command replays: the first five sections from
`references/validation/record.json` (`python references/validation/run.py`), the last from
`{newest.relative_to(ROOT).as_posix()}` (`python {newest.parent.relative_to(ROOT).as_posix()}/run.py -o DIR`).

## Open planes

Mean visibility of an unoccluded plane, 16 slices; the true value is 1. Windows are spread over a field of view
of 100 degrees, planes tilted toward several azimuths; in brackets the lowest and the highest window. Reading
the nearest texel darkens tilted planes; the published slice measure is wrong off the optical axis in both
directions.

{planes(numbers["planes"])}

## Against ray marching of the same height field

32 slices and 128 steps per side against exact marching of stratified rays through the same interpolated
surface, without slices or horizons.

{marching(numbers["marching"])}

## Against ray-traced truth

RMSE and bias (estimate minus truth) over all surface pixels of the embedded scenes at {config["resolution"]}
pixels, with the truth traced at {config["spp"]} rays per pixel and the same finite radius. "Noise of the truth"
is the root mean square of its standard error. The published settings (one slice, linear steps, a falloff over
the last quarter of the radius) estimate another quantity than the sharp radius of the truth, with the noise of
one slice, and are not denoised here.

{truth(numbers["scenes"], METHODS)}

## What one depth layer can know

Most of the error above is not the estimator's. The limit of one depth layer is the visibility of the height
field that the depth buffer describes, marched exactly on {config["n_pixels"]} random pixels per scene. Where it
lies within {config["knowable"]} of the ray-traced truth, the depth buffer knows the answer, and there the
estimator has to find it.

{knowable(numbers["scenes"])}

## Normals derived from depth

Angle between normals derived from the depth buffer and the true geometric ones.

{normals(numbers["normals"])}

## The multi-bounce fit

The linear cubic for 4 bounces, fitted to twelve scenes, with f(1) = 1. Standard errors and intervals come from
resampling scenes.

{coefficients(fit["fit"])}

RMSE of every form: on the scenes it was fitted to, and on each scene with coefficients from the others. The
last column is the mean over scenes of the change against the published coefficients, with its standard error.
The last row is the mean of V' given V, which no function of visibility and albedo can undercut by much.

### 4 bounces

{forms(comparison["4"])}

### Infinitely many bounces

{forms(comparison["inf"])}
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="compare only")
    options = parser.parse_args()
    text = page()
    if options.check:
        if not PAGE.exists() or PAGE.read_text() != text:
            sys.exit(f"{PAGE.name} is not what the records say; run python docs/generate.py")
    else:
        gtao.io.write_text(PAGE, text)


if __name__ == "__main__":
    main()
