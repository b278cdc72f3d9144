"""Brute force on a depth buffer: rays over the hemisphere of every pixel, no slices and no horizons."""

from dataclasses import dataclass

import drjit as dr

from . import depth_bounds, noise, ray_path
from .depth_cells import basis
from .open_directions import Sums
from .strata import Strata

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
    directions: bool  # sum the open directions too

    @property
    def n_rays(self):
        return self.n_directions * self.rays_per_direction


def visibility(view_z, cells, normal, k: Switches, view, types):
    """Share of the open rays per pixel, and an unbiased estimate of its variance; 1 and 0 on the background.

    Rays are stratified in azimuth about the normal and in elevation, two to a stratum. The variance of the mean of N
    rays is the sum over strata of the squared difference of the two, over N² (theory, eq. (77)).

    With ``k.directions`` the third result is :meth:`gtao.kernels.open_directions.Sums.in_view`, 0 on the background;
    else it is empty. Where both rays of a stratum are open they stand for all its directions, whose mean is known, so
    that only strata which an edge of the visible set passes through leave noise (theory, below eq. (77)).

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
    frame = (*basis(normal), normal)
    bounds = depth_bounds.pyramid(cells) if k.n_steps is None else None
    stream = noise.pcg(noise.pcg(xi) + yi) + view.key
    strata = Strata(k.n_directions // 2, k.rays_per_direction, k.weighting == "cosine")

    def body(ray, n_open, n_pairs, previous, *directions):
        elevation = ray // k.n_directions
        azimuth = ray - elevation * k.n_directions
        stratum = Float(azimuth >> 1), Float(elevation)
        bits = noise.pcg(stream + ray * STRIDE)
        u, bits = _unit(bits, Float), noise.pcg(bits)
        local = strata.direction(*stratum, u, _unit(bits, Float))
        d = tuple(_combine(local, axis) for axis in zip(*frame, strict=True))
        path = ray_path.over_image(d, point, w0, cells, view, k.unlimited)
        if bounds is not None:
            hit = ray_path.passes_behind(path, cells, bounds, surface, types)
        else:
            jitter = _unit(noise.pcg(bits), Float)
            hit = ray_path.found_behind(path, cells, k.n_steps, jitter, surface, types)
        is_open = dr.select(hit, Float(0), 1)
        second = (ray & 1) == 1
        unlike = second & (is_open != previous)
        if k.directions:
            first, sums = directions[:3], directions[3:]
            of_pair = zip(sums, Sums.of(*first), Sums.of(*local), strata.mean(*stratum), strict=True)
            n_of_pair = dr.select(second, is_open + previous, 0)
            sign = dr.select(second, is_open - previous, 0)
            directions = (*local, *(dr.fma(sign, b - a, dr.fma(n_of_pair, m, s)) for s, a, b, m in of_pair))
        return ray + 1, n_open + is_open, n_pairs + dr.select(unlike, Float(1), 0), is_open, *directions

    width = dr.width(x)
    zero = dr.zeros(Float, width)
    directions = (zero, zero, zero, *Sums.zero(Float, width)) if k.directions else ()
    _, n_open, n_pairs, _, *directions = dr.while_loop(
        (UInt(0), zero, zero, zero, *directions), lambda ray, *_: ray < k.n_rays, body, label="rays"
    )
    share = n_open * (1 / k.n_rays)
    visible, variance = dr.select(surface, share, 1), dr.select(surface, n_pairs * (1 / k.n_rays**2), 0)
    if not k.directions:
        return visible, variance, ()
    means = Sums(*(total * (1 / k.n_rays) for total in directions[3:]))
    return visible, variance, tuple(dr.select(surface, mean, 0) for mean in means.in_view(share, frame))


def _combine(local, axis):
    return dr.fma(local[0], axis[0], dr.fma(local[1], axis[1], local[2] * axis[2]))


def _unit(bits, Float):
    """A number in [0, 1) from 32 random bits."""
    return Float(bits >> 8) * 2**-24
