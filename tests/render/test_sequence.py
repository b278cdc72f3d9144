"""Sequences: their frames are those of scenes loaded in each state, cost nothing twice, and say what is wrong."""

import subprocess
import sys
import weakref

import drjit as dr
import numpy as np
import pytest

from gtao import ConfigError, SceneError, ShapeError, render

import mitsuba as mi  # isort: skip

import _scenes as S


def frames_of(animation, *args, **options):
    """What is kept of frames: index and images."""
    return [
        (f.index, *(v.numpy() for v in (f.g.view_z, f.g.motion, f.moving, f.disoccluded)), f)
        for f in render.sequence(animation, *args, **options)
    ]


def slide(frame):
    return render.rigid((0.1 * frame, 0.02 * frame, 0), axis=(0, 0, 1), angle=0.1 * frame)


def circle(frame):
    return render.look_at((np.sin(0.1 * frame), -4 * np.cos(0.1 * frame), 2), (0, 0, 0.3))


def simple(n_frames=5, size=(20, 16), **options):
    shapes = {"floor": S.cube((-5, -5, -1), (5, 5, 0)), "box": S.cube((-0.5, -0.5, 0), (0.5, 0.5, 0.8))}
    description = S.scene(S.perspective((0, -4, 2), (0, 0, 0.3), size=size), **shapes)
    return render.Animation.from_scene(description, radius=1.0, n_frames=n_frames, **options)


def described(animation, frame):
    """Scene dictionary with everything where it is in a frame, made without a sequence."""
    description = dict(render.animations.build(animation.name, width=24, height=20).scene)
    for key, value in description.items():
        if isinstance(value, mi.Mesh):
            state = animation.state(frame)
            parameters = mi.traverse(value)
            vertices = np.array(parameters["vertex_positions"], dtype=np.float64).reshape(-1, 3)
            if key in state.movers:
                vertices = vertices @ state.movers[key][:3, :3].T + state.movers[key][:3, 3]
            vertices = state.deforming.get(key, vertices)
            parameters["vertex_positions"] = vertices.astype(np.float32).ravel()
            parameters.update()
    return description


@pytest.mark.parametrize("name", ["passing_object", "waves"])
def test_truth_is_that_of_a_scene_loaded_in_the_state_of_the_frame(name):
    animation = render.animations.build(name, width=24, height=20)
    *_, frame = render.sequence(animation, range(7, 10), truth_spp=16, seed=3)
    fresh = render.load_scene(described(animation, 9))
    expected = render.visibility(fresh, max_distance=animation.radius, spp=16, seed=3)
    g = render.gbuffer(fresh)
    np.testing.assert_array_equal(frame.g.view_z.numpy(), g.view_z.numpy())
    np.testing.assert_array_equal(frame.g.normal_v.numpy(), g.normal_v.numpy())
    np.testing.assert_array_equal(frame.g.albedo.numpy(), g.albedo.numpy())
    np.testing.assert_array_equal(frame.truth.mean.numpy(), expected.mean.numpy())
    assert frame.truth.max_distance == animation.radius
    rest = render.load_scene(render.animations.build(name, width=24, height=20).scene)
    assert (render.gbuffer(rest).view_z.numpy() != g.view_z.numpy()).mean() > 0.02


def test_the_camera_takes_its_poses_exactly():
    animation = simple(camera=circle)
    for frame in render.sequence(animation):
        np.testing.assert_allclose(frame.g.view_to_world, circle(frame.index), atol=1e-6)
        np.testing.assert_allclose(render.view_to_world(frame.scene), frame.g.view_to_world)
    as_list = simple(camera=[circle(i) for i in range(5)], n_frames=None)
    assert as_list.n_frames == 5
    for a, b in zip(frames_of(animation), frames_of(as_list), strict=True):
        np.testing.assert_array_equal(a[2], b[2])


def test_a_parallel_camera_keeps_its_scale():
    to_world = S.look_at((0, -4, 2), (0, 0, 0.3)) @ S.transform().scale([1.7, 1.7, 1])
    sensor = {"type": "orthographic", "to_world": to_world, "film": S.film(16, 16)}
    description = S.scene(sensor, floor=S.cube((-5, -5, -1), (5, 5, 0)))
    animation = render.Animation.from_scene(description, radius=1, n_frames=40, camera=circle)
    sizes = {frame.g.camera.view_height for frame in render.sequence(animation)}
    # 1.7 in single precision; the norm of a rotated column is rounded once, not once for every frame.
    assert max(abs(size - 3.4) for size in sizes) < 1e-6


def test_any_part_is_what_the_whole_has_there():
    animation = simple(camera=circle, movers={"box": slide})
    whole = frames_of(animation, truth_spp=8)
    assert [f[0] for f in whole] == list(range(5))
    part = frames_of(simple(camera=circle, movers={"box": slide}), range(2, 5), truth_spp=8)
    for a, b in zip(whole[2:], part, strict=True):
        for x, y in zip(a[:-1], b[:-1], strict=True):
            np.testing.assert_array_equal(x, y)
        np.testing.assert_array_equal(a[-1].truth.mean.numpy(), b[-1].truth.mean.numpy())
    assert len(frames_of(animation, 2)) == 2


def test_the_first_frame_has_no_past():
    frame = next(iter(render.sequence(simple(camera=circle, movers={"box": slide}))))
    assert not frame.g.motion.numpy().any()
    assert frame.g.motion.shape == (16, 20, 3)
    assert frame.disoccluded.numpy().all()
    assert 0 < frame.moving.numpy().mean() < 0.5
    assert frame.truth is None
    assert "0, 20x16" in repr(frame)


def test_what_stands_still_is_traced_once(monkeypatch):
    calls = []
    inner = render.visibility
    # The function hides the module of its name.
    module = sys.modules[render.sequence.__module__]
    monkeypatch.setattr(module, "visibility", lambda *a, **k: calls.append(1) or inner(*a, **k))
    animation = simple(camera=lambda frame: circle(frame // 3), n_frames=6)
    frames = frames_of(animation, truth_spp=8)
    assert len(calls) == 2
    for frame in frames[1:3]:
        assert not frame[2].any()
        assert not frame[4].any()
    np.testing.assert_array_equal(frames[0][-1].truth.mean.numpy(), frames[2][-1].truth.mean.numpy())


def test_two_sequences_of_one_animation_do_not_disturb_each_other():
    animation = simple(movers={"box": slide})
    expected = [f[1] for f in frames_of(animation)]
    for a, b in zip(render.sequence(animation), render.sequence(animation), strict=True):
        np.testing.assert_array_equal(a.g.view_z.numpy(), expected[a.index])
        np.testing.assert_array_equal(b.g.view_z.numpy(), expected[b.index])
    backwards = [next(iter(render.sequence(animation, range(i, i + 1)))).g.view_z.numpy() for i in (4, 1, 3)]
    for i, z in zip((4, 1, 3), backwards, strict=True):
        np.testing.assert_array_equal(z, expected[i])


def test_normals_of_smooth_meshes_turn_with_them():
    vertices, faces = S.sphere_grid(6, 9)
    squeezed = vertices * (0.5, 0.9, 0.7)
    normals = vertices / (0.5, 0.9, 0.7)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    matrix = render.rigid((0.2, 0.1, 0.3), axis=(1, 2, 3), angle=1.1)
    sensor = S.perspective((0, -4, 1), (0, 0, 0), size=(24, 24))
    moved = render.Animation.from_scene(
        S.scene(sensor, egg=S.mesh(squeezed, faces, normals)), radius=1, movers={"egg": [np.eye(4), matrix]}
    )
    *_, frame = render.sequence(moved)
    fresh = S.mesh(squeezed @ matrix[:3, :3].T + matrix[:3, 3], faces, normals @ matrix[:3, :3].T)
    g = render.gbuffer(render.load_scene(S.scene(sensor, egg=fresh)))
    # Rounded to single precision before they turn, and not only after.
    np.testing.assert_allclose(frame.g.normal_v.numpy(), g.normal_v.numpy(), atol=1e-6)
    assert g.mask.numpy().mean() > 0.1


@pytest.mark.parametrize("kind", ["sphere", "rectangle", "disk", "cylinder", "cube"])
def test_shapes_of_all_kinds_move(kind):
    rest = S.transform().translate([0.1, 0, 0.2]) @ S.transform().rotate([1, 0, 0], 60) @ S.transform().scale(0.7)
    sensor = S.perspective((0, -4, 2), (0, 0, 0), size=(24, 24))
    description = S.scene(sensor, thing={"type": kind, "to_world": rest, "bsdf": S.matte()})
    matrix = render.rigid((0.3, 0.2, -0.1), axis=(0, 1, 0.2), angle=0.4)
    animation = render.Animation.from_scene(description, radius=1, movers={"thing": [np.eye(4), matrix]})
    *_, frame = render.sequence(animation)
    moved = mi.ScalarTransform4f(matrix) @ rest
    g = render.gbuffer(render.load_scene(S.scene(sensor, thing={"type": kind, "to_world": moved, "bsdf": S.matte()})))
    # Two products of matrices in single precision, once of vertices and once of the matrix.
    np.testing.assert_array_equal(frame.g.mask.numpy(), g.mask.numpy())
    mask = g.mask.numpy()
    np.testing.assert_allclose(frame.g.view_z.numpy()[mask], g.view_z.numpy()[mask], atol=2e-5)
    assert frame.moving.numpy()[mask].all()
    assert not frame.moving.numpy()[~mask].any()
    assert not frame.disoccluded.numpy()[mask].all()


SCENE_FILE = """<scene version="3.0.0">
  <sensor type="perspective">
    <float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, -4, 2" target="0, 0, 0.3" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="20"/><integer name="height" value="16"/></film>
  </sensor>
  <shape type="cube"><transform name="to_world"><scale x="5" y="5" z="0.5"/></transform></shape>
  <shape type="cube" id="box"><transform name="to_world"><scale value="0.4"/><translate z="1"/></transform></shape>
</scene>"""


def test_scenes_of_all_sources(tmp_path):
    """Files, whose shapes Mitsuba would merge, and shapes without an id, which have numbers."""
    path = tmp_path / "scene.xml"
    path.write_text(SCENE_FILE)
    images = []
    for source in (path, str(path), mi.load_file(str(path), optimize=False)):
        for key in ("box", 1):
            animation = render.Animation.from_scene(source, radius=1, movers={key: slide}, n_frames=3)
            *_, frame = render.sequence(animation)
            images.append(np.concatenate([frame.g.motion.numpy().ravel(), frame.moving.numpy().ravel()]))
            animation.stage.put(animation.state(0), animation.stage.scene.sensors()[0])
    assert np.abs(images[0]).max() > 1
    for image in images[1:]:
        np.testing.assert_array_equal(image, images[0])


def test_a_scene_file_may_be_the_first_thing(tmp_path):
    """Before anything has chosen one of Mitsuba's variants."""
    (tmp_path / "scene.xml").write_text(SCENE_FILE)
    code = (
        "import gtao; a = gtao.render.Animation.from_scene('scene.xml', radius=1, n_frames=2, movers={'box': lambda f: "
    )
    code += "gtao.render.rigid((f, 0, 0))}); print(len(list(gtao.render.sequence(a))))"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.strip() == "2", done.stderr


def test_frames_are_not_kept():
    frames = render.sequence(render.animations.build("passing_object", width=16, height=16), 3)
    for _ in range(3):
        frame = next(frames)
        reference = weakref.ref(frame)
        del frame
        assert reference() is None


def resident():
    with open("/proc/self/statm") as f:
        return int(f.read().split()[1]) * 4096


@pytest.mark.slow
def test_memory_stays_constant():
    animation = render.animations.build("passing_object", width=16, height=16)

    def run(n):
        for _ in range(n):
            for _frame in render.sequence(animation, truth_spp=8):
                pass

    run(1)
    before = resident()
    run(3)
    # 180 frames. Geometry and its tree are 2 MB: one of them kept in ten frames would make 36.
    assert resident() - before < 15e6


def compiled(history):
    """Kernels that were compiled or read from the disk."""
    return sum(not k.get("cache_hit", True) or k.get("cache_disk", False) for k in history)


@pytest.mark.parametrize("name", ["orbit", "passing_object", "waves"])
def test_no_frame_compiles_again(name):
    frames = render.sequence(render.animations.build(name, width=17, height=13), 8, truth_spp=8)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        counts = []
        for _ in frames:
            counts.append(compiled(dr.kernel_history()))
    # Two kernels of the first three frames differ in a handful of Mitsuba's own operations.
    assert counts[3:] == [0] * 5


def test_progress_is_told():
    told = []
    list(render.sequence(simple(movers={"box": slide}), range(1, 4), progress=lambda *a: told.append(a)))
    assert told == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"movers": {"bix": slide}}, SceneError, r"no shape 'bix'; give an id or number of: 0: floor \(Cube\), 1: box"),
        ({"movers": {7: slide}}, SceneError, "there is no shape 7"),
        ({"movers": {"box": slide, 1: slide}}, SceneError, "moved under two names"),
        ({"movers": {"box": slide}, "deforming": {"box": slide}}, ConfigError, "cannot both move and deform"),
        ({"n_frames": 0}, ConfigError, "n_frames must be"),
        ({"n_frames": None}, ConfigError, "nothing tells the number of frames"),
        ({"movers": {"box": [np.eye(4)]}}, ConfigError, "the way of shape 'box' has 1 entries for 5 frames"),
        ({"camera": [np.eye(4)]}, ConfigError, "the camera's path has 1 entries for 5 frames"),
        ({"cut": 5}, ConfigError, "a cut lies between"),
    ],
)
def test_wrong_animations(options, error, words):
    with pytest.raises(error, match=words):
        simple(**options)


def test_wrong_scenes():
    ball = {"type": "sphere", "bsdf": S.matte()}
    sensor = S.perspective((0, -4, 2), (0, 0, 0), size=(8, 8))
    with pytest.raises(SceneError, match="'ball' is of the kind Sphere and cannot deform"):
        render.Animation.from_scene(S.scene(sensor, ball=ball), radius=1, n_frames=2, deforming={"ball": slide})
    group = {"type": "shapegroup", "ball": ball}
    instance = {"type": "instance", "of": {"type": "ref", "id": "group"}}
    copies = S.scene(sensor, group=group, copy=instance, other={"type": "cube"})
    with pytest.raises(SceneError, match="'copy' is of the kind Instance and cannot move"):
        render.Animation.from_scene(copies, radius=1, n_frames=2, movers={"copy": slide})
    with pytest.raises(SceneError, match="cannot move in a scene with instances"):
        render.Animation.from_scene(copies, radius=1, n_frames=2, movers={"other": slide})
    assert len(frames_of(render.Animation.from_scene(copies, radius=1, n_frames=2, camera=circle))) == 2
    with pytest.raises(SceneError, match="no scene file"):
        render.Animation.from_scene("nowhere.xml", radius=1, n_frames=2)


def mirrored(frame):
    return np.diag([1.0, 1, -1, 1])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"camera": mirrored}, "the camera's pose in frame 0 mirrors"),
        ({"camera": lambda frame: np.zeros((4, 4))}, "frame 0 must be rigid"),
        ({"movers": {"box": lambda frame: 2 * np.eye(4)}}, "the matrix of shape 'box' in frame 0 must be rigid"),
        ({"deforming": {"box": lambda frame: np.zeros((3, 3))}}, "shape 'box' has 24 vertices, got 3"),
        ({"deforming": {"box": lambda frame: np.zeros((3, 4))}}, r"must have shape \(V, 3\)"),
        ({"deforming": {"box": lambda frame: np.full((24, 3), np.nan)}}, "not finite"),
    ],
)
def test_wrong_states(options, words):
    with pytest.raises(ShapeError, match=words):
        list(render.sequence(simple(**options)))


SHEARS = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1]])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"camera": [np.eye(4), SHEARS]}, "the camera's pose in frame 1 must be rigid"),
        ({"movers": {"box": [np.eye(4), SHEARS]}}, "the matrix of shape 'box' in frame 1 must be rigid"),
        ({"deforming": {"box": [np.zeros((24, 3)), np.zeros((24, 2))]}}, "the vertices of 'box' in frame 1 must have"),
        ({"deforming": {"box": [np.zeros((24, 3)), np.zeros((23, 3))]}}, "shape 'box' has 24 vertices, got 23"),
    ],
)
def test_lists_are_looked_at_as_a_whole_before_any_frame(options, words):
    with pytest.raises(ShapeError, match=words):
        simple(n_frames=2, **options)


def test_a_stage_tells_scenes_apart_by_all_that_they_hold():
    def digest(origin=(0, -4, 2), height=0.8, reflectance=0.5):
        floor = S.cube((-5, -5, -1), (5, 5, 0)) | {"bsdf": S.matte(reflectance)}
        shapes = {"floor": floor, "box": S.cube((-0.5, -0.5, 0), (0.5, 0.5, height))}
        scene = S.scene(S.perspective(origin, (0, 0, 0.3), size=(8, 8)), **shapes)
        return render.Animation.from_scene(scene, radius=1.0, n_frames=1).stage.digest()

    changes = ({}, {"origin": (0, -4, 3)}, {"height": 0.9}, {"reflectance": 0.6})
    assert len({digest(**change) for change in changes}) == 4
    assert digest() == digest()


@pytest.mark.parametrize(
    ("arguments", "options", "words"),
    [
        ((6,), {}, "has frames 0 to 4, asked for range"),
        ((0,), {}, "has frames 0 to 4"),
        ((range(-1, 3),), {}, "has frames 0 to 4"),
        ((range(0, 4, 2),), {}, "in steps of 1"),
        (([1, 2],), {}, "a number of frames or a range"),
        ((), {"truth_spp": 12}, "spp"),
        ((), {"truth_spp": 8, "radius": -1.0}, "max_distance must be positive"),
        ((), {"normals": "smooth"}, "normals must be one of"),
    ],
)
def test_wrong_requests_are_refused_at_once(arguments, options, words):
    with pytest.raises(ConfigError, match=words):
        render.sequence(simple(), *arguments, **options)


def test_other_wrong_requests():
    with pytest.raises(ConfigError, match=r"expected a gtao\.render\.Animation, got str"):
        render.sequence("orbit")
    with pytest.raises(SceneError, match="there is no sensor 3"):
        render.sequence(simple(), sensor=3)
    with pytest.raises(ConfigError, match="there is no frame 5"):
        simple().state(5)


def test_poses_to_write_paths_with():
    pose = render.look_at((1, 2, 3), (4, 2, 3))
    np.testing.assert_allclose(pose[:3], [[0, 0, -1, 1], [-1, 0, 0, 2], [0, 1, 0, 3]], atol=1e-15)
    scene = render.load_scene(S.scene(S.perspective((1, 2, 3), (-1, 0.5, 2)), ball={"type": "sphere"}))
    np.testing.assert_allclose(render.look_at((1, 2, 3), (-1, 0.5, 2)), render.view_to_world(scene), atol=1e-6)
    matrix = render.rigid((0, 0, 2), axis=(0, 0, 3), angle=np.pi / 2, about=(1, 0, 0))
    np.testing.assert_allclose(matrix @ (1, 0, 5, 1), (1, 0, 7, 1), atol=1e-15)
    np.testing.assert_allclose(matrix @ (2, 0, 0, 1), (1, 1, 2, 1), atol=1e-15)
    for call in (
        lambda: render.look_at((1, 2, 3), (1, 2, 3)),
        lambda: render.look_at((0, 0, 3), (0, 0, 0)),
        lambda: render.look_at((0, 0), (0, 0, 0)),
        lambda: render.rigid(axis=(0, 0, 0)),
        lambda: render.rigid(angle=np.inf),
    ):
        with pytest.raises(ConfigError):
            call()
