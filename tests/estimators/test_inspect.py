"""What ``gtao.inspect_slices`` and ``gtao.filter_weights`` report, against the estimates that it is to explain."""

import math
from dataclasses import replace

import drjit as dr
import numpy as np
import pytest
from oracles import fields

import gtao

X, Y = 11, 13
HORIZON = gtao.GTAO(radius=1.5, n_slices=3, n_steps=6)
METHODS = {
    "sphere": HORIZON,
    "sphere, uniform, moments": replace(HORIZON, weighting="uniform", bent_normal=True, directional=True),
    "falloff": replace(HORIZON, falloff=gtao.LinearFalloff(start=0.4, end=1.5)),
    "by index, running": replace(
        HORIZON, falloff=gtao.IndexFalloff(strength=0.7), thickness=gtao.RunningThickness(blend=0.2)
    ),
    "soft": replace(HORIZON, falloff=gtao.LinearFalloff(start=0.4, end=1.5), soft_horizon=0.1),
    "approximate": replace(HORIZON, falloff=gtao.SampleCut(end=1.2), arccosine="two_term"),
    "interpolated": replace(HORIZON, fetch="linear", snap_to_texel=False),
    "pyramid": replace(HORIZON, pyramid=gtao.DepthPyramid()),
    "screen": replace(HORIZON, slice_measure="screen", noise="hilbert_r2", step_jitter="step"),
    "many steps": replace(HORIZON, n_slices=1, n_steps=70),
    "hbao": gtao.HBAO(radius=1.5, n_directions=6, n_steps=5),
    "hbao, whole directions": gtao.HBAO(radius=1.5, n_directions=6, n_steps=5, attenuation="horizon"),
    "bitmask": gtao.VisibilityBitmask(radius=1.5, n_slices=3, n_steps=6),
    "bitmask, thin": gtao.VisibilityBitmask(
        radius=1.5, n_slices=2, n_steps=6, thickness=gtao.ConstantThickness(thickness=0.3), n_sectors=64
    ),
    "bitmask, angles": gtao.VisibilityBitmask(radius=1.5, n_slices=2, n_steps=6, weighting="angle", n_sectors=16),
}
every_method = pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)


def frame(dtype=np.float64, orthographic=False):
    bumps = fields.gaussians(0.5, 0.25, seed=2)
    above = fields.from_above(bumps, size=24)
    field = above if orthographic else fields.in_perspective(bumps, size=24, slope=(0.4, 0.3))
    z = field.view_z.copy()
    z[8:20, 13:15] *= 0.85
    z[:6, :9] = np.inf
    camera = gtao.OrthographicCamera if orthographic else gtao.PerspectiveCamera
    return gtao.GBuffer(z.astype(dtype), field.normal_v.astype(dtype), camera(**field.camera))


FRAME = frame()


@every_method
@pytest.mark.parametrize("frame_index", [0, 5])
def test_the_mean_over_slices_is_the_estimate(method, frame_index):
    found = gtao.inspect_slices(FRAME, method, X, Y, frame_index=frame_index)
    want = np.array(gtao.ambient_occlusion(FRAME, method, frame_index=frame_index).visibility)[Y, X]
    assert len(found.slices) == method.n_slices
    # Sums of the same numbers in another order, and powers that the compiler took of constants.
    assert found.visibility == pytest.approx(want, abs=1e-13)
    assert found.visibility == pytest.approx(np.mean([s.contribution for s in found.slices]), abs=1e-15)
    assert any(s.wins for sl in found.slices for s in sl.samples)


@pytest.mark.parametrize("orthographic", [False, True])
def test_in_single_precision_and_in_parallel_projection(orthographic):
    g = frame(np.float32, orthographic)
    found = gtao.inspect_slices(g, HORIZON, X, Y)
    want = np.array(gtao.ambient_occlusion(g, HORIZON).visibility)[Y, X]
    assert found.visibility == pytest.approx(want, abs=1e-6)


def test_every_pixel_can_be_asked():
    image = np.array(gtao.ambient_occlusion(FRAME, HORIZON, frame_index=2).visibility)
    for x, y in ((0, 23), (23, 0), (9, 0), (23, 23), (13, 8)):
        found = gtao.inspect_slices(FRAME, HORIZON, x, y, frame_index=2)
        assert found.visibility == pytest.approx(image[y, x], abs=1e-13)
        assert (found.x, found.y, found.frame_index, found.method) == (x, y, 2, HORIZON)


@pytest.mark.parametrize("name", ["sphere", "screen", "bitmask", "hbao"])
def test_samples_are_what_the_depth_buffer_holds(name):
    found = gtao.inspect_slices(FRAME, METHODS[name], X, Y, frame_index=1)
    z, camera = np.array(FRAME.view_z), FRAME.camera
    P = np.array(found.position_v)
    assert found.view_z == z[Y, X] == -P[2]
    assert np.allclose(found.normal_v, np.array(FRAME.normal_v)[Y, X], atol=1e-15)
    zenith = (0, 0, 1) if name == "hbao" else -P / np.linalg.norm(P)
    assert np.allclose(found.zenith, zenith, atol=1e-15)
    samples = [s for sl in found.slices for s in sl.samples]
    assert len(samples) == 2 * METHODS[name].n_steps * len(found.slices)
    for s in samples:
        assert s.x == round(s.x)
        assert s.view_z == z[int(s.y), int(s.x)]
        if math.isinf(s.view_z):
            assert math.isinf(s.distance)
            assert math.isnan(s.cosine)
            assert not s.blocks
            continue
        at = np.array([(s.x + 0.5 - camera.cx) / camera.fx, -(s.y + 0.5 - camera.cy) / camera.fy, -1]) * s.view_z
        assert np.allclose(s.position_v, at, atol=1e-13)
        D = at - P
        assert s.distance == pytest.approx(np.linalg.norm(D), abs=1e-13)
        assert s.cosine == pytest.approx(D @ np.array(found.zenith) / np.linalg.norm(D), abs=1e-12)


def test_samples_lie_along_their_slice():
    """Within the half texel that they snap to, outward, on the side that they say."""
    for sl in gtao.inspect_slices(FRAME, HORIZON, X, Y).slices:
        direction = np.array(sl.direction)
        assert np.linalg.norm(direction) == pytest.approx(1, abs=1e-13)
        for side in (0, 1):
            places = np.array([(s.x - X, s.y - Y) for s in sl.samples if s.side == side])
            along = places @ direction * (2 * side - 1)
            assert (along > 0).all()
            assert (along < sl.reach[side] + 0.71).all()
            assert (np.diff(along) > -1e-12).all()
            assert np.abs(places @ (direction[::-1] * (1, -1))).max() <= 0.71


def test_the_background_and_sides_without_samples():
    found = gtao.inspect_slices(FRAME, replace(HORIZON, n_slices=4), 9, 3)
    assert any(math.isinf(s.view_z) for sl in found.slices for s in sl.samples)
    corner = gtao.inspect_slices(FRAME, replace(HORIZON, noise="none", n_slices=2), 23, 23)
    short = [side for sl in corner.slices for side in (0, 1) if sl.reach[side] < 1]
    assert short
    for sl in corner.slices:
        for side in (0, 1):
            samples = [s for s in sl.samples if s.side == side]
            assert len(samples) == (0 if sl.reach[side] < 1 else HORIZON.n_steps)


def cosine_arc(normal, cosines):
    """The listing of Jimenez et al. (2016): two horizons to the share of a slice."""
    (n_V, n_T), (c0, c1) = normal, cosines
    gamma, length = math.atan2(n_T, n_V), math.hypot(n_V, n_T)
    h = (-math.acos(c0), math.acos(c1))
    return length * sum(-math.cos(2 * a - gamma) + math.cos(gamma) + 2 * a * math.sin(gamma) for a in h) / 4


@pytest.mark.parametrize("name", ["sphere", "falloff", "soft", "screen"])
def test_horizons_explain_the_contribution(name):
    for sl in gtao.inspect_slices(FRAME, METHODS[name], X, Y).slices:
        (u0, l0), (u1, l1) = sl.horizons
        tangent = sl.tangent
        gaps = cosine_arc(sl.normal, tangent) - cosine_arc(sl.normal, (l0, l1))
        assert sl.contribution == pytest.approx(cosine_arc(sl.normal, (u0, u1)) + gaps, abs=1e-6)
        assert sl.open_sectors is None


@pytest.mark.parametrize("name", ["sphere", "falloff", "pyramid", "hbao"])
def test_winners_are_the_highest_of_their_side(name):
    found = gtao.inspect_slices(FRAME, METHODS[name], X, Y, frame_index=3)
    assert any(s.wins for sl in found.slices for s in sl.samples)
    for sl in found.slices:
        for side in (0, 1):
            samples = [s for s in sl.samples if s.side == side]
            fronts = [max((b[0] for b in s.blocks), default=-1.0) for s in samples]
            winners = [s for s in samples if s.wins]
            highest = max([*fronts, sl.tangent[side]])
            assert sl.horizons[side][0] == pytest.approx(highest, abs=1e-13)
            assert samples[-1].horizon == sl.horizons[side][0]
            assert [s.horizon for s in samples] == sorted(s.horizon for s in samples)
            assert len(winners) == (highest > sl.tangent[side])
            assert all(fronts[samples.index(w)] == highest for w in winners)


def test_hbao_is_the_rise_of_its_horizons():
    method = gtao.HBAO(radius=1.5, n_directions=6, n_steps=5, attenuation="none")
    for sl in gtao.inspect_slices(FRAME, method, X, Y).slices:
        rises = sum(upper - lower for upper, lower in sl.horizons)
        assert sl.contribution == pytest.approx(1 - rises / 2, abs=1e-13)


@pytest.mark.parametrize("name", ["bitmask", "bitmask, thin", "bitmask, angles"])
def test_sectors_explain_the_contribution(name):
    method = METHODS[name]
    found = gtao.inspect_slices(FRAME, method, X, Y)
    assert any(s.wins for sl in found.slices for s in sl.samples)
    for sl in found.slices:
        n_V, n_T = sl.normal
        full = n_V + math.atan2(n_T, n_V) * n_T if method.weighting == "cosine" else 1.0
        assert len(sl.open_sectors) == method.n_sectors
        assert sl.contribution == pytest.approx(full * np.mean(sl.open_sectors), abs=1e-6)
        closed = sorted(k for s in sl.samples for k in s.closes)
        assert closed == [k for k, is_open in enumerate(sl.open_sectors) if not is_open]
        assert sl.horizons is None
        for s in sl.samples:
            assert s.wins == bool(s.closes)
            assert s.horizon is None


def test_bitmasks_of_layers_have_an_arc_for_each():
    z = np.array(FRAME.view_z)
    far = np.where(np.isfinite(z), z + 0.5, np.inf)
    front = np.stack([z, far])
    layers = gtao.DepthLayers(front=front, back=front + 0.2)
    g = FRAME.with_layers(layers)
    method = gtao.VisibilityBitmask(radius=1.5, n_slices=2, n_steps=6, thickness=gtao.MeasuredThickness())
    found = gtao.inspect_slices(g, method, X, Y)
    want = np.array(gtao.ambient_occlusion(g, method).visibility)[Y, X]
    assert found.visibility == pytest.approx(want, abs=1e-13)
    assert max(len(s.blocks) for sl in found.slices for s in sl.samples) == 2


def test_looking_leaves_gradients_alone():
    radius, threshold = dr.opaque(FRAME.types.Float, 1.5), dr.opaque(FRAME.types.Float, 0.1)
    dr.enable_grad(radius, threshold)
    found = gtao.inspect_slices(FRAME, replace(HORIZON, radius=radius), X, Y)
    assert found.visibility == pytest.approx(gtao.inspect_slices(FRAME, HORIZON, X, Y).visibility, abs=1e-13)
    gtao.filter_weights(FRAME, gtao.SpatialFilter(threshold=threshold), X, Y)
    assert dr.grad(radius)[0] == dr.grad(threshold)[0] == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((FRAME, gtao.HeightfieldHorizon(), X, Y), "gtao.VisibilityBitmask"),
        ((FRAME, gtao.Pipeline(), X, Y), "method must be one of"),
        ((FRAME.view_z, HORIZON, X, Y), "g must be"),
        ((FRAME, HORIZON, 24, Y), "x must be an integer from 0 to 23"),
        ((FRAME, HORIZON, X, -1), "y must be an integer"),
        ((FRAME, HORIZON, 1.5, Y), "x must be an integer"),
        ((FRAME, HORIZON, 2, 2), "shows the background"),
    ],
)
def test_refusals_of_slices(arguments, words):
    with pytest.raises(gtao.ConfigError) as caught:
        gtao.inspect_slices(*arguments)
    assert words in str(caught.value)
    with pytest.raises(gtao.ConfigError, match="frame_index"):
        gtao.inspect_slices(FRAME, HORIZON, X, Y, frame_index=-1)


FILTERS = {
    "edge-aware": gtao.EdgeAwareFilter(),
    "edge-aware, 3 passes": gtao.EdgeAwareFilter(passes=3, quantised_edges=False),
    "bilateral": gtao.SpatialFilter(),
    "planes": gtao.PlaneAwareFilter(),
    "planes, 4": gtao.PlaneAwareFilter(size=4, fit="constant"),
}


@pytest.mark.parametrize("spatial", FILTERS.values(), ids=FILTERS)
@pytest.mark.parametrize("frame_index", [0, 3])
def test_weights_are_what_the_filter_does(spatial, frame_index):
    image = np.random.default_rng(4).random(FRAME.shape)
    ao = gtao.AmbientOcclusion(visibility=FRAME.types.Tensor(image))
    want = np.array(gtao.denoise(ao, FRAME, spatial, frame_index=frame_index).visibility)
    # In the middle, beside the depth step, beside the background and in a corner.
    for x, y in ((6, 15), (12, 13), (9, 5), (23, 0)):
        found = gtao.filter_weights(FRAME, spatial, x, y, frame_index=frame_index)
        weights = np.array(found.weights)
        reach = len(weights) // 2
        assert weights.shape == (2 * reach + 1,) * 2
        assert weights.sum() == pytest.approx(1, abs=1e-13)
        value = sum(
            weights[dy + reach, dx + reach] * image[y + dy, x + dx]
            for dy in range(-reach, reach + 1)
            for dx in range(-reach, reach + 1)
            if 0 <= x + dx < 24 and 0 <= y + dy < 24
        )
        assert value == pytest.approx(want[y, x], abs=1e-13)
        assert (found.x, found.y, found.spatial, found.frame_index) == (x, y, spatial, frame_index)


def test_even_footprints_leave_a_row_and_a_column_out():
    flat = gtao.GBuffer(np.full((9, 9), 2.0), None, gtao.PerspectiveCamera(9, 9, 0.9))
    for spatial in (gtao.SpatialFilter(), gtao.PlaneAwareFilter(size=4, fit="constant")):
        even, odd = (np.array(gtao.filter_weights(flat, spatial, 4, 4, frame_index=k).weights) for k in (0, 1))
        assert even[1:, 1:] == pytest.approx(1 / 16, abs=1e-15)
        assert (even[0] == 0).all()
        assert (even[:, 0] == 0).all()
        assert np.array_equal(odd, even[::-1, ::-1])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((FRAME, HORIZON, X, Y), "gtao.EdgeAwareFilter"),
        ((FRAME.view_z, gtao.SpatialFilter(), X, Y), "g must be"),
        ((FRAME, gtao.SpatialFilter(), X, 24), "y must be an integer"),
        ((FRAME, gtao.SpatialFilter(), 2, 2), "shows the background"),
    ],
)
def test_refusals_of_weights(arguments, words):
    with pytest.raises(gtao.ConfigError) as caught:
        gtao.filter_weights(*arguments)
    assert words in str(caught.value)
