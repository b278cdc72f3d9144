"""Noise patterns and their spectra, and what they leave of the error over frames."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from gtao.errors import ShapeError

from .style import grid_shape, hide_unused, method_styles, new_figure, styled

__all__ = ["noise_errors", "noise_patterns", "noise_spectra"]

#: Powers from a thousandth of that of uncorrelated values, black, to ten times it, white.
_POWERS = (-3.0, 1.0)


@styled
def noise_patterns(tiles: Mapping[str, Any], spectra: Mapping[str, Any], *, shown: int = 32) -> Figure:
    """A corner of each pattern, and below it the power of the whole tile by frequency.

    Args:
        tiles: (size, size) values in [0, 1) by name.
        spectra: :class:`gtao.noise.Spectrum` of the same names; the frequency 0 is in the middle, powers from a
            thousandth (black) to ten times (white) that of uncorrelated noise.
        shown: pixels of the corner along each side.

    Raises:
        ShapeError: There is no pattern, or one without a spectrum.
    """
    if not tiles or set(tiles) - set(spectra):
        raise ShapeError("give at least one tile, and a spectrum for each")
    figure, grid = new_figure(2, len(tiles), cell=(1.9, 1.95))
    for (upper, lower), (name, tile) in zip(grid.T, tiles.items(), strict=True):
        upper.imshow(np.asarray(tile)[:shown, :shown], cmap="gray", vmin=0, vmax=1)
        power = np.log10(np.maximum(spectra[name].power, 10.0 ** _POWERS[0]))
        lower.imshow(power, cmap="gray", vmin=_POWERS[0], vmax=_POWERS[1])
        upper.set_title(name.replace("_", " "), fontsize=8)
        for axis in (upper, lower):
            axis.set(xticks=[], yticks=[])
            axis.grid(False)
    return figure


@styled
def noise_spectra(spectra: Mapping[str, Any], *, title: str = "Power by frequency") -> Figure:
    """Power averaged over directions against frequency; that of uncorrelated noise is 1.

    Args:
        spectra: :class:`gtao.noise.Spectrum`, or anything with its ``frequency`` and ``radial``, by name.
        title: Title.

    Raises:
        ShapeError: There is no spectrum.
    """
    if not spectra:
        raise ShapeError("there is no spectrum to draw; give at least one")
    styles = method_styles(spectra)
    figure, grid = new_figure(1, 1, cell=(7.4, 3.6))
    axis = grid[0, 0]
    for name, found in spectra.items():
        axis.plot(found.frequency, found.radial, label=name, **styles[name] | {"marker": ""})
    axis.set_yscale("log")
    axis.set(xlabel="cycles per pixel", ylabel="power", ylim=(10.0 ** _POWERS[0], 30), xlim=(0, 0.5))
    figure.legend(loc="outside right center")
    figure.suptitle(title, fontweight="bold")
    return figure


@styled
def noise_errors(
    curves: Mapping[str, Mapping[str, Mapping[int, float]]], *, shown: Sequence[str] = (), title: str = ""
) -> Figure:
    """Error against the number of frames in the mean, both logarithmic, a panel for each filter.

    Args:
        curves: Filter -> pattern -> number of frames -> error, positive.
        shown: Patterns to draw, in this order; all if empty.
        title: Title.

    Raises:
        ShapeError: There is no error, or one is not positive.
    """
    names = list(shown) or list(dict.fromkeys(name for rows in curves.values() for name in rows))
    drawn = [rows[name] for rows in curves.values() for name in names if name in rows]
    if not drawn or any(not error > 0 for row in drawn for error in row.values()):
        raise ShapeError("there are no errors to draw, or some are not positive")
    styles, numbers = method_styles(names), sorted({int(n) for row in drawn for n in row})
    rows, columns = grid_shape(len(curves), 3)
    figure, grid = new_figure(rows, columns, cell=(2.9, 2.7), sharey=True, sharex=True)
    for axis, (spatial, by_pattern) in zip(hide_unused(grid, len(curves)), curves.items(), strict=True):
        for name in names:
            points = sorted((int(n), error) for n, error in by_pattern.get(name, {}).items())
            if points:
                axis.plot(*zip(*points, strict=True), **styles[name], markersize=3.5, label=name)
        axis.set(title=spatial, xscale="log", yscale="log", xlabel="frames")
        axis.xaxis.set_major_locator(FixedLocator([n for n in numbers if n & (n - 1) == 0 or n == numbers[-1]]))
        axis.xaxis.set_major_formatter(FuncFormatter(lambda n, _: f"{n:.0f}"))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.tick_params(labelbottom=True)
    for axis in grid[:, 0]:
        axis.set_ylabel("RMS deviation")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    figure.suptitle(title, fontweight="bold")
    return figure
