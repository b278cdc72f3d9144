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


def test_a_grazing_normal_keeps_its_side_in_single_precision():
    """Between depths that jump, normals are seen so nearly edge-on that float32 cannot tell the sign of ⟨N, P⟩.

    Such a normal is still right to within a fraction of a degree; to turn it would be to reverse it.
    """
    camera = gtao.PerspectiveCamera(1920, 1080, 1.0).crop(0, 0, 64, 48)
    view_z = np.exp(np.random.default_rng(0).uniform(-2, 2, camera.shape)).astype(np.float32)
    single, double = (gtao.GBuffer(view_z.astype(dtype), None, camera) for dtype in (np.float32, np.float64))
    n, P = single.normal_v.numpy().astype(np.float64), single.position_v.numpy().astype(np.float64)
    assert (np.sum(n * P, axis=-1) > 0).any()
    # A neighbour is nearer by e^4 at most, so the two tangents differ by at least the angle of a pixel over e^4; their
    # rounding turns the plane through them by 2^-24 over that.
    assert np.abs(n - double.normal_v.numpy()).max() < 2**-24 * camera.fy * np.exp(4)


@pytest.mark.parametrize("kind", cameras())
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_normals_between_any_depths_are_unit_vectors(kind, dtype):
    """From 1e-12 to 1e12 side by side: the square of a cross product of such differences would overflow."""
    camera = cameras()[kind]
    view_z = 10 ** np.random.default_rng(2).uniform(-11.9, 11.9, camera.shape)
    n = gtao.GBuffer(view_z.astype(dtype), None, camera).normal_v.numpy()
    # A length, a square root and a division, each rounded.
    assert np.abs(np.linalg.norm(n, axis=-1) - 1).max() <= 3 * np.finfo(dtype).eps
