"""What a surface reflects of the light within a cone, by quadrature in double precision with an error estimate."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from gtao import backend
from gtao.errors import ConfigError, ShapeError

from .brdf_sums import panel_sums

__all__ = ["LEVELS", "TOLERANCE", "Quadrature", "cone_shares", "cone_terms", "hemisphere_terms"]

#: Numbers of nodes, one after the other, until two of them agree.
LEVELS = (5, 8, 12, 18, 27, 40, 60, 90)
#: Estimated error that is good enough; the true one is mostly a hundredth of it, and at most three times as large
#: (within a hundredth of a radian of a grazing view, in one cone of forty).
TOLERANCE = 1e-5
#: An error is not taken to have fallen by more than this from one level to the next.
LEAST_GAIN = 0.1
#: Cones that are computed at a time.
CHUNK = 1 << 15
#: Narrower lobes count as this narrow; 0 itself is a mirror.
LEAST_ALPHA = 1e-8


class Quadrature(NamedTuple):
    """Integrals and how far to trust them.

    Attributes:
        values: (…, C) numbers, one column per channel.
        error: (…) by how much the parts of the integral changed, all in the same sense, when they got half as many
            nodes again; the largest of the channels. Mostly far above the error, which falls geometrically.
    """

    values: np.ndarray
    error: np.ndarray


def cone_terms(
    alpha_v: Any,
    beta: Any,
    alpha: Any,
    theta_o: Any,
    chi: Any = 0.0,
    *,
    brdf: Callable[[Any, Any], Any] | None = None,
    tolerance: float = TOLERANCE,
    progress: Callable[[int, int], None] | None = None,
) -> Quadrature:
    """A_V and B_V, the terms of the share F0 A_V + B_V that is reflected of a white light within a cone.

    GGX with height-correlated shadowing and Schlick's Fresnel term; directions below the horizon do not count
    (theory, eq. (158)). The arguments broadcast against each other. The same arguments give the same bits, whatever
    the number of threads.

    Args:
        alpha_v: half angle of the cone, in [0, π], radians.
        beta: angle between the cone's axis b and the reflected direction ω_r, in [0, π].
        alpha: width of the microfacets' slopes, perceptual roughness squared, in [0, 1]; 0 is a mirror.
        theta_o: angle between the normal and the direction to the camera, in [0, π/2].
        chi: azimuth of b about ω_r; 0: in the incidence plane, from ω_r towards the normal.
        brdf: another BRDF, isotropic: function of the directions to the light and to the camera in the frame with
            n = z (Dr.Jit arrays of three numbers of double precision) that returns f_r cos θ_i; one channel then. It
            is traced and may only use operations of Dr.Jit; those of :func:`gtao.render.brdf` do. ``alpha`` tells the
            nodes how narrow its lobe is, and must not be 0.
        tolerance: nodes are added until the estimate of the error is below, or :data:`LEVELS` are exhausted.
        progress: called with (cones done, their total number).

    Raises:
        ConfigError: an angle or width is outside its range, or not a number.
        ShapeError: the shapes of the arguments do not go together.
        BackendError: there is no usable Dr.Jit backend.
    """
    arguments, shape = _checked(alpha_v, beta, alpha, theta_o, chi, brdf)
    values, error = _integrated(arguments, np.ones((arguments.shape[1], 1)), brdf, tolerance, progress)
    return Quadrature(values.reshape(*shape, -1), error.reshape(shape))


def hemisphere_terms(
    alpha: Any,
    theta_o: Any,
    *,
    brdf: Callable[[Any, Any], Any] | None = None,
    tolerance: float = TOLERANCE,
) -> Quadrature:
    """A and B of the whole hemisphere, the environment BRDF; arguments as for :func:`cone_terms`."""
    # Rings about the normal: none of them meets the horizon.
    return cone_terms(0.5 * np.pi, theta_o, alpha, theta_o, brdf=brdf, tolerance=tolerance)


def cone_shares(
    alpha_v: Any,
    beta: Any,
    alpha: Any,
    theta_o: Any,
    chi: Any = 0.0,
    *,
    brdf: Callable[[Any, Any], Any] | None = None,
    tolerance: float = TOLERANCE,
    progress: Callable[[int, int], None] | None = None,
) -> Quadrature:
    """S_A = A_V / A and S_B = B_V / B in [0, 1], or S of another BRDF; arguments as for :func:`cone_terms`.

    The tolerance and the error are those of the ratios. Where B is 0, for a mirror seen from above, S_B is S_A.
    """
    arguments, shape = _checked(alpha_v, beta, alpha, theta_o, chi, brdf)
    pairs, which = np.unique(arguments[2:4], axis=1, return_inverse=True)
    alpha, theta_o = pairs
    above = np.full_like(theta_o, 0.5 * np.pi), theta_o, alpha, theta_o, np.zeros_like(theta_o)
    whole, relative = _integrated(np.stack(above), None, brdf, 0.5 * tolerance, None)
    whole, relative = whole[which], relative[which]
    values, error = _integrated(arguments, np.where(whole > 0, whole, 1.0), brdf, 0.5 * tolerance, progress)
    shares = np.divide(values, whole, out=np.repeat(values[:, :1], values.shape[1], 1), where=whole > 0)
    return Quadrature(np.minimum(shares, 1.0).reshape(*shape, -1), (error + relative).reshape(shape))


def _integrated(arguments, scale, brdf, tolerance, progress):
    """Values (n, C) and errors (n,) of flat arguments (5, n), in units of ``scale``; None: of the values themselves."""
    backend.require()
    alpha_v, beta, alpha, theta_o, chi = arguments
    n = len(beta)
    values, error = np.zeros((n, 2 if brdf is None else 1)), np.zeros(n)
    mirror = (alpha == 0) & (brdf is None)
    if np.any(mirror):
        values[mirror] = _mirror(alpha_v[mirror], beta[mirror], theta_o[mirror])
    # Where b lies in the incidence plane the half of a ring tells all.
    in_plane = (np.sin(beta) < 1e-15) | (np.abs(np.sin(chi)) < 1e-15)
    rest = np.stack([alpha_v, beta, np.maximum(alpha, LEAST_ALPHA), theta_o, chi])
    done = int(np.count_nonzero(mirror))
    for flat in (True, False):
        chosen = np.nonzero((in_plane == flat) & ~mirror)[0]
        for first in range(0, len(chosen), CHUNK):
            index = chosen[first : first + CHUNK]
            unit = None if scale is None else scale[index]
            values[index], error[index] = _refined(rest[:, index], flat, unit, brdf, tolerance)
            done += len(index)
            if progress is not None:
                progress(done, n)
    return values, error


def _refined(arguments, in_plane, scale, brdf, tolerance):
    """Values and errors: of each part of a cone on its own, so that errors of different parts do not cancel."""
    n = arguments.shape[1]
    owner, parts = panel_sums(*arguments, in_plane=in_plane, n_nodes=LEVELS[0], brdf=brdf)
    values, error, before = _totals(owner, parts, n), np.full(n, np.inf), np.full(n, np.inf)
    cones = np.arange(n)
    for n_nodes in LEVELS[1:]:
        _, finer = panel_sums(*arguments[:, cones], in_plane=in_plane, n_nodes=n_nodes, brdf=brdf)
        values[cones] = _totals(owner, finer, len(cones))
        unit = np.maximum(values[cones], np.finfo(np.float64).tiny) if scale is None else scale[cones]
        change = np.max(_totals(owner, np.abs(finer - parts), len(cones)) / unit, axis=-1)
        error[cones], before[cones] = np.maximum(change, LEAST_GAIN * before[cones]), change
        wanting = error[cones] > tolerance
        if not np.any(wanting):
            break
        index = np.cumsum(wanting) - 1
        kept = wanting[owner]
        owner, parts, cones = index[owner[kept]], finer[kept], cones[wanting]
    return values, error


def _totals(owner, parts, n):
    return np.stack([np.bincount(owner, channel, n) for channel in parts.T], axis=-1)


def _mirror(alpha_v, beta, theta_o):
    """The limit of ever narrower lobes: half of it is in a cone whose edge it is on."""
    k = (1 - np.cos(theta_o)) ** 5
    return 0.5 * (1 + np.sign(alpha_v - beta))[:, None] * np.stack([1 - k, k], axis=-1)


def _checked(alpha_v, beta, alpha, theta_o, chi, brdf):
    """Arguments as a flat array (5, n), and their common shape."""
    named = {"alpha_v": alpha_v, "beta": beta, "alpha": alpha, "theta_o": theta_o, "chi": chi}
    upper = {"alpha_v": np.pi, "beta": np.pi, "alpha": 1.0, "theta_o": 0.5 * np.pi}
    arrays = {name: np.asarray(x, np.float64) for name, x in named.items()}
    for name, x in arrays.items():
        low, high = (0.0, upper[name]) if name in upper else (-np.inf, np.inf)
        if not np.all(np.isfinite(x) & (x >= low) & (x <= high)):
            known = f"in [{low:g}, {high:.6g}]" if name in upper else "finite"
            raise ConfigError(f"{name} must be {known}; got numbers from {np.min(x)} to {np.max(x)}")
    if brdf is not None and not np.all(arrays["alpha"] > 0):
        raise ConfigError("alpha must be above 0 for a BRDF of one's own: it is the width that the nodes follow")
    try:
        full = np.broadcast_arrays(*arrays.values())
    except ValueError:
        shapes = ", ".join(f"{name} {x.shape}" for name, x in arrays.items())
        raise ShapeError(f"arguments do not broadcast against each other: {shapes}") from None
    return np.stack([x.ravel() for x in full]), full[0].shape
