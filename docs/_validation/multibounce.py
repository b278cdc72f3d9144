"""The multi-bounce fit and the forms it was compared with, from ``fits/multibounce``."""

import gtao

from .markdown import table


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


def section(record):
    fit = record["numbers"]
    comparison = fit["comparison"]
    return f"""## The multi-bounce fit

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
