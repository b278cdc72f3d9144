"""How far a few noisy directions are from all of them, after which filter and how many frames."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gtao.errors import ConfigError, ShapeError
from gtao.estimators import ambient_occlusion, denoise
from gtao.estimators.adjoint import estimate
from gtao.estimators.noise_inputs import packed
from gtao.estimators.occlusion import JOBS
from gtao.estimators.shaped import is_shaped
from gtao.gbuffer import GBuffer
from gtao.results import AmbientOcclusion

__all__ = ["Deviation", "dense_limit", "estimate_with", "variance"]

_TILE = (64, 64, 2)


@dataclass(frozen=True)
class Deviation:
    """Distance of an estimate from its dense limit, over the pixels that show a surface.

    Attributes:
        variance: mean square of what more slices, offsets or frames would take away: the distance from the limit
            filtered alike.
        rmse: root mean square distance from the limit that no filter has blurred.
        bias: mean of the signed distance from that limit.
    """

    variance: float
    rmse: float
    bias: float


def dense_limit(g: GBuffer, method: Any, n_slices: int = 96, n_frames: int = 16) -> AmbientOcclusion:
    """The mean of the estimate over all rotations and offsets, with the method's own number of steps.

    Evenly spaced slices, each turned in every pixel and frame by scrambled Sobol numbers: n_slices · n_frames
    directions, each with an offset of its own.

    Args:
        g: the frame.
        method: a :class:`gtao.GTAO`, :class:`gtao.HBAO` or :class:`gtao.VisibilityBitmask`.
        n_slices: slices of each estimate.
        n_frames: number of estimates.

    Raises:
        ConfigError: the method has no slices.
    """
    _check_method(method)
    dense = replace(method, noise="sobol", **{_counted(method): n_slices})
    estimates = [ambient_occlusion(g, dense, frame_index=f) for f in range(n_frames)]
    return replace(estimates[0], visibility=sum(ao.visibility for ao in estimates) / n_frames, config=method)


def estimate_with(g: GBuffer, method: Any, mask: Any) -> AmbientOcclusion:
    """Visibility with rotations and offsets of the caller's own, by the kernel that reads the mask of blue noise.

    Args:
        g: the frame.
        method: a :class:`gtao.GTAO`, :class:`gtao.HBAO` or :class:`gtao.VisibilityBitmask` that leaves visibility as
            it is integrated (no power, floor, ceiling or fade); its noise and seed are not looked at.
        mask: (64, 64, 2) numbers in [0, 1), rotation and offset, repeated over the frame; kept are 16 digits.

    Raises:
        ConfigError: the method has no slices, or changes visibility after it is integrated.
        ShapeError: the mask has another shape or range.
    """
    _check_method(method)
    if is_shaped(method):
        raise ConfigError("a mask of your own is put into the integral alone; leave power, floor and ceiling out")
    found = np.asarray(mask, dtype=np.float64)
    if found.shape != _TILE or not (found.min() >= 0 and found.max() < 1):
        raise ShapeError(f"a mask is (64, 64, 2) numbers in [0, 1), got shape {found.shape}")
    # A seed would begin elsewhere in the mask.
    job = JOBS[type(method)](g, replace(method, noise="blue_noise", seed=0), 0)
    words = job.types.UInt(packed(np.floor(found.ravel() * 65536).astype(int).tolist()))
    flat, *_ = estimate(replace(job, scalars=replace(job.scalars, mask=words)))
    return AmbientOcclusion(visibility=job.types.Tensor(flat, g.shape), config=method)


def variance(
    g: GBuffer,
    method: Any,
    spatial: Any = None,
    *,
    n_frames: Sequence[int] = (1, 24),
    limit: AmbientOcclusion | None = None,
    masks: Callable[[int], Any] | None = None,
) -> dict[int, Deviation]:
    """Error of the mean of n estimates in a row, filtered in the image, against the dense limit of the same estimator.

    Of the sequence of max(n_frames) frames all stretches of n that follow each other are looked at, so that a single
    frame's number is that of the mean frame, not of the first.

    Args:
        g: the frame.
        method: a :class:`gtao.GTAO`, :class:`gtao.HBAO` or :class:`gtao.VisibilityBitmask`, with its noise.
        spatial: a filter for :func:`gtao.denoise`; None for none.
        n_frames: lengths of the mean over frames, at least 1.
        limit: from :func:`dense_limit`, if it is there already.
        masks: instead of the method's noise, the numbers of each frame for :func:`estimate_with`.

    Returns:
        Deviation by number of frames.

    Raises:
        ConfigError: the method has no slices, or a number of frames is no positive integer.
        ShapeError: a mask has another shape or range.
    """
    _check_method(method)
    if not n_frames or any(not isinstance(n, int) or n < 1 for n in n_frames):
        raise ConfigError(f"n_frames must be positive integers, got {n_frames!r}")
    limit = dense_limit(g, method) if limit is None else limit
    surface = g.mask.numpy()
    sharp = limit.visibility.numpy()[surface].astype(np.float64)
    estimates, limits = [], []
    for f in range(max(n_frames)):
        if masks is None:
            ao = ambient_occlusion(g, method, frame_index=f)
        else:
            ao = estimate_with(g, method, masks(f))
        for image, kept in ((ao, estimates), (limit, limits)):
            # Even footprints change sides from frame to frame, so that the filtered limit does too.
            filtered = image if spatial is None else denoise(image, g, spatial, frame_index=f)
            kept.append(filtered.visibility.numpy()[surface].astype(np.float64))
    found, smooth = np.array(estimates), np.array(limits)
    return {n: _deviation(_stretches(found, n), _stretches(smooth, n), sharp) for n in n_frames}


def _stretches(images, n):
    """Means of n images in a row, without the rest that is shorter."""
    whole = len(images) // n * n
    return images[:whole].reshape(-1, n, images.shape[1]).mean(axis=1)


def _deviation(found, smooth, sharp) -> Deviation:
    error = found - sharp
    return Deviation(
        variance=float(np.mean((found - smooth) ** 2)),
        rmse=float(np.sqrt(np.mean(error**2))),
        bias=float(np.mean(error)),
    )


def _counted(method: Any) -> str:
    """Name of the option that counts a method's slices."""
    return "n_directions" if hasattr(method, "n_directions") else "n_slices"


def _check_method(method: Any) -> None:
    if type(method) not in JOBS:
        choices = ", ".join(f"gtao.{kind.__name__}" for kind in JOBS)
        raise ConfigError(f"noise is measured with {choices}, got {type(method).__name__}")
