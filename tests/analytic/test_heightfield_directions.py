"""Open directions of the two ground truths of a depth buffer: an independent marcher, closed forms, and each other."""

import numpy as np
import pytest
from analytic import _tables
from analytic._frames import frame
from oracles import closed_forms, fields, harmonics, heightfield, slice_oracle

import gtao

MARCH = {"n_directions": 24, "rays_per_direction": 16}
HORIZON = {"n_slices": 48, "n_nodes": 128}
WEIGHTINGS = ["cosine", "uniform"]

#: What pieces of surface between two looks and directions between two nodes cost the dense slices in the mean, as for
#: their visibility: a harmonic is a visibility times π, or 2π, and a factor of 1.1 at most.
DISCRETISATION = {"cosine": 2e-4 * np.pi, "uniform": 2e-4 * 2 * np.pi}


def run(g, kind, **options):
    """Mean directions and harmonics side by side, (H, W, 12)."""
    g = frame(g) if isinstance(g, fields.Field) else g
    defaults = MARCH if kind is gtao.HeightfieldRayMarch else HORIZON
    ao = gtao.ambient_occlusion(g, kind(directional=True, **(defaults | options)))
    return np.concatenate([ao.mean_direction.numpy(), ao.visibility_sh.numpy()], axis=-1).astype(np.float64)


def march(g, **options):
    return run(g, gtao.HeightfieldRayMarch, **options)


def horizon(g, **options):
    return run(g, gtao.HeightfieldHorizon, **options)


def twice(method, g, **options):
    """The first of two runs, and the variance of a run: over the pixels' mean for each of the 12 numbers."""
    a, b = (method(g, seed=s, **options) for s in (0, 1))
    return a, (a - b) ** 2 / 2


def in_the_open(normals, weighting):
    first, second = closed_forms.cone(normals, 0.0, weighting)
    return np.concatenate([first, harmonics.of_moments(first, second, weighting)], axis=-1)


def excess(error, noise):
    """How many of its own standard errors the mean square lies above the noise."""
    squares = error**2
    return (squares.mean(axis=0) - noise) / (squares.std(axis=0, ddof=1) / np.sqrt(len(squares)))


@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize(("radius", "fetch"), [(np.inf, "linear"), (0.5, "linear"), (0.15, "linear"), (0.5, "nearest")])
@pytest.mark.parametrize("name", _tables.MARCHED)
def test_both_agree_with_the_oracle(name, radius, fetch, weighting):
    """All 12 numbers in the mean within 4.5 standard errors, and no more spread than the noise of both explains."""
    field = _tables.MARCHED[name]()
    pixels = np.random.default_rng(5).integers(0, field.view_z.shape[0], (200, 2))
    options = {"radius": radius, "weighting": weighting}
    truth = heightfield.directional(field, pixels, n_rays=1024, surface=fetch, seed=6, **options)
    row, column = pixels.T
    want = np.concatenate([truth.mean, truth.harmonics], axis=-1)
    own = np.concatenate([truth.mean_error, truth.harmonics_error], axis=-1)
    assert np.abs(want - in_the_open(field.normal_v[row, column], weighting)).mean() > 1e-3
    for method, slack in ((march, 0.0), (horizon, DISCRETISATION[weighting])):
        got, variance = twice(method, field, fetch=fetch, **options)
        noise = np.mean(own**2, axis=0) + variance[row, column].mean(axis=0)
        error = got[row, column] - want
        assert (np.abs(error.mean(axis=0)) < 4.5 * np.sqrt(noise / 200) + slack).all()
        assert (excess(error, noise + slack**2) < 5).all()


@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize("tilt", _tables.TILTS)
def test_an_open_plane_has_its_own_normal(tilt, weighting):
    """B = 2/3 N (1/2 N without the cosine), and harmonics of the hemisphere about N: the ray march has them exactly
    where no ray is blocked by what depth is rounded to, whatever the rays. Slices and nodes leave the rectangle rule's
    error: of second order, but of first where the weight does not end at 0."""
    for field in _tables.open_planes(tilt):
        want = in_the_open(field.normal_v, weighting)
        got = march(field, weighting=weighting, n_directions=4, rays_per_direction=2)
        # Of eight rays one makes an eighth of Y_00, and single precision nothing like it.
        clear = got[..., 3] > (1 - 1e-3) * want[..., 3]
        assert clear.mean() > 0.99
        # Single precision, times 2π.
        assert np.abs(got - want)[clear].max() < 5e-6
        dense = np.abs(horizon(field, weighting=weighting) - want)
        assert dense.max() < (2e-3 if weighting == "cosine" else 1e-2)
        assert dense.mean() < (5e-5 if weighting == "cosine" else 1e-3)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_a_trench_has_its_closed_form(weighting):
    """Walls on texel borders, known exactly to the nearest fetch; what is beyond their ends, half of 240 pixels of 0.1
    away, counts no more than its weight times the largest value of a harmonic."""
    field = fields.walls(0.5, 1.0, 1.0, 1.5, n_px=30, pixel=0.1, length_px=240)
    x = field.plane_coordinates()[0][0]
    floor = (x > -0.5) & (x < 1.0)
    left, right = x[floor] + 0.5, 1.0 - x[floor]
    first, second = closed_forms.profile_directions(-np.arctan2(left, 1.0), np.arctan2(right, 1.5), 0 * left, weighting)
    want = np.concatenate([first, harmonics.of_moments(first, second, weighting)], axis=-1)
    rows, half_length = slice(110, 130), 11
    if weighting == "cosine":
        ends = (left + 1.5**2 * right) / (3 * np.pi * half_length**3) * np.pi * 1.1
    else:
        ends = (left + 1.5 * right) / (2 * np.pi * half_length**2) * 2 * np.pi * 1.1
    for method in (march, horizon):
        error = method(field, fetch="nearest", weighting=weighting)[rows, floor] - want
        spread = error.std(axis=0, ddof=1) / np.sqrt(20)
        # Among 15 columns of 12 numbers the rows' own estimate of their spread is small by chance somewhere.
        spread = np.sqrt((spread**2 + np.mean(spread**2, axis=0)) / 2)
        assert (np.abs(error.mean(axis=0)) < 5 * spread + ends[:, None] + DISCRETISATION[weighting]).all()


@pytest.mark.parametrize("side", [-1, 1])
def test_a_groove_has_its_closed_form(side):
    """Tilted normals. The linear fetch blurs the rim over a pixel of 1/12, at distances of half a unit and more."""
    n_px = 24
    field = fields.groove(0.8, 1.2, n_px=n_px, pixel=2 / n_px, length_px=6 * n_px)
    x = field.plane_coordinates()[0][0]
    wall = (side * x > 0.1) & (side * x < 0.7)
    slope, at = np.arctan2(1.2, 0.8), np.abs(x[wall])
    rim = np.arctan2(0.8 + at, 1.2 * (1 - at / 0.8))
    # The wall on the right leans to the left, where it sees the far rim.
    arc = (-rim, 0 * at + np.pi) if side > 0 else (0 * at - np.pi, rim)
    first, second = closed_forms.profile_directions(*arc, 0 * at - side * slope)
    want = np.concatenate([first, harmonics.of_moments(first, second)], axis=-1)
    assert np.abs(want[:, 0] - in_the_open(field.normal_v[0, wall], "cosine")[:, 0]).min() > 0.02
    for method in (march, horizon):
        error = (method(field)[3 * n_px - 4 : 3 * n_px + 4, wall] - want).mean(axis=(0, 1))
        assert np.abs(error).max() < 5e-3


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_the_centre_of_a_pit_is_a_cone(weighting):
    """A disc of texels: a cone between those of the discs half a texel's diagonal smaller and larger."""
    radius, depth, n_px = 1.0, 2.0, 61
    field = fields.pit(radius, depth, n_px=n_px, pixel=3.0 / n_px)
    low, high = (
        in_a_cone(np.cos(np.arctan2(radius + side * 1.5 / n_px * np.sqrt(2), depth)), weighting) for side in (-1, 1)
    )
    centre = n_px // 2
    for got in (
        march(field, fetch="nearest", weighting=weighting, n_directions=64, rays_per_direction=32)[centre, centre],
        horizon(field, fetch="nearest", weighting=weighting, n_slices=128, n_nodes=256)[centre, centre],
    ):
        # 2048 rays: standard errors of 0.001 and, times π or 2π, of 0.004 at most.
        noise = np.repeat([0.004, 0.016], [3, 9])
        assert (got > np.minimum(low, high) - noise).all()
        assert (got < np.maximum(low, high) + noise).all()


def in_a_cone(cosine, weighting):
    first, second = closed_forms.cone([0, 0, 1], cosine, weighting)
    return np.concatenate([first, harmonics.of_moments(first, second, weighting)])


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_few_rays_are_right_in_the_mean(weighting):
    """Two rays, or twelve, in strata as wide as the hemisphere: what is subtracted is 0 in the mean, not before."""
    field = _tables.MARCHED["steep groove from above"]()
    pixels = np.s_[10:30]
    want = np.mean([horizon(field, weighting=weighting, seed=s)[pixels] for s in range(2)], axis=0)
    for n_directions, rays_per_direction in ((2, 1), (4, 3)):
        counts = {"n_directions": n_directions, "rays_per_direction": rays_per_direction}
        runs = np.array([march(field, weighting=weighting, seed=s, **counts)[pixels] for s in range(24)])
        error = (runs - want).mean(axis=(1, 2))
        spread = error.std(axis=0, ddof=1) / np.sqrt(24)
        assert (spread < 0.02).all()
        assert (np.abs(error.mean(axis=0)) < 5 * spread + DISCRETISATION[weighting]).all()


def test_noise_is_where_an_edge_of_the_visible_set_is():
    """Sixteen times the rays leave fewer strata that are cut: the variance falls faster than the number of rays."""
    field = _tables.MARCHED["waves from above"]()
    few, many = (twice(march, field, n_directions=n, rays_per_direction=n)[1].mean() for n in (8, 32))
    assert many < few / 32


def broken_field():
    """Broken surfaces, holes and shading normals that face away."""
    field = fields.in_perspective(fields.waves(0.3, 5.0), size=40, slope=(0.5, 0.2))
    view_z = field.view_z.copy()
    view_z[10:22, 8:20] *= 0.6
    view_z[25:, 28:] = np.inf
    normal = slice_oracle.unit(field.normal_v + 0.6 * np.random.default_rng(1).normal(size=field.normal_v.shape))
    assert np.mean(np.sum(normal * field.view_dirs(), axis=-1) < 0) > 0.02
    return fields.Field(view_z, normal, field.camera, orthographic=False)


@pytest.mark.parametrize("radius", [np.inf, 0.7], ids=["unlimited", "radius"])
@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_both_agree_on_silhouettes_and_background(weighting, radius):
    """No oracle, but two computations: in the mean of the frame, and in spread."""
    field = broken_field()
    mask = np.isfinite(field.view_z)
    options = {"radius": radius, "weighting": weighting}
    (b, of_b), (c, of_c) = (twice(method, field, **options) for method in (march, horizon))
    assert (b[~mask] == 0).all()
    assert (c[~mask] == 0).all()
    noise = (of_b + of_c)[mask].mean(axis=0)
    error = (b - c)[mask]
    assert (np.abs(error.mean(axis=0)) < 4.5 * np.sqrt(noise / mask.sum()) + DISCRETISATION[weighting]).all()
    assert (excess(error, noise) < 5).all()
    assert (excess(error, noise) > -5).all()
