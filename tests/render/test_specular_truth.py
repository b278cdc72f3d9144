"""Ray-traced occlusion of glossy reflections against quadrature, closed forms and its own batches."""

import math
from _statistics import assert_mean_is

import _scenes as S
import numpy as np
import pytest
from oracles import golden, reflection

from gtao import render


def float64(tensor):
    return tensor.numpy().astype(np.float64)


def looking_down(size=12, **more):
    return S.perspective((0, 0, 3), (0, 0, 0), up=(0, 1, 0), fov=60.0, size=(size, size), **more)


#: Sides of the opening's rim: inscribed, it loses (π / n)² / 6 of its radius on average, 2.5e-5.
N_RIM = 256
PATCH = 1e-3


def shell(theta_o, b, alpha_v, size=16):
    """A speck at the origin with normal z, inside a sphere that is open within ``alpha_v`` of ``b``."""
    vertices, faces = S.sphere_grid(64, N_RIM, alpha_v)
    across = np.cross(b, [1.0, 0, 0] if abs(b[0]) < 0.7 else [0, 1.0, 0])
    across /= np.linalg.norm(across)
    turned = vertices @ np.stack([across, np.cross(b, across), b])
    v = reflection.frame(theta_o, 0, 0)[0]
    # Half of the speck's height as it appears fills the image: all pixels look at nearly one point.
    fov = 2 * math.degrees(math.atan(0.5 * PATCH * math.cos(theta_o) / 0.5))
    sensor = S.perspective(v / 2, (0, 0, 0), up=(0, 1, 0), fov=fov, size=(size, size), near=1e-3)
    speck = S.rectangle(S.transform().scale([PATCH, PATCH, 1]))
    return S.scene(sensor, speck=speck, shell=S.mesh(turned, faces, name="shell"))


CONES = [(i, o) for i, o in golden.cases("E.full_brdf")]


@pytest.mark.parametrize(("inputs", "outputs"), CONES)
def test_a_cone_of_visibility(inputs, outputs):
    """Golden values of the split reflection of a cone, in and out of the plane of incidence."""
    f0, alpha = inputs["F0"], inputs["alpha"]
    _, b = reflection.frame(inputs["theta_o"], inputs["beta"], inputs["chi"])
    scene = render.load_scene(shell(inputs["theta_o"], b, inputs["alpha_v"]))
    s = render.specular(scene, roughness=math.sqrt(alpha), f0=f0, spp=256, seed=1)
    assert s.terms.mask.all()
    lobes, whole = float64(s.lobes).reshape(-1, 2), float64(s.hemisphere).reshape(-1, 2)
    # Seen from half a unit, a point PATCH / 2 away from the middle appears under another angle by as much.
    np.testing.assert_allclose(whole, [[outputs["A"], outputs["B"]]] * len(whole), rtol=0, atol=2e-3)
    for k, name in enumerate(("A_V", "B_V")):
        assert_mean_is(lobes[:, k], outputs[name], allowance=1e-4 * outputs[name])
    expected = (f0 * outputs["A_V"] + outputs["B_V"]) / (f0 * outputs["A"] + outputs["B"])
    assert_mean_is(float64(s.occlusion.mean).ravel(), expected, allowance=1e-4)
    mirror_like = s.with_f0(1.0).occlusion
    assert_mean_is(float64(mirror_like.mean).ravel(), outputs["S_F1"], allowance=1e-4)
    # 256 rays, weights of at most 2: no more than that of an indicator, doubled.
    assert float64(mirror_like.mean).std() < 2 * 0.5 / math.sqrt(256)


@pytest.mark.parametrize("roughness", [0.0, 0.2, 0.5, 1.0])
def test_the_hemisphere_is_exact(roughness):
    scene = render.load_scene(S.plane(S.perspective((0, -3, 1), (0, 0, 0), fov=60.0, size=(8, 8))))
    s = render.specular(scene, roughness=roughness, spp=8, n_batches=2)
    g = render.gbuffer(scene)
    n, p = float64(g.normal_v), float64(g.position_v)
    mask = g.mask.numpy()
    cosine = -(n * p).sum(-1)[mask] / np.linalg.norm(p[mask], axis=-1)
    for c, found in list(zip(cosine, float64(s.hemisphere)[mask], strict=True))[::7]:
        if roughness == 0:
            expected = np.array([1 - (1 - c) ** 5, (1 - c) ** 5])
        else:
            expected = reflection.whole(np.arccos(c), roughness**2)
        # The oracle's own error at the narrowest lobe, found by doubling its points; float32.
        np.testing.assert_allclose(found, expected, rtol=0, atol=3e-6)
