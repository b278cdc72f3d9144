"""Gradients of a march: search without them, remember the winning samples, and differentiate only those.

A horizon is a maximum over samples, and the derivative of a maximum is that of the sample that attains it (Danskin's
theorem; theory, eq. (88)). What one reverse or forward pass costs therefore does not grow with the number of steps.
"""

from contextlib import contextmanager
from typing import Any

import drjit as dr

from gtao.errors import ConfigError
from gtao.kernels import steps

from .job import Job

__all__ = ["estimate"]

#: Up to this many slices are differentiated in straight code.
MAX_UNROLLED = 4
#: Copies of a gradient image that there is always memory for.
MAX_COPIES = 4


def estimate(job: Job):
    """The mean over slices, flat, with gradients for whatever input carries any.

    Raises:
        ConfigError: gradients are asked through more samples than reverse mode can go through.
    """
    inputs = {name: a for name, a in job.inputs().items() if dr.grad_enabled(a)}
    if not inputs:
        return job.march().mean(job.accumulator)
    if not job.accumulator.n_extrema:
        if not job.switches.unrolled:
            raise ConfigError(
                f"gradients of this method go through every sample: choose n_steps <= {steps.MAX_UNROLLED}, got"
                f" {job.switches.n_steps}"
            )
        return job.march().mean(job.accumulator)
    detached = job.with_inputs({name: dr.detach(a) for name, a in inputs.items()})
    return dr.custom(_Envelope, _Sealed(detached), inputs)


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


class _Sealed:
    """Keeps Dr.Jit from looking into an argument that holds no gradients."""

    def __init__(self, job: Job):
        self.job = job


class _Envelope(dr.CustomOp):
    """A march whose derivatives are those of the winning samples."""

    def eval(self, sealed: _Sealed, inputs: dict[str, Any]):
        self.job, self.names = sealed.job, tuple(inputs)
        value, self.winners = self.job.march().search(self.job.accumulator)
        dr.eval(value, self.winners)
        return value

    def backward(self):
        with _expanded(dr.width(self.job.field)):
            self.set_grad_in("inputs", self._gradients(self.grad_out()))

    def _gradients(self, seed) -> dict[str, Any]:
        arrays = self._arrays()
        whole = {name: a for name, a in arrays.items() if name == "field"}
        zero = {name: dr.zeros(type(a), self.job.n) for name, a in self.job.lanes(arrays).items()}
        with dr.resume_grad():
            dr.enable_grad(whole)

        def of_slice(i, azimuth):
            with dr.resume_grad():
                lanes = self.job.lanes(arrays)
                dr.enable_grad(lanes)
                value = self._replayed(lanes | whole, i, azimuth)
                dr.backward_from(value * seed)
                return dr.grad(lanes)

        gradients = self._over_slices(of_slice, zero) | dr.grad(whole)
        gradients = self.job.gathered(gradients)
        # Dr.Jit goes by the order of the entries.
        return {name: gradients[name] for name in self.names}

    def forward(self):
        arrays, tangents = self._arrays(), self.grad_in("inputs")
        tangents = self.job.lanes(tangents) | {name: a for name, a in tangents.items() if name == "field"}

        def of_slice(i, azimuth):
            with dr.resume_grad():
                lanes = self.job.lanes(arrays) | {name: type(a)(a) for name, a in arrays.items() if name == "field"}
                dr.enable_grad(lanes)
                dr.set_grad(lanes, tangents)
                value = self._replayed(lanes, i, azimuth)
                dr.enqueue(dr.ADMode.Forward, *lanes.values())
                dr.traverse(dr.ADMode.Forward)
                return {"value": dr.grad(value)}

        total = self._over_slices(of_slice, {"value": dr.zeros(self.job.types.Float, self.job.n)})
        self.set_grad_out(total["value"])

    def _arrays(self) -> dict[str, Any]:
        """The inputs as variables of their own."""
        arrays = self.job.inputs()
        return {name: type(arrays[name])(arrays[name]) for name in self.names}

    def _replayed(self, lanes: dict[str, Any], i, azimuth):
        job = self.job.with_lanes(lanes)
        return job.march().replay(job.accumulator, self.winners, i, azimuth)

    def _over_slices(self, of_slice, zero: dict[str, Any]) -> dict[str, Any]:
        """The sum of what ``of_slice(i, azimuth)`` gives."""
        march, n_slices = self.job.march(), self.job.switches.n_slices

        def body(i, total, *azimuth):
            share = of_slice(i, azimuth)
            return i + 1, {k: total[k] + share[k] for k in total}, *march.next_azimuth(*azimuth)

        state = (self.job.types.UInt(0), zero, *march.first_azimuth())
        if n_slices <= MAX_UNROLLED:
            for _ in range(n_slices):
                state = body(*state)
        else:
            state = dr.while_loop(state, lambda i, *_: i < n_slices, body, label="adjoint")
        return state[1]

    def name(self):
        return "gtao"
