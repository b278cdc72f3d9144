"""Motion of a still scene, poses of frames, and how both travel, against NumPy written from the definition."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gtao

WIDTH, HEIGHT = 40, 30
PERSPECTIVE = gtao.PerspectiveCamera(WIDTH, HEIGHT, fx=37.0, fy=41.0, cx=17.5, cy=16.25)
WIDER = gtao.PerspectiveCamera(WIDTH, HEIGHT, fx=29.0, cx=21.0)
PARALLEL = gtao.OrthographicCamera(WIDTH, HEIGHT, 3.0, cx=18.0)
SMALLER = gtao.OrthographicCamera(WIDTH, HEIGHT, 2.5)


def pose(rotation_vector=(0, 0, 0), position=(0, 0, 0)):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = Rotation.from_rotvec(rotation_vector).as_matrix(), position
    return matrix


HERE = pose((0.2, -0.4, 0.1), (1.0, -2.0, 0.5))
NEARBY = pose((0.23, -0.36, 0.08), (1.1, -1.95, 0.6))
BEHIND = pose((0.2, -0.4 + np.pi, 0.1), (1.0, -2.0, 0.5))


def depth(background=True, seed=0):
    z = np.random.default_rng(seed).uniform(2, 6, (HEIGHT, WIDTH))
    if background:
        z[:4] = np.inf
    return z


def project(camera, P):
    scale = 1 if camera.is_orthographic else -P[..., 2]
    return camera.cx + camera.fx * P[..., 0] / scale, camera.cy - camera.fy * P[..., 1] / scale, -P[..., 2]


def unproject(camera, z):
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    scale = 1 if camera.is_orthographic else z
    return x, y, np.stack([(x - camera.cx) / camera.fx * scale, (camera.cy - y) / camera.fy * scale, -z], axis=-1)


@pytest.mark.parametrize(
    ("now", "previous"), [(PERSPECTIVE, WIDER), (PARALLEL, SMALLER), (PERSPECTIVE, PARALLEL), (PARALLEL, PERSPECTIVE)]
)
def test_surfaces_move_as_their_world_points_project(now, previous):
    z = depth(background=False)
    g = gtao.GBuffer(z, None, now, view_to_world=HERE)
    motion = gtao.camera_motion(g, previous, NEARBY).numpy()
    x, y, P = unproject(now, z)
    world = P @ HERE[:3, :3].T + HERE[:3, 3]
    x0, y0, z0 = project(previous, (world - NEARBY[:3, 3]) @ NEARBY[:3, :3])
    # Double precision on both sides; coordinates reach 1e2 pixels.
    np.testing.assert_allclose(motion, np.stack([x - x0, y - y0, z - z0], axis=-1), atol=1e-11)


def test_the_background_turns_with_the_camera_alone():
    z = depth()
    g = gtao.GBuffer(z, None, PERSPECTIVE, view_to_world=HERE)
    motion = gtao.camera_motion(g, WIDER, NEARBY).numpy()[:4]
    x, y, direction = unproject(PERSPECTIVE, np.ones_like(z))
    x0, y0, _ = project(WIDER, direction @ HERE[:3, :3].T @ NEARBY[:3, :3])
    expected = np.stack([x - x0, y - y0, np.zeros_like(x)], axis=-1)[:4]
    np.testing.assert_allclose(motion, expected, atol=1e-11)
    moved = pose((0.23, -0.36, 0.08), (50.0, 0.0, -30.0))
    np.testing.assert_array_equal(gtao.camera_motion(g, WIDER, moved).numpy()[:4], motion)


@pytest.mark.parametrize(("now", "previous"), [(PARALLEL, SMALLER), (PERSPECTIVE, PARALLEL), (PARALLEL, PERSPECTIVE)])
def test_the_background_of_a_parallel_camera_stays_in_its_place(now, previous):
    """Its rays all meet at infinity, which tells no pixel from another: not even a turn by half a circle moves it."""
    g = gtao.GBuffer(depth(), None, now, view_to_world=HERE)
    for moved in (NEARBY, BEHIND):
        motion = gtao.camera_motion(g, previous, moved).numpy()
        assert not motion[:4].any()
        assert motion[4:].all(axis=-1).any()


def test_what_was_behind_the_camera_comes_from_outside_every_frame():
    g = gtao.GBuffer(depth(), None, PERSPECTIVE, view_to_world=HERE)
    motion = gtao.camera_motion(g, PERSPECTIVE, BEHIND).numpy()
    assert np.isfinite(motion).all()
    assert (motion[..., :2] == 2.0**20).all()


def test_nothing_moves_before_a_still_camera():
    g = gtao.GBuffer(depth().astype(np.float32), None, PERSPECTIVE, view_to_world=HERE)
    assert not gtao.camera_motion(g, PERSPECTIVE, HERE).numpy().any()


def test_single_precision():
    z = depth().astype(np.float32)
    double = gtao.camera_motion(gtao.GBuffer(z.astype(float), None, PERSPECTIVE, view_to_world=HERE), WIDER, NEARBY)
    single = gtao.camera_motion(gtao.GBuffer(z, None, PERSPECTIVE, view_to_world=HERE), WIDER, NEARBY)
    # A few roundings of coordinates up to 64 pixels, 4e-6 each.
    np.testing.assert_allclose(single.numpy(), double.numpy(), atol=4e-5)


def test_motion_and_pose_stay_with_the_frame(tmp_path):
    g = gtao.GBuffer(depth().astype(np.float32), None, PERSPECTIVE, view_to_world=HERE.tolist())
    assert g.view_to_world == tuple(map(tuple, HERE.tolist()))
    for moving in (motion := gtao.camera_motion(g, WIDER, NEARBY).numpy(), motion[..., :2]):
        whole = g.with_motion(moving)
        part = whole.crop(3, 2, 20, 10)
        np.testing.assert_array_equal(part.motion.numpy(), moving[2:12, 3:23])
        assert part.view_to_world == g.view_to_world
        gtao.io.write_gbuffer(tmp_path / "frame.exr", whole)
        again = gtao.GBuffer.from_exr(tmp_path / "frame.exr")
        np.testing.assert_array_equal(again.motion.numpy(), moving)
        assert again.view_to_world == g.view_to_world
    assert g.motion is None


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        (np.eye(3), "4x4"),
        (None, None),
        ("pose", "4x4 matrix"),
        (np.diag([2.0, 2, 2, 1]), "scales or shears"),
        (np.diag([-1.0, 1, 1, 1]), "mirrors"),
        (pose((0, 0, 0), (1, 2, 3)).T, "transposed"),
        (np.full((4, 4), np.nan), "not finite"),
    ],
)
def test_poses_are_rigid(matrix, words):
    if words is None:
        assert gtao.GBuffer(depth(), None, PERSPECTIVE, view_to_world=None).view_to_world is None
        return
    with pytest.raises(gtao.ShapeError, match=words):
        gtao.GBuffer(depth(), None, PERSPECTIVE, view_to_world=matrix)


def test_refusals():
    g = gtao.GBuffer(depth(), None, PERSPECTIVE, view_to_world=HERE)
    with pytest.raises(gtao.ConfigError, match="no pose"):
        gtao.camera_motion(gtao.GBuffer(depth(), None, PERSPECTIVE), PERSPECTIVE, HERE)
    with pytest.raises(gtao.ConfigError, match="camera must be"):
        gtao.camera_motion(g, "wide", HERE)
    with pytest.raises(gtao.ShapeError, match="8x6, the frame 40x30"):
        gtao.camera_motion(g, gtao.PerspectiveCamera(8, 6, 1.0), HERE)
    motion = np.zeros((HEIGHT, WIDTH, 3))
    motion[3, 4, 1] = np.nan
    with pytest.raises(gtao.ShapeError, match="motion must be finite: 1 value"):
        g.with_motion(motion)
    with pytest.raises(gtao.ShapeError, match="motion must have shape"):
        g.with_motion(np.zeros((HEIGHT, WIDTH)))
