"""The operations that hold the derivatives of a march: what each keeps of the search, and when it launches.

A horizon is a maximum over samples, and the derivative of a maximum is that of the sample that attains it (Danskin's
theorem; theory, eq. (88)). What one reverse or forward pass costs therefore does not grow with the number of steps.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, cast

import drjit as dr

from gtao.kernels import search
from gtao.kernels.directions import n_sums
from gtao.kernels.loops import while_loop

from .bands import images, mean_of_bands
from .job import Job

__all__ = ["MAX_UNROLLED", "Banded", "Fused", "Sealed", "Stored", "Through", "fused", "is_fused"]

#: The most slices in straight code.
MAX_UNROLLED = 4
#: Copies of a gradient image that there is always memory for.
MAX_COPIES = 4

_LAUNCHED: ContextVar[Callable[[], None] | None] = ContextVar("_LAUNCHED", default=None)


@contextmanager
def fused(launched: Callable[[], None]):
    """Leave estimates with gradients unevaluated, so that one launch can hold them, the loss and the gradients.

    Args:
        launched: called after that launch, before gradients are added up.
    """
    token = _LAUNCHED.set(launched)
    try:
        yield
    finally:
        _LAUNCHED.reset(token)


def is_fused() -> bool:
    """Whether the caller holds the launch back, see :func:`fused`."""
    return _LAUNCHED.get() is not None


@contextmanager
def _expanded(size: int):
    """Let threads of the CPU add to copies of a gradient of ``size`` numbers: a third faster than to one with locks.

    Dr.Jit does so up to a size that suits many threads; few can afford more.
    """
    before = dr.expand_threshold()
    if dr.thread_count() <= MAX_COPIES:
        dr.set_expand_threshold(max(before, size))
    try:
        yield
    finally:
        dr.set_expand_threshold(before)


class Sealed:
    """Keeps Dr.Jit from looking into arguments that hold no gradients."""

    def __init__(self, job: Job, bands: int | None):
        self.job, self.bands = job, bands


class _Envelope(dr.CustomOp):
    """A march whose derivatives are those of the winning samples."""

    #: Up to this many slices are differentiated in straight code.
    unrolled = MAX_UNROLLED

    def eval(self, sealed: Sealed, inputs: dict[str, Any]):
        self.job, self.bands, self.names = sealed.job, sealed.bands, tuple(inputs)
        return self._search()

    def _search(self) -> tuple[Any, ...]:
        """The results."""
        raise NotImplementedError

    def _parts(self) -> Iterator[tuple[Job, Callable[[Any], Any]]]:
        """Parts of the frame, each with a function from a slice's number to the packed numbers of its winners."""
        raise NotImplementedError

    def _make(self, arrays: Any) -> None:
        """Called with all gradients of a part: one that was looked at alone would launch the whole pass for itself."""
        dr.eval(arrays)

    def backward(self):
        arrays, seeds = self._arrays(), cast(tuple[Any, ...], self.grad_out())
        whole = {name: a for name, a in arrays.items() if name == "field"}
        gradients: dict[str, Any] = {}
        with _expanded(dr.width(self.job.field)):
            with dr.resume_grad():
                dr.enable_grad(whole)
            for part, winners in self._parts():
                own = tuple(part.new(part.own(seed)) for seed in seeds)
                packed = part.packed(self._adjoint(part, winners, own, arrays, whole))
                self._make((packed, dr.grad(whole)))
                part.collect(gradients, packed)
            gradients |= dr.grad(whole)
        # Dr.Jit goes by the order of the entries.
        self.set_grad_in("inputs", {name: gradients[name] for name in self.names})

    def _adjoint(self, job: Job, winners, seeds, arrays: dict[str, Any], whole: dict[str, Any]) -> dict[str, Any]:
        """Gradients of the lanes of a part; those of ``whole`` accumulate in its variables."""

        def of_slice(i, azimuth):
            with dr.resume_grad():
                lanes = job.lanes(arrays)
                dr.enable_grad(lanes)
                march, accumulator = job.march_of(lanes | whole)
                values = self._slice(march, accumulator, winners, i, azimuth)
                dr.backward_from(sum(v * seed for v, seed in zip(values, seeds, strict=True)))
                return dr.grad(lanes)

        zero = {name: dr.zeros(type(a), job.n) for name, a in job.lanes(arrays).items()}
        return _over_slices(job, of_slice, zero, self.unrolled)

    def _slice(self, march, accumulator, winners, i, azimuth):
        """What a slice adds to the results of a part."""
        return march.replay(accumulator, winners(i), i, azimuth)

    def forward(self):
        arrays, tangents = self._arrays(), self.grad_in("inputs")
        parts = [(part, self._tangent(part, winners, arrays, tangents)) for part, winners in self._parts()]
        if len(parts) == 1:
            self.set_grad_out(parts[0][1])
            return
        results = images(self.job)
        for part, tangents in parts:
            for whole, tangent in zip(results, tangents, strict=True):
                dr.scatter(whole, tangent, part.lane_index())
        self.set_grad_out(results)

    def _tangent(self, job: Job, winners, arrays: dict[str, Any], tangents: dict[str, Any]):
        """Changes of a part of the results."""
        field = {name: a for name, a in tangents.items() if name == "field"}

        def of_slice(i, azimuth):
            with dr.resume_grad():
                lanes = job.lanes(arrays) | {name: type(arrays[name])(arrays[name]) for name in field}
                dr.enable_grad(lanes)
                dr.set_grad(lanes, job.lanes(tangents) | field)
                march, accumulator = job.march_of(lanes)
                values = self._slice(march, accumulator, winners, i, azimuth)
                dr.enqueue(dr.ADMode.Forward, *lanes.values())
                dr.traverse(dr.ADMode.Forward)
                return {str(k): dr.grad(value) for k, value in enumerate(values)}

        zero = {str(k): dr.zeros(job.types.Float, job.n) for k in range(n_sums(job.accumulator.order))}
        return tuple(_over_slices(job, of_slice, zero, self.unrolled).values())

    def _arrays(self) -> dict[str, Any]:
        """The inputs as variables of their own."""
        arrays = self.job.inputs()
        return {name: type(arrays[name])(arrays[name]) for name in self.names}

    def name(self):
        return "gtao"


class Stored(_Envelope):
    """One launch for the search, which stores the winners, and one for the gradients, whatever happens in between."""

    def _search(self):
        values, self.winners = search.search(self.job.march(), self.job.accumulator)
        dr.eval(values, self.winners)
        return values

    def _parts(self):
        yield self.job, lambda i: search.stored(self.job.march(), self.winners, i, self.job.accumulator)


class Fused(_Envelope):
    """Everything in one launch, if nothing is evaluated in between."""

    def _search(self):
        values, self.winners = search.search_straight(self.job.march(), self.job.accumulator)
        return values

    def _parts(self):
        yield self.job, lambda i: self.winners[i]

    def _make(self, arrays):
        super()._make(arrays)
        launched = _LAUNCHED.get()
        assert launched is not None
        launched()


class Banded(_Envelope):
    """Band after band; the gradients search again, so that memory does not grow with the number of slices."""

    def _search(self):
        return mean_of_bands(self.job, self.bands)

    def _parts(self):
        for band in self.job.bands(self.bands):
            _, winners = search.search(band.march(), band.accumulator)
            dr.eval(winners)
            yield band, lambda i, band=band, winners=winners: search.stored(band.march(), winners, i, band.accumulator)


class Through(_Envelope):
    """Through every sample, because each changes the result: there are no winners."""

    unrolled = 1

    def _search(self):
        if self.bands is not None:
            return mean_of_bands(self.job, self.bands)
        values = self.job.march().mean(self.job.accumulator)
        dr.eval(values)
        return values

    def _parts(self):
        for part in (self.job,) if self.bands is None else self.job.bands(self.bands):
            yield part, None

    def _slice(self, march, accumulator, winners, i, azimuth):
        return march.through(accumulator, i, azimuth)


def _over_slices(job: Job, of_slice, zero: dict[str, Any], unrolled: int) -> dict[str, Any]:
    """The sum of what ``of_slice(i, azimuth)`` gives, in straight code for up to ``unrolled`` slices."""
    march, n_slices = job.march(), job.switches.n_slices

    def body(i, total, *azimuth):
        share = of_slice(i, azimuth)
        return i + 1, {k: total[k] + share[k] for k in total}, *march.next_azimuth(*azimuth)

    if n_slices > unrolled:
        start = (job.types.UInt(0), zero, *march.first_azimuth())
        return while_loop(start, lambda i, *_: i < n_slices, body, label="adjoint")[1]
    state = (0, zero, *march.first_azimuth())
    for _ in range(n_slices):
        state = body(*state)
    return state[1]
