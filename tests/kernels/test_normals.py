"""Normals from depth face the camera by construction: nothing turns them."""

import numpy as np
import pytest

import gtao


def cameras():
    return {
        "perspective": gtao.PerspectiveCamera(24, 16, 1.9),
        "off-centre, stretched": gtao.PerspectiveCamera(24, 16, fx=9.0, fy=4.0, cx=-30.0, cy=40.0),
        "orthographic": gtao.OrthographicCamera(24, 16, 2.0),
    }


@pytest.mark.parametrize("kind", cameras())
@pytest.mark.parametrize("spread", [0.1, 1.0, 3.0])
def test_every_normal_of_a_random_depth_faces_the_camera(kind, spread):
    """Depths that jump by factors up to e^(2 spread), with holes: ⟨N, P⟩ < 0, strictly, in float64."""
    rng = np.random.default_rng(6)
    camera = cameras()[kind]
    for _ in range(20):
        view_z = np.exp(rng.uniform(-spread, spread, camera.shape))
        view_z[rng.random(camera.shape) < 0.1] = np.inf
        g = gtao.GBuffer(view_z, None, camera)
        n, P = g.normal_v.numpy(), g.position_v.numpy()
        surface = np.isfinite(view_z)
        # Where a pixel has no neighbour on an axis the normal is the substitute (0, 0, 1), which need not face it.
        surface &= (n != [0, 0, 1]).any(axis=-1)
        assert surface.sum() > 200
        toward = (
            n[..., 2]
            if camera.is_orthographic
            else -np.sum(n * P, axis=-1) / np.linalg.norm(P + ~surface[..., None], axis=-1)
        )
        assert toward[surface].min() > 0
