"""Methods where what they all assume is true: the visible directions are a cone, cut by the tangent plane."""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from gtao import backend, evaluate
from gtao.camera import OrthographicCamera
from gtao.config import GTAO
from gtao.estimators import specular_occlusion
from gtao.gbuffer import GBuffer
from gtao.kernels import cones
from gtao.kernels.cone_brdf import cone_brdf, hemisphere_brdf
from gtao.results import AmbientOcclusion

from .methods import EXACT, method_of

__all__ = ["CLOSURE", "TILTS", "Cones", "cone_shaped"]

#: Greatest angles between bent normal and normal, degrees.
TILTS = (30, 50, 90)
#: Reflectances at normal incidence.
F0 = (0.04, 1.0)
#: Configurations are the pixels of a frame of this many rows and columns.
SIDE = 64
#: Microfacet widths are drawn from here up to 1.
LEAST_ALPHA = 0.05
#: Of the sums over the BRDF that others are measured against: 1e-5 of A, where the default has 5e-4.
N_NODES = 48
#: What a table of four axes would be without the error of a table: the bent normal turned into the plane of incidence.
CLOSURE = "no azimuth, no table"


def cone_shaped(names: tuple[str, ...], seed: int) -> dict[str, dict[str, dict[str, float]]]:
    """RMSE of methods that are told the true cone: what is left is what they make of lobe, surface and directions.

    Bent normals are tilted from the normal by angles that are even between 0 and the greatest one, reflected directions
    even over the hemisphere, cosine-weighted visibility of the uncut cone and width of the microfacets even.

    Returns:
        F0 -> greatest tilt in degrees -> method -> root mean square error against the BRDF summed up over the cone.
        Methods that differ in their apertures alone are one here, and have the first one's name.
    """
    methods: dict[str, Any] = {}
    for name in names:
        method = method_of(name)
        if hasattr(method, "aperture"):
            method = replace(method, aperture="matched")
        if method is not None and name != EXACT and method not in methods.values():
            methods[name] = method
    found: dict[str, dict[str, dict[str, float]]] = {f"{f0:g}": {} for f0 in F0}
    for tilt in TILTS:
        given = Cones(math.radians(tilt), seed)
        for f0 in F0:
            exact = given.occlusion(f0)
            rows = {CLOSURE: given.occlusion(f0, azimuth=False)}
            for name, method in methods.items():
                rows[name] = specular_occlusion(given.ao, given.g, given.roughness, f0, method).numpy()
            found[f"{f0:g}"][f"{tilt}"] = {name: evaluate.rmse(image, exact) for name, image in rows.items()}
    return found


class Cones:
    """A frame of cones, drawn at random.

    Attributes:
        g, ao: the frame, and the uniform estimate that the cones would give; its directions are the cones' axes.
        roughness: (H, W) perceptual roughness.
    """

    def __init__(self, tilt: float, seed: int):
        backend.require()
        rng = np.random.default_rng(seed)
        shape = (SIDE, SIDE)
        turn = 2 * math.pi * rng.random(shape)
        # The viewer is at z; the normals are even over the hemisphere of that, as the viewer's directions over theirs.
        self.cos_o = 1 - rng.random(shape)
        n = _direction(np.arccos(self.cos_o), turn)
        across = np.cross(n, _direction(np.full(shape, math.pi / 2), turn + math.pi / 2))
        aside = np.cross(n, across)
        beta, azimuth = tilt * rng.random(shape), 2 * math.pi * rng.random(shape)
        axis = np.cos(beta)[..., None] * n
        axis += np.sin(beta)[..., None] * (np.cos(azimuth)[..., None] * across + np.sin(azimuth)[..., None] * aside)
        self.cos_v = np.sqrt(rng.random(shape))
        self.alpha = LEAST_ALPHA + (1 - LEAST_ALPHA) * rng.random(shape)
        self.roughness = np.sqrt(self.alpha).astype(np.float32)
        self.axis, self.n = axis, n
        camera = OrthographicCamera(SIDE, SIDE, 1.0)
        self.g = GBuffer(np.ones(shape, np.float32), n.astype(np.float32), camera)
        T = self.g.types
        c, cb, sb = (T.Float(x.ravel().astype(np.float32)) for x in (self.cos_v, np.cos(beta), np.sin(beta)))
        share, cosine = cones.solid_angle(c, cb, sb) * (0.5 / math.pi), cones.energy(c, cb, sb)
        # 2 <n, B> is the cosine-weighted visibility.
        length = (cosine / (2 * cb)).numpy().reshape(shape)
        self.ao = AmbientOcclusion(
            visibility=T.Tensor(share, shape),
            mean_direction=T.Tensor((axis * length[..., None]).astype(np.float32)),
            normal_v=self.g.normal_v,
            config=GTAO(weighting="uniform", bent_normal=True),
        )

    def occlusion(self, f0: float, azimuth: bool = True) -> np.ndarray:
        """(H, W) occlusion by the BRDF summed up over the cone, or over one turned into the plane of incidence."""
        v = np.array([0.0, 0.0, 1.0])
        reflected = 2 * self.cos_o[..., None] * self.n - v
        cos_b = (self.axis * reflected).sum(-1)
        inward = (self.axis * self.n).sum(-1) - cos_b * self.cos_o
        outward = (self.axis * np.cross(reflected, self.n)).sum(-1)
        beta = np.arccos(np.clip(cos_b, -1, 1))
        chi = np.arctan2(np.abs(outward), inward) if azimuth else np.zeros_like(beta)
        T = self.g.types
        alpha_v, beta, chi, alpha, theta_o = (
            T.Float(x.ravel().astype(np.float32))
            for x in (np.arccos(self.cos_v), beta, chi, self.alpha, np.arccos(self.cos_o))
        )
        terms = *cone_brdf(alpha_v, beta, chi, alpha, theta_o, N_NODES), *hemisphere_brdf(alpha, theta_o, N_NODES)
        A_V, B_V, A, B = (np.array(x, np.float64).reshape(self.g.shape) for x in terms)
        return (f0 * A_V + B_V) / (f0 * A + B)


def _direction(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
