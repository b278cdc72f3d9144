"""Methods of :func:`gtao.specular_occlusion`: what stands for the visible directions and for the reflected lobe."""

from dataclasses import dataclass
from typing import Any, Literal

from gtao.errors import ConfigError

from ._checks import check_choice, check_count, check_number
from .codec import to_dict

__all__ = ["ConeBRDF", "ConeCone", "ConeLobe", "ConeTable", "Lagarde2014", "VisibilityAsSpecular"]

Aperture = Literal["seed", "tilted", "matched"]
Intersection = Literal["exact", "oat"]
Reflection = Literal["power", "drobot", "uludag"]
Lobe = Literal["ggx", "phong"]

#: Nodes of a quadrature of :class:`ConeBRDF` in each of its two dimensions.
FEWEST_NODES, MOST_NODES = 4, 64


class _Method:
    def to_dict(self) -> dict[str, Any]:
        """Plain values that :func:`gtao.method_from_dict` turns back into the same configuration."""
        return to_dict(self)


class _Cone(_Method):
    aperture: Aperture

    def __post_init__(self) -> None:
        check_choice("aperture", self.aperture, Aperture)


def _described(table: Any) -> dict[str, Any] | None:
    names = ("kind", "axes", "size", "n_channels", "source")
    return table and {"type": "SpecularTable"} | {name: getattr(table, name) for name in names}


@dataclass(frozen=True, kw_only=True)
class ConeTable(_Cone):
    """A cone of visible directions about the bent normal, looked up in a table of what the surface reflects of it.

    Args:
        table: a :class:`gtao.data.specular.SpecularTable` of any kind of occlusion; None is the shipped "brdf-4d", cone
            against GGX with two channels, so that every F0 has its own occlusion. One of four coordinates takes the
            bent normal to lean from the reflected direction toward the normal, χ = 0; one of three takes it for the
            normal too, and looks the angle β between bent normal and reflected direction up. Its values may be a
            Dr.Jit tensor that carries gradients; others are uploaded once and must not change.
        environment: the "environment-brdf" table that goes with a ``table`` of two channels; None is the shipped one.
            Inside ``dr.freeze`` both must be given, with Dr.Jit tensors that are arguments of the frozen function.
        aperture: of the cone: "seed" as published, cos α = √(1 - A), which takes the bent normal for the normal;
            "tilted", sin² α = A / ⟨N, B⟩, the cone about the bent normal that has the visibility A if the tangent plane
            leaves it whole; "matched", the cone that has it whether cut or not, which may be wider than a hemisphere.
            With uniform weighting the first two are cos α = 1 - A, and "matched" is the cone of which the tangent plane
            leaves the solid angle 2π A. Theory, eq. (151). The wider cones suit rough surfaces, the seed smooth ones.
    """

    table: Any = None
    environment: Any = None
    aperture: Aperture = "seed"

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("table", "environment"):
            table = getattr(self, name)
            # This room does not know the class.
            kind = getattr(table, "kind", None)
            if table is not None and not isinstance(kind, str):
                raise ConfigError(f"{name} must be None or a SpecularTable, got {type(table).__name__}")
            if table is not None and (kind == "environment-brdf") != (name == "environment"):
                raise ConfigError(f"{name} must be of another kind than {kind!r}: one is occlusion, one the whole lobe")

    def to_dict(self) -> dict[str, Any]:
        """As of the other methods, except that of tables of one's own it tells what they are, not their values."""
        described = {name: _described(getattr(self, name)) for name in ("table", "environment")}
        return {"type": type(self).__name__} | described | {"aperture": self.aperture}


@dataclass(frozen=True, kw_only=True)
class ConeCone(_Cone):
    """The share of a cone about the reflected direction that the visible cone covers (Jimenez et al. 2016).

    Theory, eqs. (132) and (134).

    Args:
        intersection: solid angle of what two cones share: "exact", or "oat", the smoothstep of Oat and Sander 2007.
        reflection: half angle of the reflection cone: "power", cos α_s = u^(α²/2), u = 0.01 as published; "drobot",
            α_s = 2 α (Drobot 2014); "uludag", cos α_s = 0.244^(1/(p+1)) with p = 2/α² - 2 (Uludag 2014).
        u: share of the "power" cone, in (0, 1); a number or a Dr.Jit float of width 1, which may carry a gradient.
        aperture: as of :class:`ConeTable`.
    """

    intersection: Intersection = "exact"
    reflection: Reflection = "power"
    u: Any = 0.01
    aperture: Aperture = "seed"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_choice("intersection", self.intersection, Intersection)
        check_choice("reflection", self.reflection, Reflection)
        if not 0 < check_number("u", self.u) < 1:
            raise ConfigError(f"u must lie between 0 and 1, got {self.u!r}")


@dataclass(frozen=True, kw_only=True)
class ConeLobe(_Cone):
    """The share of a lobe about the reflected direction within the cone of visible directions.

    The lobe is that of pre-filtered probes, n = v = ω_r: theory, eq. (162).

    Args:
        distribution: "ggx", or "phong" with the exponent p = 2/α² - 2 of the half vector.
        aperture: as of :class:`ConeTable`.
    """

    distribution: Lobe = "ggx"
    aperture: Aperture = "seed"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_choice("distribution", self.distribution, Lobe)


@dataclass(frozen=True, kw_only=True)
class ConeBRDF(_Cone):
    """What a GGX surface reflects out of the cone of visible directions, summed up at every pixel.

    What tables approximate, without their error and without a closure: normal, bent normal and reflected direction
    are all three as they are, theory, eq. (165). Cones wider than hemispheres count as hemispheres. Slow, and not for
    functions inside ``dr.freeze``.

    Args:
        aperture: as of :class:`ConeTable`.
        n_nodes: nodes of the quadrature in each of its two dimensions, 4 to 64.
    """

    aperture: Aperture = "seed"
    n_nodes: int = 16

    def __post_init__(self) -> None:
        super().__post_init__()
        check_count("n_nodes", self.n_nodes, FEWEST_NODES, MOST_NODES)


@dataclass(frozen=True, kw_only=True)
class Lagarde2014(_Method):
    """An empirical curve of visibility, roughness and viewing angle (Lagarde and de Rousiers 2014); no directions.

    sat((⟨N, V⟩ + A)^(2^(-16 ϱ - 1)) - 1 + A) with perceptual roughness ϱ, theory, eq. (154).
    """


@dataclass(frozen=True, kw_only=True)
class VisibilityAsSpecular(_Method):
    """The visibility itself, in [0, 1]: ambient occlusion taken for the specular one; no directions."""
