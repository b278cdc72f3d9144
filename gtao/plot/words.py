"""Sentences about a refit, made from its numbers."""

import math
from typing import Any

__all__ = ["best_form", "clusters_note", "inside", "listed", "noise_note", "number", "tail_note", "verdict"]

#: A mean difference below so many of its standard errors is called no difference.
CLEAR = 2.0


def number(value: float, spec: str = ".4f") -> str:
    """A number with a proper minus sign."""
    return format(value, spec).replace("-", "−")


def listed(names: tuple[str, ...] | list[str]) -> str:
    """Names as a list in a sentence."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def verdict(table: Any, label: str) -> str:
    """Whether the refit beats the published coefficients on scenes that it has not seen, and which scenes it loses."""
    ours, published = table[label], table["published"]
    if ours.loso_rmse is None or published.loso_rmse is None:
        return (
            f"There is no scene to leave out, so these numbers say how the refit does on what it has seen: "
            f"RMSE {ours.train_rmse:.4f}, published {published.train_rmse:.4f}."
        )
    n = len(table.scenes)
    lost = f" It loses on {listed(ours.lost)}." if ours.lost else " It loses on none."
    if abs(ours.difference) <= CLEAR * ours.difference_error:
        clear = "which is no clear difference"
    else:
        clear = "a clear gain" if ours.difference < 0 else "a clear loss"
    pooled = "below" if ours.loso_rmse < published.loso_rmse else "not below"
    return (
        f"Fitted to the other scenes each time, the refit beats the published coefficients on {ours.wins} of {n} "
        f"scenes.{lost} Its pooled left-out RMSE of {ours.loso_rmse:.4f} is {pooled} the published "
        f"{published.loso_rmse:.4f}; per scene the RMSE changes by {number(ours.difference, '+.4f')} ± "
        f"{ours.difference_error:.4f} (standard error), {clear}."
    )


def best_form(table: Any) -> str:
    """Which form has the smallest left-out error."""
    rows = [row for row in table.rows if row.loso_rmse is not None and row.form != "binned_mean"]
    if not rows:
        return ""
    best = min(rows, key=lambda row: row.loso_rmse)
    floor = next((row for row in table.rows if row.form == "binned_mean"), None)
    words = f"Of all forms, “{best.label}” has the smallest left-out RMSE, {best.loso_rmse:.4f}"
    if floor is None:
        return words + "."
    return (
        words + f"; no function of visibility and albedo alone gets much below {floor.train_rmse:.4f} on these scenes."
    )


def clusters_note(result: Any) -> str:
    """What standard errors and intervals cover."""
    if result.fit.intervals is None:
        return "No bootstrap was asked for, so there are no standard errors."
    failed = (
        f" {result.n_failed} draws did not determine the coefficients and were left out." if result.n_failed else ""
    )
    if result.clusters == "scenes":
        return (
            f"Standard errors and intervals come from resampling the {result.n_clusters} scenes: they say how the "
            f"coefficients would move with other scenes of the same kind. With so few they are rough themselves."
            f"{failed}"
        )
    return (
        f"There are too few scenes to resample. Standard errors and intervals come from resampling {result.n_clusters} "
        f"blocks of pixels: they cover noise, not the choice of scenes, and are too narrow for that.{failed}"
    )


def noise_note(result: Any) -> str:
    """What ignoring the noise in visibility would have done."""
    shifts = [a - b for a, b in zip(result.naive, result.fit.coefficients, strict=True)]
    parts = [f"{name} {number(shift, '+.4f')}" for name, shift in zip(result.fit.names, shifts, strict=True)]
    return f"Noise in the visibility is taken out. Ignoring it would have moved the coefficients: {', '.join(parts)}."


def tail_note(result: Any) -> str:
    """How much of infinitely many bounces was extrapolated."""
    if not math.isinf(result.settings.bounces):
        return ""
    largest, scene = max(zip(result.tail, result.scenes, strict=True))
    return (
        f"Bounces beyond the counted ones are a geometric tail. At albedo {max(result.settings.albedos):g} it adds "
        f"{largest:.4f} at most, in {scene}."
    )


def inside(value: float, interval: tuple[float, float] | None) -> str:
    """Whether a number lies in an interval, in a word."""
    if interval is None:
        return "–"
    return "yes" if interval[0] <= value <= interval[1] else "no"
