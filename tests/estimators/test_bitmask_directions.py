"""Directions of the visibility bitmask: against open arcs found point by point, against GTAO's, and what they are."""

import dataclasses
import math

import numpy as np
import pytest
from analytic._frames import frame, holed, pixels
from estimators._bitmask import FIELDS, ROUNDING, THICKNESSES, along_eye_rays
from oracles import bitmask_oracle, fields, harmonics

import drjit as dr  # isort: skip

import gtao

MARCH = {"radius": 0.6, "n_slices": 3, "n_steps": 7}
THIN = gtao.ConstantThickness(thickness=0.15)
WEIGHTINGS = ["cosine", "uniform"]


def estimate(field, dtype=np.float64, frame_index=0, **options):
    """An estimate with all directions; options of the bitmask."""
    method = gtao.VisibilityBitmask(**({"directional": True} | MARCH | options))
    return gtao.ambient_occlusion(frame(field, dtype), method, frame_index=frame_index)


def numbers(ao):
    """Mean direction and harmonics side by side, (H, W, 12)."""
    return np.concatenate([ao.mean_direction.numpy(), ao.visibility_sh.numpy()], axis=-1).astype(np.float64)


def expected(field, where, weighting="cosine", **options):
    """The same of some pixels, (K, 12)."""
    found = [bitmask_oracle.open_directions(field, *at, weighting=weighting, **(MARCH | options)) for at in where]
    first, second = np.array([o.first for o in found]), np.array([o.second for o in found])
    return np.concatenate([first, harmonics.of_moments(first, second, weighting)], axis=-1)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize("thickness", THICKNESSES)
@pytest.mark.parametrize("name", FIELDS)
def test_against_open_arcs_found_point_by_point(name, thickness, weighting):
    field = holed(FIELDS[name]())
    model, length = THICKNESSES[thickness]
    where = pixels(field, 6)
    got = numbers(estimate(field, thickness=model, weighting=weighting, noise="none", sector_rounding="nearest"))
    want = expected(field, where, weighting, bodies=along_eye_rays(field, length), rounding="nearest")
    assert got[where[:, 0], where[:, 1]] == pytest.approx(want, abs=ROUNDING)
    assert np.ptp(want, axis=0).min() > 0.01


@pytest.mark.parametrize(
    ("options", "oracle"),
    [
        ({"sector_rounding": "outward"}, {"rounding": "outward"}),
        ({"linked": True, "sector_rounding": "nearest"}, {"rounding": "nearest", "linked": True}),
        ({"n_sectors": 7, "sector_rounding": "nearest"}, {"rounding": "nearest", "n_sectors": 7}),
        ({"n_sectors": 96, "sector_rounding": "nearest"}, {"rounding": "nearest", "n_sectors": 96}),
        ({"falloff": gtao.NoCut(), "sector_rounding": "nearest"}, {"rounding": "nearest", "cut": "none"}),
    ],
    ids=["outward", "linked", "7 sectors", "96 sectors", "no cut"],
)
def test_options_of_the_sectors(options, oracle):
    field = FIELDS["stretched, off-centre"]()
    where = pixels(field, 4)
    got = numbers(estimate(field, thickness=THIN, noise="none", **options))
    want = expected(field, where, bodies=along_eye_rays(field, THICKNESSES["constant"][1]), **oracle)
    assert got[where[:, 0], where[:, 1]] == pytest.approx(want, abs=ROUNDING)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_the_mean_over_jitters_is_that_of_the_arcs(weighting):
    """But for what rounding the ends costs: a chord of the moments over a sector of a 16th in place of them.

    Mean directions change by 1.3 per unit of the share at most and harmonics by five times that; near the zenith and
    the tangent plane they bend like y^(3/2), whose chord is off by 0.15 of the 64th, and by 0.002 in sectors' mean.
    """
    field = FIELDS["from above"]()
    where, n_frames = pixels(field, 10), 80
    options = {"weighting": weighting, "thickness": THIN, "n_sectors": 16}
    frames = np.array(
        [numbers(estimate(field, noise="none", frame_index=i, **options))[tuple(where.T)] for i in range(n_frames)]
    )
    bodies = along_eye_rays(field, THICKNESSES["constant"][1])
    want = expected(field, where, weighting, bodies=bodies)
    spread = frames.std(axis=0, ddof=1) / np.sqrt(n_frames)
    assert spread.max() > 1e-3
    unit = np.repeat([1.0, math.pi if weighting == "cosine" else 2 * math.pi], [3, 9])
    assert (np.abs(frames.mean(axis=0) - want) < 4.5 * spread + 0.002 * unit).all()
    outward = numbers(estimate(field, noise="none", sector_rounding="outward", **options))[tuple(where.T)]
    assert (np.abs(outward - want) > 0.01 * unit).any(axis=0).sum() > 6


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_solid_sectors_converge_to_gtao(weighting):
    """Errors fall like those of the visibility, as 1/n; see the test of the latter."""
    field, m = FIELDS["from above"](), 8
    options = {"radius": math.inf, "n_slices": m, "n_steps": 12, "weighting": weighting, "directional": True}
    want = numbers(gtao.ambient_occlusion(frame(field), gtao.GTAO(**options)))
    counts = np.array([8, 16, 32, 64, 128])
    errors = np.array([numbers(estimate(field, np.float32, n_sectors=int(n), **options)) - want for n in counts])
    rms = np.sqrt(np.mean(np.sum(errors[..., :3] ** 2, axis=-1), axis=(1, 2)))
    # The ends on both sides move by one jitter, so that the share knows their difference only, and directions both.
    predicted = 1 / (np.sqrt(6 * m) * counts)
    assert np.all((predicted < rms) & (rms < np.sqrt(2) * predicted))
    for error in (rms, np.sqrt(np.mean(errors[..., 3:] ** 2, axis=(1, 2, 3)))):
        # Arcs that are narrower than a sector have errors that fall more slowly, until they are wider.
        assert np.polyfit(np.log(counts), np.log(error), 1)[0] == pytest.approx(-1, abs=0.07)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_solid_arcs_are_those_of_rays_through_the_height_field(weighting):
    """Many slices, steps and sectors; 512 rays leave noise of 0.003 in a component of the mean, steps as much again.

    Harmonics of the mean are π or 2π times that, times 1.1 at most.
    """
    field = FIELDS["from above"]()
    options = {"radius": 0.6, "weighting": weighting, "fetch": "linear", "directional": True}
    fine = numbers(estimate(field, np.float32, n_slices=24, n_steps=32, n_sectors=128, **options))
    rays = gtao.HeightfieldRayMarch(n_directions=32, rays_per_direction=16, **options)
    want = numbers(gtao.ambient_occlusion(frame(field), rays))
    length, unit = (2 / 3, math.pi) if weighting == "cosine" else (1 / 2, 2 * math.pi)
    inner = np.s_[4:-4, 4:-4]
    error, scale = (fine - want)[inner], np.repeat([1.0, 1.1 * unit], [3, 9])
    assert (np.sqrt(np.mean(error**2, axis=(0, 1))) < 0.006 * scale).all()
    assert (np.abs(error.mean(axis=(0, 1))) < 0.0015 * scale).all()
    occluded = (want[..., :3] - length * field.normal_v)[inner]
    assert np.sqrt(np.mean(occluded**2)) > 0.08


@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_open_plane_is_that_of_gtao(weighting, dtype):
    """No sector is closed, whatever the jitter: the hemisphere of the slices, ⅔ N or ½ N in the mean."""
    field = fields.tilted_plane(0.7, 1.0, (0.5, -0.3))
    options = {"radius": math.inf, "n_slices": 16, "n_steps": 6, "fetch": "linear", "weighting": weighting}
    got = estimate(field, dtype, thickness=gtao.ConstantThickness(thickness=0.05), **options)
    want = gtao.ambient_occlusion(frame(field, dtype), gtao.GTAO(directional=True, **options))
    assert numbers(got) == pytest.approx(numbers(want), abs=1e-9 if dtype == np.float64 else 1e-4)
    length = 2 / 3 if weighting == "cosine" else 1 / 2
    # Sixteen slices of a surface tilted by 40° from the image's axis.
    assert got.mean_direction.numpy() == pytest.approx(length * field.normal_v, abs=2e-3)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"weighting": "uniform", "sector_rounding": "outward"},
        {"thickness": gtao.ContinuityThickness(continuing=0.6, isolated=0.24, gap=0.15), "n_sectors": 64},
        {"thickness": gtao.LinearThickness(slope=0.04), "linked": True, "sector_rounding": "nearest", "n_sectors": 9},
    ],
    ids=["jittered", "outward", "continuity", "linked"],
)
def test_visibility_is_the_same_bit_for_bit(options, dtype):
    field = holed(FIELDS["stretched, off-centre"]())
    asked = [{"directional": False}, {"directional": False, "bent_normal": True}, {}]
    plain, bent, all_ = (estimate(field, dtype, **options, **a) for a in asked)
    assert plain.mean_direction is plain.visibility_sh is plain.bent_normal is None
    assert bent.visibility_sh is None
    for other in (bent, all_):
        assert np.array_equal(other.visibility, plain.visibility)
    # Nine sums per slice are one kernel, three another: what they share is rounded alike but for its last digit.
    assert all_.mean_direction.numpy() == pytest.approx(bent.mean_direction.numpy(), abs=1e-6)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_bands_zero_and_one_are_visibility_and_mean_direction(weighting):
    ao, unit = estimate(FIELDS["from above"](), weighting=weighting), math.pi * (2 if weighting == "uniform" else 1)
    B, sh = ao.mean_direction.numpy(), ao.visibility_sh.numpy()
    assert sh[..., 0] == pytest.approx(unit / math.sqrt(4 * math.pi) * ao.visibility.numpy(), abs=1e-12)
    assert sh[..., 1:4] == pytest.approx(math.sqrt(3 / (4 * math.pi)) * unit * B[..., [1, 2, 0]], abs=1e-12)
    # No density over unit vectors has a longer mean than it has mass.
    assert (np.linalg.norm(B, axis=-1) <= ao.visibility.numpy() + 1e-12).all()


def test_solid_angle_and_cosine_agree():
    """2 ⟨N, ½π⁻¹ ∫ V ω⟩ is the cosine-weighted visibility: with 128 sectors of each, within what these leave."""
    field = FIELDS["from above"]()
    common = {"thickness": THIN, "n_sectors": 128, "n_slices": 8}
    uniform, cosine = (estimate(field, weighting=w, **common) for w in ("uniform", "cosine"))
    along = 2 * np.sum(uniform.mean_direction.numpy() * field.normal_v, axis=-1)
    error = along - cosine.visibility.numpy()
    # Both have ends of their own that jitter by 0.4 of a sector: some of them in each of eight slices.
    assert np.sqrt(np.mean(error**2)) < 2 * np.sqrt(4) * 0.4 / 128 / np.sqrt(8)
    assert abs(error.mean()) < 3e-4
    assert (1 - cosine.visibility.numpy()).mean() > 0.05


def test_power_floor_and_ceiling_leave_directions_alone():
    field = FIELDS["from above"]()
    plain, shaped = estimate(field), estimate(field, power=2.0, floor=0.3, ceiling=1.0)
    assert np.abs(shaped.visibility.numpy() - plain.visibility.numpy()).max() > 0.05
    assert np.array_equal(numbers(shaped), numbers(plain))
    assert np.array_equal(shaped.unshaped, plain.visibility)


def test_background_and_bands_of_rows():
    field = holed(FIELDS["from above"]())
    g, method = frame(field, np.float64), gtao.VisibilityBitmask(directional=True, thickness=THIN, **MARCH)
    whole, parts = gtao.ambient_occlusion(g, method), gtao.ambient_occlusion(g, method, max_pixels=100)
    assert np.array_equal(numbers(whole), numbers(parts))
    background = ~np.isfinite(field.view_z)
    assert background.any()
    assert (numbers(whole)[background] == 0).all()
    assert np.isfinite(numbers(whole)).all()


def test_single_precision_agrees_with_double():
    field = FIELDS["stretched, off-centre"]()
    double, single = (numbers(estimate(field, dtype, thickness=THIN)) for dtype in (np.float64, np.float32))
    # An end of an arc may be rounded to another sector: the median says what single precision costs otherwise.
    assert np.median(np.abs(double - single)) < 1e-6
    assert np.abs(double - single).mean() < 1e-3


def test_one_kernel_with_everything():
    g = frame(FIELDS["from above"](), np.float32)
    method = gtao.VisibilityBitmask(directional=True, thickness=THIN, n_sectors=64, **MARCH)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        ao = gtao.ambient_occlusion(g, method)
        dr.eval(ao.visibility, ao.planes("visibility_sh").arrays)
        assert len([k for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]) == 1


def test_the_recommended_pipeline_gives_directions():
    field = holed(FIELDS["from above"]())
    g = frame(field, np.float32)
    plain, bent, all_ = (
        gtao.Pipeline.recommended(0.6, **asked) for asked in ({}, {"bent_normal": True}, {"directional": True})
    )
    assert bent == dataclasses.replace(plain, occlusion=dataclasses.replace(plain.occlusion, bent_normal=True))
    assert gtao.method_from_dict(all_.to_dict()) == all_
    ao, with_bent, with_all = (pipeline.step(g) for pipeline in (plain, bent, all_))
    assert ao.bent_normal is None
    assert np.array_equal(with_bent.visibility, ao.visibility)
    assert np.linalg.norm(with_bent.bent_normal.numpy(), axis=-1) == pytest.approx(1, abs=1e-6)
    raw, surface = gtao.ambient_occlusion(g, all_.occlusion), np.array(g.mask)
    assert np.array(with_all.visibility_sh)[surface].std() < np.array(raw.visibility_sh)[surface].std()
    light = np.zeros(9, np.float32)
    light[0] = math.sqrt(4 * math.pi)
    # Light of radiance 1 from everywhere: π times the visibility before the clamp.
    unclamped = dataclasses.replace(all_, clamp=False).step(g)
    got = gtao.irradiance(light, g, unclamped).numpy()[surface]
    assert got == pytest.approx(math.pi * unclamped.visibility.numpy()[surface], abs=1e-5)


@pytest.mark.parametrize("name", ["bent_normal", "directional"])
def test_refusals(name):
    for options, words in (
        ({name: 1}, f"{name} must be True or False"),
        ({name: True, "weighting": "angle"}, f"{name} is an integral over solid angle"),
        ({name: True, "zenith": "optical_axis", "falloff": gtao.NoCut()}, f"{name} needs slices about the view vector"),
    ):
        with pytest.raises(gtao.ConfigError, match=words):
            gtao.VisibilityBitmask(**options)
    z = gtao.backend.types_of(gtao.backend.default_float()).Tensor(FIELDS["from above"]().view_z.astype(np.float32))
    dr.enable_grad(z)
    g = gtao.GBuffer(z, None, frame(FIELDS["from above"]()).camera)
    with pytest.raises(gtao.ConfigError, match="no gradient"):
        gtao.ambient_occlusion(g, gtao.VisibilityBitmask(**{name: True}))
