"""The surface that composites of irradiance and pre-filtered light stand for, as a BSDF for Mitsuba's integrators."""

from functools import cache
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from .specular_hemisphere import hemisphere_terms
from .specular_lobe import Lobe
from .variant import ensure_variant

__all__ = ["coated"]

#: Name of the plugin.
PLUGIN = "gtao_coated"
#: Texels of the table of the coat's albedo, over the cosine and perceptual roughness: bilinear to 1e-3.
N_TEXELS = 64


def coated(albedo: Any = 0.5, roughness: Any = 0.5, f0: Any = 0.04) -> dict:
    """Dictionary of a Mitsuba BSDF: a diffuse surface under a glossy coat, as :func:`gtao.shade` has it.

    f_r = (1 - F0 A - B) ρ/π plus GGX with height-correlated Smith masking and Schlick's Fresnel term; A and B are those
    of the direction to the viewer (theory, eq. (142)). The light that the coat reflects of a white dome is missing
    below it, so that nothing shines brighter than the dome; unlike layers of nature it is not reciprocal. Of Mitsuba's
    own, ``principled`` comes nearest: without that loss it reflects up to a tenth more of a dome, a fifth at grazing
    angles. ``roughplastic`` loses light at rough boundaries, a third of it at roughness 0.6.

    Args:
        albedo: ρ in [0, 1]: a number, or the dictionary of a Mitsuba texture.
        roughness: perceptual roughness in [0, 1], the root of the microfacet width: likewise.
        f0: reflectance at normal incidence in [0, 1]: likewise.

    Returns:
        Dictionary for a shape of ``mitsuba.load_dict``, two-sided. The albedo of :func:`gtao.render.gbuffer` is ρ.

    Raises:
        BackendError: there is no usable backend.
    """
    _register(ensure_variant())
    return {
        "type": "twosided",
        "bsdf": {"type": PLUGIN, "albedo": albedo, "roughness": roughness, "f0": f0},
    }


@cache
def _register(variant: str) -> None:
    """Make the plugin known to a variant; its class derives from one that each variant has for itself."""

    class Coated(mi.BSDF):
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self._textures = {name: props.get_texture(name) for name in ("albedo", "roughness", "f0")}
            diffuse, glossy = mi.BSDFFlags.DiffuseReflection, mi.BSDFFlags.GlossyReflection
            self.m_components = [glossy | mi.BSDFFlags.FrontSide, diffuse | mi.BSDFFlags.FrontSide]
            self.m_flags = glossy | diffuse | mi.BSDFFlags.FrontSide
            self._table = mi.Texture2f(mi.TensorXf(_albedo_terms()), wrap_mode=dr.WrapMode.Clamp)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> tuple[Any, Any]:
            lobe = self._lobe(si, active)
            glossy = sample1 < 0.5
            wo = dr.select(glossy, lobe.sample(sample2), mi.warp.square_to_cosine_hemisphere(sample2))
            value, pdf = self._eval_pdf(lobe, si, wo, active)
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo, bs.pdf, bs.eta = wo, pdf, 1.0
            bs.sampled_component = dr.select(glossy, mi.UInt32(0), mi.UInt32(1))
            bs.sampled_type = dr.select(
                glossy, mi.UInt32(mi.BSDFFlags.GlossyReflection), mi.UInt32(mi.BSDFFlags.DiffuseReflection)
            )
            return bs, dr.select(pdf > 0, value / pdf, 0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            return self._eval_pdf(self._lobe(si, active), si, wo, active)

        def eval_diffuse_reflectance(self, si: Any, active: Any = True) -> Any:
            return self._colour("albedo", si, active)

        def _lobe(self, si: Any, active: Any) -> Lobe:
            return Lobe(si.wi, dr.square(self._roughness(si, active)))

        def _roughness(self, si: Any, active: Any) -> Any:
            return self._textures["roughness"].eval_1(si, active)

        def _colour(self, name: str, si: Any, active: Any) -> Any:
            return self._textures[name].eval(si, active)

        def _eval_pdf(self, lobe: Lobe, si: Any, wo: Any, active: Any) -> tuple[Any, Any]:
            """f_r cos θ, and the density of :meth:`sample`, which draws from both layers alike."""
            above = (si.wi.z > 0) & (wo.z > 0)
            density, f0 = lobe.density(wo), self._colour("f0", si, active)
            a, b = lobe.weights(wo)
            # Texels stand at their centres, the first and last at the ends of the ranges.
            where = mi.Point2f(si.wi.z, self._roughness(si, active))
            A, B = self._table.eval((where * (N_TEXELS - 1) + 0.5) / N_TEXELS)
            below = (1 - f0 * A - B) * self._colour("albedo", si, active)
            cosine = dr.select(above, wo.z, 0) * (1 / dr.pi)
            value = dr.select(above, (f0 * a + b) * density, 0) + below * cosine
            return value, 0.5 * dr.select(above, density, 0) + 0.5 * cosine

        def traverse(self, callback: Any) -> None:
            for name, texture in self._textures.items():
                callback.put(name, texture, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return f"Coated[{', '.join(self._textures)}]"

    mi.register_bsdf(PLUGIN, Coated)


@cache
def _albedo_terms() -> np.ndarray:
    """A and B over perceptual roughness and the cosine, (N, N, 2) float32."""
    at = np.linspace(0, 1, N_TEXELS)
    roughness, cosine = (x.ravel() for x in np.meshgrid(at, at, indexing="ij"))
    terms = hemisphere_terms(mi.Float(np.maximum(cosine, 1e-4)), mi.Float(roughness**2))
    return np.stack([t.numpy() for t in terms], axis=-1).reshape(N_TEXELS, N_TEXELS, 2).astype(np.float32)
