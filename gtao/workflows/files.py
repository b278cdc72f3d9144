"""One image in, one image out: the work behind ``gtao render``, ``gtao occlusion`` and ``gtao export``."""

import json
import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from gtao import io, render
from gtao._version import __version__
from gtao.camera import PerspectiveCamera, camera_from_dict
from gtao.errors import ConfigError, ImageError, SceneError

from .options import pipeline_from_options
from .packed import packed_paths, write_packings

__all__ = ["export_fit", "occlusion_file", "render_scene"]

Report = Callable[[str, int, int], None]

#: What a fit can be exported as.
EXPORTS = ("hlsl", "glsl", "wgsl", "c", "json")


def _step(progress: Report | None, task: str) -> Callable[[int, int], None] | None:
    return None if progress is None else lambda done, total: progress(task, done, total)


def _truth(scene: Any, g: Any, *numbers: Any, **options: Any) -> tuple[io.Directions, Any]:
    """What rays find, and the variance of their visibility."""
    traced = render.visibility(scene, g, *numbers, **options)
    return io.Directions(visibility=traced.mean.numpy(), bent_normal=traced.bent_normal.numpy()), traced.variance


def _directional_truth(scene: Any, g: Any, *numbers: Any, **options: Any) -> tuple[io.Directions, Any]:
    """The same rays, and the coefficients of bands 0 to 2."""
    traced = render.directional(scene, g, *numbers, **options)
    names = ("visibility", "bent_normal", "mean_direction")
    found = io.Directions(**{name: getattr(traced, name).numpy() for name in names}, visibility_sh=traced.mean.numpy())
    zeroth = 2 / math.sqrt(math.pi)  # from the coefficient of band 0 to visibility
    return found, zeroth**2 * traced.variance.numpy()[..., 0]


def render_scene(
    source: str,
    output: Path,
    *,
    sensor: int = 0,
    resolution: int | None = None,
    normals: str = "shading",
    spp: int = 256,
    max_distance: float = math.inf,
    n_bounces: int = 0,
    n_layers: int = 0,
    directional: bool = False,
    seed: int = 0,
    progress: Report | None = None,
) -> None:
    """Render the G-buffer and the ground truth of one view into an EXR.

    Args:
        source: Mitsuba XML file or name of an embedded scene.
        output: EXR to write; its channels are described in the documentation's conventions.
        sensor: index of the camera.
        resolution: longer side in pixels; None keeps the scene's own.
        normals: "shading" or "geometric".
        spp: rays per pixel of the truth, and paths per pixel of the transport images.
        max_distance: reach of occluders in scene units.
        n_bounces: transport images T_1 … T_K to trace as well; 0 for none.
        n_layers: bodies along every pixel's ray to peel as well; 0 for none.
        directional: also write the visibility in spherical harmonics of bands 0 to 2, from the same rays.
        seed: of the random numbers.
        progress: called as ``progress(task, done, total)``.

    Raises:
        SceneError: the scene cannot be loaded, has no such camera, or shows no surface.
        ConfigError: a parameter is out of range.
        ImageError: the output cannot be written.
    """
    _exr(output)
    scene = render.load_scene(source, resolution=resolution)
    g = render.gbuffer(scene, sensor, normals=normals)
    if not g.mask.numpy().any():
        raise SceneError(f"no pixel of scene {source} shows a surface; point its camera at one")
    if n_layers:
        g = g.with_layers(render.layers(scene, g, n_layers, sensor=sensor))
    trace = _directional_truth if directional else _truth
    truth, variance = trace(
        scene, g, max_distance, spp, seed, sensor=sensor, normals=normals, progress=_step(progress, "visibility")
    )
    extra = {
        **io.direction_channels(truth),
        "visibility.var": variance,
        "visibility.count": np.where(g.mask.numpy(), np.float32(spp), np.float32(0)),
    }
    if n_bounces:
        transport = render.transport(
            scene,
            g,
            n_bounces,
            spp,
            seed,
            sensor=sensor,
            normals=normals,
            progress=_step(progress, "transport"),
        )
        extra |= {f"transport.{i:02d}": image for i, image in enumerate(transport.T, start=1)}
    config = {
        "source": Path(source).name,
        "sensor": sensor,
        "normals": normals,
        "spp": spp,
        "max_distance": max_distance,
        "n_bounces": n_bounces,
        "n_layers": n_layers,
        "directional": directional,
        "seed": seed,
        "fingerprint": render.fingerprint(scene, sensor),
    }
    manifest = {"made_by": f"gtao {__version__} render", "config": config, **io.direction_manifest(truth)}
    io.write_gbuffer(output, g, extra=extra, manifest=manifest)


def _camera(camera_file: Path | None, fov_y: float | None, source: Path) -> tuple[Any, Any]:
    """The camera that the options describe, and the matrix from world to view frame if the file has one."""
    if camera_file is not None and fov_y is not None:
        raise ConfigError("give a camera file or a field of view, not both")
    if camera_file is not None:
        try:
            data = json.loads(camera_file.read_text())
        except OSError as error:
            raise ConfigError(f"cannot read camera {camera_file}: {error.strerror}") from None
        except ValueError as error:
            raise ConfigError(f"camera {camera_file} is not JSON: {error}") from None
        if not isinstance(data, dict):
            raise ConfigError(f"camera {camera_file} must hold a JSON object, got {type(data).__name__}")
        to_view = data.pop("to_view", None)
        return camera_from_dict(data), to_view
    if fov_y is not None:
        _, metadata = io.read_channels(source)
        *_, width, height = metadata["display_window"]
        return PerspectiveCamera(width, height, fov_y), None
    return None, None


def occlusion_file(
    source: Path,
    output: Path,
    *,
    method: str = "gtao",
    settings: Sequence[str] = (),
    frame_index: int = 0,
    camera_file: Path | None = None,
    fov_y: float | None = None,
    layer: str | None = None,
    normal_frame: Literal["auto", "view", "world"] = "auto",
    derive_normals: bool = False,
    packings: Sequence[str] = (),
) -> dict[Path, io.PackingErrors]:
    """Estimate visibility from an EXR and write it beside depth and normals, with its directions if it has any.

    Args:
        source: EXR with depth and normals; see :func:`gtao.io.read_gbuffer` for the channel names.
        output: EXR to write.
        method: name of a method, a key of :data:`gtao.config.NAMED`.
        settings: options as ``key=value``; see :func:`gtao.workflows.options.pipeline_from_options`.
        frame_index: of the noise.
        camera_file: JSON of :meth:`gtao.PerspectiveCamera.to_dict`; needed where the file carries no camera. Its
            optional key ``to_view`` holds the 4x4 matrix from world to view frame, for normals in world space.
        fov_y: vertical field of view in radians, in place of ``camera_file``.
        layer: layer to read.
        normal_frame: frame of the normals; "auto" believes their names.
        derive_normals: take normals from the depth, not from the file.
        packings: keys of :data:`gtao.io.PACKINGS` in which to write visibility and directions as well, each to its own
            file beside ``output``; the settings have to ask for what they store.

    Returns:
        The packed files, and what packing cost.

    Raises:
        ImageError: the input cannot be read or lacks a channel, or an output cannot be written.
        ConfigError: an option is wrong.
        ShapeError: depth or normals are not what they should be.
    """
    pipeline = pipeline_from_options(method, settings)
    if os.path.realpath(output) == os.path.realpath(source):
        raise ImageError(f"output {output} is the input; choose another name")
    _exr(output)
    paths = packed_paths(output, packings, pipeline.occlusion)
    camera, to_view = _camera(camera_file, fov_y, source)
    normals = "derive" if derive_normals else "file"
    g = io.read_gbuffer(source, camera, to_view=to_view, layer=layer, normals=normals, normal_frame=normal_frame)
    ao = pipeline.step(g, frame_index=frame_index)
    manifest = {
        "made_by": f"gtao {__version__} occlusion",
        "config": {**pipeline.to_dict(), "frame_index": frame_index},
        "input": {"name": source.name, "sha256": io.sha256_file(source)},
    }
    found = io.directions_of(ao)
    told = {**manifest, **io.direction_manifest(found)}
    io.write_gbuffer(output, g, extra=io.direction_channels(found), manifest=told)
    return write_packings(found, paths, manifest)


def export_fit(source: Path, language: str) -> str:
    """Shader code of a fit, or the fit as JSON.

    Args:
        source: ``coefficients.json``, or the ``record.json`` beside it.
        language: "hlsl", "glsl", "wgsl", "c" or "json".

    Raises:
        RecordError: the file is neither.
        ConfigError: the language is unknown.
    """
    if language not in EXPORTS:
        raise ConfigError(f"language must be one of {', '.join(EXPORTS)}, got {language!r}")
    fit = io.fit_of_record(io.read_record(source)) if _is_record(source) else io.read_fit(source)
    return io.pretty_json(io.fit_to_dict(fit)) if language == "json" else io.shader_code(fit, language)


def _is_record(path: Path) -> bool:
    try:
        content = json.loads(path.read_text())
    except (OSError, ValueError):
        return False
    return isinstance(content, dict) and content.get("kind") == "multibounce refit"


def _exr(path: Path) -> Path:
    """An output whose name says what it is.

    Raises:
        ImageError: it does not end in .exr.
    """
    if path.suffix.lower() != ".exr":
        raise ImageError(f"output {path} would hold an EXR image; give a name that ends in .exr")
    io.ensure_writable(path)
    return path
