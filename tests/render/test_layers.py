"""Depth peeling against closed forms, and against points inside of surfaces."""

import numpy as np
import pytest
from oracles import peeling

import gtao
from gtao import ConfigError, SceneError, render

import mitsuba as mi  # isort: skip
import _scenes as S  # isort: skip

INF = np.inf
# Hit points a few units away in float32, along rays that are not perpendicular to what they hit.
ROUNDING = 2e-5


def from_above(size=(20, 16), height=5.0, scale=1.5, near=0.5):
    """Orthographic camera that looks down from z = ``height``; the image is 2 ``scale`` wide."""
    to_world = S.look_at((0, 0, height), (0, 0, 0), up=(0, 1, 0)) @ S.transform().scale([scale, scale, 1])
    return {"type": "orthographic", "near_clip": near, "to_world": to_world, "film": S.film(*size)}


def pinhole(size=(20, 16), height=5.0, fov=30.0):
    return S.perspective((0, 0, height), (0, 0, 0), fov=fov, up=(0, 1, 0), size=size)


def peel(d, n=3, sensor=0):
    """``(g, front, back)`` of a scene dict as NumPy arrays."""
    scene = render.load_scene(d)
    g = render.gbuffer(scene, sensor)
    layers = render.layers(scene, g, n, sensor=sensor)
    return g, layers.front.numpy(), layers.back.numpy()


def extent(front, back):
    """Thickness of the first body, 0 where there is none."""
    return np.where(np.isfinite(front[0]), back[0] - np.where(np.isfinite(front[0]), front[0], 0), 0)


def offsets(camera):
    """(H, W) world x and y of the pixel centres on the plane z = 0 below an orthographic camera."""
    y, x = np.indices(camera.shape) + 0.5
    return (x - camera.cx) / camera.fx, (camera.cy - y) / camera.fy


def slopes(g):
    """(H, W) length of the ray per unit along the optical axis."""
    y, x = np.indices(g.shape) + 0.5
    return np.sqrt(((x - g.camera.cx) / g.camera.fx) ** 2 + ((y - g.camera.cy) / g.camera.fy) ** 2 + 1)


def box(low, high, inverted=False):
    # Mitsuba merges meshes of one material, and fails where their normals differ: hence another grey.
    return {**S.cube(low, high, 0.4 if inverted else 0.5), "flip_normals": inverted}


def ball(centre, radius, inverted=False):
    return {"type": "sphere", "center": list(centre), "radius": radius, "flip_normals": inverted}


def card(z, half, tilt=0.0, at=(0, 0)):
    to_world = S.transform().translate([*at, z]) @ S.transform().rotate([1, 0, 0], tilt)
    return S.rectangle(to_world @ S.transform().scale([half, half, 1]))


@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize("camera", [from_above, pinhole])
def test_a_slab_is_as_thick_as_it_is(camera, inverted):
    g, front, back = peel(S.scene(camera(), slab=box((-9, -9, 0.5), (9, 9, 2), inverted)))
    np.testing.assert_array_equal(front[0], g.view_z.numpy())
    # Along the optical axis, in the corners of the frame as in the middle.
    np.testing.assert_allclose(front[0], 3, rtol=1e-6)
    np.testing.assert_allclose(back[0], 4.5, rtol=1e-6)
    assert np.all(np.isinf(front[1:]))
    assert np.all(np.isinf(back[1:]))


@pytest.mark.parametrize("inverted", [False, True])
def test_the_chord_of_a_sphere(inverted):
    d = S.scene(from_above(), ball=ball((0.2, -0.1, 1), 0.8, inverted))
    g, front, back = peel(d, 1)
    x, y = offsets(g.camera)
    inside = 0.64 - (x - 0.2) ** 2 - (y + 0.1) ** 2
    np.testing.assert_array_equal(g.mask.numpy(), inside > 0)
    half = np.sqrt(np.maximum(inside, 0))[inside > 0]
    # Near the rim a rounding of the position is a large part of what is left of the chord.
    assert np.abs(extent(front, back)[inside > 0] - 2 * half).max() < 1e-3
    deep = half > 0.1
    np.testing.assert_allclose(extent(front, back)[inside > 0][deep], 2 * half[deep], atol=ROUNDING)
    thickness = render.thickness(render.load_scene(d)).numpy()
    np.testing.assert_allclose(thickness[inside > 0], extent(front, back)[inside > 0], atol=1e-6)
    assert np.all(thickness[inside <= 0] == 0)


def test_thickness_along_the_ray_is_thickness_times_its_length():
    scene = render.load_scene(S.scene(pinhole(fov=40.0), ball=ball((0, 0, 1), 1.2)))
    g = render.gbuffer(scene)
    thickness = render.thickness(scene, g).numpy() * slopes(g)
    # Distance of each ray from the centre, 4 in front of the camera.
    inside = 1.2**2 - 16 * (1 - 1 / slopes(g) ** 2)
    m = inside > 0.01
    assert m.sum() > 40
    np.testing.assert_allclose(thickness[m], 2 * np.sqrt(inside[m]), atol=ROUNDING)


def test_two_balls_one_behind_the_other():
    d = S.scene(from_above(), near=ball((0, 0, 2), 0.5), far=ball((0.1, 0, -1), 0.9))
    g, front, back = peel(d)
    x, y = offsets(g.camera)
    near, far = np.hypot(x, y) < 0.45, np.hypot(x - 0.1, y) < 0.8
    both = near & far
    h = np.sqrt(0.25 - (x**2 + y**2)[both])
    np.testing.assert_allclose(front[0][both], 3 - h, atol=ROUNDING)
    np.testing.assert_allclose(back[0][both], 3 + h, atol=ROUNDING)
    h = np.sqrt(0.81 - ((x - 0.1) ** 2 + y**2)[both])
    np.testing.assert_allclose(front[1][both], 6 - h, atol=ROUNDING)
    np.testing.assert_allclose(back[1][both], 6 + h, atol=ROUNDING)
    alone = far & (np.hypot(x, y) > 0.55)
    assert np.all(np.isfinite(back[0][alone]))
    assert np.all(np.isinf(front[1][alone]))
    assert np.all(np.isinf(front[2]))


@pytest.mark.parametrize("inverted", [False, True])
def test_what_is_inside_a_body_does_not_show(inverted):
    d = S.scene(
        from_above(),
        outer=box((-1, -1, 0), (1, 1, 3)),
        inner=box((-0.6, -0.6, 0.5), (0.6, 0.6, 2), inverted),
        innermost=ball((0, 0, 1), 0.3),
        letter=card(2.5, 0.9),
    )
    g, front, back = peel(d)
    m = g.mask.numpy()
    np.testing.assert_allclose(front[0][m], 2, rtol=1e-6)
    np.testing.assert_allclose(back[0][m], 5, rtol=1e-6)
    assert np.all(np.isinf(front[1]))


def test_overlapping_bodies_are_one():
    d = S.scene(from_above(), a=box((-1, -1, 1), (1, 1, 3)), b=box((-1, -1, 0), (1, 1, 2)))
    _, front, back = peel(d)
    m = np.isfinite(front[0])
    np.testing.assert_allclose(front[0][m], 2, rtol=1e-6)
    np.testing.assert_allclose(back[0][m], 5, rtol=1e-6)
    assert np.all(np.isinf(front[1]))


@pytest.mark.parametrize("tilt", [0.0, 40.0, 180.0])
def test_a_card_is_a_sheet_whichever_side_shows(tilt):
    d = S.scene(from_above(), card=card(1, 0.5, tilt), slab=box((-9, -9, -1), (9, 9, 0)))
    g, front, back = peel(d)
    over = g.view_z.numpy() < 4.9
    assert over.sum() > 10
    np.testing.assert_array_equal(back[0][over], front[0][over])
    np.testing.assert_allclose(front[1][over], 5, rtol=1e-6)
    np.testing.assert_allclose(back[1][over], 6, rtol=1e-6)
    assert np.all(render.thickness(render.load_scene(d), g).numpy()[over] == 0)


def test_cards_in_front_of_the_sky_and_of_each_other():
    """Cards that turn alternate sides to the camera are no bodies, though front and back faces alternate."""
    cards = {f"card{i}": card(3 - 0.5 * i, 0.6, tilt=180.0 * (i % 2)) for i in range(5)}
    far = {"far": card(-1, 0.1, at=(9, 9))}  # makes the scene large
    g, front, back = peel(S.scene(from_above(), **cards, **far), 6)
    over = g.mask.numpy()
    for k in range(5):
        np.testing.assert_allclose(front[k][over], 2 + 0.5 * k, rtol=1e-6)
        np.testing.assert_array_equal(front[k][over], back[k][over])
    assert np.all(np.isinf(front[5]))


def test_the_ground_is_never_left():
    d = S.scene(from_above(), ground=card(0, 50), box=box((-0.5, -0.5, 0), (0.5, 0.5, 1)), up=card(2, 0.2))
    g, front, back = peel(d)
    x, y = offsets(g.camera)
    on = np.maximum(np.abs(x), np.abs(y)) < 0.5
    sheet = np.maximum(np.abs(x), np.abs(y)) < 0.2
    assert np.all(np.isinf(back[0][~on]))
    # The box stands on the ground and is one with it.
    np.testing.assert_allclose(front[0][on & ~sheet], 4, rtol=1e-6)
    assert np.all(np.isinf(back[0][on & ~sheet]))
    np.testing.assert_allclose(back[0][sheet], 3, rtol=1e-6)
    np.testing.assert_allclose(front[1][sheet], 4, rtol=1e-6)
    assert np.all(np.isinf(back[1][sheet]))
    assert np.all(np.isinf(render.thickness(render.load_scene(d), g).numpy()[~on]))
    # Where a rounding puts the ground above the bottom of the box, and where below.
    _, front, back = peel(S.scene(pinhole(fov=50), ground=card(0, 50), box=box((-5, -6, 0), (6, 5.7, 0.7))))
    np.testing.assert_allclose(front[0], 4.3, rtol=1e-6)
    assert np.all(np.isinf(back[0]))


def test_a_box_on_a_slab_is_one_body_with_it():
    """Bottom and top lie in one plane, and a tracer reports only one of them."""
    shapes = {"slab": box((-9, -9, -1), (9, 9, 0))}
    shapes |= {f"box{i}": box((-1 + 0.5 * i, -1, 0), (-0.6 + 0.5 * i, 1, 0.3 + 0.2 * i)) for i in range(4)}
    wide = {"slab": shapes["slab"], "box": box((-5, -5, 0), (5, 5, 0.5))}
    for d in (S.scene(from_above(), **shapes), S.scene(pinhole(), **wide)):
        g, front, back = peel(d)
        np.testing.assert_array_equal(front[0], g.view_z.numpy())
        np.testing.assert_allclose(back[0], 6, rtol=1e-5)
        assert np.all(np.isinf(front[1]))


def test_inside_of_a_box_nothing_is_known_behind_the_walls():
    for inverted in (False, True):
        _, front, back = peel(S.scene(pinhole(fov=80.0), room=box((-6, -6, -6), (6, 6, 6), inverted)))
        assert np.all(np.isfinite(front[0]))
        assert np.all(np.isinf(back[0]))


def _panels(low, high):
    """A box of six rectangles, as scenes by hand have them."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    middle, half = (low + high) / 2, (high - low) / 2
    turns = [([1, 0, 0], 0), ([1, 0, 0], 180), ([0, 1, 0], 90), ([0, 1, 0], -90), ([1, 0, 0], 90), ([1, 0, 0], -90)]
    shapes = {}
    for i, (axis, angle) in enumerate(turns):
        to_world = S.transform().translate(list(middle)) @ S.transform().scale(list(half))
        to_world = to_world @ S.transform().rotate(axis, angle) @ S.transform().translate([0, 0, 1])
        shapes[f"panel{i}"] = S.rectangle(to_world)
    return shapes


def test_faces_of_several_shapes_make_one_body():
    far = {"far": card(-3, 0.1, at=(20, 20))}
    for shapes in (
        _panels((-0.73, -0.51, 0.33), (0.61, 0.77, 1.9)),
        # A can of three shapes, upright and lying.
        _can(S.transform()),
        _can(S.transform().rotate([1, 0, 0], 71)),
    ):
        _, front, back = peel(S.scene(from_above(), **shapes, **far))
        whole = np.isfinite(front[0])
        assert whole.sum() > 20
        assert extent(front, back)[whole].min() > 0
        assert np.all(np.isinf(front[1]))
    g, front, back = peel(S.scene(from_above(), **_can(S.transform()), **far))
    x, y = offsets(g.camera)
    np.testing.assert_allclose(extent(front, back)[np.hypot(x, y) < 0.6], 1.2, atol=ROUNDING)


def _can(turn):
    place = turn @ S.transform().translate([0, 0, 0.4]) @ S.transform().scale([0.7, 0.7, 1.2])
    top, bottom = S.transform().translate([0, 0, 1]), S.transform().rotate([1, 0, 0], 180)
    return {
        "side": {"type": "cylinder", "to_world": place},
        "top": {"type": "disk", "to_world": place @ top},
        "bottom": {"type": "disk", "to_world": place @ bottom},
    }


def test_pipes_and_disks_alone():
    """A pipe has no ends: seen through, it is not there; from the side, it is a body to the ray."""
    pipe = {"type": "cylinder", "p0": [0, -1, 1], "p1": [0, 1, 1], "radius": 0.5}
    far = {"far": card(-3, 0.1, at=(20, 20))}
    g, front, back = peel(S.scene(from_above(), pipe=pipe, **far))
    x, y = offsets(g.camera)
    m = (np.abs(x) < 0.4) & (np.abs(y) < 0.9)
    np.testing.assert_allclose(extent(front, back)[m], 2 * np.sqrt(0.25 - x[m] ** 2), atol=ROUNDING)
    upright = {"type": "cylinder", "p0": [0, 0, 0], "p1": [0, 0, 1], "radius": 0.5}
    g, front, back = peel(S.scene(from_above(), pipe=upright, slab=box((-9, -9, -1), (9, 9, 0))))
    np.testing.assert_allclose(front[0], 5, rtol=1e-6)
    np.testing.assert_allclose(back[0], 6, rtol=1e-6)
    g, front, back = peel(S.scene(from_above(), disk={"type": "disk"}, **far))
    np.testing.assert_array_equal(front, back)


def test_a_mesh_is_what_its_edges_say_not_its_vertices():
    """Every triangle with vertices of its own, and the triangles in two shapes: still one closed surface."""
    vertices, faces = S.sphere_grid(10, 14)
    vertices = vertices + np.array([0, 0, 1])
    split = vertices[faces].reshape(-1, 3)
    triangles = np.arange(len(split)).reshape(-1, 3)
    far = {"far": card(-3, 0.1, at=(20, 20))}
    halves = {"a": S.mesh(split, triangles[::2]), "b": S.mesh(split, triangles[1::2])}
    _, front, back = peel(S.scene(from_above(), whole=S.mesh(vertices, faces), **far))
    _, other_front, other_back = peel(S.scene(from_above(), **halves, **far))
    np.testing.assert_array_equal(other_front, front)
    np.testing.assert_array_equal(other_back, back)
    assert extent(front, back)[np.isfinite(front[0])].max() > 1.9


def test_the_same_box_twice():
    twice = {name: box((-1, -1, 0), (1, 1, 1)) for name in "ab"}
    _, front, back = peel(S.scene(from_above(), **twice))
    m = np.isfinite(front[0])
    np.testing.assert_allclose(extent(front, back)[m], 1, rtol=1e-5)
    assert np.all(np.isinf(front[1]))


def test_instances_of_a_group():
    group = {"type": "shapegroup", "box": {"type": "cube"}}
    d = S.scene(from_above(scale=4.1), group=group)
    for i, z in enumerate((0.5, -2.5)):
        to_world = S.transform().translate([0, 0, z]) @ S.transform().scale([1, 1, 0.5])
        d[f"i{i}"] = {"type": "instance", "g": {"type": "ref", "id": "group"}, "to_world": to_world}
    _, front, back = peel(d)
    m = np.isfinite(front[0])
    assert m.sum() > 10
    for k, (low, high) in enumerate(((4, 5), (7, 8))):
        np.testing.assert_allclose(front[k][m], low, rtol=1e-6)
        np.testing.assert_allclose(back[k][m], high, rtol=1e-6)


def test_instances_of_a_card_are_surfaces_of_their_own():
    """Two that face up, one behind the other, and one that faces down: sheets, and none is taken for another."""
    group = {"type": "shapegroup", "card": {"type": "rectangle"}}
    d = S.scene(from_above(scale=4.1), group=group, ball=ball((0, 0, -1), 0.2), slab=box((-9, -9, -3), (9, 9, -2.9)))
    for i, (z, turn) in enumerate(((2, 0), (1, 0), (0, 180))):
        to_world = S.transform().translate([0, 0, z]) @ S.transform().rotate([1, 0, 0], turn)
        d[f"i{i}"] = {"type": "instance", "g": {"type": "ref", "id": "group"}, "to_world": to_world}
    g, front, back = peel(d, 4)
    m = g.view_z.numpy() < 4
    assert m.sum() > 10
    for k, depth in enumerate((3, 4, 5)):
        np.testing.assert_allclose(front[k][m], depth, rtol=1e-6)
        np.testing.assert_array_equal(back[k][m], front[k][m])


@pytest.mark.parametrize("inverted", [False, True])
def test_the_sides_of_an_open_surface_count(inverted, tmp_path):
    """A pipe seen from the side is a body; turned inside out, each of its walls is a sheet."""
    pipe = {"type": "cylinder", "p0": [0, -1, 1], "p1": [0, 1, 1], "radius": 0.5, "flip_normals": inverted}
    far = {"far": card(-3, 0.1, at=(20, 20))}
    g, front, back = peel(S.scene(from_above(), pipe=pipe, **far))
    x, y = offsets(g.camera)
    m = (np.abs(x) < 0.4) & (np.abs(y) < 0.9)
    assert np.all((front[0] == back[0])[m] == inverted)
    # In a mesh that is traced in parts, because a box stands on the ground.
    pieces = [
        _corners((-9, -9, -1), (9, 9, 0)),
        _corners((0.9, -1, 0), (1.3, 1, 0.5)),
        _corners((-1, -1, 1), (0, 1, 2)),
    ]
    pieces[2] = (pieces[2][0], pieces[2][1][2:])  # without the side at low x
    starts = np.cumsum([0] + [len(v) for v, _ in pieces])[:-1]
    faces = np.concatenate([f + start for (_, f), start in zip(pieces, starts, strict=True)])
    S.mesh(np.concatenate([v for v, _ in pieces]), faces).write_ply(str(tmp_path / "all.ply"))
    ply = {"type": "ply", "filename": str(tmp_path / "all.ply"), "face_normals": True, "flip_normals": inverted}
    g, front, back = peel(S.scene(from_above(), all=ply))
    x, y = offsets(g.camera)
    m = (x > -0.9) & (x < -0.1) & (np.abs(y) < 0.9)
    assert m.sum() > 10
    np.testing.assert_allclose(back[0][m], 3 if inverted else 4, rtol=1e-6)


def test_merging_meshes_when_a_scene_is_loaded_changes_nothing():
    shapes = {"slab": box((-9, -9, -1), (9, 9, 0))}
    for i in range(4):
        shapes[f"box{i}"] = {**box((-1 + 0.5 * i, -1, 0), (-0.6 + 0.5 * i, 1, 0.3 + 0.2 * i))}
    grey = S.matte()
    for shape in shapes.values():
        shape["bsdf"] = {"type": "ref", "id": "grey"}
    d = {"type": "scene", "grey": {**grey, "id": "grey"}, "sensor": pinhole(), **shapes}
    merged, apart = (mi.load_dict(d, optimize=choice) for choice in (True, False))
    assert (len(merged.shapes()), len(apart.shapes())) == (1, 5)
    a, b = (render.layers(scene, None, 3) for scene in (merged, apart))
    np.testing.assert_array_equal(a.front.numpy(), b.front.numpy())
    np.testing.assert_array_equal(a.back.numpy(), b.back.numpy())


@pytest.mark.parametrize("count", [7, 8, 9, 40])
def test_many_layers(count):
    """More crossings than one launch keeps, and none lost between launches."""
    slabs = {f"s{i}": box((-3, -3, 3 - 0.1 * i), (3, 3, 3.05 - 0.1 * i)) for i in range(count)}
    _, front, back = peel(S.scene(pinhole(size=(6, 5)), **slabs), count + 1)
    for k in range(count):
        np.testing.assert_allclose(front[k], 1.95 + 0.1 * k, rtol=1e-6)
        np.testing.assert_allclose(back[k], 2 + 0.1 * k, rtol=1e-6)
    assert np.all(np.isinf(front[count]))


def test_a_foil_is_not_lost():
    """1e-5 units thick, five away: thinner than the offset of Mitsuba's own rays by a factor of fifty."""
    for turn in (0.0, 35.0):
        to_world = S.transform().rotate([1, 0.3, 0], turn) @ S.transform().scale([9, 9, 5e-6])
        _, front, back = peel(S.scene(pinhole(), foil={"type": "cube", "to_world": to_world}))
        thickness = extent(front, back)
        # view_z near 5 has steps of 4.8e-7; a few roundings on either face.
        assert thickness.min() > 5e-6
        assert thickness.max() < 3e-5
        assert np.all(np.isinf(front[1]))


def test_far_from_the_origin():
    at = np.array([3e4, -2e4, 1e4])
    slab = S.cube(at - np.array([50, 0, 50]), at + np.array([50, 0.5, 50]))
    card_ = S.rectangle(
        S.transform().translate(list(at - (0, 1, 0)))
        @ S.transform().rotate([1, 0, 0], 90)
        @ S.transform().scale([0.3, 0.3, 1])
    )
    g, front, back = peel(S.scene(S.perspective(at - (0, 3, 0), at, fov=50.0), slab=slab, card=card_))
    over = g.view_z.numpy() < 2.5
    assert 20 < over.sum() < 500
    # Hit points are only known to 3e4 * 2^-24 there.
    np.testing.assert_allclose(extent(front, back)[~over], 0.5, atol=4e-3)
    np.testing.assert_array_equal(back[0][over], front[0][over])
    np.testing.assert_allclose(back[1][over] - front[1][over], 0.5, atol=4e-3)


def _rays(g, scene):
    """(H W, 3) origins and directions of the pixel centres in float64, and units along the axis per unit of ray."""
    _, view_to_world = render.camera_from_sensor(scene.sensors()[0])
    y, x = np.indices(g.shape).reshape(2, -1) + 0.5
    camera = g.camera
    X, Y = (x - camera.cx) / camera.fx, (camera.cy - y) / camera.fy
    if camera.is_orthographic:
        direction, start = np.broadcast_to([0.0, 0.0, -1.0], (len(x), 3)), np.stack([X, Y, 0 * X], 1)
    else:
        direction, start = np.stack([X, Y, -np.ones_like(X)], 1), np.zeros((len(x), 3))
    length = np.linalg.norm(direction, axis=1, keepdims=True)
    R, c = view_to_world[:3, :3], view_to_world[:3, 3]
    return start @ R.T + c, direction / length @ R.T, -(direction / length)[:, 2]


def _corners(low, high):
    v = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * (np.subtract(high, low)) + low
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return v, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def _random_scene(seed, merged):
    """Boxes and balls that overlap, nest, touch and stand on a slab, half of them inside out, and cards."""
    rng = np.random.default_rng(seed)
    solids, sheets = [_corners((-4, -4, -0.5), (4, 4, 0))], []
    for i in range(9):
        size, at = rng.uniform(0.2, 0.9, 3), rng.uniform(-1.2, 1.2, 3)
        if i < 4:
            at[2] = 0.0  # stands on the slab
            if i % 2:
                at, size = np.round(at * 4) / 4, np.round(size * 4 + 1) / 4  # side by side with another, face to face
            v, f = _corners(at, at + size)
        elif i < 7:
            v, f = S.sphere_grid(7, 11)
            v = v * size + at + np.array([0, 0, 1])
        else:
            v, f = _corners((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))
            v = v @ np.linalg.qr(rng.normal(size=(3, 3)))[0] * size + at + (0, 0, 1.5)
        solids.append((v, f[:, ::-1] if i % 2 else f))
    for _ in range(5):
        v = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]) * 0.4
        v = v @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + rng.uniform(-1, 1, 3) + (0, 0, 1.5)
        sheets.append((v, np.array([(0, 1, 2), (0, 2, 3)])))
    pieces = [(np.float32(v).astype(float), f) for v, f in (*solids, *sheets)]
    if merged:
        starts = np.cumsum([0] + [len(v) for v, _ in pieces])[:-1]
        faces = np.concatenate([f + s for (_, f), s in zip(pieces, starts, strict=True)])
        shapes = {"all": S.mesh(np.concatenate([v for v, _ in pieces]), faces)}
    else:
        shapes = {f"m{i}": S.mesh(v, f, name=f"m{i}") for i, (v, f) in enumerate(pieces)}
    triangles = [v[f] for v, f in pieces]
    return shapes, triangles[: len(solids)], triangles[len(solids) :]


@pytest.mark.parametrize("merged", [True, False], ids=["one mesh", "many shapes"])
@pytest.mark.parametrize("seed", range(4))
def test_against_points_inside_of_surfaces(seed, merged):
    shapes, solids, sheets = _random_scene(seed, merged)
    camera = from_above(size=(12, 10)) if seed == 3 else S.perspective((2.1, -3.9, 3.2), (0, 0, 0.4), 38, size=(12, 10))
    scene = render.load_scene(S.scene(camera, **shapes))
    g = render.gbuffer(scene)
    layers = render.layers(scene, g, 5)
    front, back = (v.numpy().reshape(5, -1) for v in (layers.front, layers.back))
    np.testing.assert_array_equal(front[0], g.view_z.numpy().ravel())
    wrong = 0
    for i, (o, d, along) in enumerate(zip(*_rays(g, scene), strict=True)):
        want = np.stack(peeling.layers(o, d, solids, sheets, 5)) * along
        got = np.stack([front[:, i], back[:, i]])
        wrong += not np.allclose(got, want, rtol=1e-5, atol=3e-5)
    # Of 120 rays one may graze an edge, where a body is there in one precision and not in the other.
    assert wrong <= 1
    assert np.isfinite(front[1]).sum() > 20
    assert np.isfinite(front[2]).sum() > 5
    assert (front[0] == back[0]).sum() + (front[1] == back[1]).sum() > 5


def test_a_frame_with_a_guard_band():
    shapes, _, _ = _random_scene(1, True)
    scene = render.load_scene(S.scene(S.perspective((2.1, -3.9, 3.2), (0, 0, 0.4), 38, size=(24, 16)), **shapes))
    plain = render.layers(scene, render.gbuffer(scene), 3)
    g = render.gbuffer(scene, guard_px=5)
    layers = render.layers(scene, g, 3)
    assert layers.shape == (3, 26, 34)
    inner = layers.crop(5, 5, 24, 16)
    np.testing.assert_array_equal(inner.front.numpy(), plain.front.numpy())
    np.testing.assert_array_equal(inner.back.numpy(), plain.back.numpy())
    whole = gtao.GBuffer(g.view_z, g.normal_v, g.camera, layers=layers)
    assert whole.crop(5, 5, 24, 16).layers.shape == (3, 16, 24)


def test_a_rounded_frame_keeps_its_depth_and_the_thickness():
    scene = render.load_scene(S.scene(pinhole(), ball=ball((0, 0, 1), 1.2), slab=box((-9, -9, -0.01), (9, 9, 0))))
    g = render.gbuffer(scene)
    half = g.view_z.numpy().astype(np.float16).astype(np.float32)
    rounded = gtao.GBuffer(half, g.normal_v, g.camera)
    layers = render.layers(scene, rounded, 2)
    np.testing.assert_array_equal(layers.front.numpy()[0], half)
    np.testing.assert_allclose(layers.thickness.numpy(), render.thickness(scene, g).numpy(), atol=2e-6)
    double = gtao.GBuffer(half.astype(np.float64), g.normal_v, g.camera)
    assert render.layers(scene, double, 1).front.numpy().dtype == np.float64
    gtao.GBuffer(double.view_z, g.normal_v, g.camera, layers=render.layers(scene, double, 1))


def test_pixels_without_a_surface_in_either_have_no_layers():
    scene = render.load_scene(S.scene(pinhole(), ball=ball((0, 0, 1), 0.7)))
    g = render.gbuffer(scene)
    holed = g.view_z.numpy().copy()
    holed[7, 9:11] = INF
    layers = render.layers(scene, gtao.GBuffer(holed, g.normal_v, g.camera), 2)
    np.testing.assert_array_equal(layers.front.numpy()[0], holed)
    assert np.all(np.isinf(layers.back.numpy()[:, 7, 9:11]))
    np.testing.assert_array_equal(layers.thickness.numpy()[7, 9:11], 0)
    empty = render.load_scene({"type": "scene", "sensor": pinhole()})
    assert np.all(np.isinf(render.layers(empty).front.numpy()))
    assert render.layers(empty).shape == (4, 16, 20)


def test_peeling_leaves_the_scene_as_it_is():
    shapes, _, _ = _random_scene(2, False)
    scene = render.load_scene(S.scene(S.perspective((2.1, -3.9, 3.2), (0, 0, 0.4), 38), **shapes))
    before = render.gbuffer(scene).view_z.numpy()
    fingerprint = render.fingerprint(scene)
    first = render.layers(scene)
    second = render.layers(scene)
    np.testing.assert_array_equal(first.back.numpy(), second.back.numpy())
    np.testing.assert_array_equal(render.gbuffer(scene).view_z.numpy(), before)
    assert render.fingerprint(scene) == fingerprint


def test_bad_layer_requests():
    scene = render.load_scene(S.scene(pinhole(), ball=ball((0, 0, 1), 0.7)))
    for n in (0, -1, 1.5, True):
        with pytest.raises(ConfigError, match="n_layers must be a positive integer, got"):
            render.layers(scene, None, n)
    g = render.gbuffer(scene)
    other = gtao.GBuffer(np.ones((16, 22), np.float32), None, gtao.PerspectiveCamera(22, 16, 0.5))
    with pytest.raises(SceneError, match=r"22x16 pixels, the sensor 20x16: that is no guard band of equal width"):
        render.layers(scene, other)
    far = gtao.GBuffer(g.view_z.numpy() + 1, g.normal_v, g.camera)
    with pytest.raises(SceneError, match="the G-buffer is not of this scene and sensor"):
        render.thickness(scene, far)
    with pytest.raises(SceneError, match="there is no sensor 3"):
        render.layers(scene, g, sensor=3)


@pytest.mark.parametrize("name", render.scenes.names())
def test_embedded_scenes(name):
    info = render.scenes.get(name)
    scene = render.load_scene(name, resolution=48)
    for sensor in range(len(info.views)):
        g = render.gbuffer(scene, sensor)
        layers = render.layers(scene, g, 4, sensor=sensor)
        np.testing.assert_array_equal(layers.front.numpy()[0], g.view_z.numpy())
        thickness = layers.thickness.numpy()[g.mask.numpy()]
        # Solids are left again, all of them; a ray in a thousand may slip through the seam of two triangles.
        assert np.isinf(thickness).mean() <= 1e-3
        sheets = (thickness == 0).mean()
        assert sheets <= 1e-3 if info.solid else sheets > 0.2
