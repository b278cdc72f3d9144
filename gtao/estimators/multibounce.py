"""Multi-bounce visibility from single-bounce visibility and albedo."""

from typing import Any

import drjit as dr

from gtao import backend
from gtao.config import plain
from gtao.data.multibounce import JIMENEZ2016, MultibounceFit
from gtao.errors import ConfigError, ShapeError
from gtao.kernels.multibounce import evaluate
from gtao.stages import staged

__all__ = ["multibounce"]


def _tensor(value: Any, name: str):
    if dr.is_tensor_v(value):
        return value
    if not (hasattr(value, "__dlpack__") or hasattr(value, "__array_interface__")):
        raise ShapeError(f"{name} must be an array or a number, got {type(value).__name__}")
    tensor = dr.tensor_t(backend.default_float())(value)
    # A NumPy array is aliased, and what is computed later would see how it changed.
    return type(tensor)(dr.opaque(tensor.array), tensor.shape)


def _check_range(tensor: Any, name: str, low: float, high: float) -> None:
    flat = dr.detach(tensor.array)
    wrong = ~((flat >= low) & (flat <= high))
    if dr.any(wrong):
        raise ShapeError(f"{name} must be in [{low:g}, {high:g}]: {dr.count(wrong)[0]} values are not")


def multibounce(visibility: Any, albedo: Any, fit: MultibounceFit = JIMENEZ2016) -> Any:
    """Visibility after several bounces of light, per colour channel.

    The light that occluders reflect back grows with the albedo; a fit maps cosine-weighted visibility and albedo to
    the fraction of ambient light that arrives after ``fit.bounces`` bounces (Jimenez et al. 2016, Eq. 10).

    Args:
        visibility: (H, W) cosine-weighted visibility. Estimates may exceed 1 by sampling error; they are clamped
            to [0, 1] first. A finite radius makes the result an approximation.
        albedo: (H, W, 3) or (H, W) diffuse albedo in [0, 1], or one number for all (a Dr.Jit float of width 1 too).
        fit: published or refitted coefficients.

    Visibility, albedo and coefficients may carry gradients. Where the fit leaves the bounds below, the result and its
    derivatives are those of the bound, which knows no coefficients; visibility above 1 has none.

    Returns:
        Tensor of the shape of ``albedo`` (of ``visibility`` for a number), in [V, V + ρ (1 - V)] (theory, eq. (38)):
        bounces add light, and no surface of albedo ρ under a white dome shines brighter than ρ.

    Raises:
        ShapeError: shapes do not match, an albedo lies outside [0, 1], or a visibility is NaN or negative.
        ConfigError: ``fit`` is not a :class:`MultibounceFit`, or a number of bounces carries a gradient.
    """
    backend.require()
    if not isinstance(fit, MultibounceFit):
        raise ConfigError(f"fit must be a MultibounceFit, got {type(fit).__name__}")
    v = _tensor(visibility, "visibility")
    shape = tuple(v.shape)
    _check_range(v, "visibility", 0, float("inf"))
    V = dr.select(v.array <= 1, v.array, 1)
    number = _number(albedo)
    if number is not None:
        if not 0 <= number <= 1:
            raise ShapeError(f"albedo must be in [0, 1], got {number}")
        out_shape, images, numbers = shape, (V,), (albedo,)
    else:
        a = _tensor(albedo, "albedo")
        out_shape = tuple(a.shape)
        _check_range(a, "albedo", 0, 1)
        if out_shape not in (shape, (*shape, 3)):
            raise ShapeError(f"albedo must have shape {shape} or {(*shape, 3)}, got {out_shape}")
        images, numbers = (V if out_shape == shape else dr.repeat(V, 3), a.array), ()
    whole = fit.form == "sphere_truncated"
    if whole and dr.grad_enabled(fit.coefficients):
        raise ConfigError("the number of bounces of a truncated sphere is whole, which has no derivative; detach it")

    def stage(images, numbers):
        V, rho, *coefficients = (*(image.own for image in images), *numbers)
        return (_bounded(fit.form, fit.numbers if whole else coefficients, V, rho),)

    (f,) = staged(stage, images, numbers if whole else (*numbers, *fit.coefficients))
    return dr.tensor_t(type(f))(f, out_shape)


def _number(albedo: Any) -> float | None:
    """The value of an albedo that is one number for all pixels."""
    if isinstance(albedo, int | float):
        return float(albedo)
    is_scalar = dr.is_array_v(albedo) and not dr.is_tensor_v(albedo) and len(albedo) == 1
    return plain(albedo) if is_scalar else None


def _bounded(form: str, coefficients: Any, V: Any, rho: Any) -> Any:
    """The fitted function between V and the energy bound; where it is on either, derivatives are those of the fit."""
    f = evaluate(form, coefficients, V, rho)
    f = dr.select(f >= V, f, V)
    bound = dr.fma(rho, 1 - V, V)
    return dr.select(f <= bound, f, bound)
