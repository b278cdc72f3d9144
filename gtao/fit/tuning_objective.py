"""What tuning minimises: the mean squared error of the estimates of all views against their truth, and its gradient."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

import drjit as dr
import numpy as np

from gtao.config import Pipeline
from gtao.errors import ConfigError, FitError
from gtao.estimators import ambient_occlusion
from gtao.gbuffer import GBuffer

from .tuning_options import with_continuous, with_options
from .tuning_problem import Problem
from .tuning_space import Space

__all__ = ["Objective", "mean_squares", "unfiltered"]

#: Half width of differences in coordinates: few samples move by more than a texel, and enough of them cross into
#: another one for the jumps to average out.
STEP = 0.02

#: Options that kernels are made for, unless they are Dr.Jit floats; with gradients those that others are computed with
#: are, too.
COMPILED = {"step_exponent"}

#: A derivative that misses the difference by more than this share does not see the jumps between texels; what the loss
#: bends over the width makes up a few percent of smooth options.
CHECK_TOLERANCE = 0.1


def unfiltered(method: Any) -> Any:
    """A pipeline without its spatial filter; whatever else as it is."""
    return replace(method, spatial=None) if isinstance(method, Pipeline) else method


def _visibility(g: GBuffer, method: Any, frame_index: int) -> Any:
    if isinstance(method, Pipeline):
        return method.step(g, frame_index=frame_index).visibility.array
    return ambient_occlusion(g, method, frame_index=frame_index).visibility.array


class _Targets:
    """Truths and weights of pixels on the device."""

    def __init__(self, problems: Sequence[Problem], frames: Sequence[int]):
        self.problems, self.frames = tuple(problems), tuple(frames)
        self._truth, self._share = [], []
        for problem in self.problems:
            T, surface = problem.g.types, problem.g.mask.numpy().astype(bool)
            share = surface / (surface.sum() * len(self.frames))
            for store, image in ((self._truth, problem.truth), (self._share, share)):
                store.append(dr.opaque(T.Float(image.ravel())))

    def errors(self, methods: Iterable[Any]) -> list[Any]:
        """Per view its mean squared error in double precision, Dr.Jit floats of width 1."""
        squares = []
        for problem, method, truth, share in zip(self.problems, methods, self._truth, self._share, strict=True):
            total: Any = 0.0
            for frame in self.frames:
                e = _visibility(problem.g, method, frame) - truth
                total = total + share * e * e
            squares.append(dr.float64_array_t(type(total))(total))
        # All views in one evaluation, whose kernels run side by side.
        dr.eval(squares)
        return [dr.sum(s) for s in squares]


def mean_squares(problems: Sequence[Problem], at: Callable[[float | None], Any], frames: Sequence[int]) -> np.ndarray:
    """Mean squared error of every view, (views,), over surface pixels and noise frames.

    Args:
        problems: the views.
        at: radius of a view -> configuration.
        frames: frame indices of the noise.
    """
    return _numbers(_Targets(problems, frames).errors([at(p.radius) for p in problems]))


def _numbers(errors: list[Any]) -> np.ndarray:
    dr.eval(errors)
    values = np.array([float(e[0]) for e in errors])
    if not np.isfinite(values).all():
        raise FitError("the estimate is not finite; check depth, normals and the method")
    return values


class Objective:
    """Mean squared error as a function of coordinates, counting its evaluations.

    Args:
        problems: views; their loss is the mean weighted by their weights.
        space: what is tuned.
        frames: frame indices of the noise.

    Attributes:
        n_evaluations: of the loss so far, with or without a gradient.
    """

    def __init__(self, problems: Sequence[Problem], space: Space, frames: Sequence[int] = (0,)):
        self.space = space
        self.problems = tuple(problems)
        weights = np.array([p.weight for p in self.problems])
        self._shares = weights / weights.sum()
        self._targets = _Targets(self.problems, frames)
        self._Float = self.problems[0].g.types.Float
        self._radii = tuple(dict.fromkeys(p.radius for p in self.problems))
        self._bases = {radius: with_continuous(space.method, {}, radius) for radius in self._radii}
        n = len(space.parameters)
        self._moved = {path for i in range(n) for path in space.derivatives(space.start, i, self._radii[0])}
        self.n_evaluations = 0

    def losses(self, coordinates: np.ndarray) -> np.ndarray:
        """Mean squared error of every view, (views,)."""
        self.n_evaluations += 1
        return _numbers(self._targets.errors(self._methods(self._inputs(coordinates, self._moved & COMPILED))))

    def loss(self, coordinates: np.ndarray) -> float:
        """Weighted mean of :meth:`losses`."""
        return float(self._shares @ self.losses(coordinates))

    def loss_and_gradient(self, coordinates: np.ndarray, attached: Sequence[int]) -> tuple[float, np.ndarray]:
        """The loss and its derivatives by some coordinates, by reverse-mode differentiation.

        Args:
            coordinates: (parameters,).
            attached: which of them, by number.

        Returns:
            The loss and the derivatives, (len(attached),).

        Raises:
            ConfigError: the estimator has no derivative by one of them.
        """
        self.n_evaluations += 1
        chain = {radius: [self.space.derivatives(coordinates, i, radius) for i in attached] for radius in self._radii}
        inputs = self._inputs(coordinates, self._moved)
        leaves = {
            (radius, path): inputs[radius][path] for radius, rows in chain.items() for row in rows for path in row
        }
        dr.enable_grad(leaves)
        errors = self._targets.errors(self._methods(inputs))
        total = sum(error * share for error, share in zip(errors, self._shares, strict=True))
        if not dr.grad_enabled(total):
            raise ConfigError("the estimate does not depend on what is attached")
        dr.backward(total)
        slopes = {key: float(dr.grad(leaf)[0]) for key, leaf in leaves.items()}
        gradient = np.zeros(len(attached))
        for radius, rows in chain.items():
            gradient += [sum(slopes[radius, path] * d for path, d in row.items()) for row in rows]
        return float(self._shares @ _numbers([dr.detach(e) for e in errors])), gradient

    def _inputs(self, coordinates: np.ndarray, as_inputs: set[str]) -> dict[float | None, dict[str, Any]]:
        """The options that coordinates move, by radius and path, some of them as Dr.Jit floats.

        As numbers they would become part of kernels, which every evaluation would compile anew.
        """
        found: dict[float | None, dict[str, Any]] = {}
        for radius in self._radii:
            options = self.space.options(coordinates, radius)
            found[radius] = {
                path: dr.opaque(self._Float, options[path]) if path in as_inputs else options[path]
                for path in self._moved
            }
        return found

    def _methods(self, options: dict[float | None, dict[str, Any]]) -> list[Any]:
        """The configuration of every view."""
        made = {radius: with_options(self._bases[radius], given) for radius, given in options.items()}
        return [made[problem.radius] for problem in self.problems]

    def differentiable(self, coordinates: np.ndarray) -> tuple[int, ...]:
        """The coordinates whose derivative exists and tells how the loss changes.

        Estimators refuse derivatives that do not exist. Where samples also jump from texel to texel, a derivative
        exists but misses the jumps; it is compared with a central difference wide enough to hold many of them.
        """
        good = []
        for i in range(len(self.space.parameters)):
            try:
                _, (slope,) = self.loss_and_gradient(coordinates, (i,))
            except ConfigError:
                continue
            difference = self.difference(coordinates, i)
            if abs(slope - difference) <= CHECK_TOLERANCE * max(abs(slope), abs(difference)):
                good.append(i)
        return tuple(good)

    def difference(self, coordinates: np.ndarray, i: int) -> float:
        """Difference quotient of the loss by coordinate ``i`` over many jumps between texels, one-sided at a bound."""
        ends = np.array([coordinates, coordinates], dtype=float)
        ends[:, i] += -STEP, STEP
        ends = np.clip(ends, self.space.lower, self.space.upper)
        low, high = (self.loss(u) for u in ends)
        return (high - low) / (ends[1, i] - ends[0, i])
