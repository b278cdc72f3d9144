"""Motion and disocclusion of frames against solids cast and projected in NumPy, and against the frame before."""

import numpy as np
import pytest
from oracles import motion as oracle

import gtao
from gtao import render

import mitsuba as mi  # isort: skip

import _scenes as S

WIDTH, HEIGHT = 48, 36
#: Single precision: pixel coordinates up to 64 have steps of 4e-6, of which a few add up; at grazing angles Mitsuba's
#: own hit points are off by some 1e-6 of the coordinates, which a pixel there magnifies a hundred times.
PIXELS = 2e-4
#: Depth of up to 13 units in steps of 1e-6, and the same of the hit points, at grazing angles too.
DEPTH = 5e-5
#: Rays end this much above the plane that they lead to, times 1 + the largest coordinate, as Mitsuba's rays begin.
OFFSET = 9e-5 * (1 + 9)


def cube_mesh(size):
    corner = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.asarray(size) / 2
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)]
    faces += [(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
    return corner, np.array(faces)


CUBE = cube_mesh((0.8, 0.5, 1.0))
FLOOR = np.array([(-9.0, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]), np.array([(0, 1, 2), (0, 2, 3)])
BALL = (0.9, 0.1, 0.6), 0.5
STILL_BALL = (-1.2, 0.9, 0.4), 0.4


def cube_way(frame):
    return render.rigid((-0.5 + 0.11 * frame, -0.4, 0.6), axis=(0.2, 0.3, 1), angle=0.07 * frame)


def ball_way(frame):
    return render.rigid((-0.05 * frame, 0.03 * frame, 0.02 * frame), axis=(0, 1, 0), angle=0.2 * frame, about=BALL[0])


def camera_way(frame):
    return render.look_at((0.3 + 0.09 * frame, -4.2, 2.2 + 0.03 * frame), (0.05 * frame, 0.1, 0.4 + 0.02 * frame))


def away(frame):
    """Shows the sky above the floor."""
    return render.look_at((0.2, -4.2, 1.1), (0.08 * frame, 1.0, 1.4 + 0.03 * frame))


CROP = {"crop_width": WIDTH, "crop_height": HEIGHT, "crop_offset_x": 9, "crop_offset_y": 4}


def perspective(**extra):
    return S.perspective((0, -4, 2), (0, 0, 0.4), fov=45.0, size=(WIDTH, HEIGHT), near=0.3) | extra


def parallel(film):
    to_world = S.look_at((0, -4, 2), (0, 0, 0.4)) @ S.transform().scale([2.3, 2.3, 1.2])
    return {"type": "orthographic", "near_clip": 0.2, "to_world": to_world, "film": film}


FOCAL = 0.5 * WIDTH / np.tan(np.radians(45) / 2)
WIDE = 0.5 * 70 / np.tan(np.radians(45) / 2)
SENSORS = {
    "perspective": (
        lambda: perspective(),
        oracle.Eye(FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2, WIDTH, HEIGHT, 0.3),
    ),
    "principal point": (
        lambda: perspective(principal_point_offset_x=0.11, principal_point_offset_y=-0.07),
        oracle.Eye(FOCAL, FOCAL, WIDTH * (0.5 - 0.11), HEIGHT * (0.5 + 0.07), WIDTH, HEIGHT, 0.3),
    ),
    "crop and principal point": (
        lambda: perspective(film=S.film(70, 50, **CROP), principal_point_offset_x=0.05, principal_point_offset_y=0.04),
        oracle.Eye(WIDE, WIDE, 70 * (0.5 - 0.05) - 9, 50 * (0.5 - 0.04) - 4, WIDTH, HEIGHT, 0.3),
    ),
    "parallel": (
        lambda: parallel(S.film(WIDTH, HEIGHT)),
        oracle.Eye(WIDTH / 4.6, WIDTH / 4.6, WIDTH / 2, HEIGHT / 2, WIDTH, HEIGHT, 0.2 * 1.2, parallel=True),
    ),
    "parallel, crop": (
        lambda: parallel(S.film(70, 50, **CROP)),
        oracle.Eye(70 / 4.6, 70 / 4.6, 35 - 9, 25 - 4, WIDTH, HEIGHT, 0.2 * 1.2, parallel=True),
    ),
}


def scene(sensor):
    ball, still = ({"type": "sphere", "center": list(c), "radius": r, "bsdf": S.matte()} for c, r in (BALL, STILL_BALL))
    return S.scene(sensor, floor=S.mesh(*FLOOR), still=still, cube=S.mesh(*CUBE), ball=ball)


SOLIDS = [oracle.Triangles(*FLOOR), oracle.Ball(*STILL_BALL), oracle.Triangles(*CUBE), oracle.Ball(*BALL)]
IDENTITY = np.eye(4)


def matrices(frame):
    return [IDENTITY, IDENTITY, cube_way(frame), ball_way(frame)]


def frame_of(animation, index, **options):
    (frame,) = render.sequence(animation, range(index, index + 1), **options)
    return frame


def images(frame):
    return frame.g.motion.numpy(), frame.moving.numpy(), frame.disoccluded.numpy()


def check(frame, expected, first_mover):
    """A frame against the oracle's."""
    motion, moving, disoccluded = images(frame)
    np.testing.assert_allclose(frame.g.view_z.numpy(), expected.z, atol=DEPTH)
    np.testing.assert_array_equal(moving, expected.which >= first_mover)
    assert np.abs(motion - expected.motion)[..., :2].max() < PIXELS
    assert np.abs(motion - expected.motion)[..., 2].max() < DEPTH
    clear = expected.clearance > OFFSET
    assert clear.mean() > 0.99
    np.testing.assert_array_equal(disoccluded[clear], expected.disoccluded[clear])
    assert 0.005 < expected.disoccluded.mean() < 0.6


@pytest.mark.parametrize("way", [camera_way, away, None], ids=["camera moves", "sky", "camera stands"])
@pytest.mark.parametrize("kind", SENSORS)
def test_motion_and_disocclusion_are_those_of_the_solids(kind, way):
    sensor, eye = SENSORS[kind]
    animation = render.Animation.from_scene(
        scene(sensor()), radius=0.5, camera=way, movers={"cube": cube_way, "ball": ball_way}, n_frames=9
    )
    still = render.look_at((0, -4, 2), (0, 0, 0.4))
    for index in (3, 8):
        frame = frame_of(animation, index)
        poses = [still, still] if way is None else [way(index), way(index - 1)]
        expected = oracle.step(eye, SOLIDS, matrices(index), matrices(index - 1), *poses)
        np.testing.assert_allclose(frame.g.view_to_world, poses[0], atol=1e-6)
        assert np.isin([2, 3], expected.which).all()
        check(frame, expected, 2)


def test_what_does_not_move_has_no_motion_at_all():
    animation = render.Animation.from_scene(
        scene(perspective()), radius=0.5, movers={"cube": cube_way, "ball": lambda _: ball_way(3)}, n_frames=9
    )
    motion, moving, _ = images(frame_of(animation, 5))
    shown = oracle.cast(SOLIDS, [IDENTITY, IDENTITY, cube_way(5), ball_way(3)], *_rays())[1]
    assert (motion[shown == 2, 0] != 0).all()
    assert not motion[shown != 2].any()
    np.testing.assert_array_equal(moving, shown >= 2)


def _rays():
    eye = SENSORS["perspective"][1]
    return eye.rays(render.look_at((0, -4, 2), (0, 0, 0.4)), *eye.centres())


def test_points_behind_the_camera_before_come_from_outside_of_the_frame():
    poses = [render.look_at((0, -4, 2), (0, -8, 2)), render.look_at((0, -4, 2), (0, 0, 0.4))]
    frame = frame_of(render.Animation.from_scene(scene(perspective()), radius=1, camera=poses), 1)
    motion, _, disoccluded = images(frame)
    assert np.isfinite(motion).all()
    x, y = SENSORS["perspective"][1].centres()
    before = np.stack([x - motion[..., 0], y - motion[..., 1]], axis=-1)
    assert ((before < 0) | (before > (WIDTH, HEIGHT))).any(axis=-1).all()
    assert disoccluded.all()


def sheet(frame):
    """A height field of 2 (a - 1) (b - 1) triangles above the floor, other in each frame."""
    a, b = 7, 6
    u, v = np.meshgrid(np.linspace(-1.4, 1.4, a), np.linspace(-1.1, 1.1, b), indexing="ij")
    z = 0.5 + 0.25 * np.sin(2.2 * u + 0.5 * frame) * np.cos(1.8 * v - 0.3 * frame)
    index = np.arange(a * b).reshape(a, b)
    p, q, r, s = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.concatenate([np.stack([p, q, r], -1).reshape(-1, 3), np.stack([p, r, s], -1).reshape(-1, 3)])
    return np.stack([u + 0.2 * z + 0.04 * frame, v, z], axis=-1).reshape(-1, 3), faces


def test_deforming_meshes_move_as_their_vertices():
    eye = SENSORS["perspective"][1]
    shapes = {"floor": S.mesh(*FLOOR), "cube": S.mesh(*CUBE), "sheet": S.mesh(*sheet(0))}
    animation = render.Animation.from_scene(
        S.scene(perspective(), **shapes),
        radius=0.5,
        camera=camera_way,
        movers={"cube": cube_way},
        deforming={"sheet": lambda frame: sheet(frame)[0]},
        n_frames=6,
    )
    for index in (2, 5):
        frame = frame_of(animation, index)
        solids = [oracle.Triangles(*FLOOR), oracle.Triangles(*CUBE), oracle.Triangles(*sheet(index))]
        now, before = ([IDENTITY, cube_way(i), IDENTITY] for i in (index, index - 1))
        old = {2: oracle.Triangles(*sheet(index - 1))}
        expected = oracle.step(eye, solids, now, before, camera_way(index), camera_way(index - 1), old)
        assert (expected.which == 2).mean() > 0.1
        check(frame, expected, 1)


PLATE = np.array([(-0.7, 0.0, -0.6), (0.7, 0, -0.6), (0.7, 0, 0.6), (-0.7, 0, 0.6)])


@pytest.mark.parametrize("faces", [[(0, 1, 2), (0, 2, 3)], [(0, 2, 1), (0, 3, 2)]], ids=["one way", "the other way"])
@pytest.mark.parametrize("deforms", [False, True])
def test_the_other_side_of_a_sheet_is_something_new(faces, deforms):
    """A plate that turns about the vertical: it is nearly edge-on when the sides change."""
    angles = np.radians([70, 80, 100, 110])
    ways = [render.rigid(axis=(0, 0, 1), angle=angle) for angle in angles]
    if deforms:
        options = {"deforming": {"plate": [PLATE @ m[:3, :3].T for m in ways]}}
    else:
        options = {"movers": {"plate": ways}}
    sensor = S.perspective((0, -3, 0), (0, 0, 0), fov=30.0, size=(64, 16))
    animation = render.Animation.from_scene(S.scene(sensor, plate=S.mesh(PLATE, faces)), radius=1, **options)
    _, *frames = render.sequence(animation)
    shares = [frame.disoccluded.numpy()[frame.moving.numpy()].mean() for frame in frames]
    assert all(frame.moving.numpy().sum() > 50 for frame in frames)
    assert shares == [0, 1, 0]


def test_what_was_nearer_than_the_near_plane_is_new():
    sensor = S.perspective((0, -1, 0), (0, 0, 0), fov=60.0, size=(16, 16), near=0.5)
    plates = {
        "plate": S.mesh(PLATE, [(0, 1, 2), (0, 2, 3)]),
        "wall": S.mesh(4 * PLATE + (0, 2, 0), [(0, 1, 2), (0, 2, 3)]),
    }
    poses = [render.look_at((0, y, 0), (0, 9, 0)) for y in (-0.4, -0.45, -0.55, -0.6)]
    animation = render.Animation.from_scene(S.scene(sensor, **plates), radius=1, camera=poses)
    _, *frames = render.sequence(animation)
    depth = [frame.g.view_z.numpy()[8, 8] for frame in frames]
    np.testing.assert_allclose(depth, [2.45, 0.55, 0.6], atol=1e-5)
    assert [bool(frame.disoccluded.numpy()[8, 8]) for frame in frames] == [False, True, False]


@pytest.mark.parametrize("name", render.animations.names())
def test_the_frame_before_shows_the_same_point_where_motion_leads(name):
    """Rays of the frame before, through where motion says that the points were, in the scene of that frame."""
    size = 72
    info = render.animations.get(name)
    index = info.cut or 7
    frame = frame_of(render.animations.build(name, width=size, height=size), index)
    motion, _, disoccluded = images(frame)
    z = frame.g.view_z.numpy()
    last = frame_of(render.animations.build(name, width=size, height=size), index - 1)
    sensor = last.scene.sensors()[0]
    y, x = np.mgrid[:size, :size] + 0.5
    x, y = x - motion[..., 0], y - motion[..., 1]
    inside = (x >= 0) & (x < size) & (y >= 0) & (y < size)
    ray, _ = sensor.sample_ray(0.0, 0.5, mi.Point2f((x / size).ravel(), (y / size).ravel()), mi.Point2f(0.5))
    si = last.scene.ray_intersect(ray)
    to_view = np.linalg.inv(np.array(last.g.view_to_world))
    found = np.where(si.is_valid().numpy(), -(to_view[:3] @ np.vstack([si.p.numpy(), np.ones(size * size)]))[2], np.inf)
    found = found.reshape(size, size)
    with np.errstate(invalid="ignore"):
        off = np.where(np.isinf(z) & np.isinf(found), 0, found - (z - motion[..., 2])) / np.where(np.isinf(z), 1, z)
    # A thousandth of a pixel across a grazing surface makes this much depth; the rays of a few edges slip past them.
    same = np.abs(off) < 2e-3
    kept = ~disoccluded
    assert inside[kept].all()
    assert same[kept].mean() > 0.998 if kept.any() else True
    # What was hidden lay behind what is found there, or shows its other side now.
    hidden = disoccluded & inside
    if name in ("passing_object", "thin_bars", "orbit", "waves"):
        assert hidden.sum() > 10
        assert (off[hidden] < -2e-3).mean() > 0.9


def test_motion_belongs_to_gbuffers_of_the_package():
    """Of a still scene, it is the reprojection that gtao computes without a renderer."""
    animation = render.animations.build("orbit", width=40, height=32)
    last, frame = (frame_of(animation, i) for i in (4, 5))
    expected = gtao.camera_motion(frame.g, last.g.camera, last.g.view_to_world)
    # Both are reprojected in single precision, with matrices made in different ways.
    np.testing.assert_allclose(frame.g.motion.numpy(), expected.numpy(), atol=5e-5)
