"""Frames of attached scenes against differences of meshes in float64: geometry, sensors, albedo, and what follows."""

import math
from dataclasses import replace

import drjit as dr
import numpy as np
import pytest
from oracles.meshes import Camera, look_at, mesh_frame, vertex_normals

import gtao
from gtao import render

import mitsuba as mi  # isort: skip

import _scenes as S

#: Mitsuba intersects and differentiates in single precision: some roundings of positions a few units from the camera,
#: at angles that lose a digit, relative to the largest derivative of the frame.
TOLERANCE = 1e-4
#: Rounding where the derivative is zero.
NOISE = 1e-6
#: Half width of central differences in float64; their own error is its square.
H = 1e-5

SIZE = (24, 18)
PLACE = ((0.3, -2.2, 1.9), (0.05, 0.0, 0.0), (0, 0, 1))
FOV = 50.0
FOCAL = 0.5 * SIZE[0] / math.tan(math.radians(FOV) / 2)
SCALE = (1.2, 1.2, 1.1)


def _terrain():
    """A rough patch seen from above, so that it hides no part of itself."""
    rng = np.random.default_rng(0)
    y, x = np.mgrid[:7, :7] / 3 - 1
    vertices = np.stack([x, y, 0.25 * rng.random((7, 7))], -1).reshape(-1, 3)
    i = np.arange(49).reshape(7, 7)
    a, b, c, d = (v.ravel() for v in (i[:-1, :-1], i[:-1, 1:], i[1:, :-1], i[1:, 1:]))
    # The mesh is kept in single precision.
    return vertices.astype(np.float32).astype(float), np.vstack([np.c_[a, b, c], np.c_[b, d, c]])


VERTICES, FACES = _terrain()
PERSPECTIVE = Camera(look_at(*PLACE), SIZE, FOCAL, FOCAL, SIZE[0] / 2, SIZE[1] / 2)
PIXEL = 2 / SIZE[0]
PARALLEL = replace(PERSPECTIVE, fx=1 / (PIXEL * SCALE[0]), fy=1 / (PIXEL * SCALE[1]), parallel=True)


def _scene(camera=PERSPECTIVE, smooth=False, size=SIZE):
    normals = vertex_normals(VERTICES, FACES) if smooth else None
    sensor = S.perspective(*PLACE[:2], fov=FOV, size=size)
    if camera.parallel:
        to_world = S.look_at(*PLACE[:2]) @ S.transform().scale(list(SCALE))
        sensor = {"type": "orthographic", "near_clip": 0.3, "to_world": to_world, "film": S.film(*size)}
    return render.load_scene(S.scene(sensor, mesh=S.mesh(VERTICES, FACES, normals)))


def _set(scene, **changes):
    """Replace parameters that end in the names, by functions of their values."""
    parameters = mi.traverse(scene)
    for name, change in changes.items():
        (key,) = (k for k, _ in parameters if k.endswith(name.replace("__", ".")))
        parameters[key] = change(parameters[key])
    parameters.update()


def _move_vertices(direction):
    """``direction`` (V, 3) is where the vertices go."""

    def scene(s, x):
        _set(s, vertex_positions=lambda v: v + x * mi.Float(direction.ravel()))

    def mesh(x, camera):
        return VERTICES + x * direction, camera

    return scene, mesh


def _one_vertex(index, coordinate):
    direction = np.zeros_like(VERTICES)
    direction[index, coordinate] = 1
    return _move_vertices(direction)


def _place(move, matrix):
    """Move the sensor about the world."""

    def scene(s, x):
        _set(s, to_world=lambda t: move(mi.AffineTransform4f(), x) @ t)

    def mesh(x, camera):
        return VERTICES, replace(camera, to_world=matrix(x) @ camera.to_world)

    return scene, mesh


def _turned(axis, angle):
    """(4, 4) rotation about a unit axis by Rodrigues' formula."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = np.eye(4)
    matrix[:3, :3] += math.sin(angle) * K + (1 - math.cos(angle)) * K @ K
    return matrix


def _shifted(direction, x):
    matrix = np.eye(4)
    matrix[:3, 3] = np.multiply(direction, x)
    return matrix


def _number(name, change):
    """One of the sensor's own numbers, and what becomes of the camera."""
    return (lambda s, x: _set(s, **{name: lambda v: v + x})), (lambda x, camera: (VERTICES, change(camera, x)))


def _widened(camera, x):
    focal = 0.5 * SIZE[0] / math.tan(math.radians(FOV + x) / 2)
    return replace(camera, fx=focal, fy=focal)


AXIS, WAY = [2 / 7, -3 / 7, 6 / 7], [0.4, -0.2, 0.7]
_RANDOM = np.random.default_rng(1).normal(size=VERTICES.shape)

GEOMETRY = {
    "height of a vertex": _one_vertex(24, 2),
    "a vertex sideways": _one_vertex(17, 0),
    "all vertices up": _move_vertices(np.tile([0.0, 0, 1], (len(VERTICES), 1))),
    "all vertices anyhow": _move_vertices(_RANDOM),
}
SENSOR = {
    "its direction": _place(lambda t, x: t.rotate(AXIS, x * (180 / math.pi)), lambda x: _turned(AXIS, x)),
    "its place": _place(lambda t, x: t.translate([x * w for w in WAY]), lambda x: _shifted(WAY, x)),
}
LENS = {
    "field of view": _number("x_fov", _widened),
    "principal point x": _number("point_offset_x", lambda c, x: replace(c, cx=c.cx - SIZE[0] * x)),
    "principal point y": _number("point_offset_y", lambda c, x: replace(c, cy=c.cy - SIZE[1] * x)),
}
ZOOM = {
    "scale": (
        lambda s, x: _set(s, to_world=lambda t: t @ mi.AffineTransform4f().scale([1 + x, 1 - 2 * x, 1])),
        lambda x, camera: (VERTICES, replace(camera, fx=camera.fx / (1 + x), fy=camera.fy / (1 - 2 * x))),
    )
}
CASES = [
    *((name, change, camera) for camera in (PERSPECTIVE, PARALLEL) for name, change in (GEOMETRY | SENSOR).items()),
    *((name, change, PERSPECTIVE) for name, change in LENS.items()),
    *((name, change, PARALLEL) for name, change in ZOOM.items()),
]


def _case_name(value):
    return value if isinstance(value, str) else ("parallel" if value.parallel else "") if hasattr(value, "fx") else ""


def _positions(view_z, camera):
    o, d = camera.rays()
    return o + d * np.where(np.isfinite(view_z), view_z, 0)[:, None]


def _frame(mesh, x, camera, smooth):
    vertices, camera = mesh(x, camera)
    view_z, normal_v, triangle = mesh_frame(vertices, FACES, camera, smooth=smooth)
    return np.hstack([_positions(view_z, camera), normal_v]), triangle


def _difference(mesh, camera, smooth):
    """(N, 6) derivatives of positions and normals, and the pixels that show the same triangle throughout."""
    (high, above), (low, below) = (_frame(mesh, x, camera, smooth) for x in (H, -H))
    return (high - low) / (2 * H), (above == below) & (above >= 0)


def _attached(scene, change):
    x = mi.Float(0)
    dr.enable_grad(x)
    change(scene, x)
    return x, render.gbuffer(scene)


def _forward(x, tensor):
    """Derivative of an image, (N, 3)."""
    # An image that others are made of would lose it on the way.
    dr.forward(x, dr.ADFlag.ClearEdges)
    return dr.grad(tensor).numpy().reshape(-1, 3)


@pytest.mark.parametrize("smooth", [False, True], ids=["flat", "smooth"])
@pytest.mark.parametrize(("name", "change", "camera"), CASES, ids=_case_name)
def test_positions_and_normals_move_with_the_scene(name, change, camera, smooth):
    expected, inside = _difference(change[1], camera, smooth)
    assert inside.sum() > 200
    for part, columns in (("position_v", slice(3)), ("normal_v", slice(3, 6))):
        # The scene is gone by the time that derivatives are asked for.
        x, g = _attached(_scene(camera, smooth), change[0])
        tensor = getattr(g, part)
        got = _forward(x, tensor) if dr.grad_enabled(tensor) else np.zeros((len(inside), 3))
        scale = np.abs(expected[:, columns][inside]).max()
        np.testing.assert_allclose(
            got[inside], expected[:, columns][inside], rtol=0, atol=TOLERANCE * scale + NOISE, err_msg=part
        )


@pytest.mark.parametrize("smooth", [False, True], ids=["flat", "smooth"])
def test_gradients_of_all_vertices_are_those_of_single_ones(smooth):
    """Reverse mode: one number of a whole frame and every vertex of the mesh."""
    rng = np.random.default_rng(2)
    scene = _scene(smooth=smooth)
    parameters = mi.traverse(scene)
    dr.enable_grad(parameters["mesh.vertex_positions"])
    parameters.update()
    g = render.gbuffer(scene)
    # Pixels whose triangle changes have no derivative; they are left out for the vertices that are looked at.
    looked_at = [(24, 2), (24, 0), (17, 1), (31, 2), (10, 2)]
    differences = [_difference(_one_vertex(*at)[1], PERSPECTIVE, smooth) for at in looked_at]
    inside = np.all([also for _, also in differences], axis=0)
    weights = rng.normal(size=(len(inside), 6)) * inside[:, None]
    loss = sum(
        dr.sum(tensor * mi.TensorXf(weights[:, columns].reshape(tensor.shape).astype(np.float32)), axis=None)
        for tensor, columns in ((g.position_v, slice(3)), (g.normal_v, slice(3, 6)))
    )
    dr.backward(loss)
    gradient = dr.grad(parameters["mesh.vertex_positions"]).numpy().reshape(-1, 3)
    expected = [np.sum(weights * difference) for difference, _ in differences]
    np.testing.assert_allclose([gradient[at] for at in looked_at], expected, rtol=0, atol=TOLERANCE * 20)


def test_a_silhouette_that_moves_over_a_pixel_has_no_derivative():
    """A plate that slides sideways changes no depth behind the pixels that it covers throughout."""
    plate = S.mesh([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]], [[0, 1, 2], [0, 2, 3]])
    ground = S.rectangle(S.transform().translate([0, 0, -1]) @ S.transform().scale([9, 9, 1]))
    scene = render.load_scene(S.scene(S.perspective((0, 0, 4), (0, 0, 0), up=(0, 1, 0)), plate=plate, ground=ground))

    def covered():
        return int((render.gbuffer(scene).view_z.numpy() < 4.5).sum())

    before = covered()
    slide = mi.Float([1, 0, 0] * 4)
    _set(scene, plate__vertex_positions=lambda v: v + 0.3 * slide)
    assert covered() != before
    x = mi.Float(0)
    dr.enable_grad(x)
    _set(scene, plate__vertex_positions=lambda v: v + x * slide)
    g = render.gbuffer(scene)
    assert dr.grad_enabled(g.view_z)
    dr.forward(x, dr.ADFlag.ClearEdges)
    assert np.abs(dr.grad(g.view_z).numpy()).max() < NOISE


def test_a_ball_moves_with_its_transform():
    """An analytic shape: the nearer root of |o + t d - c|² = r², and its derivative by the centre."""
    way, radius = np.array([0.2, 0.3, -0.5]), 0.8
    scene = render.load_scene(S.scene(S.perspective((0, -4, 0), (0, 0, 0)), ball={"type": "sphere", "radius": radius}))
    x = mi.Float(0)
    dr.enable_grad(x)
    _set(scene, ball__to_world=lambda t: mi.AffineTransform4f().translate([x * float(w) for w in way]) @ t)
    g = render.gbuffer(scene)
    camera = Camera(
        look_at((0, -4, 0), (0, 0, 0), (0, 0, 1)), (32, 32), *(2 * (16 / math.tan(math.radians(20)),)), 16, 16
    )
    _, d = camera.rays()
    R, c = camera.to_world[:3, :3], np.array([0.0, 0, -4])

    def view_z(shift):
        centre = c + shift * (way @ R)
        a, b, q = np.sum(d * d, -1), d @ centre, centre @ centre - radius**2
        with np.errstate(invalid="ignore"):
            return (b - np.sqrt(b * b - a * q)) / a

    expected = (view_z(H) - view_z(-H)) / (2 * H)
    # Beside the rim, where derivatives grow without bound.
    inside = np.abs(np.nan_to_num(expected, nan=9.0)) < 2
    assert inside.sum() > 50
    dr.forward(x, dr.ADFlag.ClearEdges)
    np.testing.assert_allclose(dr.grad(g.view_z).numpy().ravel()[inside], expected[inside], rtol=1e-4, atol=NOISE)


def test_albedo_carries_the_derivatives_of_the_reflectance():
    scene = _scene()
    x = mi.Float(0)
    dr.enable_grad(x)
    _set(scene, reflectance__value=lambda v: v + mi.Color3f(1, 2, -1) * x)
    g = render.gbuffer(scene)
    assert not dr.grad_enabled(g.view_z)
    assert not dr.grad_enabled(g.normal_v)
    got = _forward(x, g.albedo)
    np.testing.assert_array_equal(got, np.where(g.mask.numpy().reshape(-1, 1), [[1, 2, -1]], 0))


def test_visibility_moves_with_the_scene():
    """The whole way from a vertex to an estimate, against estimates in float64 of frames that were made in float64."""
    camera = gtao.PerspectiveCamera(*SIZE, fx=FOCAL)
    method = gtao.GTAO(radius=0.5, n_slices=2, n_steps=4, falloff=gtao.LinearFalloff(start=0.2, end=0.5))
    change, mesh = GEOMETRY["height of a vertex"]

    def visibility(x):
        view_z, normal_v, triangle = mesh_frame(mesh(x, None)[0], FACES, PERSPECTIVE, smooth=False)
        g = gtao.GBuffer(view_z.reshape(SIZE[::-1]), normal_v.reshape(*SIZE[::-1], 3), camera)
        return gtao.ambient_occlusion(g, method).visibility.numpy().ravel(), triangle

    (high, above), (low, below) = visibility(H), visibility(-H)
    x, g = _attached(_scene(), change)
    image = gtao.ambient_occlusion(g, method).visibility
    dr.forward(x, dr.ADFlag.ClearEdges)
    error = np.abs(dr.grad(image).numpy().ravel() - (high - low) / (2 * H))[(above == below) & (above >= 0)]
    scale = np.abs(high - low).max() / (2 * H)
    assert scale > 0.3
    # The rest are kinks, where the highest sample changes within the difference or by a rounding.
    assert np.mean(error <= 10 * TOLERANCE * scale) > 0.97
