"""The table that a comparison of forms returns."""

import math
from dataclasses import asdict, dataclass
from typing import Any

__all__ = ["FormScore", "FormTable"]


@dataclass(frozen=True, kw_only=True)
class FormScore:
    """One row of the table.

    All errors are of V', noise taken out; an RMSE is the root of the mean squared error over scenes (each
    counting the same) and albedos. Fields of the left-out errors are None where leaving a scene out leaves
    nothing to fit.

    Attributes:
        label: What it is.
        form: Key of ``FORM_PARAMETERS``, or "binned_mean".
        n_parameters: Numbers that were fitted.
        coefficients: From all scenes.
        train_rmse: On the scenes that were fitted.
        loso_rmse: Each scene with the fit to the others.
        bias: Mean of fit minus V', each scene with the fit to the others.
        wins: Scenes on which it beats the published coefficients, left out.
        lost: Names of the others; both empty in the row of the published ones.
        rmse_per_scene: Left-out, (scenes,).
        rmse_per_albedo: Left-out, (albedos,).
        difference: Mean over scenes of its left-out RMSE minus that of the published coefficients.
        difference_error: Standard error of that mean: scenes are paired, their spread is the noise.
    """

    label: str
    form: str
    n_parameters: int
    coefficients: tuple[float, ...]
    train_rmse: float
    loso_rmse: float | None = None
    bias: float | None = None
    wins: int = 0
    lost: tuple[str, ...] = ()
    rmse_per_scene: tuple[float, ...] | None = None
    rmse_per_albedo: tuple[float, ...] | None = None
    difference: float | None = None
    difference_error: float | None = None


@dataclass(frozen=True, kw_only=True)
class FormTable:
    """Comparison of forms at one number of bounces.

    Attributes:
        bounces: Surface bounces of the truth; ``inf`` for all.
        albedos: Albedos.
        scenes: Names of the scenes.
        rows: One per form.
    """

    bounces: float
    albedos: tuple[float, ...]
    scenes: tuple[str, ...]
    rows: tuple[FormScore, ...]

    def __getitem__(self, label: str) -> FormScore:
        return next(row for row in self.rows if row.label == label)

    def to_dict(self) -> dict[str, Any]:
        """Plain lists and numbers, ready for a record; ``inf`` bounces become the string "inf"."""
        return asdict(self) | {"bounces": "inf" if math.isinf(self.bounces) else int(self.bounces)}

    def _repr_html_(self) -> str:
        head = ["form", "parameters", "train", "left out", "wins", "difference to published"]
        body = "".join(
            "<tr>" + "".join(f"<td>{cell}</td>" for cell in _cells(row, len(self.scenes))) + "</tr>"
            for row in self.rows
        )
        return f"<table><tr>{''.join(f'<th>{name}</th>' for name in head)}</tr>{body}</table>"


def _cells(row: FormScore, n_scenes: int) -> list[str]:
    if row.loso_rmse is None:
        return [row.label, str(row.n_parameters), f"{row.train_rmse:.4f}", "–", "–", "–"]
    first = [row.label, str(row.n_parameters), f"{row.train_rmse:.4f}", f"{row.loso_rmse:.4f}"]
    if row.difference is None:
        return [*first, "–", "–"]
    error = "" if row.difference_error is None else f" ± {row.difference_error:.4f}"
    return [*first, f"{row.wins} of {n_scenes}", f"{row.difference:+.4f}{error}"]
