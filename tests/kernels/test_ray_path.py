"""Single rays over a depth buffer against the definition, point by point."""

import numpy as np
import pytest
from oracles import fields, reconstruction

import drjit as dr  # isort: skip

from gtao.kernels import depth_bounds, ray_path
from gtao.kernels.depth_cells import DepthCells, View
from gtao.kernels.fetch import affine_field


def _stepped(x, y):
    """Two smooth pieces with a jump between them and a block on one: silhouettes beside slopes."""
    h, hx, hy = fields.waves(0.25, 4.0)(x, y)
    lift = np.where(x + 0.4 * y > 0.15, 0.5, 0.0) + np.where((abs(x + 0.5) < 0.15) & (abs(y) < 0.3), 0.4, 0.0)
    return h + lift, hx, hy


def _holed():
    field = fields.in_perspective(_stepped, size=20)
    view_z = field.view_z.copy()
    view_z[:4, 12:] = np.inf
    view_z[10, 3] = np.inf
    return fields.Field(view_z, field.normal_v, field.camera, orthographic=False)


FIELDS = {
    "waves": lambda: fields.in_perspective(fields.waves(0.25, 6.0), size=20, stretch=1.25, shift_px=(3, -5)),
    "waves from above": lambda: fields.from_above(fields.waves(0.3, 5.0), size=20),
    "steps": lambda: fields.in_perspective(_stepped, size=20, slope=(0.2, -0.3)),
    "steps from above": lambda: fields.from_above(_stepped, size=20),
    "steps and holes": _holed,
    "blocks": lambda: fields.blocks(size=20, n_cells=5),
}


def scene(field, precision, fetch, radius):
    T = precision.types
    height, width = field.view_z.shape
    view_z = precision.Float(field.view_z.ravel().astype(precision.name))
    footprint = 1 / min(field.scale)
    buffer = affine_field(view_z, width, height, footprint, field.orthographic, T)
    dr.eval(buffer)
    cells = DepthCells.of(buffer, width, height, field.orthographic, fetch == "nearest", T)
    fx, fy = field.scale
    cx, cy = field.camera["cx"], field.camera["cy"]
    values = (1 / fx, (0.5 - cx) / fx, -1 / fy, (cy - 0.5) / fy, fx, fy, radius)
    return view_z, cells, View(*(precision.Float(float(v)) for v in values), precision.types.UInt(0))


def random_rays(field, n, seed):
    """Pixels and unit directions, half of them within 0.1 of the tangent plane."""
    rng = np.random.default_rng(seed)
    pixels = np.argwhere(np.isfinite(field.view_z))
    pixels = pixels[rng.integers(0, len(pixels), n)]
    normal = field.normal_v[pixels[:, 0], pixels[:, 1]]
    d = rng.normal(size=(n, 3))
    up = np.sum(d * normal, axis=1, keepdims=True)
    d -= np.where(rng.random((n, 1)) < 0.5, 0.9, 0.0) * up * normal
    d *= np.sign(np.sum(d * normal, axis=1, keepdims=True))
    return pixels, d / np.linalg.norm(d, axis=1, keepdims=True)


def paths(field, precision, fetch, radius, pixels, directions):
    view_z, cells, view = scene(field, precision, fetch, radius)
    T = precision.types
    x, y = precision.lanes(pixels[:, 1]), precision.lanes(pixels[:, 0])
    z = dr.gather(T.Float, view_z, T.UInt(y) * cells.width + T.UInt(x))
    d = tuple(precision.lanes(c) for c in directions.T)
    point = (x, y, dr.fma(x, view.ax, view.bx), dr.fma(y, view.ay, view.by), z)
    return ray_path.over_image(d, point, cells.w(z), cells, view, np.isinf(radius)), cells


@pytest.mark.parametrize("radius", [np.inf, 0.6])
@pytest.mark.parametrize("fetch", ["linear", "nearest"])
@pytest.mark.parametrize("name", FIELDS)
def test_every_ray_is_blocked_as_its_points_say(precision, name, fetch, radius):
    """A point behind the surface blocks the ray; no point behind it and a blocked ray is one that grazes.

    The 4000 points of a ray are up to 1/100 of a texel apart. Inside of a cell the excess bends by its twist, which
    points sample to a part in 10⁴ of a step between texels; at the border of a block it jumps from one slope to
    another, and the ray's w changes by up to a hundredth of what it does over a texel. Rounding adds its own.
    """
    field = FIELDS[name]()
    n = 250
    pixels, directions = random_rays(field, n, seed=3)
    path, cells = paths(field, precision, fetch, radius, pixels, directions)
    active = dr.full(precision.types.Bool, True, n)
    got = np.array(ray_path.passes_behind(path, cells, depth_bounds.pyramid(cells), active, precision.types))
    surface = reconstruction.Surface.of(field, fetch)
    rays = zip(pixels, directions, strict=True)
    excess = np.array([reconstruction.highest_excess(field, surface, *pixel, d, radius) for pixel, d in rays])
    rounding = 4 * np.finfo(precision.name).eps
    assert 0.1 < np.mean(excess > 0) < 0.9
    assert got[excess > rounding].all()
    # The slope of a ray per texel, relative to w: steep rays pass far in 1/100 of a texel.
    per_texel = np.abs(np.array(path.slope / path.w0)) / np.hypot(np.array(path.sx), np.array(path.sy))
    assert not got[excess < -rounding - 0.02 * (per_texel + 0.05)].any()
    assert np.mean(got != (excess > 0)) < 0.02


@pytest.mark.parametrize("name", ["waves", "steps and holes", "steps from above"])
def test_steps_along_a_ray_converge_from_above(precision, name):
    """Sampling misses what lies between: it never blocks a ray that is open, and misses less with more steps."""
    field = FIELDS[name]()
    n = 4000
    pixels, directions = random_rays(field, n, seed=4)
    path, cells = paths(field, precision, "linear", np.inf, pixels, directions)
    active = dr.full(precision.types.Bool, True, n)
    exact = np.array(ray_path.passes_behind(path, cells, depth_bounds.pyramid(cells), active, precision.types))
    jitter = precision.lanes(np.random.default_rng(0).random(n))
    missed = []
    for n_steps in (8, 32, 128, 1024):
        found = np.array(ray_path.found_behind(path, cells, n_steps, jitter, active, precision.types))
        # A graze that rounding decides may go either way.
        assert np.mean(found & ~exact) <= (2e-3 if precision.name == "float32" else 0)
        missed.append(np.mean(exact & ~found))
    assert missed[0] > 0.005
    assert missed == sorted(missed, reverse=True)
    assert missed[-1] < 2e-3


def test_inactive_rays_are_not_followed(precision):
    field = FIELDS["blocks"]()
    pixels, directions = random_rays(field, 64, seed=1)
    path, cells = paths(field, precision, "nearest", np.inf, pixels, directions)
    active = dr.full(precision.types.Bool, False, 64)
    bounds = depth_bounds.pyramid(cells)
    assert not np.array(ray_path.passes_behind(path, cells, bounds, active, precision.types)).any()
    jitter = dr.full(precision.Float, 0.5, 64)
    assert not np.array(ray_path.found_behind(path, cells, 8, jitter, active, precision.types)).any()


@pytest.mark.parametrize("fetch", ["linear", "nearest"])
def test_rays_along_the_eye_ray(precision, fetch):
    """Toward the eye nothing blocks; straight away from it the solid does, but a block not its own texel's rays."""
    field = FIELDS["waves from above"]()
    n = 9
    pixels = np.argwhere(np.isfinite(field.view_z))[37 : 37 + n]
    active = dr.full(precision.types.Bool, True, n)
    for direction, expected in (((0, 0, 1), False), ((0, 0, -1), fetch == "linear")):
        path, cells = paths(field, precision, fetch, 0.5, pixels, np.tile(np.array(direction, float), (n, 1)))
        bounds = depth_bounds.pyramid(cells)
        got = np.array(ray_path.passes_behind(path, cells, bounds, active, precision.types))
        assert (got == expected).all()
