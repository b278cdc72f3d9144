"""The faithful estimator against its oracles, from ``references/validation``."""

from .markdown import table

#: Columns in the order of effort; records sort their keys.
METHODS = ("published settings", "default, 4 × 8", "4 × 8, linear fetch", "dense, 64 × 256")


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


def directions(rows):
    methods = [("default, 4 × 8", "default"), ("dense, 64 × 256", "dense"), ("average of the horizons", "average")]
    head = ["scene"]
    for against in ("height field", "scene"):
        head += [f"{short}: {against}" for _, short in methods]
    head += ["noise of the marched rays", "harmonics, dense: height field", "scene"]
    body = []
    for row in rows:
        angles = [f"{row['errors'][a][m]['degrees']:.2f}°" for a in ("height field", "scene") for m, _ in methods]
        errors = [f"{row['errors'][a][METHODS[-1]]['harmonics']:.3f}" for a in ("height field", "scene")]
        body.append([row["scene"], *angles, f"{row['noise_degrees']:.2f}°", *errors])
    return table(head, body)


def section(record):
    numbers, config = record["numbers"], record["config"]
    directed = config["directions"]
    return f"""## Open planes

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

## Bent normals and harmonics

Mean angle between estimated bent normals and those of {directed["n_rays"]} rays per pixel, over the pixels that see
more than {directed["visible"]} of the hemisphere, at {directed["resolution"]} pixels and the same finite radius: rays
that march over the same height field, and rays through the scene, which know what one depth layer does not. "Average"
takes the directions halfway between the horizons of the dense estimate, as the slides of 2016 do. The last columns
are the RMSE of all nine harmonics over their root mean square. What separates the dense estimate from the same height
field is, beside the noise of the rays, depth edges: its search begins a pixel away, and the first cell beyond an edge
is often nearer. On smooth height fields, tests hold the mean angle below half a degree.

{directions(numbers["directions"])}

## Normals derived from depth

Angle between normals derived from the depth buffer and the true geometric ones.

{normals(numbers["normals"])}
"""
