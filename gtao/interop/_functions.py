"""The package's functions as functions of arrays alone: what they depend on beside is fixed, and can be compared."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import gtao
from gtao.errors import ConfigError

__all__ = ["Denoising", "Multibounce", "Occlusion", "SpecularOcclusion"]


@dataclass(frozen=True)
class Occlusion:
    """Visibility from depth, normals and the values of the named parameters.

    ``names`` are fields of the method, of what it holds (``"falloff.end"``), or of the camera (``"camera.fx"``).
    """

    camera: Any
    method: Any
    names: tuple[str, ...]
    validate: bool

    def __call__(self, view_z: Any, normal_v: Any, frame_index: int, *values: Any) -> Any:
        given = _nested(dict(zip(self.names, values, strict=True)))
        camera = _with_values(self.camera, given.pop("camera", {}), "camera")
        g = gtao.GBuffer(view_z, normal_v, camera, validate=self.validate)
        method = _with_values(gtao.GTAO() if self.method is None else self.method, given, "method")
        return gtao.ambient_occlusion(g, method, frame_index=frame_index).visibility


@dataclass(frozen=True)
class Denoising:
    """Filtered visibility from visibility, depth and normals."""

    camera: Any
    spatial: Any
    validate: bool

    def __call__(self, visibility: Any, view_z: Any, normal_v: Any, frame_index: int) -> Any:
        g = gtao.GBuffer(view_z, normal_v, self.camera, validate=self.validate)
        ao = gtao.AmbientOcclusion(visibility=visibility)
        return gtao.denoise(ao, g, self.spatial, frame_index=frame_index).visibility


@dataclass(frozen=True)
class Multibounce:
    """Multi-bounce visibility from visibility and albedo."""

    fit: gtao.MultibounceFit

    def __call__(self, visibility: Any, albedo: Any) -> Any:
        return gtao.multibounce(visibility, albedo, self.fit)


@dataclass(frozen=True)
class SpecularOcclusion:
    """Specular occlusion from depth, normals and what the surface is made of."""

    camera: Any
    occlusion: Any
    method: Any
    validate: bool

    def __call__(self, view_z: Any, normal_v: Any, roughness: Any, f0: Any, frame_index: int) -> Any:
        g = gtao.GBuffer(view_z, normal_v, self.camera, validate=self.validate)
        occlusion = gtao.GTAO(weighting="uniform", bent_normal=True) if self.occlusion is None else self.occlusion
        ao = gtao.ambient_occlusion(g, occlusion, frame_index=frame_index)
        return gtao.specular_occlusion(ao, g, roughness, f0, self.method)


def _nested(values: Mapping[str, Any]) -> dict[str, Any]:
    """``{"a.b": x}`` as ``{"a": {"b": x}}``."""
    result: dict[str, Any] = {}
    for name, value in values.items():
        *path, last = name.split(".")
        inner = result
        for part in path:
            inner = inner.setdefault(part, {})
        inner[last] = value
    return result


def _with_values(config: Any, values: Mapping[str, Any], place: str) -> Any:
    """``config`` with other values in some of its fields, all replaced at once, as checks look at several together."""
    if not values:
        return config
    known = [field.name for field in fields(config)] if is_dataclass(config) else []
    if unknown := sorted(set(values) - set(known)):
        choices = f"choose from {', '.join(known)}" if known else f"it is {config!r}"
        raise ConfigError(f"parameters: {place} has no {', '.join(unknown)}; {choices}")
    return replace(
        config,
        **{
            name: _with_values(getattr(config, name), value, f"{place}.{name}") if isinstance(value, dict) else value
            for name, value in values.items()
        },
    )
