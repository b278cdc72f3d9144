"""Directions of the two ground truths of a depth buffer through the public door: what is asked for, types, edges."""

import drjit as dr
import numpy as np
import pytest
from analytic._frames import frame
from oracles import fields

import gtao

FIELD = fields.in_perspective(fields.waves(0.3, 5.0), size=24, slope=(0.3, -0.2))
KINDS = [gtao.HeightfieldRayMarch, gtao.HeightfieldHorizon]
RADIUS = 0.8
OPTIONS = ["bent_normal", "directional"]


def estimate(method, dtype=np.float32, field=FIELD):
    return gtao.ambient_occlusion(frame(field, dtype), method)


@pytest.mark.parametrize("kind", KINDS)
def test_results_are_what_was_asked_for(kind):
    for dtype in (np.float32, np.float64):
        ao = estimate(kind(radius=RADIUS, directional=True), dtype)
        for image, n in ((ao.mean_direction, 3), (ao.visibility_sh, 9), (ao.bent_normal, 3), (ao.normal_v, 3)):
            assert image.shape == (24, 24, n)
            assert image.numpy().dtype == dtype
        alone = estimate(kind(radius=RADIUS, bent_normal=True), dtype)
        assert alone.visibility_sh is None
        assert alone.mean_direction.numpy() == pytest.approx(ao.mean_direction.numpy(), abs=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_visibility_is_the_same_to_the_bit(kind):
    """Directions are counted beside it, of the same rays and nodes."""
    plain = estimate(kind(radius=RADIUS)).visibility.numpy()
    for option in OPTIONS:
        assert np.array_equal(estimate(kind(radius=RADIUS, **{option: True})).visibility.numpy(), plain)


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
@pytest.mark.parametrize("kind", KINDS)
def test_bands_0_and_1_are_visibility_and_mean_direction(kind, weighting):
    ao = estimate(kind(radius=RADIUS, directional=True, weighting=weighting), np.float64)
    sh, B = ao.visibility_sh.numpy(), ao.mean_direction.numpy()
    whole = np.pi if weighting == "cosine" else 2 * np.pi
    assert sh[..., 0] == pytest.approx(whole * np.sqrt(1 / (4 * np.pi)) * ao.visibility.numpy(), abs=1e-12)
    assert sh[..., 1:4] == pytest.approx(whole * np.sqrt(3 / (4 * np.pi)) * B[..., [1, 2, 0]], abs=1e-12)
    assert np.linalg.norm(ao.bent_normal.numpy(), axis=-1) == pytest.approx(np.ones((24, 24)), abs=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_the_background_has_no_directions(kind):
    view_z = FIELD.view_z.copy()
    view_z[:, 12:] = np.inf
    ao = estimate(kind(directional=True), field=fields.Field(view_z, FIELD.normal_v, FIELD.camera, orthographic=False))
    for image in (ao.mean_direction.numpy(), ao.visibility_sh.numpy()):
        assert (image[:, 12:] == 0).all()
        assert np.isfinite(image).all()
    assert (ao.bent_normal.numpy()[:, 12:] == [0, 0, 1]).all()


@pytest.mark.parametrize("kind", KINDS)
def test_where_nothing_is_visible_there_is_no_direction(kind):
    field = fields.Field(FIELD.view_z, -FIELD.normal_v, FIELD.camera, orthographic=False)
    ao = estimate(kind(radius=RADIUS, directional=True), field=field)
    closed = ao.visibility.numpy() == 0
    assert closed.mean() > 0.1
    assert (ao.mean_direction.numpy()[closed] == 0).all()
    assert (ao.visibility_sh.numpy()[closed] == 0).all()
    assert ao.bent_normal.numpy()[closed] == pytest.approx(-FIELD.normal_v[closed], abs=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_single_precision_sums_as_double_does(kind):
    """Both see the same random numbers; a direction that grazes may go either way."""
    single, double = (estimate(kind(radius=RADIUS, directional=True), t).visibility_sh.numpy() for t in "fd")
    assert np.mean(np.abs(single - double) > 1e-5) < 0.01


@pytest.mark.parametrize("kind", KINDS)
def test_all_results_come_from_one_march(kind):
    ao = estimate(kind(directional=True))
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        _ = [image.numpy() for image in (ao.visibility, ao.mean_direction, ao.visibility_sh)]
        operations = [k["operation_count"] for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]
    # Channels are brought together, and that is all: marches have thousands of operations.
    assert max(operations, default=0) < 200


def test_sampled_rays_have_directions_too():
    counts = {"radius": RADIUS, "n_directions": 16, "rays_per_direction": 8, "directional": True}
    exact, sampled = (
        estimate(gtao.HeightfieldRayMarch(n_steps=n, **counts)).visibility_sh.numpy() for n in (None, 256)
    )
    assert np.abs(exact - sampled).mean() < 4e-3


@pytest.mark.parametrize("option", OPTIONS)
@pytest.mark.parametrize("kind", KINDS)
def test_options_are_flags(kind, option):
    for value in (1, "average_horizon", None):
        with pytest.raises(gtao.ConfigError, match=option):
            kind(**{option: value})
    method = kind(**{option: True})
    assert gtao.method_from_dict(method.to_dict()) == method
