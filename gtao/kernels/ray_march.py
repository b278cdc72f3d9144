"""Brute force on a depth buffer: rays over the hemisphere of every pixel, no slices and no horizons."""

import math
from dataclasses import dataclass

import drjit as dr

from . import depth_bounds, noise, ray_path
from .depth_cells import basis

__all__ = ["Switches", "visibility"]

# Separates the random numbers of the rays of a pixel; odd, and none of the factors of noise.frame_terms.
STRIDE = 0xC2B2AE35


@dataclass(frozen=True)
class Switches:
    """What specialises the kernel."""

    n_directions: int  # even
    rays_per_direction: int
    n_steps: int | None  # None follows every ray exactly
    weighting: str
    unlimited: bool  # the radius is infinite

    @property
    def n_rays(self):
        return self.n_directions * self.rays_per_direction


def visibility(view_z, cells, normal, k: Switches, view, types):
    """Share of the open rays per pixel, and an unbiased estimate of its variance; 1 and 0 on the background.

    Rays are stratified in azimuth about the normal and in elevation, two to a stratum. The variance of the mean of N
    rays is the sum over strata of the squared difference of the two, over N² (theory, eq. (77)).

    Args:
        view_z: flat depth, inf on the background.
        cells: :class:`gtao.kernels.depth_cells.DepthCells` of the same depth.
        normal: three flat arrays, unit normals in the view frame.
        view: :class:`gtao.kernels.depth_cells.View`.
        types: namespace of :func:`gtao.backend.types_of`.
    """
    Float, UInt = types.Float, types.UInt
    index = dr.arange(UInt, cells.width * cells.height)
    yi = index // cells.width
    xi = index - yi * cells.width
    x, y = Float(xi), Float(yi)
    surface = dr.isfinite(view_z)
    z = dr.select(surface, view_z, 1)
    point = (x, y, dr.fma(x, view.ax, view.bx), dr.fma(y, view.ay, view.by), z)
    w0 = cells.w(z)
    b1, b2 = basis(normal)
    bounds = depth_bounds.pyramid(cells) if k.n_steps is None else None
    stream = noise.pcg(noise.pcg(xi) + yi) + view.key

    def direction(azimuth, elevation, u, v):
        share = (Float(elevation) + u) * (1 / k.rays_per_direction)
        sine, cosine = dr.sincos((Float(azimuth >> 1) + v) * (4 * math.pi / k.n_directions))
        if k.weighting == "cosine":
            up, out = dr.sqrt(1 - share), dr.sqrt(share)
        else:
            up, out = 1 - share, dr.sqrt(share * (2 - share))
        cosine, sine = cosine * out, sine * out
        return tuple(dr.fma(cosine, p, dr.fma(sine, q, up * n)) for p, q, n in zip(b1, b2, normal, strict=True))

    def body(ray, n_open, n_pairs, previous):
        elevation = ray // k.n_directions
        azimuth = ray - elevation * k.n_directions
        bits = noise.pcg(stream + ray * STRIDE)
        u, bits = _unit(bits, Float), noise.pcg(bits)
        d = direction(azimuth, elevation, u, _unit(bits, Float))
        path = ray_path.over_image(d, point, w0, cells, view, k.unlimited)
        if bounds is not None:
            hit = ray_path.passes_behind(path, cells, bounds, surface, types)
        else:
            jitter = _unit(noise.pcg(bits), Float)
            hit = ray_path.found_behind(path, cells, k.n_steps, jitter, surface, types)
        is_open = dr.select(hit, Float(0), 1)
        unlike = ((ray & 1) == 1) & (is_open != previous)
        return ray + 1, n_open + is_open, n_pairs + dr.select(unlike, Float(1), 0), is_open

    zero = dr.zeros(Float, dr.width(x))
    _, n_open, n_pairs, _ = dr.while_loop(
        (UInt(0), zero, zero, zero), lambda ray, *_: ray < k.n_rays, body, label="rays"
    )
    return dr.select(surface, n_open * (1 / k.n_rays), 1), dr.select(surface, n_pairs * (1 / k.n_rays**2), 0)


def _unit(bits, Float):
    """A number in [0, 1) from 32 random bits."""
    return Float(bits >> 8) * 2**-24
