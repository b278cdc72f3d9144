"""G-buffers as EXR images: ours, and those of Mitsuba, Blender and their like."""

import os
from collections.abc import Mapping
from typing import Any, Literal, get_args

import drjit as dr
import numpy as np

from gtao.camera import OrthographicCamera, PerspectiveCamera, camera_from_dict
from gtao.errors import ConfigError, ImageError, ShapeError
from gtao.gbuffer import GBuffer

from . import foreign
from .channels import Triple, find_channels
from .images import read_channels, write_channels
from .layers import layer_channels, layers_of
from .motion import motion_channels, motion_of, pose_in

__all__ = ["read_gbuffer", "write_gbuffer"]

Camera = PerspectiveCamera | OrthographicCamera
DepthKind = Literal["auto", "view_z", "ray_t"]
Normals = Literal["file", "derive"]
Frame = Literal["auto", "view", "world"]


def _check_choice(name: str, value: Any, allowed: Any) -> None:
    if value not in get_args(allowed):
        choices = ", ".join(map(repr, get_args(allowed)))
        raise ConfigError(f"{name} must be one of {choices}, got {value!r}")


def _camera_of(path: Any, camera: Camera | None, metadata: Mapping[str, Any], window: str) -> Camera:
    if camera is None:
        stored = (metadata["manifest"] or {}).get("camera")
        if not isinstance(stored, dict):
            raise ImageError(
                f"{path} does not say which camera made it; give the camera, in Python for example"
                " PerspectiveCamera(width, height, fov_y), on the command line --fov-y or --camera"
            )
        try:
            camera = camera_from_dict(stored)
        except ConfigError as cause:
            raise ImageError(f"{path} holds a damaged camera ({cause}); give camera=") from None
    x0, y0, width, height = metadata["display_window"]
    if camera.shape != (height, width):
        raise ShapeError(
            f"the camera is {camera.width}x{camera.height}, but the frame of {path} is {width}x{height};"
            " give the camera of that frame"
        )
    if window == "data":
        left, top, width, height = metadata["data_window"]
        camera = camera.crop(left - x0, top - y0, width, height)
    return camera


def read_gbuffer(
    path: str | os.PathLike,
    camera: Camera | None = None,
    *,
    to_view: Any = None,
    depth: DepthKind = "auto",
    depth_channel: str | None = None,
    normals: Normals = "file",
    normal_layer: str | None = None,
    normal_frame: Frame = "auto",
    layer: str | None = None,
    window: Literal["display", "data"] = "display",
) -> GBuffer:
    """Read depth, normals and, if present, albedo from an EXR image; layers, motion and pose of a file of ours.

    Names that are understood: ours (``Z``, ``N.X`` …, ``albedo.R`` …); those of Mitsuba's ``aov`` integrator
    (``<aov>.T`` is the distance along the ray from the near plane, ``<aov>.X`` … normals in world space, and
    are turned to the camera); Blender's (``<view layer>.Depth.Z`` or ``.V`` along the axis, ``.Normal.X`` …
    in world space); and Nuke's habits (``depth.Z``, ``N.X``, ``normals.X``). A depth of 0, from 1e10 on, or
    infinite is background. Normals that were averaged over a pixel are stretched to unit length.

    Args:
        path: the file.
        camera: the camera of the display window; files written by gtao bring their own.
        to_view: 3x3 or 4x4 matrix from world to view frame (+x right, +y up, camera looks along -z), needed
            for normals in world space. Of a Mitsuba sensor it is ``diag(-1, 1, -1)`` times the inverse of
            ``to_world``, of a Blender camera the inverse of ``matrix_world``.
        depth: what the depth channel holds. "auto": what its name says; "view_z": distance along the axis;
            "ray_t": distance along the unit ray, for ``<aov>.T`` from the camera's ``near`` plane.
        depth_channel: name of the depth channel if it cannot be found.
        normals: "file" wants normals in the file; "derive" derives geometric ones from depth instead.
        normal_layer: layer of the normals (the name before ``.X``) if it cannot be found.
        normal_frame: frame of the normals. "auto": what the names say; "view"; "world".
        layer: look only at channels of this layer, for example one of several view layers.
        window: "display" or "data" (with overscan), see :func:`read_channels`; the camera is moved with it.

    Raises:
        ImageError: as for :func:`read_channels`; channels are missing or ambiguous; nothing tells the camera
            or the frame of the normals.
        ShapeError: the camera has another size; depth or normals are impossible or contradict each other.
        ConfigError: an option is unknown or ``to_view`` is no rotation.
        BackendError: there is no usable Dr.Jit backend.
    """
    _check_choice("depth", depth, DepthKind)
    _check_choice("normals", normals, Normals)
    _check_choice("normal_frame", normal_frame, Frame)
    rotation = None if to_view is None else foreign.rotation_of(to_view)
    channels, metadata = read_channels(path, window=window)

    def stack(names: Triple) -> np.ndarray:
        return np.stack([channels[name].astype(np.float32) for name in names], axis=-1)

    found = find_channels(
        path,
        list(channels),
        metadata["attributes"],
        lambda names: foreign.looks_unit(stack(names)),
        layer=layer,
        depth_channel=depth_channel,
        normal_layer=normal_layer,
        want_normals=normals == "file",
    )
    camera = _camera_of(path, camera, metadata, window)
    view_z = foreign.to_view_z(path, channels[found.depth], found, depth, camera)
    surface = np.isfinite(view_z)
    albedo = None
    if found.albedo is not None:
        albedo = np.where(surface[..., None], stack(found.albedo), np.float32(0))
    extras: dict[str, Any] = {"albedo": albedo}
    if metadata["manifest"] is not None and found.depth == "Z":
        extras["layers"] = layers_of(path, channels, view_z)
        extras |= {"motion": motion_of(channels), "view_to_world": pose_in(path, metadata["manifest"])}
    if found.normals is None:
        return GBuffer(view_z, None, camera, **extras)

    normal_layer = found.normals[0].rpartition(".")[0]
    n = foreign.unit_normals(path, stack(found.normals), surface, normal_layer)
    if foreign.is_world(path, normal_layer, found.world, normal_frame, to_view):
        assert rotation is not None
        n = (n @ rotation.T).astype(np.float32)
    if metadata["manifest"] is None:
        plain = GBuffer(view_z, None, camera)
        foreign.check_agreement(path, n, plain)
        if found.flip:
            n = foreign.turn_to_camera(n, plain)
    return GBuffer(view_z, n, camera, **extras)


def _expand(name: str, values: Any) -> dict[str, Any]:
    """Channels of one entry of ``extra``: (H, W) under its name, (H, W, 3) as X, Y, Z below it, more as 00, 01 …"""
    array = np.asarray(values.numpy() if dr.is_tensor_v(values) else values)
    if array.ndim == 3 and array.shape[2] == 3:
        return {f"{name}.{axis}": array[..., i] for i, axis in enumerate("XYZ")}
    if array.ndim == 3:
        return {f"{name}.{i:02d}": array[..., i] for i in range(array.shape[2])}
    return {name: array}


def write_gbuffer(
    path: str | os.PathLike,
    g: GBuffer,
    *,
    extra: Mapping[str, Any] | None = None,
    manifest: Mapping[str, Any] | None = None,
) -> None:
    """Write a G-buffer, and what was computed on it, as EXR (float32, ZIP), whole or not at all.

    Channels: ``Z`` is view_z (infinite on the background), ``N.X N.Y N.Z`` the normal in the view frame,
    ``albedo.R albedo.G albedo.B`` if there is one; of depth layers, if there are any, ``ZBack`` is where the first
    ends, ``layers.01.Z`` and ``layers.01.ZBack`` where the next begins and ends, and so on; of motion, if there is any,
    ``motion.X``, ``motion.Y`` in pixels and ``motion.Z`` in scene units. Then ``extra``: by convention
    ``visibility.mean``, ``visibility.var``, ``visibility.count``, ``bent`` and ``mean_direction`` (three components),
    ``visibility_sh`` (nine), ``transport.01`` … The header attribute ``gtao`` holds the manifest with the camera and
    its pose, so that :func:`read_gbuffer` needs nothing else.

    Args:
        path: the file; its folder is made.
        g: the G-buffer.
        extra: name -> (H, W) array, or (H, W, 3) array that becomes ``name.X``, ``name.Y``, ``name.Z``, or (H, W, n)
            array that becomes ``name.00``, ``name.01`` …
        manifest: what shall be known about the file: configuration, seed, versions, hashes.

    Raises:
        ImageError: an array has the wrong shape or holds NaN, or the file cannot be written.
        RecordError: the manifest holds what JSON cannot.
    """
    normal = g.normal_v.numpy()
    channels: dict[str, Any] = {"Z": g.view_z.numpy()}
    channels |= {f"N.{axis}": normal[..., i] for i, axis in enumerate("XYZ")}
    if g.albedo is not None:
        albedo = g.albedo.numpy()
        channels |= {f"albedo.{c}": albedo[..., i] for i, c in enumerate("RGB")}
    if g.layers is not None:
        channels |= layer_channels(g.layers)
    channels |= motion_channels(g)
    for name, values in (extra or {}).items():
        expanded = _expand(name, values)
        clash = sorted(channels.keys() & expanded.keys())
        if clash:
            raise ImageError(f"cannot write {path}: channel {clash[0]} is given twice; rename the extra one")
        channels |= expanded
    pose = {} if g.view_to_world is None else {"view_to_world": [list(row) for row in g.view_to_world]}
    write_channels(path, channels, {**(manifest or {}), **pose, "camera": g.camera.to_dict()})
