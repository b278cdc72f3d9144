"""The input of every estimator: depth and normals of one frame, validated once."""

from functools import cached_property
from typing import Any

import drjit as dr

from . import backend
from .camera import OrthographicCamera, PerspectiveCamera
from .errors import ShapeError
from .kernels import fetch, normals, pyramid
from .layers import DepthLayers
from .tensors import to_tensor, window

__all__ = ["GBuffer"]

#: Largest tolerated deviation of a normal's length from 1; half-float buffers reach 1e-3.
UNIT_TOLERANCE = 5e-3
#: Deviations up to this come from rounding a unit vector to float32.
ROUNDING = 3e-7
#: Depths whose squares neither overflow nor vanish in float32.
NEAREST, FARTHEST = 1e-12, 1e12
#: The first layer of the frame is its depth, up to the rounding of a conversion.
LAYER_TOLERANCE = 1e-6


class GBuffer:
    """Depth and normals of one frame.

    Args:
        view_z: (H, W) distance along the optical axis in scene units, positive; ``inf`` on the background. NumPy,
            PyTorch, JAX or Dr.Jit (Mitsuba) arrays; float32 unless float64 comes in.
        normal_v: (H, W, 3) unit normals in the view frame (+x right, +y up, camera looks along -z); ignored on the
            background. ``None`` derives geometric normals from the depth.
        camera: the camera that the frame was made with.
        albedo: optional (H, W, 3) diffuse albedo in [0, 1].
        motion: optional (H, W, 2) motion in pixels from the previous frame.
        layers: optional :class:`gtao.DepthLayers`: where the bodies behind each pixel begin and end; the first begins
            at ``view_z``.

    Raises:
        ShapeError: a shape or type is wrong, depth is NaN, not positive or beyond 1e-12 … 1e12, a normal is not
            finite or not unit, the layers are of another frame.
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
    ):
        if not isinstance(camera, PerspectiveCamera | OrthographicCamera):
            raise ShapeError(f"camera must be a PerspectiveCamera or OrthographicCamera, got {type(camera).__name__}")
        self.camera = camera
        self.shape: tuple[int, int] = camera.shape
        self.view_z = to_tensor(view_z, "view_z", self.shape)
        self._affine_field: Any = None
        self._pyramid: tuple[Any, Any] = (None, None)
        self.mask = self._check_depth()
        self.normals_derived = normal_v is None
        if normal_v is None:
            self.normal_v = self._derive_normals()
        else:
            self.normal_v = self._check_normals(to_tensor(normal_v, "normal_v", (*self.shape, 3)))
        self.albedo = None if albedo is None else self._check_albedo(to_tensor(albedo, "albedo", (*self.shape, 3)))
        self.motion = None if motion is None else to_tensor(motion, "motion", (*self.shape, 2))
        self.layers = None if layers is None else self._check_layers(layers)

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
        result = GBuffer(view_z, normal_v, self.camera.crop(*region), albedo, motion, layers)
        result.normals_derived = self.normals_derived
        return result

    def with_layers(self, layers: DepthLayers) -> "GBuffer":
        """The same frame with depth layers.

        Raises:
            ShapeError: they are of another frame.
        """
        result = GBuffer(self.view_z, self.normal_v, self.camera, self.albedo, self.motion, layers)
        result.normals_derived = self.normals_derived
        return result

    @property
    def types(self):
        """Array types of this buffer; see :func:`gtao.backend.types_of`."""
        return backend.types_of(type(self.view_z))

    @cached_property
    def position_v(self):
        """(H, W, 3) surface points in the view frame; zero on the background."""
        P = dr.select(self.mask.array, self._unproject_flat(self.view_z.array), 0)
        return self.types.Tensor(dr.ravel(P), (*self.shape, 3))

    def affine_field(self):
        """What the linear fetch reads; see :func:`gtao.kernels.fetch.affine_field`."""
        # Kept between estimates, but not while gradients flow: a backward pass consumes the graph behind it.
        attached = dr.grad_enabled(self.view_z)
        if attached or self._affine_field is None:
            height, width = self.shape
            camera = self.camera
            field = fetch.affine_field(
                self.view_z.array,
                width,
                height,
                1 / min(camera.fx, camera.fy),
                camera.is_orthographic,
                self.types,
            )
            dr.eval(field)
            if attached:
                return field
            self._affine_field = field
        return self._affine_field

    def depth_pyramid(self, table: pyramid.Table, name: str, start: float, end: float):
        """Depth at several resolutions; see :func:`gtao.kernels.pyramid.build`. The last one made is kept."""
        key, attached = (table, name, start, end), dr.grad_enabled(self.view_z)
        if attached or self._pyramid[0] != key:
            bounds = (dr.opaque(self.types.Float, value) for value in (start, end))
            levels = pyramid.build(self.view_z.array, table, name, *bounds, self.types)
            dr.eval(levels)
            if attached:
                return levels
            self._pyramid = key, levels
        return self._pyramid[1]

    def normal_arrays(self):
        """The normals as an Array3."""
        return dr.unravel(self.types.Array3, self.normal_v.array)

    def _pixel_centres(self):
        height, width = self.shape
        index = dr.arange(self.types.UInt, width * height)
        y = index // width
        return self.types.Float(index - y * width) + 0.5, self.types.Float(y) + 0.5

    def _unproject_flat(self, view_z):
        x, y = self._pixel_centres()
        return self.camera.unproject(x, y, view_z)

    def _check_depth(self):
        z = self.view_z.array
        n_nan, n_bad = dr.count(dr.isnan(z))[0], dr.count(z <= 0)[0]
        if n_nan:
            raise ShapeError(f"view_z is NaN at {n_nan} pixels; mark the background with inf and repair the rest")
        if n_bad:
            lowest = dr.min(z)[0]
            raise ShapeError(
                f"view_z must be positive (distance in front of the camera), got {n_bad} pixels down to {lowest:g};"
                " mark the background with inf"
            )
        surface = dr.isfinite(z)
        beyond = surface & ((z < NEAREST) | (z > FARTHEST))
        if dr.any(beyond):
            example = dr.gather(self.types.Float, z, dr.compress(beyond)[0])[0]
            raise ShapeError(
                f"view_z must lie between {NEAREST:g} and {FARTHEST:g}, got {example:g} among {dr.count(beyond)[0]}"
                " pixels; mark the background with inf, or choose another unit of length"
            )
        return self.types.TensorBool(surface, self.shape)

    def _check_normals(self, normal_v):
        T = self.types
        n = dr.unravel(T.Array3, normal_v.array)
        if type(n) is not T.Array3:
            n = T.Array3(n)
        surface = self.mask.array
        length = dr.norm(n)
        bad = surface & ~dr.isfinite(length)
        if dr.any(bad):
            raise ShapeError(f"normal_v is not finite at {dr.count(bad)[0]} surface pixels")
        off = surface & (abs(length - 1) > UNIT_TOLERANCE)
        if dr.any(off):
            raise ShapeError(
                f"normal_v must be unit vectors: {dr.count(off)[0]} surface pixels are not"
                f" (a length of {dr.gather(T.Float, length, dr.compress(off)[0])[0]:.4g}); normalise them first"
            )
        # Unit vectors keep their bits, so that a file that is read and written again does not drift.
        n = dr.select(surface & (abs(length - 1) > ROUNDING), n / length, n)
        n = dr.select(surface, n, T.Array3(0, 0, 1))
        flat = dr.ravel(n)
        if not dr.grad_enabled(flat):
            dr.eval(flat)
        return T.Tensor(flat, (*self.shape, 3))

    def _check_albedo(self, albedo):
        a = albedo.array
        wrong = ~((a >= 0) & (a <= 1))
        if dr.any(wrong):
            raise ShapeError(f"albedo must be in [0, 1]: {dr.count(wrong)[0]} values are not")
        return albedo

    def _check_layers(self, layers):
        if not isinstance(layers, DepthLayers):
            raise ShapeError(f"layers must be gtao.DepthLayers, got {type(layers).__name__}")
        if layers.shape[1:] != self.shape:
            height, width = layers.shape[1:]
            raise ShapeError(f"the layers are of a frame of {width}x{height}, not {self.shape[1]}x{self.shape[0]}")
        if type(layers.front) is not type(self.view_z):
            raise ShapeError("the layers and view_z must both be single or both be double precision")
        z = self.view_z.array
        first = dr.gather(type(z), layers.front.array, dr.arange(self.types.UInt, dr.width(z)))
        n_off = dr.count(~((first == z) | (dr.isfinite(z) & (abs(first - z) <= LAYER_TOLERANCE * z))))[0]
        if n_off:
            raise ShapeError(
                f"the first layer must begin at view_z, but does not at {n_off} pixels; are they one view?"
            )
        return layers

    def _derive_normals(self):
        T, camera = self.types, self.camera

        def position(x, y, z):
            return camera.unproject(T.Float(x) + 0.5, T.Float(y) + 0.5, z)

        height, width = self.shape
        n = normals.from_depth(self.view_z.array, position, width, height, camera.is_orthographic, T)
        flat = dr.ravel(n)
        if not dr.grad_enabled(flat):
            dr.eval(flat)
        return T.Tensor(flat, (*self.shape, 3))

    def __repr__(self) -> str:
        height, width = self.shape
        extras = [name for name in ("albedo", "motion", "layers") if getattr(self, name) is not None]
        return f"GBuffer({width}x{height}, {self.camera.kind}{''.join(', ' + e for e in extras)})"
