"""What glossy surfaces reflect of light from afar, and how much of it occluders take away."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import drjit as dr

from gtao import backend
from gtao.config import ConeBRDF, ConeCone, ConeLobe, ConeTable, Lagarde2014, VisibilityAsSpecular
from gtao.data import specular as data
from gtao.data.specular import SpecularTable
from gtao.errors import ConfigError
from gtao.gbuffer import GBuffer
from gtao.kernels import caps, lobes
from gtao.kernels.cone_brdf import cone_brdf, hemisphere_brdf
from gtao.kernels.cone_lobe import cone_lobe
from gtao.planes import Planes
from gtao.results import AmbientOcclusion
from gtao.tensors import scalar

from .estimate import check_estimate, check_frame
from .specular_pixels import Pixels, View, limited, shares, spread
from .specular_tables import look_up

__all__ = [
    "Reflection",
    "environment_brdf",
    "environment_terms",
    "reflection_of",
    "specular_occlusion",
    "specular_reflectance",
]


def specular_occlusion(ao: AmbientOcclusion, g: GBuffer, roughness: Any, f0: Any = 0.04, method: Any = None) -> Any:
    """Share of what a glossy surface reflects of a white dome that is left in the presence of occluders.

    S = (F0 A_V + B_V) / (F0 A + B), theory, eq. (143): what an unoccluded pre-filtered reflection is to be multiplied
    by. The surface is GGX with height-correlated Smith shadowing and Schlick's Fresnel term; the methods approximate S
    in different ways.

    Args:
        ao: an estimate of the frame, with bent normals unless the method does without. It is evaluated, if it has not
            been. Where power, floor, ceiling or a fade of small radii shaped its visibility, methods with directions
            take the one that belongs to these. Visibility is limited to [0, 1].
        g: the frame. Normals that face away from the viewer are turned until they are seen edge-on (docs/departures).
        roughness: perceptual roughness in [0, 1], the root of the microfacet width α: a number or (H, W).
        f0: reflectance at normal incidence in [0, 1]: a number, (3,), (H, W) or (H, W, 3).
        method: :class:`gtao.ConeTable` (the default), :class:`gtao.ConeCone`, :class:`gtao.ConeLobe`,
            :class:`gtao.ConeBRDF`, :class:`gtao.Lagarde2014` or :class:`gtao.VisibilityAsSpecular`.

    Returns:
        (H, W) tensor in [0, 1] in the precision of ``g``, or (H, W, 3) where ``f0`` has three channels; 1 on the
        background, 0 where nothing is visible. Lazily evaluated in one kernel. Gradients flow to the estimate's
        visibility and directions, to normals, roughness, F0, a table's values and options that are Dr.Jit floats.

    Raises:
        ConfigError: ``method`` is no method of specular occlusion, or needs another estimate; ``g`` is no frame or
            ``ao`` no estimate.
        ShapeError: the estimate is not of this frame; roughness or F0 have another shape, or lie outside of [0, 1].
    """
    reflection = reflection_of(ao, g, roughness, method)
    return _image(g, [reflection.occlusion(f) for f in shares(f0, "f0", g)], f0, 1)


def specular_reflectance(ao: AmbientOcclusion, g: GBuffer, roughness: Any, f0: Any = 0.04, method: Any = None) -> Any:
    """What a glossy surface reflects of a white dome in the presence of occluders, F0 A_V + B_V: no division.

    Arguments and errors are those of :func:`specular_occlusion`. Methods that know one occlusion for all F0 multiply
    F0 A + B by it.

    Returns:
        (H, W) tensor in [0, 1], or (H, W, 3) where ``f0`` has three channels; 0 on the background.
    """
    reflection = reflection_of(ao, g, roughness, method)
    return _image(g, [reflection.reflectance(f) for f in shares(f0, "f0", g)], f0, 0)


def environment_brdf(g: GBuffer, roughness: Any) -> Any:
    """Scale A and offset B of F0 in what an open surface reflects of a white dome, F0 A + B (Karis 2013).

    Of GGX with height-correlated Smith shadowing and Schlick's Fresnel term, looked up in the shipped table.

    Args:
        g: the frame.
        roughness: perceptual roughness in [0, 1]: a number or (H, W).

    Returns:
        (H, W, 2) tensor, A and B in [0, 1]; 0 on the background. Gradients flow to normals and roughness.

    Raises:
        ConfigError: ``g`` is no frame.
        ShapeError: roughness has another shape, or lies outside of [0, 1].
    """
    backend.require()
    check_frame(g)
    terms = environment_terms(View.of(g, roughness), g.types)
    return Planes(tuple(dr.select(g.mask.array, t, 0) for t in terms), g.shape).tensor()


def reflection_of(ao: Any, g: Any, roughness: Any, method: Any) -> "Reflection":
    """What a method makes of a frame; arguments and errors are those of :func:`specular_occlusion`."""
    backend.require()
    method = ConeTable() if method is None else method
    if type(method) not in _METHODS:
        choices = ", ".join(f"gtao.{kind.__name__}" for kind in _METHODS)
        raise ConfigError(f"method must be one of {choices}, got {type(method).__name__}")
    check_estimate(ao, g)
    _check_needs(method, ao)
    view = View.of(g, roughness)
    pixels = Pixels.of(g, ao, view)
    found = _METHODS[type(method)](pixels, method, g)
    if pixels.b is not None:
        # A mirror's limit of a cone of no width about the reflected direction is no darkness.
        found = [dr.select(pixels.A > 0, s, 0) for s in found[:2]] + found[2:]
    environment = getattr(method, "environment", None)
    flat = getattr(getattr(method, "table", None), "kind", "") == "brdf-3d"
    return Reflection(
        found,
        lambda: environment_terms(view, g.types, environment),
        (lambda: environment_terms(view, g.types, environment, pixels.tilted)) if flat else None,
    )


@dataclass(frozen=True)
class Reflection:
    """What is left of reflections.

    Attributes:
        found: one share for every F0; or two, of the terms with and without F0; or A_V, B_V, A and B themselves.
        environment: function that returns A and B.
        weights: function that returns the A and B that two shares are ratios to, where those are another view's.
    """

    found: list[Any]
    environment: Callable[[], list[Any]]
    weights: Callable[[], list[Any]] | None = None

    def unoccluded(self, f0: Any) -> Any:
        """F0 A + B."""
        _, _, A, B = self._terms
        return dr.fma(f0, A, B)

    def occlusion(self, f0: Any) -> Any:
        """S."""
        if len(self.found) == 1:
            return self.found[0]
        A_V, B_V, A, B = self._terms if self.weights is None else self._weighed(self.weights())
        # Without F0 a mirror that is seen along its normal reflects nothing: the limit of small F0.
        f0 = dr.select(dr.fma(f0, A, B) > 1e-20, f0, 1)
        return limited(dr.fma(f0, A_V, B_V) / dr.fma(f0, A, B))

    def reflectance(self, f0: Any) -> Any:
        """F0 A_V + B_V."""
        if self.weights is not None:
            return self.occlusion(f0) * self.unoccluded(f0)
        A_V, B_V, _, _ = self._terms
        return dr.fma(f0, A_V, B_V)

    @cached_property
    def _terms(self) -> list[Any]:
        return self.found if len(self.found) == 4 else self._weighed(self.environment())

    def _weighed(self, terms: list[Any]) -> list[Any]:
        A, B = terms
        S_A, S_B = self.found if len(self.found) == 2 else self.found * 2
        return [S_A * A, S_B * B, A, B]


def environment_terms(view: View, T: Any, table: SpecularTable | None = None, theta_o: Any = None) -> list[Any]:
    """A and B of every pixel, flat, from the shipped table or another one; seen at another angle if one is given."""
    table = data.shipped("environment-brdf") if table is None else table
    return look_up(table, T, None, None, view.alpha, view.theta_o if theta_o is None else theta_o, None)


def _image(g: GBuffer, channels: list[Any], f0: Any, background: float) -> Any:
    planes = [dr.select(g.mask.array, c, background) for c in channels]
    return g.types.Tensor(planes[0], g.shape) if len(planes) == 1 else Planes(tuple(planes), g.shape).tensor()


def _check_needs(method: Any, ao: AmbientOcclusion) -> None:
    """Raise a ConfigError where the estimate does not hold what the method computes from."""
    for table in ("table", "environment"):
        value = getattr(method, table, None)
        if not isinstance(value, SpecularTable | None):
            raise ConfigError(f"{table} must be None or a SpecularTable, got {type(value).__name__}")
    if isinstance(method, Lagarde2014 | VisibilityAsSpecular):
        return
    name, weighting = type(method).__name__, getattr(ao.config, "weighting", "cosine")
    if ao.planes("mean_direction") is None:
        raise ConfigError(
            f"{name} needs an estimate with bent_normal=True, or directional=True; this one has neither. Without"
            " directions there are gtao.Lagarde2014 and gtao.VisibilityAsSpecular"
        )
    if weighting not in ("cosine", "uniform"):
        raise ConfigError(
            f"{name} needs an estimate with cosine or uniform weighting to find an aperture from, not {weighting!r}"
        )


def _cone_table(p: Pixels, method: ConeTable, g: GBuffer):
    table = data.shipped("brdf-4d") if method.table is None else method.table
    chi = p.chi if table.kind == "brdf-5d" else 0.0
    return look_up(table, g.types, p.alpha_v(method.aperture), p.beta, p.view.alpha, p.view.theta_o, chi)


def _cone_cone(p: Pixels, method: ConeCone, g: GBuffer):
    alpha = p.view.alpha
    if method.reflection == "power":
        alpha_s = lobes.power_aperture(alpha, spread(scalar(method.u, g.types.Float), g))
    else:
        alpha_s = (lobes.drobot_aperture if method.reflection == "drobot" else lobes.uludag_aperture)(alpha)
    share = caps.cap_share if method.intersection == "exact" else caps.oat_share
    return [share(p.alpha_v(method.aperture), alpha_s, p.beta)]


def _cone_lobe(p: Pixels, method: ConeLobe, g: GBuffer):
    # The quadrature's error may lead out of the interval.
    return [limited(cone_lobe(p.alpha_v(method.aperture), p.beta, p.view.alpha, method.distribution))]


def _cone_brdf(p: Pixels, method: ConeBRDF, g: GBuffer):
    if dr.flag(dr.JitFlag.FreezingScope):
        # Its nodes are an array that recordings may not depend on.
        raise ConfigError("ConeBRDF cannot be recorded by dr.freeze; choose another method there")
    alpha_v, alpha, theta_o = p.alpha_v(method.aperture), p.view.alpha, p.view.theta_o
    whole = hemisphere_brdf(alpha, theta_o, method.n_nodes)
    visible = cone_brdf(alpha_v, p.beta, p.chi, alpha, theta_o, method.n_nodes)
    return [*visible, *whole]


def _lagarde(p: Pixels, method: Lagarde2014, g: GBuffer):
    A, nv = p.diffuse, p.view.nv
    exponent = dr.exp2(dr.fma(-16, p.view.roughness, -1))
    return [limited((nv + A) ** exponent - 1 + A)]


#: What is left of reflections at every pixel; see :class:`_Reflection`.
_METHODS: dict[type, Callable[[Pixels, Any, GBuffer], list[Any]]] = {
    ConeTable: _cone_table,
    ConeCone: _cone_cone,
    ConeLobe: _cone_lobe,
    ConeBRDF: _cone_brdf,
    Lagarde2014: _lagarde,
    VisibilityAsSpecular: lambda p, method, g: [p.diffuse],
}
