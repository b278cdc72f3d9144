"""``gtao.denoise``: what every filter promises on whole frames, whatever its weights."""

import dataclasses

import drjit as dr
import numpy as np
import pytest
from oracles import fields
from oracles import filters as oracle

import gtao

FILTERS = {
    "edge-aware": gtao.EdgeAwareFilter(),
    "edge-aware, 3 passes": gtao.EdgeAwareFilter(passes=3, quantised_edges=False),
    "bilateral": gtao.SpatialFilter(),
    "bilateral, no derivatives": gtao.SpatialFilter(derivatives="none"),
    "bilateral, planar": gtao.SpatialFilter(derivatives="first", planar=True),
    "planes": gtao.PlaneAwareFilter(),
    "planes, mean of 4": gtao.PlaneAwareFilter(size=4, fit="constant"),
}
every_filter = pytest.mark.parametrize("spatial", FILTERS.values(), ids=FILTERS)
# Three roundings to float32 in a row, of values near 1.
ROUNDING = 5e-7


def frame(field, dtype=np.float64):
    camera = gtao.OrthographicCamera if field.orthographic else gtao.PerspectiveCamera
    return gtao.GBuffer(field.view_z.astype(dtype), field.normal_v.astype(dtype), camera(**field.camera))


def terrain(size=24, holes=True):
    field = fields.in_perspective(fields.gaussians(0.3, 0.4, seed=2), size=size, slope=(0.5, 0.3))
    if holes:
        field.view_z[4:9, 3:12] = np.inf
        field.view_z[6, 6] = 3.0
        field.view_z[:, -1] = np.inf
    return field


def estimate(g, visibility, directions=None, sh=None):
    visibility, directions, sh = (
        None if image is None else g.types.Tensor(np.ascontiguousarray(image, dtype=np.float64))
        for image in (visibility, directions, sh)
    )
    return gtao.AmbientOcclusion(
        visibility=visibility, mean_direction=directions, visibility_sh=sh, normal_v=g.normal_v, config=gtao.GTAO()
    )


def filtered(g, visibility, spatial, directions=None, frame_index=0):
    result = gtao.denoise(estimate(g, visibility, directions), g, spatial, frame_index=frame_index)
    image = np.array(result.visibility)
    return image if directions is None else (image, np.array(result.mean_direction))


def random_image(shape, seed=0):
    return np.random.default_rng(seed).random(shape)


@every_filter
def test_constant_images_stay(spatial):
    field = terrain()
    g = frame(field)
    direction = np.array([0.48, 0.6, 0.64])
    bent = np.broadcast_to(direction, (*g.shape, 3))
    image, bent = filtered(g, np.where(np.isfinite(field.view_z), 0.37, 1.0), spatial, bent)
    surface = np.isfinite(field.view_z)
    assert image[surface] == pytest.approx(0.37, abs=1e-12)
    assert (image[~surface] == 1).all()
    assert bent == pytest.approx(np.where(surface[..., None], direction, 0.0), abs=1e-12)


@every_filter
def test_the_background_is_1_and_never_read(spatial):
    field = terrain()
    g, surface = frame(field), np.isfinite(field.view_z)
    image = random_image(g.shape)
    bent = np.random.default_rng(1).standard_normal((*g.shape, 3))
    want, want_bent = filtered(g, np.where(surface, image, 1.0), spatial, bent)
    poison = np.where(surface[..., None], bent, [1.0, 0.0, 0.0])
    got, got_bent = filtered(g, np.where(surface, image, 1e6), spatial, poison)
    assert (got[~surface] == 1).all()
    assert np.array_equal(got, want)
    assert np.array_equal(got_bent[surface], want_bent[surface])
    assert np.isfinite(got).all()
    assert np.all(got_bent[~surface] == 0)
    # The pixel without neighbours keeps its value.
    assert got[6, 6] == pytest.approx(image[6, 6], abs=1e-12)
    assert not np.allclose(got[surface], image[surface])


@every_filter
def test_unshaped_visibility_is_filtered_like_the_other_and_1_on_the_background(spatial):
    """Whatever the estimate holds there: a lower bound on visibility, for example, leaves what is not shaped at 1."""
    field = terrain()
    g, surface = frame(field), np.isfinite(field.view_z)
    image, other = random_image(g.shape), random_image(g.shape, seed=1)
    ao = estimate(g, np.where(surface, image, 1.0), np.zeros((*g.shape, 3)))
    ao = dataclasses.replace(ao, unshaped=g.types.Tensor(np.where(surface, other, 1.0)))
    result = gtao.denoise(ao, g, spatial).unshaped.numpy()
    assert (result[~surface] == 1).all()
    # The sums of weights are not in the same place of the kernel: a rounding apart.
    assert result[surface] == pytest.approx(filtered(g, np.where(surface, other, 1.0), spatial)[surface], abs=1e-12)


@every_filter
def test_nothing_leaks_across_a_depth_step(spatial):
    """Two parallel planes in each other's prolongation: one at depth 2, dark, and one at depth 3, bright."""
    z = np.full((16, 20), 2.0)
    z[:, 9:] = 3.0
    g = gtao.GBuffer(z, np.broadcast_to([0.0, 0, 1], (16, 20, 3)).copy(), gtao.PerspectiveCamera(20, 16, 0.9))
    image = filtered(g, np.where(z < 2.5, 0.25, 0.75), spatial)
    assert image == pytest.approx(np.where(z < 2.5, 0.25, 0.75), abs=1e-12)


@pytest.mark.parametrize("tilt", [0.0, 0.6, 1.2, 1.45])
def test_planes_of_any_tilt_are_averaged_in_full(tilt):
    """The plane-aware filter is then a plain average of its footprint; a filter by depth alone gives up."""
    field = fields.tilted_plane(tilt, 0.7, size=16, f=150.0)
    g, values = frame(field), random_image((16, 16))
    kernel = np.array([0.5, 1, 1, 1, 0.5])
    want = (
        sum(kernel[i] * kernel[j] * values[i : i + 12, j : j + 12] for i in range(5) for j in range(5))
        / kernel.sum() ** 2
    )
    got = filtered(g, values, gtao.PlaneAwareFilter(fit="constant"))[2:-2, 2:-2]
    assert got == pytest.approx(want, abs=1e-12)
    by_depth = filtered(g, values, gtao.SpatialFilter(derivatives="none"))
    box = np.lib.stride_tricks.sliding_window_view(values, (4, 4)).mean(axis=(2, 3))
    gap = np.abs(by_depth[1:-2, 1:-2] - box).max()
    assert gap < 1e-12 if tilt == 0 else gap > 1e-3


@pytest.mark.parametrize(
    "spatial",
    [gtao.SpatialFilter(), gtao.PlaneAwareFilter(size=4), gtao.PlaneAwareFilter(size=5)],
    ids=["slides", "4", "5"],
)
def test_one_period_of_the_noise_pattern_averages_out(spatial):
    """On a plane that faces the eye every pixel receives all 16 directions once, and 4 offsets, four times each."""
    y, x = np.mgrid[:16, :16]
    g = facing()
    direction = ((((x + y) & 3) << 2) + (x & 3)) / 16
    values = direction + ((y - x) & 3) / 4
    image = filtered(g, values, spatial)[2:-2, 2:-2]
    if getattr(spatial, "fit", "constant") == "constant":
        assert image == pytest.approx(15 / 32 + 3 / 8, abs=1e-12)
    else:
        # A fitted slope picks up the rows' rise to the right: at most a texel or two of it.
        assert np.abs(image - 27 / 32).max() < np.abs(values - 27 / 32).max() / 5
    sharp = filtered(g, values, gtao.EdgeAwareFilter())[2:-2, 2:-2]
    assert np.abs(sharp - 27 / 32).max() > 0.02


EVEN = {
    "slides": gtao.SpatialFilter(),
    "planes, 4": gtao.PlaneAwareFilter(size=4, fit="constant"),
    "planes, 2": gtao.PlaneAwareFilter(size=2, fit="constant"),
}


def facing(size=16):
    """A plane that faces the eye: every filter by depth or planes is an average over its footprint there."""
    camera = gtao.PerspectiveCamera(size, size, 0.9)
    return gtao.GBuffer(np.full((size, size), 2.0), np.broadcast_to([0.0, 0, 1], (size, size, 3)).copy(), camera)


def stages_of(result):
    """Visibility, directions and harmonics as one (H, W, 13) image."""
    images = (result.visibility, result.mean_direction, result.visibility_sh)
    return np.concatenate([np.array(image).reshape(*result.visibility.shape, -1) for image in images], axis=-1)


@pytest.mark.parametrize("spatial", EVEN.values(), ids=EVEN)
def test_even_footprints_move_the_image_by_half_a_pixel_and_back(spatial):
    """Of a ramp, the value says where it comes from: visibility, directions and harmonics alike."""
    g = facing()
    y, x = np.mgrid[:16.0, :16.0]
    ramps = np.stack([x + 0.1 * y, y - 0.3 * x] + [k * x + (13 - k) * y for k in range(11)], axis=-1)
    ao = estimate(g, ramps[..., 0], ramps[..., 1:4], ramps[..., 4:])
    frames = [stages_of(gtao.denoise(ao, g, spatial, frame_index=k))[2:-2, 2:-2] - ramps[2:-2, 2:-2] for k in range(3)]
    # Half a pixel of the ramp, to the rounding of sums of 16 values of about 200.
    half = 0.5 * (ramps[1, 1] - ramps[0, 0])
    assert frames[0] == pytest.approx(np.broadcast_to(half, frames[0].shape), abs=1e-11)
    assert frames[1] == pytest.approx(-np.broadcast_to(half, frames[0].shape), abs=1e-11)
    assert np.abs(frames[0] + frames[1]).max() < 1e-11
    assert np.array_equal(frames[2], frames[0])


@pytest.mark.parametrize("spatial", [*EVEN.values(), gtao.PlaneAwareFilter(size=4)])
def test_odd_frames_mirror_even_ones(spatial):
    """On any surface: what the filter makes of a frame upside down and left to right is its other footprint."""
    field = terrain()
    values = random_image(field.view_z.shape)
    turned = fields.Field(
        field.view_z[::-1, ::-1].copy(),
        field.normal_v[::-1, ::-1] * np.array([-1.0, -1.0, 1.0]),
        field.camera,
        field.orthographic,
    )
    want = filtered(frame(field), values, spatial, frame_index=5)
    got = filtered(frame(turned), values[::-1, ::-1], spatial, frame_index=4)[::-1, ::-1]
    # As for mirrors below, only the order of sums differs.
    assert np.abs(got - want).max() < 1e-9
    assert np.abs(filtered(frame(field), values, spatial, frame_index=4) - want).max() > 0.05


@pytest.mark.parametrize("spatial", [gtao.EdgeAwareFilter(), gtao.EdgeAwareFilter(passes=2), gtao.PlaneAwareFilter()])
def test_symmetric_footprints_do_not_depend_on_the_frame(spatial):
    g = frame(terrain())
    values = random_image(g.shape)
    assert np.array_equal(filtered(g, values, spatial, frame_index=1), filtered(g, values, spatial))


@pytest.mark.parametrize("frame_index", [-1, 0.5, True])
def test_numbers_of_frames_are_whole(frame_index):
    g = facing()
    with pytest.raises(gtao.ConfigError, match="frame_index"):
        gtao.denoise(estimate(g, np.ones(g.shape)), g, gtao.SpatialFilter(), frame_index=frame_index)


def test_a_pipeline_tells_its_filter_which_frame_it_is():
    """With noise that does not change: what differs between frames is the footprint."""
    g = frame(terrain())
    occlusion = gtao.GTAO(radius=1.0, n_slices=1, n_steps=2, noise="none")
    pipeline = gtao.Pipeline(occlusion=occlusion, spatial=gtao.SpatialFilter(), clamp=False)
    for k in (0, 1):
        want = gtao.denoise(gtao.ambient_occlusion(g, pipeline.occlusion), g, pipeline.spatial, frame_index=k)
        got = pipeline.step(g, frame_index=k)
        assert np.array_equal(np.array(got.visibility), np.array(want.visibility))


@pytest.mark.parametrize("name", ["edge-aware", "edge-aware, 3 passes", "planes"])
@pytest.mark.parametrize("axis", [0, 1])
def test_symmetric_footprints_commute_with_mirrors(name, axis):
    field = terrain()
    values = random_image(field.view_z.shape)
    flip = np.array([-1.0, 1, 1] if axis == 1 else [1.0, -1, 1])
    mirrored = fields.Field(
        np.flip(field.view_z, axis).copy(),
        np.flip(field.normal_v, axis).copy() * flip,
        field.camera,
        field.orthographic,
    )
    want = np.flip(filtered(frame(field), values, FILTERS[name]), axis)
    got = filtered(frame(mirrored), np.flip(values, axis), FILTERS[name])
    # The camera's centre is that of the frame, so that only the order of sums differs; 2-bit links may round anew.
    assert np.abs(got - want).max() < 1e-9


@pytest.mark.parametrize("passes", [1, 2, 3])
def test_earlier_passes_of_xegtao_smooth_more(passes):
    """Against the oracle's matrices: a fifth of beta before the last pass."""
    field = terrain(size=14)
    g = frame(field)
    values = random_image(g.shape)
    links = oracle.edge_links(field.view_z)
    want = values.ravel()
    for k in range(passes):
        beta = 1.2 if k == passes - 1 else 0.24
        want = oracle.average(oracle.edge_weights(field.view_z, links, beta), want)
    surface = np.isfinite(field.view_z)
    got = filtered(g, values, gtao.EdgeAwareFilter(passes=passes))
    assert got[surface] == pytest.approx(want.reshape(g.shape)[surface], abs=1e-12)


def test_options_of_the_edge_aware_filter_reach_the_kernel():
    field = terrain(size=14)
    g, values = frame(field), random_image(field.view_z.shape)
    surface = np.isfinite(field.view_z)
    options = {"diagonal_weight": 0.3, "leak_threshold": 1.0, "leak_strength": 0.8}
    links = oracle.edge_links(field.view_z, 0.004, False)
    weights = oracle.edge_weights(field.view_z, links, 2.0, 0.3, 1.0, 0.8)
    want = oracle.average(weights, values.ravel()).reshape(g.shape)
    spatial = gtao.EdgeAwareFilter(beta=2.0, edge_threshold=0.004, quantised_edges=False, **options)
    assert filtered(g, values, spatial)[surface] == pytest.approx(want[surface], abs=1e-12)


def test_directions_get_the_weights_of_the_visibility():
    field = terrain()
    g, surface = frame(field), np.isfinite(field.view_z)
    rng = np.random.default_rng(5)
    directions, sh = rng.standard_normal((*g.shape, 3)), rng.standard_normal((*g.shape, 9))
    for spatial in (gtao.EdgeAwareFilter(), gtao.SpatialFilter(), gtao.PlaneAwareFilter()):
        result = gtao.denoise(estimate(g, np.ones(g.shape), directions, sh), g, spatial)
        for got, image in ((result.mean_direction, directions), (result.visibility_sh, sh)):
            want = np.stack([filtered(g, channel, spatial) for channel in np.moveaxis(image, -1, 0)], axis=-1)
            got = np.array(got)
            assert got[surface] == pytest.approx(want[surface], abs=1e-12)
            assert np.all(got[~surface] == 0)
        bent = np.array(result.bent_normal)
        assert np.linalg.norm(bent, axis=-1) == pytest.approx(1, abs=1e-12)
        assert np.all(bent[~surface] == [0, 0, 1])


def test_visibility_above_1_counts_in_full():
    field = terrain(holes=False)
    g = frame(field)
    values = 0.5 + random_image(g.shape)
    for spatial in (gtao.EdgeAwareFilter(), gtao.SpatialFilter(), gtao.PlaneAwareFilter()):
        image = filtered(g, values, spatial)
        assert (image > 1).any()
        # Most footprints lie on one surface, where averages keep the mean; at the borders they do not quite.
        assert image.mean() == pytest.approx(values.mean(), abs=0.02)


@every_filter
def test_gradients(spatial):
    """Filters are linear in the image: the adjoint is the transpose; and depth gets finite gradients."""
    field = terrain(size=12)
    g = frame(field)
    rng = np.random.default_rng(9)
    v, w = rng.random(g.shape), rng.standard_normal(g.shape)
    direction = rng.standard_normal(g.shape)
    x = g.types.Tensor(v)
    dr.enable_grad(x)
    y = gtao.denoise(gtao.AmbientOcclusion(visibility=x), g, spatial).visibility
    dr.backward(dr.sum(y * g.types.Tensor(w)))
    gradient = np.array(dr.grad(x))
    change = filtered(g, v + direction, spatial) - filtered(g, v, spatial)
    assert (gradient * direction).sum() == pytest.approx((w * change).sum(), rel=1e-9)
    assert (gradient[~np.isfinite(field.view_z)] == 0).all()


DIFFERENTIABLE = [gtao.EdgeAwareFilter(quantised_edges=False), gtao.SpatialFilter(), gtao.PlaneAwareFilter()]


@pytest.mark.parametrize("spatial", DIFFERENTIABLE)
def test_gradients_of_depth_are_finite(spatial):
    field = terrain(size=12)
    z = gtao.GBuffer(field.view_z, field.normal_v, gtao.PerspectiveCamera(**field.camera)).view_z
    dr.enable_grad(z)
    g = gtao.GBuffer(z, field.normal_v, gtao.PerspectiveCamera(**field.camera))
    y = gtao.denoise(estimate(g, random_image(g.shape)), g, spatial).visibility
    dr.backward(dr.sum(y * g.types.Tensor(random_image(g.shape, 1))))
    gradient = np.array(dr.grad(z))
    assert np.isfinite(gradient).all()
    assert np.abs(gradient).max() > 1e-3


def kernels(g, spatial):
    ao = estimate(g, random_image(g.shape))
    # A frame normalises its normals when they are first looked at.
    dr.eval(ao.visibility, g.normal_v)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        gtao.denoise(ao, g, spatial)
        dr.sync_thread()
        return [k for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]


@pytest.mark.parametrize(
    ("spatial", "count"),
    [
        # Besides the passes: the links.
        (gtao.EdgeAwareFilter(), 2),
        (gtao.EdgeAwareFilter(passes=3), 4),
        (gtao.SpatialFilter(), 1),
        (gtao.PlaneAwareFilter(), 1),
    ],
)
def test_one_kernel_per_pass(spatial, count):
    assert len(kernels(frame(terrain()), spatial)) == count


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (
            gtao.EdgeAwareFilter(beta=1.0, edge_threshold=0.01, diagonal_weight=0.4),
            gtao.EdgeAwareFilter(beta=2.0, edge_threshold=0.02, diagonal_weight=0.3, leak_strength=0.1),
        ),
        (gtao.SpatialFilter(threshold=0.1), gtao.SpatialFilter(threshold=0.2)),
        (gtao.PlaneAwareFilter(tolerance=0.5), gtao.PlaneAwareFilter(tolerance=0.7)),
    ],
)
def test_values_change_without_recompiling(first, second):
    g = frame(terrain(), np.float32)
    kernels(g, first)
    assert all(k["cache_hit"] for k in kernels(g, second))


@every_filter
def test_images_of_one_pixel_and_of_one_row(spatial):
    for shape in ((1, 1), (1, 7), (7, 1)):
        g = gtao.GBuffer(np.full(shape, 2.0), None, gtao.PerspectiveCamera(shape[1], shape[0], 0.9))
        image = filtered(g, np.full(shape, 0.5), spatial)
        assert image == pytest.approx(np.full(shape, 0.5), abs=1e-12)


def test_single_precision_agrees_with_double():
    field = terrain()
    values = random_image(field.view_z.shape)
    for spatial in (gtao.SpatialFilter(), gtao.PlaneAwareFilter(fit="constant")):
        double = filtered(frame(field), values, spatial)
        g = frame(field, np.float32)
        ao = gtao.AmbientOcclusion(visibility=g.types.Tensor(values.astype(np.float32)))
        single = np.array(gtao.denoise(ao, g, spatial).visibility)
        assert single.dtype == np.float32
        # Depths of 3 are known to 2e-7, a pixel of them is 0.25 wide; a bilateral threshold is 0.3.
        assert np.abs(single - double).max() < 1e-4


def test_the_result_keeps_the_configuration():
    g = frame(terrain())
    ao = gtao.ambient_occlusion(g, gtao.GTAO(n_slices=1, n_steps=2))
    result = gtao.denoise(ao, g, gtao.PlaneAwareFilter())
    assert result.config == ao.config
    assert result.bent_normal is None


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        (lambda ao, g: (ao, g, gtao.GTAO()), gtao.ConfigError, "gtao.EdgeAwareFilter"),
        (lambda ao, g: (ao.visibility, g, gtao.SpatialFilter()), gtao.ConfigError, "ao must be"),
        (lambda ao, g: (ao, g.view_z, gtao.SpatialFilter()), gtao.ConfigError, "g must be"),
        (lambda ao, g: (ao, frame(terrain(size=12)), gtao.SpatialFilter()), gtao.ShapeError, "(24, 24)"),
    ],
)
def test_refusals(arguments, error, words):
    g = frame(terrain())
    with pytest.raises(error) as caught:
        gtao.denoise(*arguments(estimate(g, np.ones(g.shape)), g))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "make",
    [
        lambda: gtao.EdgeAwareFilter(passes=0),
        lambda: gtao.EdgeAwareFilter(beta=0.0),
        lambda: gtao.EdgeAwareFilter(edge_threshold=-1),
        lambda: gtao.EdgeAwareFilter(quantised_edges=1),
        lambda: gtao.EdgeAwareFilter(diagonal_weight=-0.1),
        lambda: gtao.EdgeAwareFilter(leak_threshold=4.0),
        lambda: gtao.EdgeAwareFilter(leak_strength=1.5),
        lambda: gtao.SpatialFilter(threshold=0.0),
        lambda: gtao.SpatialFilter(derivatives="third"),
        lambda: gtao.SpatialFilter(planar=1),
        lambda: gtao.SpatialFilter(derivatives="none", planar=True),
        lambda: gtao.PlaneAwareFilter(size=1),
        lambda: gtao.PlaneAwareFilter(tolerance=np.inf),
        lambda: gtao.PlaneAwareFilter(fit="cubic"),
    ],
)
def test_options_out_of_range(make):
    with pytest.raises(gtao.ConfigError):
        make()


@every_filter
def test_filters_become_plain_values_and_back(spatial):
    assert gtao.method_from_dict(spatial.to_dict()) == spatial
