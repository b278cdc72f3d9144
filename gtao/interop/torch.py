"""The estimators on PyTorch tensors, differentiable by its autograd."""

# An optional framework, which need not be there when types are checked; nor when documentation is built, where its
# types cannot be combined.
# pyright: reportMissingImports=false

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gtao import JIMENEZ2016, MultibounceFit

from ._functions import Denoising, Multibounce, Occlusion, SpecularOcclusion
from ._torch_autograd import torch, wrap

__all__ = ["ambient_occlusion", "denoise", "multibounce", "specular_occlusion", "wrap"]


def ambient_occlusion(
    view_z: torch.Tensor,
    normal_v: torch.Tensor | None,
    camera: Any,
    method: Any = None,
    *,
    parameters: Mapping[str, torch.Tensor] | None = None,
    frame_index: int = 0,
    validate: bool = True,
) -> torch.Tensor:
    """Visibility of every pixel; see :func:`gtao.ambient_occlusion`.

    Args:
        view_z: (H, W) distance along the optical axis, positive; ``inf`` on the background.
        normal_v: (H, W, 3) unit normals in the view frame; None derives them from the depth.
        camera: :class:`gtao.PerspectiveCamera` or :class:`gtao.OrthographicCamera` of H rows and W columns.
        method: a strategy object; ``gtao.GTAO()`` if left out.
        parameters: values that replace options of ``method`` or numbers of ``camera`` and may need gradients: tensors
            without dimensions by name, such as ``"radius"``, ``"falloff.end"``, ``"camera.fx"``.
        frame_index: position in the temporal noise sequence, at least 0.
        validate: as of :class:`gtao.GBuffer`: False saves training loops a look at every value.

    Returns:
        (H, W) visibility, 1 = open, 1 on the background.

    Raises:
        ShapeError, ConfigError: as :class:`gtao.GBuffer`, :func:`gtao.ambient_occlusion` and :func:`wrap` do, or a
            parameter does not exist.
    """
    parameters = parameters or {}
    function = Occlusion(camera, method, tuple(parameters), validate)
    return wrap(function)(view_z, normal_v, frame_index, *parameters.values())


def denoise(
    visibility: torch.Tensor,
    view_z: torch.Tensor,
    normal_v: torch.Tensor | None,
    camera: Any,
    spatial: Any,
    *,
    frame_index: int = 0,
    validate: bool = True,
) -> torch.Tensor:
    """Visibility filtered in the image; see :func:`gtao.denoise`.

    Args:
        visibility: (H, W), from :func:`ambient_occlusion`.
        view_z, normal_v, camera: the frame that it was estimated from.
        spatial: a :class:`gtao.EdgeAwareFilter`, :class:`gtao.SpatialFilter` or :class:`gtao.PlaneAwareFilter`.
        frame_index: as of :func:`gtao.denoise`.
        validate: as of :class:`gtao.GBuffer`.

    Returns:
        (H, W) visibility.

    Raises:
        ShapeError, ConfigError: as :class:`gtao.GBuffer`, :func:`gtao.denoise` and :func:`wrap` do.
    """
    return wrap(Denoising(camera, spatial, validate))(visibility, view_z, normal_v, frame_index)


def multibounce(visibility: torch.Tensor, albedo: Any, fit: MultibounceFit = JIMENEZ2016) -> torch.Tensor:
    """Visibility after several bounces of light; see :func:`gtao.multibounce`.

    Args:
        visibility: (H, W) cosine-weighted visibility.
        albedo: (H, W, 3) or (H, W) diffuse albedo in [0, 1], or a Python number for all.
        fit: published or refitted coefficients.

    Returns:
        Tensor of the shape of ``albedo``, of ``visibility`` for a number.

    Raises:
        ShapeError, ConfigError: as :func:`gtao.multibounce` and :func:`wrap` do.
    """
    return wrap(Multibounce(fit))(visibility, albedo)


def specular_occlusion(
    view_z: torch.Tensor,
    normal_v: torch.Tensor | None,
    camera: Any,
    roughness: Any,
    f0: Any = 0.04,
    occlusion: Any = None,
    method: Any = None,
    *,
    frame_index: int = 0,
    validate: bool = True,
) -> torch.Tensor:
    """Specular occlusion of every pixel, estimate included; see :func:`gtao.specular_occlusion`.

    Args:
        view_z: (H, W) distance along the optical axis, positive; ``inf`` on the background.
        normal_v: (H, W, 3) unit normals in the view frame; None derives them from the depth.
        camera: :class:`gtao.PerspectiveCamera` or :class:`gtao.OrthographicCamera` of H rows and W columns.
        roughness: perceptual roughness in [0, 1]: (H, W), or one number.
        f0: reflectance at normal incidence in [0, 1]: (H, W), (H, W, 3), (3,), or one number.
        occlusion: what visibility and bent normals are estimated with; ``gtao.GTAO(weighting="uniform",
            bent_normal=True)`` if left out.
        method: of :func:`gtao.specular_occlusion`; ``gtao.ConeTable()`` if left out.
        frame_index: position in the temporal noise sequence, at least 0.
        validate: as of :class:`gtao.GBuffer`.

    Returns:
        (H, W), or (H, W, 3) where ``f0`` has three channels; 1 = open, 1 on the background.

    Raises:
        ShapeError, ConfigError: as :class:`gtao.GBuffer`, :func:`gtao.ambient_occlusion`,
            :func:`gtao.specular_occlusion` and :func:`wrap` do.
    """
    function = SpecularOcclusion(camera, occlusion, method, validate)
    return wrap(function)(view_z, normal_v, roughness, f0, frame_index)
