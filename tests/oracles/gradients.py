"""Derivatives by differences in float64 NumPy, and whether there is one at all.

A function that takes maxima and reads texels is smooth almost everywhere, and has kinks and jumps. Differences tell the
two apart without knowing any gradient: where a function is smooth, central differences of two widths agree and the gap
between the one-sided ones shrinks with the width. Where they do not, at any width, there is no derivative to compare
with, and what is called resolved here is decided before a gradient is looked at.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

__all__ = ["AGREEMENT", "STEPS", "TOLERANCE", "Derivative", "derivative", "disagreements"]

#: Relative error that a gradient may have.
TOLERANCE = 1e-4
#: Relative disagreement of two differences that are taken for the same: small beside the tolerance.
AGREEMENT = 1e-5
#: Half widths, tried in this order: a narrower one escapes a kink nearby, and has the more rounding.
STEPS = (1e-5, 1e-6, 1e-7)
#: Rounding errors of one evaluation in units of its last place. Offsets between neighbouring points lose two to three
#: of the digits of their positions.
ROUNDING = 64 * np.finfo(float).eps
#: What is left where terms of a gradient cancel, by the same count, terms being up to a hundred.
CANCELLATION = 100 * ROUNDING


@dataclass(frozen=True)
class Derivative:
    """The derivative of every output of a function of one number.

    Attributes:
        value: central differences, extrapolated to width 0; of the last step where nothing is resolved.
        resolved: whether differences agree, so that ``value`` is the derivative.
        noise: error that rounding may have made in it.
        left, right: one-sided differences of the last step that was tried.
    """

    value: np.ndarray
    resolved: np.ndarray
    noise: np.ndarray
    left: np.ndarray
    right: np.ndarray

    def weighted(self, weights: np.ndarray) -> "Derivative":
        """The derivative of the weighted sum of all outputs; resolved if every one is that has any weight."""
        w = np.asarray(weights, float)
        sums = (np.sum(w * v) for v in (self.left, self.right))
        return Derivative(
            np.sum(w * self.value), np.all(self.resolved | (w == 0)), np.sum(np.abs(w) * self.noise), *sums
        )

    def agrees(self, gradient: np.ndarray) -> np.ndarray:
        """Where ``gradient`` is the derivative, up to the tolerance and rounding."""
        return np.abs(gradient - self.value) <= TOLERANCE * np.abs(self.value) + self.noise + CANCELLATION


def derivative(f: Callable[[float], np.ndarray], *, scale: float = 1.0, steps=STEPS, one_sided=False) -> Derivative:
    """The derivative at 0 of a function of one number.

    Args:
        f: from the number to an array.
        scale: by which the half widths are multiplied: the size of the number that is varied.
        steps: half widths, see ``STEPS``.
        one_sided: look at positive numbers only, where f ends at 0.
    """
    centre = np.asarray(f(0.0), float)
    result = None
    for h in (scale * s for s in steps):
        # Second order at 0 from either side, and the same of half the width.
        first, second = (_one_sided if one_sided else _central)(f, centre, h)
        wide, narrow = first[0], second[0]
        value = (4 * narrow - wide) / 3
        varies = (first[3] > 0) | (second[3] > 0)
        noise = np.where(varies, ROUNDING * np.maximum(np.abs(centre), 1.0) / h, 0.0)
        allowed = AGREEMENT * np.abs(value) + noise
        agree = np.abs(wide - narrow) <= allowed
        # The gap between one-sided differences of a smooth function halves with the width.
        agree &= np.abs((second[2] - second[1]) - 0.5 * (first[2] - first[1])) <= allowed
        new = Derivative(value, agree, noise, second[1], second[2])
        result = new if result is None else _filled(result, new)
        if result.resolved.all():
            break
    assert result is not None
    return result


def _filled(old: Derivative, new: Derivative) -> Derivative:
    """``old`` where it is resolved, else ``new``."""
    keep = old.resolved
    return Derivative(*(np.where(keep, getattr(old, n), getattr(new, n)) for n in Derivative.__dataclass_fields__))


def _central(f, centre, h):
    """For half widths h and h/2: the central difference, both one-sided ones, and by how much f varies."""
    for step in (h, h / 2):
        above, below = np.asarray(f(step), float), np.asarray(f(-step), float)
        left, right = (centre - below) / step, (above - centre) / step
        yield 0.5 * (left + right), left, right, np.abs(above - centre) + np.abs(centre - below)


def _one_sided(f, centre, h):
    """The same of a function that ends at 0: the derivative there from the parabola through three points."""
    values = [np.asarray(f(k * h / 2), float) for k in (0.5, 1, 2)]
    for step, near, far in ((h / 2, values[1], values[2]), (h / 4, values[0], values[1])):
        inner, outer = (near - centre) / step, (far - near) / step
        yield 1.5 * inner - 0.5 * outer, inner, outer, np.abs(near - centre) + np.abs(far - near)


def disagreements(gradient: np.ndarray, found: Derivative) -> list[str]:
    """One line for every resolved derivative that ``gradient`` is not."""
    g, value, noise, wrong = np.broadcast_arrays(
        gradient, found.value, found.noise, found.resolved & ~found.agrees(gradient)
    )
    return [
        f"{tuple(map(int, i))} gradient {g[tuple(i)]:.8g}, differences {value[tuple(i)]:.8g} ± {noise[tuple(i)]:.1g}"
        for i in np.argwhere(wrong)
    ]
