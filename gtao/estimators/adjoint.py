"""A march with gradients where they are asked for: which operation has them (:mod:`gtao.estimators.envelope`)."""

import drjit as dr

from gtao.errors import ConfigError
from gtao.kernels import steps

from .bands import mean_of_bands
from .envelope import MAX_UNROLLED, Banded, Fused, Sealed, Stored, Through, is_fused
from .job import Job

__all__ = ["estimate"]


def estimate(job: Job, max_pixels: int | None = None):
    """What :meth:`gtao.kernels.march.March.mean` gives, with gradients for whatever input carries any.

    Args:
        max_pixels: estimate in bands of rows with no more pixels than this, or of one row.

    Raises:
        ConfigError: gradients are asked through more samples than reverse mode can go through.
    """
    inputs = {name: a for name, a in job.inputs().items() if dr.grad_enabled(a)}
    bands = None if max_pixels is None or max_pixels >= job.n else max_pixels
    if not inputs:
        return job.march().mean(job.accumulator) if bands is None else mean_of_bands(job, bands)
    detached = job.with_inputs({name: dr.detach(a) for name, a in inputs.items()})
    return dr.custom(_kind(job, bands), Sealed(detached, bands), inputs)


def _kind(job: Job, bands: int | None) -> type:
    """The operation that has the gradients."""
    if not job.accumulator.n_extrema:
        if not job.switches.unrolled:
            raise ConfigError(
                f"gradients of this method go through every sample: choose n_steps <= {steps.MAX_UNROLLED}, got"
                f" {job.switches.n_steps}"
            )
        return Through
    if bands is not None:
        return Banded
    return Fused if is_fused() and job.switches.n_slices <= MAX_UNROLLED else Stored
