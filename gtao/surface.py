"""Points, normals and fields that depth and camera give: what a frame knows of its surfaces without being told."""

from types import SimpleNamespace
from typing import Any

import drjit as dr

from .kernels import fetch, normals
from .stages import staged
from .tensors import scalar

__all__ = ["NUMBERS", "affine_field", "derived_normals", "points", "view_directions", "with_gradient_of"]

#: What the position of a texel depends on beside its depth.
NUMBERS = ("fx", "fy", "cx", "cy")


def _position(camera: Any, numbers: Any, T: Any):
    """Function of texel coordinates and depth to points in the view frame."""
    inputs = SimpleNamespace(**dict(zip(NUMBERS, numbers, strict=True)))
    return lambda x, y, z: type(camera).unproject(inputs, T.Float(x) + 0.5, T.Float(y) + 0.5, z)


def _numbers(camera: Any) -> tuple[Any, ...]:
    return tuple(getattr(camera, name) for name in NUMBERS)


def points(view_z: Any, surface: Any, camera: Any, T: Any):
    """Surface points in the view frame, flat, three numbers per pixel; zero on the background.

    Args:
        view_z, surface: flat depth, and where there is a surface.
        T: array types; see :func:`gtao.backend.types_of`.
    """
    position = _position(camera, (scalar(value, T.Float) for value in _numbers(camera)), T)
    index = dr.arange(T.UInt, camera.width * camera.height)
    y = index // camera.width
    return dr.ravel(dr.select(surface, position(index - y * camera.width, y, dr.select(surface, view_z, 1)), 0))


def view_directions(camera: Any, T: Any):
    """Unit vectors from the surface to the viewer (x, y, z) in the view frame, flat; of the background too.

    They do not depend on the depth. In parallel projection they are one vector for all.
    """
    if camera.is_orthographic:
        return T.Float(0), T.Float(0), T.Float(1)
    position = _position(camera, (scalar(value, T.Float) for value in _numbers(camera)), T)
    index = dr.arange(T.UInt, camera.width * camera.height)
    y = index // camera.width
    P = position(index - y * camera.width, y, T.Float(1))
    return tuple(-dr.normalize(P))


def derived_normals(view_z: Any, camera: Any, T: Any):
    """Geometric normals, flat, three numbers per pixel; see :func:`gtao.kernels.normals.from_depth`.

    Their gradients by depth and by all numbers of the camera are one kernel.
    """

    def stage(images, numbers):
        (z,), (width, height) = images, (camera.width, camera.height)
        position = _position(camera, numbers, T)
        n = normals.from_depth(z.own, z.around, position, width, height, camera.is_orthographic, T)
        # Where no pixel has a neighbour they are one vector for all.
        return (dr.ravel(n + dr.zeros(T.Array3, width * height)),)

    return staged(stage, (view_z,), _numbers(camera))[0]


def affine_field(view_z: Any, camera: Any, T: Any):
    """What the linear fetch reads of flat depth without gradients; see :func:`gtao.kernels.fetch.affine_field`."""
    ax, ay = (1 / scalar(dr.detach(f), T.Float) for f in (camera.fx, camera.fy))
    footprint = dr.select(ax > ay, ax, ay)
    return fetch.affine_field(view_z, camera.width, camera.height, footprint, camera.is_orthographic, T)


def with_gradient_of(view_z: Any, field: Any, camera: Any):
    """The affine field of a depth with that depth's gradient, where it has one."""
    if not dr.grad_enabled(view_z):
        return field
    # Where the edges are has no derivative, so that the adjoint need not scatter to the texels that were compared.
    value = view_z if camera.is_orthographic else 1 / view_z
    return dr.replace_grad(field, dr.select(dr.copysign(type(field)(1), field) < 0, -value, value))
