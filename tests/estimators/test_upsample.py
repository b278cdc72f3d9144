"""``gtao.upsample``: what every method promises on whole frames, and what only the better ones do."""

import drjit as dr
import numpy as np
import pytest
from oracles import fields
from oracles import resolution as oracle

import gtao

METHODS = {
    "bilinear": gtao.BilinearUpsample(),
    "nearest depth": gtao.NearestDepthUpsample(),
    "bilateral": gtao.BilateralUpsample(),
    "planes": gtao.PlaneAwareUpsample(),
}
EDGE_AWARE = [name for name in METHODS if name != "bilinear"]
every_method = pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
edge_aware = pytest.mark.parametrize("method", [METHODS[k] for k in EDGE_AWARE], ids=EDGE_AWARE)
both_factors = pytest.mark.parametrize("factor", [2, 4])
SKY = [0.0, 0, 1]


def frame(field, dtype=np.float64):
    camera = gtao.OrthographicCamera if field.orthographic else gtao.PerspectiveCamera
    return gtao.GBuffer(field.view_z.astype(dtype), field.normal_v.astype(dtype), camera(**field.camera))


def facing(view_z, fov=0.9):
    """A frame of surfaces that face the camera."""
    height, width = view_z.shape
    n = np.broadcast_to(SKY, (height, width, 3)).copy()
    return gtao.GBuffer(view_z, n, gtao.PerspectiveCamera(width, height, fov))


def terrain(size=27, holes=True):
    field = fields.in_perspective(fields.gaussians(0.3, 0.4, seed=2), size=size, slope=(0.5, 0.3))
    if holes:
        field.view_z[4:9, 3:12] = np.inf
        field.view_z[6, 6] = 3.0
        field.view_z[:, -1] = np.inf
    return field


def from_above():
    return frame(fields.from_above(fields.waves(0.1, 1.0), size=27))


def smaller(g, **options):
    return gtao.downsample(g, gtao.Downsample(**options))


def estimate(g, visibility, **more):
    def tensor(image):
        return g.types.Tensor(np.ascontiguousarray(image))

    images = {name: tensor(image) for name, image in more.items()}
    return gtao.AmbientOcclusion(visibility=tensor(visibility), normal_v=g.normal_v, config=gtao.GTAO(), **images)


def enlarged(g_low, g, visibility, method):
    return np.array(gtao.upsample(estimate(g_low, visibility), g_low, g, method).visibility)


def at_chosen(g, image, factor, choice="checkerboard"):
    """The image's values where the small frame's pixels come from."""
    return image[tuple(np.moveaxis(oracle.chosen(np.array(g.view_z), factor, choice), -1, 0))]


@every_method
@both_factors
@pytest.mark.parametrize("choice", ["nearest", "farthest", "checkerboard", "first"])
def test_constant_images_stay_and_the_background_is_never_read(method, factor, choice):
    g = frame(terrain())
    small = smaller(g, factor=factor, choice=choice)
    surface, small_surface = np.array(g.mask), np.array(small.mask)
    direction, rng = np.array([0.48, 0.6, 0.64]), np.random.default_rng(1)
    sh = rng.random(9)
    # What stands in the background must not matter.
    ao = estimate(
        small,
        np.where(small_surface, 0.37, 1e6),
        unshaped=np.where(small_surface, 0.25, np.nan),
        mean_direction=np.where(small_surface[..., None], direction, np.nan),
        visibility_sh=np.where(small_surface[..., None], sh, 1e9),
    )
    result = gtao.upsample(ao, small, g, method)
    assert np.array(result.visibility) == pytest.approx(np.where(surface, 0.37, 1.0), abs=1e-12)
    assert np.array(result.unshaped) == pytest.approx(np.where(surface, 0.25, 1.0), abs=1e-12)
    assert np.array(result.mean_direction) == pytest.approx(np.where(surface[..., None], direction, 0.0), abs=1e-12)
    assert np.array(result.visibility_sh) == pytest.approx(np.where(surface[..., None], sh, 0.0), abs=1e-12)
    assert result.normal_v.shape == (*g.shape, 3)
    assert np.array_equal(np.array(result.normal_v), np.array(g.normal_v))
    assert result.config == ao.config
    assert result.variance is None


@every_method
@both_factors
@pytest.mark.parametrize("shape", [(21, 30), (8, 8), (1, 1), (1, 7), (5, 2)])
def test_against_the_definition(method, factor, shape):
    field = terrain(max(shape), holes=min(shape) > 12)
    field = fields.Field(
        field.view_z[: shape[0], : shape[1]],
        field.normal_v[: shape[0], : shape[1]],
        field.camera | {"height": shape[0], "width": shape[1]},
        False,
    )
    g = frame(field)
    small = smaller(g, factor=factor, choice="nearest", place="texel")
    little = oracle.downsampled(field, factor, "nearest", "texel")
    values = np.random.default_rng(0).random(small.shape)
    names = {"NearestDepthUpsample": "nearest_depth", "BilateralUpsample": "bilateral", "BilinearUpsample": "bilinear"}
    name = names.get(type(method).__name__, "planes")
    threshold = getattr(method, "threshold", getattr(method, "tolerance", None))
    weights = oracle.upsampling(field, little, name, threshold)
    want = oracle.interpolated(weights, values.reshape(-1, 1), 1.0).reshape(shape)
    got = enlarged(small, g, values, method)
    surface = np.isfinite(field.view_z)
    assert got[surface] == pytest.approx(want[surface], abs=1e-9)


@edge_aware
@both_factors
@pytest.mark.parametrize("choice", ["nearest", "farthest", "checkerboard"])
def test_nothing_leaks_across_a_depth_step(method, factor, choice):
    """Two parallel planes, the near one dark, the far one bright; the step in no texel's border."""
    z = np.full((32, 40), 2.0)
    z[:, 17:] = 3.0
    truth = np.where(z < 2.5, 0.25, 0.75)
    g = facing(z)
    small = smaller(g, factor=factor, choice=choice)
    values = at_chosen(g, truth, factor, choice)
    error = np.abs(enlarged(small, g, values, method) - truth)
    # Two pixels away, where bilinear weights would still reach across; beside the step the surface may have no texel.
    away = np.abs(np.arange(40) + 0.5 - 17) >= 2
    assert error[:, away].max() < 0.01
    blurred = np.abs(enlarged(small, g, values, gtao.BilinearUpsample()) - truth)
    assert blurred.max() > 0.05
    assert blurred.mean() > 1.5 * error.mean()


def test_planes_hold_a_small_step_apart_where_depth_alone_does_not():
    """A box lies 1.25 % of the depth above the floor: less than the bilateral threshold, but many pixels."""
    z = np.full((32, 40), 2.0)
    z[:, 18:] = 1.975
    truth = np.where(z < 1.99, 1.0, 0.5)
    g = facing(z, fov=0.1)
    small = smaller(g)
    error = {
        name: np.abs(enlarged(small, g, at_chosen(g, truth, 2), METHODS[name]) - truth).max() for name in EDGE_AWARE
    }
    assert error["planes"] < 0.02 < 0.1 < min(error["bilateral"], error["nearest depth"])


def floor(size=64):
    """A floor to near the horizon: depth doubles within few rows."""
    camera = gtao.PerspectiveCamera(size, size, 0.9)
    y = (np.arange(size) + 0.5 - camera.cy) / camera.fy
    # Seen from a height of 1, above the frame the camera looks down a little.
    tilt = 0.55
    n = np.array([0.0, np.cos(tilt), np.sin(tilt)])
    z = 1 / (n[1] * y + n[2])
    z = np.broadcast_to(z[:, None], (size, size)).copy()
    return gtao.GBuffer(z, np.broadcast_to(n, (size, size, 3)).copy(), camera)


@both_factors
@pytest.mark.parametrize("choice", ["nearest", "checkerboard"])
def test_a_grazing_floor_is_interpolated_without_bands(factor, choice):
    """On a plane the weights are bilinear, so that what is linear in the image comes back exactly."""
    g = floor()
    assert np.array(g.view_z).max() > 4 * np.array(g.view_z).min()
    y, x = np.mgrid[: g.shape[0], : g.shape[1]] + 0.5
    truth = 0.2 + 0.6 * y / g.shape[0] + 0.1 * x / g.shape[1]
    small = smaller(g, factor=factor, choice=choice)
    v, u = (np.mgrid[: small.shape[0], : small.shape[1]] + 0.5) * factor
    values = 0.2 + 0.6 * v / g.shape[0] + 0.1 * u / g.shape[1]
    inner = (slice(factor, -factor),) * 2
    got = enlarged(small, g, values, gtao.PlaneAwareUpsample())
    assert got[inner] == pytest.approx(truth[inner], abs=1e-12)
    # By depth alone the rows near the horizon are pulled to the texel row nearest in depth: steps.
    tight = np.abs(enlarged(small, g, values, gtao.BilateralUpsample(threshold=0.02)) - truth)[inner]
    assert tight.max() > 2e-3


def test_a_slope_beside_an_edge_is_interpolated_along_itself():
    """Texels of the other surface drop out, and those of the own one keep their bilinear ratios."""
    field = fields.tilted_plane(1.2, 0.3, size=32, f=60.0)
    z = field.view_z.copy()
    z[:, 20:] = 30.0
    n = field.normal_v.copy()
    n[:, 20:] = SKY
    g = gtao.GBuffer(z, n, gtao.PerspectiveCamera(**field.camera))
    small = smaller(g)
    rows = (np.arange(16) + 0.5) / 16
    values = np.where(np.array(small.view_z) < 20, rows[:, None], 5.0)
    got = enlarged(small, g, values, gtao.PlaneAwareUpsample())
    want = np.broadcast_to(((np.arange(32) + 0.5) / 32)[:, None], (32, 32))
    assert got[2:-2, :20] == pytest.approx(want[2:-2, :20], abs=1e-6)
    assert got[2:-2, 20:] == pytest.approx(5.0, abs=1e-6)


@pytest.mark.parametrize("method", [METHODS["bilateral"], METHODS["planes"]])
def test_thin_things_keep_their_value(method):
    """Bars one pixel wide in front of a wall, which every texel that they cross shows; the wall between survives."""
    z = np.full((40, 40), 9.0)
    z[:, 7::10] = 2.0
    truth = np.where(z < 5, 0.2, 0.8)
    g = facing(z)
    for choice in ("nearest", "checkerboard"):
        small = smaller(g, choice=choice)
        got = enlarged(small, g, at_chosen(g, truth, 2, choice), method)
        # A border has but two texels on its side, which on a checkerboard may both be the farthest.
        assert got[1:-1, 1:-1] == pytest.approx(truth[1:-1, 1:-1], abs=1e-3)
    # The farthest pixel of a block is never a bar's.
    lost = enlarged(small := smaller(g, choice="farthest"), g, at_chosen(g, truth, 2, "farthest"), method)
    assert np.array(small.mask).all()
    assert lost[z < 5].min() > 0.5


def test_a_surface_that_the_2x2_texels_miss_is_found_farther_away():
    """Two pixels of a wall between boxes: its nearest texels show boxes, one two texels away shows the wall."""
    z = np.full((24, 24), 2.0)
    z[:, :4] = 5.0
    z[10, 4:12] = 5.0
    truth = np.where(z > 3, 0.9, 0.3)
    g = facing(z)
    small = smaller(g, choice="nearest")
    values = at_chosen(g, truth, 2, "nearest")
    got = enlarged(small, g, values, gtao.PlaneAwareUpsample())
    # From column 4 on the row of the wall has no texel of its own; the wall's last texel column is 1.
    assert got[10, 4:6] == pytest.approx(0.9, abs=0.02)
    by_depth = enlarged(small, g, values, gtao.BilateralUpsample())
    assert by_depth[10, 5:].max() < 0.35
    # Farther than that nothing is known of it: the nearest texels, though of another surface, and no NaN.
    assert got[10, 10] == pytest.approx(0.3, abs=0.01)
    assert np.isfinite(got).all()


def test_crossing_a_crease():
    """Two walls that meet: near the corner each lies in the other's plane to within a pixel, but normals tell."""
    x = np.arange(32) + 0.5 - 16.25
    z = np.broadcast_to(30 - np.abs(x), (32, 32)).copy()
    side = np.broadcast_to(np.sign(x), (32, 32))
    n = np.stack([-side, np.zeros((32, 32)), np.ones((32, 32))], axis=-1) / np.sqrt(2)
    g = gtao.GBuffer(z, n, gtao.OrthographicCamera(32, 32, 32.0))
    truth = np.where(side > 0, 0.2, 0.7)
    small = smaller(g)
    values = at_chosen(g, truth, 2)
    sharp, blunt = (
        np.abs(enlarged(small, g, values, gtao.PlaneAwareUpsample(angle=angle)) - truth).max() for angle in (0.5, np.pi)
    )
    assert sharp < 0.01 < 0.05 < blunt


@every_method
def test_a_frame_without_the_surface_is_open(method):
    """A small frame from elsewhere may show nothing where the large one has a surface."""
    g = facing(np.full((16, 16), 2.0))
    small = gtao.GBuffer(np.full((8, 8), np.inf), np.broadcast_to(SKY, (8, 8, 3)).copy(), g.camera.reduced(2))
    ao = estimate(small, np.full((8, 8), 0.3), mean_direction=np.full((8, 8, 3), np.nan))
    result = gtao.upsample(ao, small, g, method)
    assert (np.array(result.visibility) == 1).all()
    assert (np.array(result.mean_direction) == 0).all()


@pytest.mark.parametrize("method", [gtao.BilateralUpsample(), gtao.PlaneAwareUpsample(tolerance=1e-12)])
def test_however_far_the_texels_are_they_count(method):
    """In single precision fourth powers of such distances overflow."""
    z = np.full((16, 16), 1e-3, np.float32)
    g = facing(z)
    small = gtao.GBuffer(np.full((8, 8), 1e9, np.float32), np.broadcast_to(SKY, (8, 8, 3)), g.camera.reduced(2))
    assert enlarged(small, g, np.full((8, 8), 0.3, np.float32), method) == pytest.approx(0.3, abs=1e-6)


def test_small_frames_that_are_rendered_at_their_size():
    """Any smaller frame of the view will do, at any ratio of sizes."""
    large, small = (fields.in_perspective(fields.waves(0.1, 3.0), size=size) for size in (48, 20))
    g, g_low = frame(large), frame(small)

    def value(field):
        x, y = field.plane_coordinates()
        return 0.5 + 0.2 * np.sin(2 * x) * np.cos(y)

    got = enlarged(g_low, g, value(small), gtao.PlaneAwareUpsample())
    # Bilinear interpolation of a sine over cells of 0.1: an eighth of its second derivative times the cell squared.
    assert np.abs(got - value(large))[3:-3, 3:-3].max() < 5e-3


def test_the_default_is_by_planes():
    g = frame(terrain())
    small = smaller(g)
    ao = estimate(small, np.random.default_rng(3).random(small.shape))
    default, planes = (gtao.upsample(ao, small, g, *m).visibility.numpy() for m in ((), (gtao.PlaneAwareUpsample(),)))
    assert np.array_equal(default, planes)


def test_a_checkerboard_knows_both_sides_of_an_edge():
    """Every 2×2 texels hold the nearest and the farthest: pixels of either surface find their own."""
    rng = np.random.default_rng(5)
    z = np.where(rng.random((32, 32)) < 0.4, 2.0, 6.0)
    truth = np.where(z < 4, 0.3, 0.8)
    g = facing(z)
    error = {}
    for choice in ("nearest", "farthest", "checkerboard"):
        small = smaller(g, choice=choice)
        error[choice] = np.abs(enlarged(small, g, at_chosen(g, truth, 2, choice), gtao.PlaneAwareUpsample()) - truth)
    assert error["checkerboard"].mean() < 0.25 * min(error["nearest"].mean(), error["farthest"].mean())


def test_single_precision_agrees_with_double():
    field = terrain()
    for method in METHODS.values():
        images = []
        for dtype in (np.float64, np.float32):
            g = frame(field, dtype)
            small = smaller(g)
            values = np.random.default_rng(0).random(small.shape).astype(dtype)
            images.append(enlarged(small, g, values, method))
        assert images[1].dtype == np.float32
        # Depths of 3 are known to 2e-7, a texel of them is 0.5 wide; another texel may be the nearest of two.
        assert np.quantile(np.abs(images[1] - images[0]), 0.99) < 1e-4


def kernels(method):
    g = frame(terrain(), np.float32)
    small = smaller(g)
    ao = gtao.AmbientOcclusion(visibility=g.types.Tensor(np.random.default_rng(0).random(small.shape, np.float32)))
    dr.eval(ao.visibility, g.normals_to_be_normalised()[0], small.normals_to_be_normalised()[0])
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        gtao.upsample(ao, small, g, method)
        dr.sync_thread()
        return [k for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]


@every_method
def test_one_kernel(method):
    assert len(kernels(method)) == 1


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (gtao.NearestDepthUpsample(threshold=0.1), gtao.NearestDepthUpsample(threshold=0.2)),
        (gtao.BilateralUpsample(threshold=0.1), gtao.BilateralUpsample(threshold=0.2)),
        (gtao.PlaneAwareUpsample(tolerance=0.5, angle=0.5), gtao.PlaneAwareUpsample(tolerance=0.7, angle=0.4)),
    ],
)
def test_values_change_without_recompiling(first, second):
    kernels(first)
    assert all(k["cache_hit"] for k in kernels(second))


@every_method
def test_frozen(method):
    from drjit.auto.ad import TensorXf

    def step(z, n, camera):
        g = gtao.GBuffer(z, n, camera, validate=False)
        small = gtao.downsample(g, gtao.Downsample())
        ao = gtao.ambient_occlusion(small, gtao.GTAO(radius=0.5, n_slices=1, n_steps=4))
        return gtao.upsample(ao, small, g, method).visibility

    field = terrain()
    camera = gtao.PerspectiveCamera(**field.camera)
    frozen = dr.freeze(step)
    for scale in (1.0, 1.5, 2.0):
        z, n = (dr.opaque(TensorXf(np.float32(a))) for a in (field.view_z * scale, field.normal_v))
        np.testing.assert_array_equal(frozen(z, n, camera).numpy(), step(z, n, camera).numpy())
    assert frozen.n_recordings == 1


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        (lambda ao, low, g: (ao, low, g, gtao.SpatialFilter()), gtao.ConfigError, "gtao.PlaneAwareUpsample"),
        (lambda ao, low, g: (ao.visibility, low, g), gtao.ConfigError, "ao must be"),
        (lambda ao, low, g: (ao, low, g.view_z), gtao.ConfigError, "g must be"),
        (lambda ao, low, g: (ao, low.view_z, g), gtao.ConfigError, "g must be"),
        (lambda ao, low, g: (ao, g, g), gtao.ShapeError, "(14, 14)"),
        (lambda ao, low, g: (ao, low, frame(terrain(), np.float32)), gtao.ShapeError, "precision"),
        (lambda ao, low, g: (ao, low, facing(np.ones((27, 27)), 2.0)), gtao.ShapeError, "smaller one of the view"),
        (lambda ao, low, g: (ao.crop(1, 1, 9, 9), low.crop(1, 1, 9, 9), g), gtao.ShapeError, "of the view"),
        (lambda ao, low, g: (ao, low, from_above()), gtao.ShapeError, "of the view"),
    ],
)
def test_refusals(arguments, error, words):
    g = frame(terrain())
    low = smaller(g)
    with pytest.raises(error) as caught:
        gtao.upsample(*arguments(estimate(low, np.ones(low.shape)), low, g))
    assert words in str(caught.value)


def test_a_larger_frame_is_refused():
    g = facing(np.full((16, 16), 2.0))
    with pytest.raises(gtao.ShapeError, match="smaller one of the view"):
        gtao.upsample(estimate(g, np.ones(g.shape)), g, smaller(g))


@pytest.mark.parametrize(
    "make",
    [
        lambda: gtao.NearestDepthUpsample(threshold=0.0),
        lambda: gtao.BilateralUpsample(threshold=-1.0),
        lambda: gtao.BilateralUpsample(threshold=np.inf),
        lambda: gtao.PlaneAwareUpsample(tolerance=0.0),
        lambda: gtao.PlaneAwareUpsample(angle=0.0),
        lambda: gtao.PlaneAwareUpsample(angle=3.2),
        lambda: gtao.PlaneAwareUpsample(angle="wide"),
    ],
)
def test_options_out_of_range(make):
    with pytest.raises(gtao.ConfigError):
        make()


@every_method
def test_methods_become_plain_values_and_back(method):
    assert gtao.method_from_dict(method.to_dict()) == method
