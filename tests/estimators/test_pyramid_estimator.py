"""Methods that read far samples from a depth pyramid."""

import math
from dataclasses import replace

import drjit as dr
import numpy as np
import pytest
from oracles import fields, gradients, pyramids

import gtao

METHODS = {
    "gtao": gtao.GTAO(radius=1.5, n_slices=2, n_steps=6),
    "falloff": gtao.GTAO(radius=1.5, n_slices=2, falloff=gtao.LinearFalloff(start=0.5, end=1.5)),
    "hbao": gtao.HBAO(radius=1.5, n_directions=4),
    "bitmask": gtao.VisibilityBitmask(radius=1.5, n_slices=2),
    "off the frame": gtao.GTAO(radius=1.5, n_slices=2, step_law="offset", border="replicate"),
}
PYRAMID = gtao.DepthPyramid(level_offset=1.0)
every_method = pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)


def frame(block=1, size=48, dtype=np.float32):
    """Bumps with a hole to the background, of constant depth in blocks of ``block`` pixels."""
    field = fields.in_perspective(fields.gaussians(0.5, 0.3, seed=5), size=size, slope=(0.3, 0.2))
    z = np.kron(field.view_z[block // 2 :: block, block // 2 :: block], np.ones((block, block)))
    z[8:16, 24:32] = np.inf
    n = np.where(np.isfinite(z)[..., None], field.normal_v, [0.0, 0.0, 1.0])
    return gtao.GBuffer(z.astype(dtype), n.astype(dtype), gtao.PerspectiveCamera(**field.camera))


def image(g, method, pyramid=None, **changes):
    return np.array(gtao.ambient_occlusion(g, replace(method, pyramid=pyramid, **changes)).visibility)


@every_method
@pytest.mark.parametrize("pyramid", [gtao.DepthPyramid(n_levels=1), gtao.DepthPyramid(level_offset=16.0)])
def test_level_0_is_the_depth_buffer(method, pyramid):
    g = frame()
    assert np.array_equal(image(g, method, pyramid), image(g, method))


@every_method
@pytest.mark.parametrize("name", ["weighted", "min", "max", "average"])
def test_levels_of_a_blocky_buffer_say_the_same(method, name):
    """Four equal texels are one whatever the filter, so that three levels of a buffer of 4×4 blocks change nothing."""
    g = frame(block=4)
    pyramid = gtao.DepthPyramid(filter=name, n_levels=3, level_offset=0.5)
    # The filter's mean of four equal depths rounds.
    assert np.abs(image(g, method, pyramid) - image(g, method)).max() < 2e-5


@every_method
def test_coarse_levels_do_change_the_image(method):
    g = frame()
    plain = image(g, method)
    gap = [np.abs(image(g, method, gtao.DepthPyramid(level_offset=o)) - plain).mean() for o in (0.0, 1.0, 2.0)]
    assert gap[0] > gap[1] > gap[2] > 0


def test_near_texels_occlude_more_than_far_ones():
    g = frame()
    means = {
        name: image(g, METHODS["falloff"], gtao.DepthPyramid(filter=name, level_offset=1.0)).mean()
        for name in ("min", "average", "weighted", "max")
    }
    assert means["min"] < means["average"] < means["weighted"] <= means["max"]


def test_the_weighted_filter_takes_its_range_from_the_falloff_or_from_the_radius():
    g, pyramid = frame(), gtao.DepthPyramid(level_offset=1.0)
    seen = []
    original = gtao.GBuffer.depth_pyramid

    def spy(self, table, name, start, end):
        seen.append((name, start, end))
        return original(self, table, name, start, end)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gtao.GBuffer, "depth_pyramid", spy)
        image(g, METHODS["falloff"], pyramid)
        image(g, METHODS["hbao"], pyramid, radius_multiplier=2.0)
    assert seen == [
        ("weighted", pytest.approx(0.75 * 0.5), pytest.approx(0.75 * 1.5)),
        ("weighted", pytest.approx(0.75 * (1 - 0.615) * 3.0), pytest.approx(0.75 * 3.0)),
    ]


def test_each_side_reads_the_levels_of_its_own_distances():
    """A column of pixels in parallel projection, levels that are planes of their own, and one vertical slice."""
    height, rise, offset = 64, np.array([0.0, 3.0, 9.0, 30.0]), 1.2
    g = gtao.GBuffer(np.full((height, 1), 100.0), None, gtao.OrthographicCamera(1, height, view_height=float(height)))

    def planes(self, table, name, start, end):
        images = [np.full((64 >> k, 1), 100.0 - h) for k, h in enumerate(rise)]
        return g.types.Float(pyramids.packed(images, table))

    pyramid = gtao.DepthPyramid(filter="min", n_levels=4, level_offset=offset)
    method = gtao.GTAO(n_slices=1, n_steps=5, noise="none", step_exponent=1.0, pyramid=pyramid)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gtao.GBuffer, "depth_pyramid", planes)
        got = np.array(gtao.ambient_occlusion(g, method).visibility)[:, 0]
    levels = set()
    for y in range(height):
        blocked = 0.0
        for side, reach in ((-1, y + 0.499), (1, height - 1 + 0.499 - y)):
            d = 1 + (np.arange(5) + 0.5) / 5 * (reach - 1)
            k = np.floor(np.clip(np.log2(d) - offset, 0, 3) + 0.5).astype(int) if reach >= 1 else np.zeros(5, int)
            apart = np.abs(np.round(y + side * d) - y)
            # The horizon's squared cosine, which is the share that the cosine-weighted half slice loses.
            blocked += (rise[k] ** 2 / (rise[k] ** 2 + apart**2)).max() / 2 if reach >= 1 else 0.0
            levels |= set(k)
        assert got[y] == pytest.approx(1 - blocked, abs=1e-6), y
    assert levels == {0, 1, 2, 3}


def kernels(g, method):
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        dr.eval(gtao.ambient_occlusion(g, method).visibility)
        dr.sync_thread()
        return [k for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]


def test_the_pyramid_is_built_once_and_offsets_do_not_recompile():
    g = frame()
    method = gtao.GTAO(radius=1.0, n_slices=2, pyramid=gtao.DepthPyramid(filter="min"))
    assert len(kernels(g, method)) > 1
    (again,) = kernels(g, gtao.GTAO(radius=0.8, n_slices=2, pyramid=gtao.DepthPyramid(filter="min", level_offset=2.0)))
    assert again["cache_hit"]


@pytest.mark.parametrize("name", ["weighted", "min", "max", "average", "harmonic", "rotated_grid"])
def test_gradients_pass_through_the_pyramid(name):
    """Both modes in all depths at once against central differences, wherever these say that there is a derivative.

    There is none where two texels of four, or two samples of a side, are the extremum together; a filter of four
    depths has no other kinks but the ends of the weighted filter's ramp.
    """
    g = frame(dtype=np.float64, size=24)
    levels = gtao.DepthPyramid(filter=name, level_offset=0.5)
    method = replace(METHODS["falloff"], n_steps=4, pyramid=levels)
    z, normal_v = np.array(g.view_z), np.array(g.normal_v)
    rng = np.random.default_rng(2)
    direction = np.where(np.isfinite(z), rng.standard_normal(z.shape), 0.0)

    def visibility(view_z):
        return gtao.ambient_occlusion(gtao.GBuffer(view_z, normal_v, g.camera), method).visibility

    found = gradients.derivative(lambda t: np.array(visibility(z + t * direction)))
    assert found.resolved.mean() > 0.99
    assert (np.abs(found.value) > 1e3 * found.noise).mean() > 0.5

    x = g.types.Tensor(z)
    dr.enable_grad(x)
    image = visibility(x)
    dr.set_grad(x, g.types.Tensor(direction))
    dr.enqueue(dr.ADMode.Forward, x)
    dr.traverse(dr.ADMode.Forward)
    assert gradients.disagreements(np.array(dr.grad(image)), found) == []

    weight = np.where(found.resolved, rng.standard_normal(z.shape), 0.0)
    x = g.types.Tensor(z)
    dr.enable_grad(x)
    dr.backward(dr.sum(visibility(x) * g.types.Tensor(weight)))
    gradient = np.array(dr.grad(x))
    assert np.isfinite(gradient).all()
    assert gradients.disagreements((gradient * direction).sum(), found.weighted(weight)) == []


def test_refusals():
    for fetch in ("linear", "nearest_of_four"):
        with pytest.raises(gtao.ConfigError, match="fetch 'nearest', 'floor' or 'bilinear'"):
            gtao.GTAO(radius=1.0, fetch=fetch, pyramid=PYRAMID)
    with pytest.raises(gtao.ConfigError, match="finite radius"):
        gtao.GTAO(radius=math.inf, pyramid=PYRAMID)
    gtao.GTAO(radius=math.inf, pyramid=gtao.DepthPyramid(filter="min"))
    for options in ({"filter": "median"}, {"n_levels": 0}, {"n_levels": 13}, {"level_offset": -17}):
        with pytest.raises(gtao.ConfigError, match="pyramid"):
            gtao.DepthPyramid(**options)
    with pytest.raises(gtao.ConfigError, match="pyramid must be"):
        gtao.GTAO(radius=1.0, pyramid=5)


def test_plain_values_and_back():
    method = gtao.GTAO(radius=1.0, pyramid=gtao.DepthPyramid(filter="average", n_levels=3))
    assert gtao.method_from_dict(method.to_dict()) == method
