"""Cost against pixels and against samples."""

import numpy as np
from matplotlib.ticker import NullFormatter

from gtao.plot import style

__all__ = ["growth", "save"]


@style.styled
def growth(numbers):
    """Two panels: time of a frame against its pixels, time per pixel against the steps of one slice.

    Args:
        numbers: of the section ``growth``.
    """
    figure, axes = style.new_figure(1, 2, cell=(4.6, 3.6))
    left, right = axes[0]
    lines = {}
    for point in numbers["pixels"]:
        for name, row in point["rows"].items():
            counts = f"{point['n_slices']}×{point['n_steps']}"
            lines.setdefault(f"{name}, {counts}", []).append((point["pixels"] / 1e6, 1e3 * row["best_s"]))
    _draw(left, lines)
    left.set(title="Frames", xlabel="million pixels", ylabel="ms", xscale="log", yscale="log")
    for axis in (left.xaxis, left.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())
    lines = {}
    for point in numbers["taps"]:
        if point["n_slices"] == 1:
            for name, row in point["rows"].items():
                lines.setdefault(name, []).append((point["n_steps"], 1e9 * row["best_s"] / point["pixels"]))
    _draw(right, lines)
    right.set(title=f"One slice at {numbers['size']}", xlabel="steps per side", ylabel="ns per pixel")
    right.set_ylim(bottom=0)
    return figure


def _draw(axes, lines):
    styles = style.method_styles(lines)
    for name, points in lines.items():
        x, y = np.array(points).T
        axes.plot(x, y, label=name, markersize=4, **styles[name])
    axes.legend(fontsize=7)


def save(figure, path):
    path.write_bytes(style.png_bytes(figure))
