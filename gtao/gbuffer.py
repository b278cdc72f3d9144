"""The input of every estimator: depth and normals of one frame, validated once."""

from copy import copy
from functools import cache
from typing import Any

import drjit as dr

from . import backend
from .camera import OrthographicCamera, PerspectiveCamera
from .camera.pose import pose_of
from .config import plain
from .errors import ShapeError
from .kernels import normals, pyramid
from .layers import DepthLayers
from .surface import NUMBERS, affine_field, derived_normals, points, with_gradient_of
from .tensors import scalar, to_tensor, vectors, window
from .validation import check, check_layers, motion_tensor

__all__ = ["GBuffer"]

#: Deviations of a normal's length from 1 up to this come from rounding a unit vector to float32.
ROUNDING = 3e-7


@cache
def _rounding(Float: Any) -> float:
    return ROUNDING * dr.epsilon(Float) / dr.epsilon(dr.float32_array_t(Float))


class GBuffer:
    """Depth and normals of one frame.

    Args:
        view_z: (H, W) distance along the optical axis in scene units, positive; ``inf`` on the background. NumPy,
            PyTorch, JAX or Dr.Jit (Mitsuba) arrays; float32 unless float64 comes in. The rest follows its precision.
        normal_v: (H, W, 3) unit normals in the view frame (+x right, +y up, camera looks along -z); ignored on the
            background. ``None`` derives geometric normals from the depth.
        camera: the camera that the frame was made with.
        albedo: optional (H, W, 3) diffuse albedo in [0, 1].
        motion: optional (H, W, 2) or (H, W, 3) motion, from the previous frame to this one, of the surface point that
            a pixel shows: pixels to the right, pixels down, change of ``view_z``. The background is infinitely far.
        layers: optional :class:`gtao.DepthLayers`: where the bodies behind each pixel begin and end; the first begins
            at ``view_z``.
        view_to_world: optional 4x4 rigid matrix from view frame to world, kept as nested tuples.
        validate: look at every value, which waits for the arrays to be computed. With False the caller vouches for
            them: training loops and functions inside ``dr.freeze`` need that. Shapes and types are always checked.
            Depth and normals that are Dr.Jit tensors are then taken as they are, not copied.

    Gradients that depth, normals or numbers of the camera carry flow into everything that is derived from them: enable
    them before the frame is made, or on its own ``view_z`` and ``normal_v``.

    Raises:
        ConfigError: values are to be looked at inside ``dr.freeze``.
        ShapeError: a shape or type is wrong, depth is NaN, not positive or beyond 1e-12 … 1e12, a normal is not
            finite or not unit, motion is not finite, the layers are of another frame, the pose is not rigid.
        BackendError: there is no usable Dr.Jit backend.
    """

    def __init__(
        self,
        view_z: Any,
        normal_v: Any,
        camera: Any,
        albedo: Any = None,
        motion: Any = None,
        layers: DepthLayers | None = None,
        *,
        view_to_world: Any = None,
        validate: bool = True,
    ):
        if not isinstance(camera, PerspectiveCamera | OrthographicCamera):
            raise ShapeError(f"camera must be a PerspectiveCamera or OrthographicCamera, got {type(camera).__name__}")
        self.camera = camera
        self.shape: tuple[int, int] = camera.shape
        self.view_z = to_tensor(view_z, "view_z", self.shape, copy=validate)
        self.mask = self.types.TensorBool(dr.isfinite(dr.detach(self.view_z.array)), self.shape)
        like = type(self.view_z)
        self.normals_derived = self._from_depth = normal_v is None
        n = None if normal_v is None else to_tensor(normal_v, "normal_v", (*self.shape, 3), like=like, copy=validate)
        self._given = None if n is None else n.array
        self.albedo = None if albedo is None else to_tensor(albedo, "albedo", (*self.shape, 3), like=like)
        self.motion = None if motion is None else motion_tensor(motion, self.view_z)
        self.view_to_world = None if view_to_world is None else pose_of("view_to_world", view_to_world)
        self.layers = None if layers is None else check_layers(layers, self.view_z)
        self._affine_field: Any = None
        self._pyramid: tuple[Any, Any] = (None, None)
        self._position_v: Any = None
        self._normal_v: Any = None
        if validate:
            # Derived normals are needed anyway.
            also = self.normal_v if self._from_depth and not self._geometry_attached() else None
            check(self.view_z, self._given, self.albedo, self.layers, also, motion=self.motion)

    @classmethod
    def from_exr(cls, path: Any, camera: Any = None, **options: Any) -> "GBuffer":
        """Read an EXR with the channel names of gtao, Mitsuba or Blender.

        ``options`` are those of :func:`gtao.io.read_gbuffer`, which documents them and the errors.
        """
        from .io.exr import read_gbuffer

        return read_gbuffer(path, camera, **options)

    def crop(self, x0: int, y0: int, width: int, height: int) -> "GBuffer":
        """The frame of the window whose top left pixel is ``(x0, y0)``, with the camera of that window.

        ``g.crop(p, p, width, height)`` takes a guard band of p pixels away again.

        Raises:
            ShapeError: the window reaches beyond the frame.
        """
        region = (x0, y0, width, height)

        def part(tensor):
            return None if tensor is None else window(tensor, *region)

        view_z, normal_v, albedo, motion = map(part, (self.view_z, self.normal_v, self.albedo, self.motion))
        layers = None if self.layers is None else self.layers.crop(*region)
        camera, pose = self.camera.crop(*region), self.view_to_world
        result = GBuffer(view_z, normal_v, camera, albedo, motion, layers, view_to_world=pose, validate=False)
        result.normals_derived = self.normals_derived
        return result

    def with_layers(self, layers: DepthLayers) -> "GBuffer":
        """The same frame with depth layers.

        Raises:
            ShapeError: they are of another frame.
        """
        layers = check_layers(layers, self.view_z)
        check(self.view_z, None, None, layers, None)
        result = copy(self)
        result.layers = layers
        return result

    def with_motion(self, motion: Any, *, validate: bool = True) -> "GBuffer":
        """The same frame with motion from the previous one, as for the class; for example of ``gtao.camera_motion``.

        Raises:
            ShapeError: it is of another frame or not finite.
        """
        result = copy(self)
        result.motion = motion_tensor(motion, self.view_z)
        if validate:
            check(self.view_z, None, None, None, None, motion=result.motion)
        return result

    def attached(self) -> "GBuffer":
        """The same frame with depth and normals that carry gradients, of their own."""
        result = copy(self)
        T = self.types
        result.view_z = T.Tensor(T.Float(dr.detach(self.view_z.array)), self.shape)
        dr.enable_grad(result.view_z)
        if not self._from_depth:
            # As they came: an estimate normalises them in its own kernel.
            result._given = T.Float(dr.detach(self.normal_v.array if self._given is None else self._given))
            dr.enable_grad(result._given)
        result._affine_field, result._pyramid, result._position_v, result._normal_v = None, (None, None), None, None
        return result

    def attached_inputs(self) -> tuple[Any, Any]:
        """Depth and normals as they came, to ask for their gradients; None for normals that were derived."""
        given = None if self._given is None else self.types.Tensor(self._given, (*self.shape, 3))
        return self.view_z, given

    @property
    def is_attached(self) -> bool:
        """Whether depth, normals or the camera carry gradients."""
        given = self._given if self._normal_v is None else self._normal_v
        return self._geometry_attached() or (given is not None and dr.grad_enabled(given))

    @property
    def types(self):
        """Array types of this buffer; see :func:`gtao.backend.types_of`."""
        return backend.types_of(type(self.view_z))

    @property
    def normal_v(self):
        """(H, W, 3) unit normals in the view frame; (0, 0, 1) on the background."""
        # Kept, but not while gradients flow: a backward pass consumes the graph behind it.
        if self._normal_v is not None and not (self._from_depth and self._geometry_attached()):
            return self._normal_v
        result = self._normals()
        if not dr.grad_enabled(result):
            self._normal_v, self._given = result, None
        return result

    @property
    def position_v(self):
        """(H, W, 3) surface points in the view frame; zero on the background."""
        attached = self._geometry_attached()
        if self._position_v is not None and not attached:
            return self._position_v
        P = points(self.view_z.array, self.mask.array, self.camera, self.types)
        result = self.types.Tensor(P, (*self.shape, 3))
        if not attached:
            self._position_v = result
        return result

    def affine_field(self):
        """What the linear fetch reads; see :func:`gtao.kernels.fetch.affine_field`."""
        if self._affine_field is None:
            self._affine_field = affine_field(dr.detach(self.view_z.array), self.camera, self.types)
            dr.eval(self._affine_field)
        return with_gradient_of(self.view_z.array, self._affine_field, self.camera)

    def depth_pyramid(self, table: pyramid.Table, name: str, start: Any, end: Any):
        """Depth at several resolutions; see :func:`gtao.kernels.pyramid.build`. The last one made is kept.

        ``start`` and ``end`` are numbers or Dr.Jit floats of width 1, whose gradients stay attached.
        """
        bounds = [scalar(value, self.types.Float) for value in (start, end)]
        key, attached = (table, name, plain(start), plain(end)), dr.grad_enabled(self.view_z, *bounds)
        if attached or self._pyramid[0] != key:
            levels = pyramid.build(self.view_z.array, table, name, *bounds, self.types)
            dr.eval(levels)
            if attached:
                return levels
            self._pyramid = key, levels
        return self._pyramid[1]

    def normal_arrays(self):
        """The normals as an Array3."""
        return vectors(self.normal_v.array, self.types)

    def normals_to_be_normalised(self):
        """The normals, flat, and the tolerance with which :func:`gtao.kernels.normals.unit` is to normalise them.

        An estimate does that in its own kernel, and its adjoint too: it costs nothing beside the rest, and a normalised
        copy would be the largest array of the frame. Normals that are normalised already do not change.
        """
        return self.normal_v.array if self._given is None else self._given, _rounding(self.types.Float)

    def _geometry_attached(self) -> bool:
        return dr.grad_enabled(self.view_z, *(getattr(self.camera, name) for name in NUMBERS))

    def _normals(self):
        """The tensor of normals, not evaluated yet."""
        T = self.types
        if self._from_depth:
            n = derived_normals(self.view_z.array, self.camera, T)
        else:
            n = dr.ravel(normals.unit(vectors(self._given, T), self.mask.array, _rounding(T.Float)))
        return T.Tensor(n, (*self.shape, 3))

    def __repr__(self) -> str:
        height, width = self.shape
        extras = [name for name in ("albedo", "motion", "layers", "view_to_world") if getattr(self, name) is not None]
        return f"GBuffer({width}x{height}, {self.camera.kind}{''.join(', ' + e for e in extras)})"
