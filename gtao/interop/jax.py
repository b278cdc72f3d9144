"""The estimators on JAX arrays, under ``jit``, ``grad`` and ``vmap``."""

# An optional framework, which need not be there when types are checked.
# pyright: reportMissingImports=false

from collections.abc import Callable, Mapping
from typing import Any

from gtao import JIMENEZ2016, MultibounceFit
from gtao.errors import ConfigError, ShapeError

from ._functions import Denoising, Multibounce, Occlusion, SpecularOcclusion

try:
    import jax
except ImportError as error:
    raise ImportError("gtao.interop.jax needs JAX, which is not here; pip install 'gtao[jax]'") from error

import numpy as np
from jax import numpy as jnp

from ._jax_callbacks import Bound, Shape, evaluate

__all__ = ["ambient_occlusion", "denoise", "multibounce", "specular_occlusion", "wrap"]


def wrap(function: Callable[..., Any], *, shape: Shape | tuple[Shape, ...] | None = None) -> Callable[..., Any]:
    """A function on Dr.Jit arrays as a function on JAX arrays.

    JAX and NumPy arrays among its positional and keyword arguments reach ``function`` as Dr.Jit tensors; those without
    dimensions as flat floats of width 1, which options of configurations and numbers of cameras accept, and integers
    without dimensions as Python integers. Floats are of one precision: double if an array with dimensions is, else
    single; so are the results. Other arguments pass unchanged and are part of what ``jit`` compiles for.

    The function runs in a callback on the host, and in reverse mode once more for the gradient. There is no forward
    mode. ``vmap`` calls it once per element. Wrap a function once, not in every step: JAX compiles per function.

    Args:
        function: returns a Dr.Jit array or a list or tuple of them, and depends on nothing that changes.
        shape: shape of the result, or one for each of several results; by default that of the first argument with
            dimensions.

    Raises:
        ConfigError: when called: an argument that is no array cannot be hashed.
        ShapeError: when called: no argument is an array, or one does not hold real numbers. What the function raises,
            or a result of another shape, reaches the caller as JAX's own error, with the message in it.
    """

    def wrapped(*args: Any, **kwargs: Any) -> Any:
        values: dict[Any, Any] = dict(enumerate(args)) | kwargs
        arrays = {key: jnp.asarray(value) for key, value in values.items() if isinstance(value, jax.Array | np.ndarray)}
        integers = {key: array for key, array in arrays.items() if array.ndim == 0 and array.dtype.kind in "iu"}
        floats = _unified({key: array for key, array in arrays.items() if key not in integers})
        fixed = _hashable({key: value for key, value in values.items() if key not in arrays})
        several = shape is not None and any(isinstance(part, tuple) for part in shape)
        shapes = (_leading(floats).shape,) if shape is None else shape if several else (shape,)
        bound = Bound(function, len(args), tuple(fixed.items()), tuple(integers), tuple(floats), shapes, several)
        results = evaluate(bound, tuple(integers.values()), tuple(floats.values()))
        return results if several else results[0]

    return wrapped


def ambient_occlusion(
    view_z: Any,
    normal_v: Any,
    camera: Any,
    method: Any = None,
    *,
    parameters: Mapping[str, Any] | None = None,
    frame_index: Any = 0,
    validate: bool = True,
) -> jax.Array:
    """Visibility of every pixel; see :func:`gtao.ambient_occlusion`.

    Args:
        view_z: (H, W) distance along the optical axis, positive; ``inf`` on the background.
        normal_v: (H, W, 3) unit normals in the view frame; None derives them from the depth.
        camera: :class:`gtao.PerspectiveCamera` or :class:`gtao.OrthographicCamera` of H rows and W columns.
        method: a strategy object; ``gtao.GTAO()`` if left out.
        parameters: values that replace options of ``method`` or numbers of ``camera`` and may be differentiated: arrays
            without dimensions by name, such as ``"radius"``, ``"falloff.end"``, ``"camera.fx"``.
        frame_index: position in the temporal noise sequence, at least 0; may be traced.
        validate: as of :class:`gtao.GBuffer`: False saves training loops a look at every value.

    Returns:
        (H, W) visibility, 1 = open, 1 on the background.

    Raises:
        ShapeError, ConfigError: as :func:`wrap` does.
    """
    parameters = parameters or {}
    function = Occlusion(camera, method, tuple(parameters), validate)
    return wrap(function)(view_z, normal_v, jnp.asarray(frame_index), *map(jnp.asarray, parameters.values()))


def denoise(
    visibility: Any,
    view_z: Any,
    normal_v: Any,
    camera: Any,
    spatial: Any,
    *,
    frame_index: Any = 0,
    validate: bool = True,
) -> jax.Array:
    """Visibility filtered in the image; see :func:`gtao.denoise`.

    Args:
        visibility: (H, W), from :func:`ambient_occlusion`.
        view_z, normal_v, camera: the frame that it was estimated from.
        spatial: a :class:`gtao.EdgeAwareFilter`, :class:`gtao.SpatialFilter` or :class:`gtao.PlaneAwareFilter`.
        frame_index: as of :func:`gtao.denoise`; may be traced.
        validate: as of :class:`gtao.GBuffer`.

    Returns:
        (H, W) visibility.

    Raises:
        ShapeError, ConfigError: as :func:`wrap` does.
    """
    return wrap(Denoising(camera, spatial, validate))(visibility, view_z, normal_v, jnp.asarray(frame_index))


def multibounce(visibility: Any, albedo: Any, fit: MultibounceFit = JIMENEZ2016) -> jax.Array:
    """Visibility after several bounces of light; see :func:`gtao.multibounce`.

    Args:
        visibility: (H, W) cosine-weighted visibility.
        albedo: (H, W, 3) or (H, W) diffuse albedo in [0, 1], or a Python number for all.
        fit: published or refitted coefficients.

    Returns:
        Array of the shape of ``albedo``, of ``visibility`` for a number.

    Raises:
        ShapeError, ConfigError: as :func:`wrap` does.
    """
    return wrap(Multibounce(fit), shape=np.shape(albedo) or visibility.shape)(visibility, albedo)


def specular_occlusion(
    view_z: Any,
    normal_v: Any,
    camera: Any,
    roughness: Any,
    f0: Any = 0.04,
    occlusion: Any = None,
    method: Any = None,
    *,
    frame_index: Any = 0,
    validate: bool = True,
) -> jax.Array:
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
        frame_index: position in the temporal noise sequence, at least 0; may be traced.
        validate: as of :class:`gtao.GBuffer`.

    Returns:
        (H, W), or (H, W, 3) where ``f0`` has three channels; 1 = open, 1 on the background.

    Raises:
        ShapeError, ConfigError: as :func:`wrap` does.
    """
    function = SpecularOcclusion(camera, occlusion, method, validate)
    shape = (*camera.shape, 3) if np.shape(f0)[-1:] == (3,) and np.shape(f0) != camera.shape else camera.shape
    return wrap(function, shape=shape)(view_z, normal_v, roughness, f0, jnp.asarray(frame_index))


def _hashable(values: dict[Any, Any]) -> dict[Any, Any]:
    for key, value in values.items():
        try:
            hash(value)
        except TypeError:
            name = repr(key) if isinstance(key, str) else f"number {key}"
            raise ConfigError(
                f"argument {name} is neither an array nor hashable: a {type(value).__name__}; let the function hold it"
            ) from None
    return values


def _leading(arrays: dict[Any, Any]) -> Any:
    """The first array with dimensions, or the first number if there is none."""
    return next((array for array in arrays.values() if array.ndim), next(iter(arrays.values())))


def _unified(arrays: dict[Any, Any]) -> dict[Any, Any]:
    """The arrays in one precision; numbers follow images."""
    if not arrays:
        raise ShapeError("none of the arguments is a JAX or NumPy array of floats")
    for array in arrays.values():
        if not (jnp.issubdtype(array.dtype, jnp.floating) or jnp.issubdtype(array.dtype, jnp.integer)):
            raise ShapeError(f"arrays must hold real numbers, got {array.dtype}")
    images = [array for array in arrays.values() if array.ndim] or list(arrays.values())
    dtype = jnp.float64 if any(array.dtype == jnp.float64 for array in images) else jnp.float32
    return {key: array.astype(dtype) for key, array in arrays.items()}
