"""Image-level driver of the spatial filters."""

from collections.abc import Callable
from typing import Any

import drjit as dr

from gtao.config import EdgeAwareFilter, PlaneAwareFilter, SpatialFilter
from gtao.errors import ConfigError
from gtao.gbuffer import GBuffer
from gtao.kernels import filters
from gtao.results import AmbientOcclusion
from gtao.stages import staged

from .channels import channels_of, estimate_of, in_a_row, named
from .estimate import check_estimate, check_frame_index
from .view import view_numbers

__all__ = ["denoise", "filtered"]

# Ridge of the linear fit, in weights times squared texels: an eighth of the second moment of an open 5×5 footprint.
RIDGE = 3.0
# Passes before the last smooth more: their weight of the pixel itself is this much smaller.
EARLIER_PASSES = 5

Channels = tuple[Any, ...]
#: From images of the channels, images of what guides the filter and numbers to the averaged channels.
Average = Callable[[Any, Any, Any], Channels]


def denoise(ao: AmbientOcclusion, g: GBuffer, spatial: Any, *, frame_index: int = 0) -> AmbientOcclusion:
    """The estimate ``ao`` of frame ``g``, filtered in the image.

    Noise patterns give neighbouring pixels different directions: averaging them is part of estimating with few
    slices. The background stays 1 and is never averaged in. Values are not clamped.

    Args:
        ao: from :func:`gtao.ambient_occlusion`; directions are filtered with the same weights.
        g: the frame that ``ao`` was estimated from.
        spatial: a :class:`gtao.EdgeAwareFilter`, :class:`gtao.SpatialFilter` or :class:`gtao.PlaneAwareFilter`.
        frame_index: number of the frame, 0 or more. Footprints of even size cannot be symmetric: from the pixel they
            reach one texel further toward the bottom right on even frames, toward the top left on odd ones.
            Symmetric footprints do not depend on it.

    Returns:
        A new estimate with the same ``config``; its ``variance`` is None: filtered errors depend on each other.

    Raises:
        ConfigError: ``spatial`` is no filter, ``ao`` no estimate, ``g`` no frame or ``frame_index`` negative.
        ShapeError: the estimate is not of this frame.
    """
    _check_filter(spatial)
    check_estimate(ao, g)
    check_frame_index(frame_index)
    found = channels_of(ao, g.types)
    result = filtered(in_a_row(found), g, spatial, frame_index)
    dr.eval(result)
    result = named(result, found)
    if "unshaped" in result:
        result["unshaped"] = (dr.select(g.mask.array, result["unshaped"][0], 1),)
    return estimate_of(result, ao, g)


def filtered(channels: Channels, g: GBuffer, spatial: Any, frame_index: int) -> Channels:
    """Flat images of the frame, all averaged with the same weights; on the background the first is 1, others 0.

    Raises:
        ConfigError: ``spatial`` is no filter.
    """
    _check_filter(spatial)
    return _FILTERS[type(spatial)](channels, g, spatial, frame_index % 2 == 1)


def _check_filter(spatial: Any) -> None:
    if type(spatial) not in _FILTERS:
        choices = ", ".join(f"gtao.{kind.__name__}" for kind in _FILTERS)
        raise ConfigError(f"the filter must be one of {choices}, got {type(spatial).__name__}")


def _one_pass(average: Average, channels: Channels, guides: Channels, numbers: Channels, g: GBuffer) -> Channels:
    """What ``average`` makes of the channels: visibility 1 on the background, directions 0."""
    surface, n = g.mask.array, len(channels)

    def stage(images, numbers):
        visibility, *directions = average(images[:n], images[n:], numbers)
        return dr.select(surface, visibility, 1), *(dr.select(surface, c, 0) for c in directions)

    # One kernel per pass, which reads what the one before wrote.
    dr.eval(channels)
    return staged(stage, channels + guides, numbers)


def _grid(g: GBuffer) -> filters.Grid:
    height, width = g.shape
    return filters.Grid.of(width, height, g.types)


def _edge_aware(channels: Channels, g: GBuffer, f: EdgeAwareFilter, _odd_frame: bool) -> Channels:
    if f.quantised_edges and dr.grad_enabled(g.view_z, f.edge_threshold):
        raise ConfigError(
            "links of depth that are rounded to four levels have no derivative; choose quantised_edges=False, or filter"
            " with depth and edge_threshold detached (dr.detach)"
        )
    grid = _grid(g)
    links = staged(
        lambda images, numbers: filters.depth_edges(*images, *numbers, f.quantised_edges, grid),
        (g.view_z.array,),
        (f.edge_threshold,),
    )

    def average(images, links, numbers):
        beta, *options = numbers
        return filters.weighted_mean(beta, filters.edge_taps(links, *options, grid), grid, images)

    dr.eval(links)
    options = f.diagonal_weight, f.leak_threshold, f.leak_strength
    for k in range(f.passes):
        beta = f.beta if k == f.passes - 1 else f.beta / EARLIER_PASSES
        channels = _one_pass(average, channels, links, (beta, *options), g)
    return channels


def _bilateral(channels: Channels, g: GBuffer, f: SpatialFilter, odd_frame: bool) -> Channels:
    grid, one = _grid(g), g.types.Float(1)
    order = ("none", "first", "second").index(f.derivatives)
    inverse = f.planar and not g.camera.is_orthographic

    def average(images, depth, numbers):
        taps = filters.bilateral_taps(*depth, *numbers, order, grid, odd_frame, inverse)
        return filters.weighted_mean(one, taps, grid, images)

    return _one_pass(average, channels, (g.view_z.array,), (f.threshold,), g)


def _plane_aware(channels: Channels, g: GBuffer, f: PlaneAwareFilter, odd_frame: bool) -> Channels:
    grid, camera, one = _grid(g), g.camera, g.types.Float(1)

    def average(images, guides, numbers):
        depth, *normal = guides
        tolerance, *view = numbers
        view = filters.View(*view, orthographic=camera.is_orthographic)
        taps = filters.plane_taps(depth, normal, f.size, tolerance, view, grid, odd_frame)
        if f.fit == "constant":
            return filters.weighted_mean(one, taps, grid, images)
        return filters.local_plane(one, taps, grid, images, ridge=RIDGE)

    return _one_pass(average, channels, (g.view_z.array, *g.normal_arrays()), (f.tolerance, *view_numbers(camera)), g)


# What filters the channels of an even or odd frame, for each class of filter.
_FILTERS: dict[type, Callable[[Channels, GBuffer, Any, bool], Channels]] = {
    EdgeAwareFilter: _edge_aware,
    SpatialFilter: _bilateral,
    PlaneAwareFilter: _plane_aware,
}
