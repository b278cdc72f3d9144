"""Figures of a multi-bounce refit. They take what :mod:`gtao.fit` returns and compute nothing."""

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, PowerNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gtao.data.multibounce import JIMENEZ2016

from .style import (
    CLOSED_FORM,
    DENSITY,
    MUTED,
    PUBLISHED,
    REFIT,
    albedo_colours,
    grid_shape,
    hide_unused,
    new_figure,
    styled,
)

__all__ = ["bounces_text", "coefficients", "comparison", "coverage", "residuals", "scatter"]

_LINES = {
    "refit": {"color": REFIT, "label": "refit"},
    "published": {"color": PUBLISHED, "label": "published", "linestyle": (0, (5, 2))},
    "closed form": {"color": CLOSED_FORM, "label": "integrating sphere", "linestyle": (0, (1.2, 1.4))},
}


def bounces_text(bounces: float) -> str:
    """Number of bounces in words."""
    return "infinitely many bounces" if math.isinf(bounces) else f"{bounces:g} bounces"


def _unit_axes(axis: Axes) -> None:
    axis.set(xlim=(0, 1), ylim=(0, 1), aspect="equal", xticks=[0, 0.5, 1], yticks=[0, 0.5, 1])


@styled
def scatter(diagnostics: Any) -> Figure:
    """Density of all samples per albedo, with the refit, the published curve and the integrating sphere.

    Args:
        diagnostics: A :class:`gtao.fit.Diagnostics`.

    Returns:
        One panel per albedo: V against V', grey by the share of the pixels.
    """
    n = len(diagnostics.albedos)
    rows, columns = grid_shape(n + 1, 4)
    figure, grid = new_figure(rows, columns, cell=(2.5, 2.6))
    top = float(diagnostics.density.max())
    for axis, albedo, density, r in zip(
        hide_unused(grid, n), diagnostics.albedos, diagnostics.density, range(n), strict=True
    ):
        axis.grid(visible=False)
        shown = np.ma.masked_less_equal(density.T, 0)
        norm = LogNorm(top * 1e-4, top)
        axis.imshow(shown, origin="lower", extent=(0, 1, 0, 1), cmap=DENSITY, norm=norm, aspect="equal")
        axis.plot([0, 1], [0, 1], color=MUTED, linewidth=0.7)
        for name, curve in diagnostics.curves.items():
            axis.plot(diagnostics.visibility, curve[r], **_LINES[name])
        axis.set_title(f"albedo {albedo:g}")
        _unit_axes(axis)
    for axis in grid[-1]:
        axis.set_xlabel("visibility V")
    for axis in grid[:, 0]:
        axis.set_ylabel("multi-bounce visibility V'")
    handles = [Line2D([], [], **line) for line in _LINES.values()]
    handles.append(Line2D([], [], color=MUTED, linewidth=0.7, label="V' = V"))
    grid.flat[n].legend(handles=handles, loc="center left", title="grey: samples, log scale", alignment="left")
    figure.suptitle(f"Samples and curves, {bounces_text(diagnostics.bounces)}", fontweight="bold")
    return figure


@styled
def coefficients(result: Any) -> Figure:
    """Coefficients a, b, c of the cubic of each albedo, and the lines through them.

    Args:
        result: A :class:`gtao.fit.MultibounceResult` of the form ``linear_cubic``.

    Returns:
        One panel per coefficient, with standard errors where the fit has them.
    """
    albedos = np.array(result.settings.albedos)
    span = np.array([0.0, 1.0])
    figure, grid = new_figure(1, 3, cell=(3.2, 3.0))
    ours, published = result.fit.coefficients, JIMENEZ2016.coefficients
    for j, (axis, name) in enumerate(zip(grid[0], "abc", strict=True)):
        axis.plot(span, ours[2 * j] * span + ours[2 * j + 1], **_LINES["refit"])
        axis.plot(span, published[2 * j] * span + published[2 * j + 1], **_LINES["published"])
        errors = None if result.cubic_errors is None else result.cubic_errors[:, j]
        axis.errorbar(
            albedos, result.cubics[:, j], yerr=errors, fmt="o", color=REFIT, markersize=4, capsize=2, linewidth=1,
            markerfacecolor="white", label="cubic of one albedo ± s.e.",
        )  # fmt: skip
        axis.set(xlabel="albedo ρ", xlim=(0, 1))
        axis.set_title(f"{name}(ρ)")
    grid[0, 0].legend(loc="best")
    figure.suptitle(f"Coefficients of ((aV + b)V + c)V, {bounces_text(result.settings.bounces)}", fontweight="bold")
    return figure


@styled
def residuals(diagnostics: Any) -> Figure:
    """Refit minus truth against visibility, one panel per scene, one line per albedo.

    Args:
        diagnostics: A :class:`gtao.fit.Diagnostics`.

    Returns:
        Panels with common axes; bins that hold next to no pixels are left out.
    """
    n = len(diagnostics.scenes)
    rows, columns = grid_shape(n, 4)
    columns = max(columns, 2)  # room for the title
    figure, grid = new_figure(rows, columns, cell=(2.5, 1.9), sharex=True, sharey=True)
    centres = (diagnostics.bins[:-1] + diagnostics.bins[1:]) / 2
    colours = albedo_colours(diagnostics.albedos)
    for axis, name, values in zip(hide_unused(grid, n), diagnostics.scenes, diagnostics.residuals, strict=True):
        axis.axhline(0, color=MUTED, linewidth=0.8)
        for column, colour in zip(values.T, colours, strict=True):
            axis.plot(centres, column, color=colour, linewidth=1.2, marker=".", markersize=2.5)
        axis.set_title(name)
        axis.set_xlim(0, 1)
    for axis in grid[:, 0]:
        axis.set_ylabel("fit − truth")
    for axis in grid[-1]:
        axis.set_xlabel("visibility V")
    handles = [
        Line2D([], [], color=colour, label=f"{albedo:g}")
        for albedo, colour in zip(diagnostics.albedos, colours, strict=True)
    ]
    figure.legend(handles=handles, title="albedo", loc="outside right upper")
    figure.suptitle(
        f"Residual per scene, {bounces_text(diagnostics.bounces)}\n(above 0: too bright)",
        fontweight="bold",
    )
    return figure


@styled
def comparison(diagnostics: Any) -> Figure:
    """The refit and the published curves at every albedo, and their difference.

    Args:
        diagnostics: A :class:`gtao.fit.Diagnostics`.

    Returns:
        Curves on the left, refit minus published on the right.
    """
    figure, grid = new_figure(1, 2, cell=(4.4, 3.9))
    left, right = grid[0]
    V, ours, published = diagnostics.visibility, diagnostics.curves["refit"], diagnostics.curves["published"]
    colours = albedo_colours(diagnostics.albedos)
    for r, (albedo, colour) in enumerate(zip(diagnostics.albedos, colours, strict=True)):
        left.plot(V, ours[r], color=colour)
        left.plot(V, published[r], color=colour, linestyle=(0, (4, 2)), linewidth=1.0)
        right.plot(V, ours[r] - published[r], color=colour, label=f"{albedo:g}")
    _unit_axes(left)
    left.set(xlabel="visibility V", ylabel="multi-bounce visibility V'")
    left.legend(
        handles=[
            Line2D([], [], color=MUTED, label="refit"),
            Line2D([], [], color=MUTED, linestyle=(0, (4, 2)), linewidth=1.0, label="published"),
        ],
        loc="lower right",
    )
    right.axhline(0, color=MUTED, linewidth=0.8)
    right.set(xlabel="visibility V", ylabel="refit − published", xlim=(0, 1))
    right.legend(title="albedo", ncols=2)
    left.set_title("Curves")
    right.set_title("Difference")
    figure.suptitle(f"Refit and published coefficients, {bounces_text(diagnostics.bounces)}", fontweight="bold")
    return figure


@styled
def coverage(diagnostics: Any) -> Figure:
    """Which visibilities the scenes cover: share of the pixels of each scene per bin of V.

    Args:
        diagnostics: A :class:`gtao.fit.Diagnostics`.

    Returns:
        All scenes together above, one row per scene below.
    """
    n = len(diagnostics.scenes)
    figure, grid = new_figure(
        2, 1, cell=(6.6, (1.9 + 0.27 * n) / 2), sharex=True, height_ratios=(1.3, max(0.27 * n, 0.5))
    )
    above, below = grid[:, 0]
    width = float(diagnostics.bins[1] - diagnostics.bins[0])
    above.bar(diagnostics.bins[:-1], 100 * diagnostics.coverage.mean(axis=0), width, align="edge", color=REFIT)
    above.set_ylabel("pixels [%]")
    above.set_title("All scenes, each counting the same")
    below.grid(visible=False)
    image = below.imshow(
        100 * diagnostics.coverage, aspect="auto", extent=(0, 1, n - 0.5, -0.5), cmap=DENSITY, norm=PowerNorm(0.5, 0)
    )
    below.set(yticks=range(n), yticklabels=diagnostics.scenes, xlabel="visibility V", xlim=(0, 1))
    figure.colorbar(image, ax=below, label="pixels [%]", pad=0.02)
    figure.suptitle("Coverage of visibility", fontweight="bold")
    return figure
