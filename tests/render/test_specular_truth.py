"""Ray-traced occlusion of glossy reflections against quadrature, closed forms and its own batches."""

import math
from _statistics import assert_mean_is

import _scenes as S
import numpy as np
import pytest
from _openings import shell
from oracles import glossy, golden

from gtao import render


def float64(tensor):
    return tensor.numpy().astype(np.float64)


def looking_down(size=12, **more):
    return S.perspective((0, 0, 3), (0, 0, 0), up=(0, 1, 0), fov=60.0, size=(size, size), **more)


CONES = [(i, o) for i, o in golden.cases("E.full_brdf")]


@pytest.mark.parametrize(("inputs", "outputs"), CONES)
def test_a_cone_of_visibility(inputs, outputs):
    """Golden values of the split reflection of a cone, in and out of the plane of incidence."""
    f0, alpha = inputs["F0"], inputs["alpha"]
    _, b = glossy.frame(inputs["theta_o"], inputs["beta"], inputs["chi"])
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
            expected = glossy.whole(np.arccos(c), roughness**2)
        # The oracle's own error at the narrowest lobe, found by doubling its points; float32.
        np.testing.assert_allclose(found, expected, rtol=0, atol=3e-6)
