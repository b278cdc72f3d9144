"""What other programs call spherical harmonics: signs, premultiplied kernels and constants, to and from ours.

All of them order coefficients (0, 0), (1, -1), (1, 0), (1, 1), (2, -2), … and take z as the polar axis of the *basis*,
whichever axis their worlds call up. Conversion changes numbers, not axes: that is :func:`gtao.lighting.rotate` with
:func:`gtao.lighting.axes`.

References:
    P.-P. Sloan, "Stupid Spherical Harmonics (SH) Tricks", Game Developers Conference 2008.
    R. Ramamoorthi, P. Hanrahan, "An Efficient Representation for Irradiance Environment Maps", SIGGRAPH 2001.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gtao.errors import ConfigError

from ._checks import as_coefficients
from .basis import cosine_kernel

__all__ = ["CONVENTIONS", "Convention", "convert"]

#: Factors in front of 1; y, z, x; xy, yz, 3z² - 1, xz, x² - y².
_CONSTANTS = np.sqrt(
    np.array([1 / 4, 3 / 4, 3 / 4, 3 / 4, 15 / 4, 15 / 4, 5 / 16, 15 / 4, 15 / 16]) / math.pi,
)


@dataclass(frozen=True, kw_only=True)
class Convention:
    """How stored coefficients follow from ours, each times a factor of its own; theory, eq. (108).

    Attributes:
        phase: each is times (-1)^m: the Condon-Shortley phase.
        irradiance: each is times the clamped cosine's kernel A_l: irradiance in place of radiance.
        over_pi: each is over π: what a white diffuse surface reflects.
        constants: each is times the constant of its harmonic, so that polynomials in x, y, z are left; order 2 at most.
        n_fixed: the only number of coefficients that there is, or None.
        about: where it is used.
    """

    phase: bool = False
    irradiance: bool = False
    over_pi: bool = False
    constants: bool = False
    n_fixed: int | None = None
    about: str = ""

    def factors(self, order: int) -> np.ndarray:
        """((order + 1)²,) stored coefficient over ours."""
        band = np.repeat(np.arange(order + 1), 2 * np.arange(order + 1) + 1)
        m = np.arange((order + 1) ** 2) - band * band - band
        factors = np.where(m % 2 == 0, 1.0, -1.0) if self.phase else np.ones(len(m))
        if self.irradiance:
            factors = factors * cosine_kernel(order)[band]
        if self.over_pi:
            factors = factors / math.pi
        return factors * _CONSTANTS if self.constants else factors


_POLYNOMIAL = {"irradiance": True, "over_pi": True, "constants": True, "n_fixed": 9}

#: The conventions by name.
CONVENTIONS: dict[str, Convention] = {
    "gtao": Convention(about="this package: radiance, no phase"),
    "ramamoorthi-hanrahan": Convention(about="the paper of 2001 and its published coefficients: radiance, no phase"),
    "three.js": Convention(n_fixed=9, about="SphericalHarmonics3 and LightProbe: radiance, no phase, +y up"),
    "condon-shortley": Convention(phase=True, about="radiance with the Condon-Shortley phase, as in Sloan 2008"),
    "directx": Convention(phase=True, about="D3DXSH… and XMSH… functions: radiance with the phase"),
    "drjit": Convention(phase=True, about="drjit.sh_eval: radiance with the phase"),
    "unreal": Convention(phase=True, about="TSHVector: radiance with the phase; left-handed, +z up"),
    "irradiance": Convention(irradiance=True, about="irradiance, no phase: A_l L_lm"),
    "irradiance/pi": Convention(irradiance=True, over_pi=True, about="irradiance over π, no phase"),
    "unity": Convention(**_POLYNOMIAL, about="SphericalHarmonicsL2: polynomials of irradiance/π; left-handed, +y up"),
    "filament": Convention(**_POLYNOMIAL, about="shader coefficients: polynomials of irradiance/π"),
}


def convert(sh: ArrayLike, source: str, target: str = "gtao") -> np.ndarray:
    """The same light in another convention, in the same axes.

    Args:
        sh: (n,) or (n, C) coefficients in the convention ``source``.
        source: a key of :data:`CONVENTIONS`: "gtao", "ramamoorthi-hanrahan", "three.js", "condon-shortley", "directx",
            "drjit", "unreal", "irradiance", "irradiance/pi", "unity", "filament".
        target: likewise.

    Returns:
        Coefficients shaped like ``sh``, in the convention ``target``.

    Raises:
        ConfigError: a convention is unknown; it has nine coefficients and others came; or radiance is wanted of
            irradiance beyond band 2, whose odd bands hold nothing.
        ShapeError: the coefficients have a wrong shape or are not finite.
    """
    c, order = as_coefficients(sh)
    chosen = []
    for argument, name in (("source", source), ("target", target)):
        if name not in CONVENTIONS:
            raise ConfigError(f"{argument} must be one of {', '.join(sorted(CONVENTIONS))}, got {name!r}")
        convention = CONVENTIONS[name]
        if convention.n_fixed not in (None, len(c)):
            raise ConfigError(f"the convention {name!r} has {convention.n_fixed} coefficients, got {len(c)}")
        chosen.append(convention)
    if chosen[0].irradiance and not chosen[1].irradiance and order > 2:
        raise ConfigError(
            f"irradiance holds no odd bands beyond the first, from which radiance of order {order} could be had; give"
            " the first 9 coefficients"
        )
    # Bands that are 0 in both conventions stay 0.
    before, after = chosen[0].factors(order), chosen[1].factors(order)
    factors = after / np.where(before != 0, before, 1)
    return c * factors.reshape(-1, *[1] * (c.ndim - 1))
