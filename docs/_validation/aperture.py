"""The aperture of the reflection cone, fitted anew, from ``fits/aperture``."""

from .markdown import table

#: Variant -> what it is met with.
VARIANTS = {
    "published way": ("traced occlusion", "DSSIM", "cosine"),
    "rmse": ("traced occlusion", "RMSE", "cosine"),
    "uniform": ("traced occlusion", "DSSIM", "uniform"),
    "dense slices": ("traced occlusion, cones from the depth buffer", "DSSIM", "uniform"),
    "cone": ("the same cone under the whole BRDF", "DSSIM", "uniform"),
    "cone, rmse": ("the same cone under the whole BRDF", "RMSE", "uniform"),
}


def section(record):
    """The best u by what it is to meet and how that is judged."""
    rows = []
    for name, (met, metric, weighting) in VARIANTS.items():
        n = record["numbers"][name]
        low, high = n["interval"]
        scores = (n["best"]["score"], n["best"]["published"], *n["rivals"].values())
        rows.append(
            [
                met,
                metric,
                weighting,
                f"{n['best']['u']:.2g}",
                f"{low:.1g} … {high:.1g}",
                *(f"{score:.4f}" for score in scores),
            ]
        )
    config = record["config"]
    rivals = [name.capitalize() for name in record["numbers"]["published way"]["rivals"]]
    head = ["to be met", "by", "weighting", "best u", "95 % interval", "its score", "u = 0.01", *rivals]
    origin = (
        f"Every embedded procedural scene, both cameras, {config['resolution']} pixels, roughness 0.1 to 0.8,"
        f" F0 = 0.04; intervals over scenes. The record is kept beside the script that made it:"
        f" `python {record['command'][1]} -o DIR`."
    )
    return f"{table(head, rows)}\n\n{origin}\n"
