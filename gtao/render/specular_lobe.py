"""Directions that a GGX microfacet surface reflects, drawn so that they count almost alike."""

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from gtao.kernels.microfacet import LEAST_ALPHA, ggx_of_sine, schlick, smith_visibility

__all__ = ["Lobe"]


@dataclass
class Lobe:
    """The visible normals of GGX, seen from one side, in the frame of the normal.

    Attributes:
        wo: unit vector to the viewer, z > 0.
        alpha: microfacet width, in [0, 1]; below 1e-4, where single precision ends, it counts as that.
    """

    wo: Any
    alpha: Any

    def __post_init__(self) -> None:
        self.alpha = dr.select(self.alpha > LEAST_ALPHA, self.alpha, LEAST_ALPHA)
        a2, co = dr.square(self.alpha), self.wo.z
        s2 = dr.square(1 + dr.sqrt(dr.square(self.wo.x) + dr.square(self.wo.y)))
        # Share of the cap's lower part whose reflections may lie above the horizon.
        self._above = (1 - a2) * s2 / dr.fma(a2, dr.square(co), s2)
        self._norm = 2 * dr.fma(self._above, co, dr.sqrt(dr.fma(1 - a2, dr.square(co), a2)))

    def sample(self, sample: Any) -> Any:
        """Direction from a point of the unit square, rarely below the horizon (theory, eq. (145))."""
        view = dr.normalize(mi.Vector3f(self.alpha * self.wo.x, self.alpha * self.wo.y, self.wo.z))
        # Uniform on a cap of the sphere about z: what it reflects of the stretched view are its visible normals.
        z = dr.fma(-sample.y, dr.fma(self._above, view.z, 1), 1)
        r = dr.safe_sqrt(dr.fma(-z, z, 1))
        sin_phi, cos_phi = dr.sincos(2 * dr.pi * sample.x)
        h = view + mi.Vector3f(r * cos_phi, r * sin_phi, z)
        h = dr.normalize(mi.Vector3f(self.alpha * h.x, self.alpha * h.y, h.z))
        return mi.Vector3f(dr.fma(2 * dr.dot(self.wo, h), h, -self.wo))

    def density(self, wi: Any) -> Any:
        """Density of :meth:`sample` per solid angle, above the horizon."""
        h = wi + self.wo
        across = dr.square(h.x) + dr.square(h.y)
        return ggx_of_sine(across / dr.fma(h.z, h.z, across), self.alpha) / self._norm

    def weights(self, wi: Any) -> tuple[Any, Any]:
        """The terms (a, b) of f_r cos θ_i over the density; their sum is at most 1, and 0 below the horizon."""
        above = wi.z > 0
        ci = dr.select(above, wi.z, 1)
        weight = dr.select(above, self._norm * smith_visibility(ci, self.wo.z, self.alpha) * ci, 0)
        b = weight * schlick(0.5 * dr.norm(wi + self.wo))
        return weight - b, b
