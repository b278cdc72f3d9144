"""``gtao.downsample``: what stands for a block, and what a smaller frame promises."""

import drjit as dr
import numpy as np
import pytest
from oracles import fields
from oracles import resolution as oracle

import gtao

CHOICES = ("nearest", "farthest", "checkerboard", "first")
every_choice = pytest.mark.parametrize("choice", CHOICES)
both_factors = pytest.mark.parametrize("factor", [2, 4])


def frame(field, dtype=np.float64, **more):
    camera = gtao.OrthographicCamera if field.orthographic else gtao.PerspectiveCamera
    return gtao.GBuffer(field.view_z.astype(dtype), field.normal_v.astype(dtype), camera(**field.camera), **more)


def smaller(g, **options):
    return gtao.downsample(g, gtao.Downsample(**options))


def terrain(shape=(19, 26)):
    size = max(shape)
    field = fields.in_perspective(fields.gaussians(0.3, 0.4, seed=2), size=size, slope=(0.5, 0.3), shift_px=(0.7, 2.0))
    z, n = field.view_z[: shape[0]].copy(), field.normal_v[: shape[0]].copy()
    z[4:9, 3:12] = np.inf
    z[6, 6] = 3.0
    z[:, -1] = np.inf
    return fields.Field(z, n, field.camera | {"height": shape[0]}, False)


def plane(tilt, orthographic, shape=(23, 37)):
    """A tilted plane in a frame of odd sides, and its normal."""
    if orthographic:
        camera = gtao.OrthographicCamera(shape[1], shape[0], 2.0, cx=11.3, cy=9.1)
        y, x = np.mgrid[: shape[0], : shape[1]] + 0.5
        X, Y = (x - 11.3) / camera.fx, (9.1 - y) / camera.fy
        n = np.array([np.sin(tilt) * 0.6, np.sin(tilt) * 0.8, np.cos(tilt)])
        # Far enough that the steepest one stays in front.
        z = 1000 + (n[0] * X + n[1] * Y) / n[2]
        return gtao.GBuffer(z, np.broadcast_to(n, (*shape, 3)).copy(), camera), n
    field = fields.tilted_plane(tilt, 0.7, size=max(shape), f=1500.0)
    camera = field.camera | {"height": shape[0]}
    return frame(fields.Field(field.view_z[: shape[0]], field.normal_v[: shape[0]], camera, False)), field.normal_v[
        0, 0
    ]


@pytest.mark.parametrize("orthographic", [False, True], ids=["perspective", "orthographic"])
@pytest.mark.parametrize("tilt", [0.0, 0.6, 1.2, 1.5, 1.55])
@both_factors
@every_choice
def test_planes_stay_planes(orthographic, tilt, factor, choice):
    g, n = plane(tilt, orthographic)
    small = smaller(g, factor=factor, choice=choice, place="centre")
    assert small.shape == (-(-23 // factor), -(-37 // factor))
    heights, want = np.array(small.position_v) @ n, np.array(g.position_v) @ n
    # Rounding of positions of about 1000 on a slope of up to 48, which the normal's length takes back.
    assert np.abs(heights - want.mean()).max() < 1e-10
    by_texel = np.array(smaller(g, factor=factor, choice=choice, place="texel").position_v) @ n
    off = np.abs(by_texel - want.mean()).max()
    assert off < 1e-10 if tilt == 0 else off > 1e-5


@pytest.mark.parametrize("orthographic", [False, True], ids=["perspective", "orthographic"])
@both_factors
def test_the_view_stays(orthographic, factor):
    """Corners of a small pixel are those of its block."""
    g, _ = plane(0.6, orthographic)
    small = smaller(g, factor=factor)
    P = g.types.Array3([0.3, -0.1], [0.2, 0.05], [-2.0, -3.0])
    large, little = (np.array(c.project(P)) for c in (g.camera, small.camera))
    assert little[:2] * factor == pytest.approx(large[:2], rel=1e-13)
    assert little[2] == pytest.approx(large[2])
    assert small.camera.near == g.camera.near


@both_factors
@every_choice
@pytest.mark.parametrize("place", ["texel", "centre"])
def test_against_the_definition(factor, choice, place):
    field = terrain()
    g = frame(field)
    want = oracle.downsampled(field, factor, choice, place)
    got = smaller(g, factor=factor, choice=choice, place=place)
    assert {k: getattr(got.camera, k) for k in want.camera} == pytest.approx(want.camera)
    z = np.array(got.view_z)
    surface = np.isfinite(want.view_z)
    assert (np.isfinite(z) == surface).all()
    assert z[surface] == pytest.approx(want.view_z[surface], rel=1e-12)
    # Normals of float64 are of unit length to rounding.
    assert np.array(got.normal_v)[surface] == pytest.approx(want.normal_v[surface], abs=1e-12)
    assert np.array(got.mask).tolist() == surface.tolist()


@both_factors
@every_choice
def test_everything_else_is_that_of_the_chosen_pixel(factor, choice):
    field = terrain()
    rng = np.random.default_rng(3)
    albedo, motion = rng.random((*field.view_z.shape, 3)), rng.standard_normal((*field.view_z.shape, 3))
    pose = np.eye(4)
    pose[:3, 3] = 1, 2, 3
    g = frame(field, albedo=albedo, motion=motion, view_to_world=pose)
    small = smaller(g, factor=factor, choice=choice)
    at = tuple(np.moveaxis(oracle.chosen(field.view_z, factor, choice), -1, 0))
    assert np.array(small.albedo) == pytest.approx(albedo[at])
    # A motion of four pixels is one of two small ones; a change of depth stays one.
    assert np.array(small.motion) == pytest.approx(motion[at] * [1 / factor, 1 / factor, 1])
    assert small.view_to_world == g.view_to_world
    flat = smaller(frame(field, motion=motion[..., :2]), factor=factor, choice=choice)
    assert np.array(flat.motion) == pytest.approx(motion[at][..., :2] / factor)
    assert flat.albedo is None is flat.view_to_world is flat.layers
    assert not small.normals_derived
    derived = gtao.GBuffer(field.view_z, None, g.camera)
    assert smaller(derived, factor=factor).normals_derived


def test_layers_move_with_the_depth():
    field = terrain()
    z = field.view_z
    front, back = np.stack([z, 2 * z]), np.stack([1.5 * z, 2.5 * z])
    g = frame(field, layers=gtao.DepthLayers(front, back))
    small = smaller(g, factor=2, place="centre")
    want, surface = np.array(small.view_z), np.array(small.mask)
    for layers, scales in ((small.layers.front, (1, 2)), (small.layers.back, (1.5, 2.5))):
        for k, scale in enumerate(scales):
            assert np.array(layers)[k][surface] == pytest.approx(scale * want[surface], rel=1e-12)
            assert np.isinf(np.array(layers)[k][~surface]).all()


def test_thin_things_and_the_background():
    """Bars one pixel wide before the background: every block that one crosses is a surface, whatever is chosen."""
    z = np.full((16, 16), np.inf)
    z[:, 5] = 2.0
    z[11, :] = 3.0
    g = gtao.GBuffer(z, np.broadcast_to([0.0, 0, 1], (16, 16, 3)).copy(), gtao.PerspectiveCamera(16, 16, 0.9))
    crossed = np.isfinite(z).reshape(8, 2, 8, 2).any(axis=(1, 3))
    for choice in CHOICES:
        assert np.array(smaller(g, choice=choice).mask).tolist() == crossed.tolist()
    # Before a wall the nearest keeps them, the farthest does not, and the checkerboard every other texel.
    wall = np.where(np.isfinite(z), z, 9.0)
    g = gtao.GBuffer(wall, np.broadcast_to([0.0, 0, 1], (16, 16, 3)).copy(), g.camera)
    kept = {choice: np.array(smaller(g, choice=choice).view_z) < 5 for choice in CHOICES}
    assert (kept["nearest"] == crossed).all()
    assert not kept["farthest"].any()
    even = np.indices((8, 8)).sum(axis=0) % 2 == 0
    assert (kept["checkerboard"] == crossed & even).all()


@pytest.mark.parametrize("factor", [2, 4])
def test_an_open_plane_reads_1_from_a_checkerboard(factor):
    """Nearest and farthest depths of a tilted plane in turn occlude each other, unless moved to the centres."""
    g, _ = plane(1.1, False, shape=(64, 64))
    method = gtao.GTAO(radius=0.05, n_slices=4, n_steps=8, fetch="linear")
    means = {
        (choice, place): np.array(
            gtao.ambient_occlusion(smaller(g, factor=factor, choice=choice, place=place), method).visibility
        )[4:-4, 4:-4].mean()
        for choice in ("nearest", "checkerboard")
        for place in ("texel", "centre")
    }
    full = np.array(gtao.ambient_occlusion(g, method).visibility)[16:-16, 16:-16].mean()
    # Few slices are off by a little on tilted planes, at any resolution.
    for choice in ("nearest", "checkerboard"):
        assert means[choice, "centre"] == pytest.approx(full, abs=2e-3)
    assert means["checkerboard", "texel"] < full - 0.05


@pytest.mark.parametrize("normal", [(0.0, 0, -1), (1.0, 0, 0), (1.0, 0, 5e-4), (0.9999, 0, 0.014)])
@pytest.mark.parametrize("orthographic", [False, True])
def test_normals_that_say_nothing_leave_the_depth(normal, orthographic):
    """Turned away, edge-on, nearly so; or, in perspective, a plane that doubles the depth within a block."""
    z = np.array([[2.0, 2.1], [2.2, 2.3]])
    n = np.broadcast_to(np.array(normal) / np.linalg.norm(normal), (2, 2, 3)).copy()
    camera = gtao.OrthographicCamera(2, 2, 20.0) if orthographic else gtao.PerspectiveCamera(2, 2, fx=0.2)
    moved = np.array(smaller(gtao.GBuffer(z, n, camera)).view_z)[0, 0] != 2.0
    assert moved == (orthographic and normal[2] == 0.014)


def test_the_frame_is_validated_no_more_and_few_kernels_run():
    rng = np.random.default_rng(0)
    field = terrain()
    g = frame(field, albedo=rng.random((*field.view_z.shape, 3)), motion=np.zeros((*field.view_z.shape, 3)))
    dr.eval(g.normals_to_be_normalised()[0], g.albedo, g.motion)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        smaller(g)
        dr.sync_thread()
        history = [k for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]
    assert len(history) == 1


def test_frozen():
    from drjit.auto.ad import TensorXf

    def step(z, n, camera):
        g = gtao.GBuffer(z, n, camera, validate=False)
        small = smaller(g)
        return small.view_z, small.normal_v

    field = terrain()
    camera = gtao.PerspectiveCamera(**field.camera)
    frozen = dr.freeze(step)
    for scale in (1.0, 1.5, 2.0):
        z, n = (dr.opaque(TensorXf(np.float32(a))) for a in (field.view_z * scale, field.normal_v))
        for got, want in zip(frozen(z, n, camera), step(z, n, camera), strict=True):
            np.testing.assert_array_equal(got.numpy(), want.numpy())
    assert frozen.n_recordings == 1


def test_twice_by_two_is_once_by_four_where_the_frame_is_a_plane():
    g, _ = plane(0.8, False)
    twice, once = smaller(smaller(g)), smaller(g, factor=4)
    assert twice.camera == once.camera
    assert np.array(twice.view_z) == pytest.approx(np.array(once.view_z), rel=1e-12)


def test_single_precision():
    field = terrain()
    want, got = (np.array(smaller(frame(field, dtype)).view_z) for dtype in (np.float64, np.float32))
    assert got.dtype == np.float32
    surface = np.isfinite(want)
    assert got[surface] == pytest.approx(want[surface], rel=1e-5)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (lambda g: (g, gtao.PlaneAwareUpsample()), "gtao.Downsample"),
        (lambda g: (g, 2), "gtao.Downsample"),
        (lambda g: (g.view_z, gtao.Downsample()), "g must be"),
    ],
)
def test_refusals(arguments, words):
    with pytest.raises(gtao.ConfigError, match=words):
        gtao.downsample(*arguments(frame(terrain())))


@pytest.mark.parametrize(
    "options", [{"factor": 3}, {"factor": 2.0}, {"factor": True}, {"choice": "mean"}, {"place": 0}]
)
def test_options_out_of_range(options):
    with pytest.raises(gtao.ConfigError, match=next(iter(options))):
        gtao.Downsample(**options)


def test_becomes_plain_values_and_back():
    how = gtao.Downsample(factor=4, choice="checkerboard", place="texel")
    assert gtao.method_from_dict(how.to_dict()) == how
