"""Band after band of rows, so that memory does not grow with the frame."""

import drjit as dr

from gtao.kernels.directions import n_sums

from .job import Job

__all__ = ["images", "mean_of_bands"]


def mean_of_bands(job: Job, bands: int):
    """The results of a march, band after band."""
    means = images(job)
    for band in job.bands(bands):
        for whole, part in zip(means, band.march().mean(band.accumulator), strict=True):
            dr.scatter(whole, part, band.lane_index())
        dr.eval(means)
    return means


def images(job: Job):
    """Arrays for the results of a march."""
    return tuple(dr.empty(job.types.Float, job.n) for _ in range(n_sums(job.accumulator.order)))
