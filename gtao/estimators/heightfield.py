"""Image-level drivers of the two ground truths of a depth buffer."""

import math
from typing import Any

import drjit as dr

from gtao.config import HeightfieldHorizon, HeightfieldRayMarch, plain
from gtao.errors import ConfigError
from gtao.gbuffer import GBuffer
from gtao.kernels import dense_horizon, direction_nodes, noise, ray_march
from gtao.kernels.depth_cells import DepthCells, View

from .attached import attached_numbers
from .marching import opaque

__all__ = ["horizon_truth", "march_truth"]


def march_truth(g: GBuffer, method: HeightfieldRayMarch, frame_index: int):
    """Visibility and the directions that are asked for, flat, and the variance of the visibility.

    Raises:
        ConfigError: gradients are asked for.
    """
    switches = ray_march.Switches(
        n_directions=method.n_directions,
        rays_per_direction=method.rays_per_direction,
        n_steps=method.n_steps,
        weighting=method.weighting,
        unlimited=math.isinf(plain(method.radius)),
        directions=method.bent_normal or method.directional,
    )
    visibility, variance, directions = ray_march.visibility(*_arguments(g, method, switches, frame_index))
    results = (visibility, *_asked(method, directions))
    # Read one after the other, each would march all rays.
    dr.eval(results, variance)
    return results, variance


def horizon_truth(g: GBuffer, method: HeightfieldHorizon, frame_index: int):
    """Visibility and the directions that are asked for, flat.

    Raises:
        ConfigError: gradients are asked for.
    """
    switches = dense_horizon.Switches(
        n_slices=method.n_slices,
        n_words=method.n_nodes // (2 * direction_nodes.PER_WORD),
        longest_px=math.sqrt(2) / method.steps_per_pixel,
        weighting=method.weighting,
        unlimited=math.isinf(plain(method.radius)),
        directions=method.bent_normal or method.directional,
    )
    visibility, directions = dense_horizon.visibility(*_arguments(g, method, switches, frame_index))
    results = (visibility, *_asked(method, directions))
    if directions:
        dr.eval(results)
    return results


def _asked(method: Any, directions: Any):
    """The mean direction, and the harmonics of band 2 if they are asked for."""
    return directions if method.directional else directions[:3]


def _arguments(g: GBuffer, method: Any, switches: Any, frame_index: int):
    """What both kernels take."""
    if g.is_attached or attached_numbers(method):
        raise ConfigError(
            f"{type(method).__name__} has no gradients: a direction is open or blocked and nothing in between;"
            " differentiate gtao.GTAO, or detach the depth, the normals, the camera and the options"
        )
    camera, T = g.camera, g.types
    height, width = g.shape
    # There is nothing to interpolate across a single row or column.
    nearest = method.fetch == "nearest" or min(width, height) == 1
    cells = DepthCells.of(g.affine_field(), width, height, camera.is_orthographic, nearest, T)
    values = {
        "ax": 1 / camera.fx,
        "bx": (0.5 - camera.cx) / camera.fx,
        "ay": -1 / camera.fy,
        "by": (camera.cy - 0.5) / camera.fy,
        "fx": camera.fx,
        "fy": camera.fy,
        "radius": method.radius,
    }
    key = noise.frame_terms("white", frame_index, method.seed).key
    view = View(**{name: opaque(g, value) for name, value in values.items()}, key=dr.opaque(T.UInt, key))
    n = g.normal_arrays()
    return g.view_z.array, cells, (n.x, n.y, n.z), switches, view, T
