"""Slice frames: tangents, screen directions, the azimuth measure and the extent of the search."""

import numpy as np
import pytest
from oracles import golden, slice_oracle

import drjit as dr  # isort: skip

from gtao.kernels import arcs, slices

CASES = golden.cases("A.perspective")


def scalars(precision, vector):
    return tuple(precision.Float(float(v)) for v in vector)


def view_frame(precision, V, N=(0.0, 0.0, 1.0)):
    return slices.SliceFrame.at(scalars(precision, V), scalars(precision, N))


def screen_frame(precision, V, N=(0.0, 0.0, 1.0)):
    N = np.asarray(N, dtype=float)
    return slices.ScreenFrame.at(scalars(precision, V), scalars(precision, N), precision.Float(float(N @ V)))


def numbers(arrays):
    return np.stack([np.array(a, dtype=np.float64) for a in arrays], axis=-1)


@pytest.mark.parametrize(("inputs", "outputs"), CASES)
def test_tangent_and_screen_direction_golden(precision, inputs, outputs):
    phi = inputs["phi"]
    c, s = precision.Float(np.cos(phi)), precision.Float(np.sin(phi))
    frame = view_frame(precision, outputs["V"])
    assert numbers(frame.tangent(c, s))[0] == pytest.approx(outputs["T"], abs=precision.tolerance)
    _, ux, uy = frame.normal_and_direction(c, s)
    direction = slice_oracle.unit(numbers((ux, uy))[0])
    assert direction == pytest.approx(outputs["screen_dir"], abs=precision.tolerance)


@pytest.mark.parametrize(("inputs", "outputs"), CASES)
def test_published_tangent_golden(precision, inputs, outputs):
    phi = inputs["image_phi"]
    c, s = precision.Float(np.cos(phi)), precision.Float(np.sin(phi))
    got = numbers(screen_frame(precision, outputs["V"]).tangent(c, s))[0]
    assert got == pytest.approx(outputs["T_of_image_dir"], abs=precision.tolerance)
    jacobian = screen_frame(precision, outputs["V"]).jacobian(c, s)
    assert jacobian[0] == pytest.approx(outputs["jacobian"], abs=precision.tolerance)


def random_frames(n=40, seed=3):
    """Points in a field of view of 130 degrees, normals that face them, azimuths."""
    rng = np.random.default_rng(seed)
    for _ in range(n):
        P = np.array([*rng.uniform(-1.5, 1.5, 2), -1.0]) * rng.uniform(0.5, 20)
        V = slice_oracle.unit(-P)
        N = slice_oracle.unit(V + 0.9 * slice_oracle.unit(rng.normal(size=3)))
        yield P, V, N, rng.uniform(0, 2 * np.pi)


def test_tangent_against_rotation_and_projection(precision):
    """T is the rotated azimuth vector; marching along the direction stays in the plane of V and T."""
    for P, V, N, phi in random_frames():
        c, s = precision.Float(np.cos(phi)), precision.Float(np.sin(phi))
        frame = view_frame(precision, V, N)
        T = slice_oracle.tangent(V, phi)
        assert numbers(frame.tangent(c, s))[0] == pytest.approx(T, abs=precision.tolerance)
        nT, ux, uy = frame.normal_and_direction(c, s)
        assert nT[0] == pytest.approx(T @ N, abs=precision.tolerance)
        # The central difference behind the oracle's direction has an error of 1e-9.
        want = slice_oracle.screen_direction(P, T)
        got = slice_oracle.unit(numbers((ux, uy))[0])
        assert got == pytest.approx(want, abs=max(precision.tolerance, 1e-8))


def test_length_of_the_marching_direction(precision):
    """A step τ along the direction turns about the eye by arctan(τ V_z / (1 - τ d)), d = -T_z, toward T."""
    for P, V, _, phi in random_frames():
        c, s = precision.Float(np.cos(phi)), precision.Float(np.sin(phi))
        _, ux, uy = view_frame(precision, V).normal_and_direction(c, s)
        T, tau = slice_oracle.tangent(V, phi), 0.1
        x, y = slice_oracle.project(P) + tau * numbers((ux, uy))[0]
        ray = slice_oracle.unit([x, y, -1.0])
        angle = np.arctan2(ray @ T, -ray @ V)
        want = np.arctan2(tau * V[2], 1 + tau * T[2])
        assert angle == pytest.approx(want, abs=precision.tolerance)


def test_published_frame_is_orthonormal_and_in_the_screen_plane(precision):
    for P, V, N, phi in random_frames():
        c, s = precision.Float(np.cos(phi)), precision.Float(np.sin(phi))
        frame = screen_frame(precision, V, N)
        T = numbers(frame.tangent(c, s))[0]
        products = [T @ T, T @ V]
        assert products == pytest.approx([1.0, 0.0], abs=precision.tolerance)
        nT, ux, uy = frame.normal_and_direction(c, s)
        assert nT[0] == pytest.approx(T @ N, abs=precision.tolerance)
        assert (ux[0], uy[0]) == pytest.approx((np.cos(phi), np.sin(phi)), abs=precision.tolerance)
        want = slice_oracle.screen_direction(P, T)
        assert (np.cos(phi), np.sin(phi)) == pytest.approx(want, abs=max(precision.tolerance, 1e-8))


def mean_of_open_slices(precision, frame, V, N, n=1 << 16, weighted=False):
    """Mean of n open slices. A normal that faces away puts kinks in azimuth: error O(n^-2), hence the many slices."""
    phi = np.pi * (np.arange(n) + 0.5) / n
    c, s = precision.lanes(np.cos(phi)), precision.lanes(np.sin(phi))
    nT, _, _ = frame.normal_and_direction(c, s)
    value = arcs.full_slice(precision.Float(float(N @ V)), nT)
    return np.array(value * frame.jacobian(c, s) if weighted else value, dtype=np.float64).mean()


def test_jacobian_is_the_change_of_azimuth(precision):
    """Between two image directions close together, the angle between their tangents over that between themselves."""
    step = 1e-3
    for _, V, _, phi in random_frames():
        frame = screen_frame(precision, V)
        jacobian = frame.jacobian(precision.Float(np.cos(phi)), precision.Float(np.sin(phi)))
        before, after = (
            slice_oracle.unit(
                [c - (c * V[0] + s * V[1]) * V[0], s - (c * V[0] + s * V[1]) * V[1], -(c * V[0] + s * V[1]) * V[2]]
            )
            for c, s in ((np.cos(a), np.sin(a)) for a in (phi - step / 2, phi + step / 2))
        )
        angle = np.arctan2(np.dot(np.cross(before, after), V), np.dot(before, after))
        # The central difference errs by step²/24 times a second derivative, which is below 100 in this field of view.
        assert jacobian[0] == pytest.approx(angle / step, abs=precision.tolerance + 100 * step**2 / 24)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.naive_bias"))
def test_bias_of_the_published_measure_golden(precision, inputs, outputs):
    """Image-uniform slices miss an open point's visibility by a known amount, slices about V do not."""
    N, V = slice_oracle.unit(inputs["N"]), -slice_oracle.unit(inputs["P"])
    published = mean_of_open_slices(precision, screen_frame(precision, V, N), V, N)
    assert published == pytest.approx(outputs["naive"], abs=precision.tolerance)
    exact = mean_of_open_slices(precision, view_frame(precision, V, N), V, N)
    assert exact == pytest.approx(outputs["jacobian_weighted"], abs=precision.tolerance)
    weighted = mean_of_open_slices(precision, screen_frame(precision, V, N), V, N, weighted=True)
    assert weighted == pytest.approx(outputs["jacobian_weighted"], abs=precision.tolerance)


def test_extents_are_the_silhouette_of_the_sphere(precision):
    """In the slice plane the eye sees the sphere about P between the tangent lines at ± arcsin(r/|P|)."""
    for P, V, _, phi in random_frames():
        frame = view_frame(precision, V)
        c, s = precision.Float(np.cos(phi)), precision.Float(np.sin(phi))
        T, half = slice_oracle.tangent(V, phi), np.arcsin(0.2)
        extents = frame.extents(precision.Float(np.tan(half)), c, s)
        direction = numbers(frame.normal_and_direction(c, s)[1:])[0]
        for side, extent in zip((-1.0, 1.0), extents, strict=True):
            edge = np.cos(half) * -V + side * np.sin(half) * T
            want = side * np.dot(slice_oracle.project(edge) - slice_oracle.project(P), direction)
            got = extent[0] * np.dot(direction, direction)
            assert got == pytest.approx(want, rel=10 * precision.tolerance)


def test_extents_beyond_the_image_plane_are_infinite(precision):
    """A sphere that reaches behind the eye plane has no end in the image on that side."""
    V = slice_oracle.unit([1.0, 0.0, 0.5])
    frame = view_frame(precision, V)
    behind = frame.extents(precision.Float(2.0), precision.Float(1.0), precision.Float(0.0))
    assert dr.isinf(behind[0])[0] != dr.isinf(behind[1])[0]


def test_clamped_arc_golden(precision):
    cases = golden.cases("A.slice")
    nV, nT, h0, h1 = (precision.lanes([i[k] for i, _ in cases]) for k in ("nV", "nT", "h0", "h1"))
    h0, h1 = slices.clamped_arc(nV, nT, h0, h1)
    assert np.array(h0) == pytest.approx([o["h0"] for _, o in cases], abs=precision.tolerance)
    assert np.array(h1) == pytest.approx([o["h1"] for _, o in cases], abs=precision.tolerance)


def test_an_arc_behind_the_tangent_plane_is_empty(precision):
    """A normal that faces away, with all directions open on the wrong side only."""
    nV, nT = precision.Float(-0.6), precision.Float(0.8)
    h0, h1 = slices.clamped_arc(nV, nT, precision.Float(-1.0), precision.Float(0.1))
    assert h0[0] == h1[0]


def rotation(precision, f, t):
    rows = slices.minimal_rotation(scalars(precision, slice_oracle.unit(f)), scalars(precision, slice_oracle.unit(t)))
    return np.stack([numbers(row)[0] for row in rows])


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("B.rotfromto"))
def test_minimal_rotation_golden(precision, inputs, outputs):
    got = rotation(precision, inputs["from"], inputs["to"])
    assert got == pytest.approx(np.array(outputs["rows"]), abs=precision.tolerance)


def test_minimal_rotation_turns_about_the_common_normal(precision):
    """Orthonormal, f to t, and the axis f × t stays: that is the rotation by the angle between them."""
    rng = np.random.default_rng(5)
    for f, t in slice_oracle.unit(rng.normal(size=(50, 2, 3))):
        R = rotation(precision, f, t)
        # The formula divides by 1 + ⟨f, t⟩, and so are its rounding errors.
        tolerance = precision.tolerance * max(1.0, 0.1 / (1 + f @ t))
        axis = slice_oracle.unit(np.cross(f, t))
        square = R @ R.T
        assert square == pytest.approx(np.eye(3), abs=tolerance)
        assert R @ f == pytest.approx(t, abs=tolerance)
        assert R @ axis == pytest.approx(axis, abs=tolerance)


def test_minimal_rotation_is_smooth_at_the_identity(precision):
    """No threshold: a turn by 1e-3 is a turn by 1e-3."""
    R = rotation(precision, [0, 0, 1], [np.sin(1e-3), 0, np.cos(1e-3)])
    assert R[0, 2] == pytest.approx(np.sin(1e-3), rel=10 * precision.tolerance)


def test_minimal_rotation_carries_azimuth_to_the_slice_tangent(precision):
    for _, V, _, phi in random_frames(10):
        T = numbers(view_frame(precision, V).tangent(precision.Float(np.cos(phi)), precision.Float(np.sin(phi))))[0]
        turned = rotation(precision, [0, 0, 1], V) @ [np.cos(phi), np.sin(phi), 0]
        assert turned == pytest.approx(T, abs=precision.tolerance)
