"""G-buffers: validation, positions, and normals derived from depth against true ones."""

import numpy as np
import pytest
from analytic._frames import frame
from analytic._tables import normal_errors
from oracles import fields

import gtao

CAMERA = gtao.PerspectiveCamera(6, 4, 1.0)


def good(dtype=np.float32):
    z = np.linspace(1, 2, 24).reshape(4, 6).astype(dtype)
    n = np.zeros((4, 6, 3), dtype)
    n[..., 2] = 1
    return z, n


@pytest.mark.parametrize(
    "field",
    [
        fields.in_perspective(fields.gaussians(0.2, 0.3), size=20, stretch=1.3, shift_px=(4.0, -7.0)),
        fields.from_above(fields.waves(0.2, 4.0), size=20),
    ],
    ids=["perspective", "orthographic"],
)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_positions(field, dtype):
    g = frame(field, dtype)
    got = g.position_v.numpy()
    assert got.dtype == dtype
    rounding = 10 * float(np.finfo(dtype).eps)
    assert got == pytest.approx(field.positions(), rel=rounding, abs=rounding)


def test_background_is_masked():
    z, n = good()
    z[1, 2:4] = np.inf
    n[1, 2] = np.nan
    n[1, 3] = 0
    g = gtao.GBuffer(z, n, CAMERA)
    assert np.array_equal(g.mask.numpy(), np.isfinite(z))
    assert np.isfinite(g.position_v.numpy()).all()
    assert np.isfinite(g.normal_v.numpy()).all()


def change(array, value, index=(1, 2)):
    array = array.copy()
    array[index] = value
    return array


Z, N = good()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((Z[:3], N), "view_z must have shape"),
        ((Z[..., None], N), "view_z must have shape"),
        ((Z, N[..., :2]), "normal_v must have shape"),
        ((Z, N[:, :5]), "normal_v must have shape"),
        ((change(Z, np.nan), N), "NaN"),
        ((change(Z, 0.0), N), "positive"),
        ((change(Z, -1.0), N), "positive"),
        ((change(Z, -np.inf), N), "positive"),
        ((change(Z, 2e12), N), "must lie between"),
        ((change(Z, 5e-13), N), "must lie between"),
        ((Z, change(N, np.nan)), "not finite"),
        ((Z, change(N, np.inf)), "not finite"),
        ((Z, change(N, 0.0)), "unit"),
        ((Z, 2 * N), "unit"),
        ((Z, N * 0.5 + 0.5), "unit"),
        (([[1.0]], N), "array"),
        ((Z.astype(complex), N), "real"),
        ((Z, N, np.full((4, 6, 3), 1.5, np.float32)), "albedo"),
        ((Z, N, np.full((4, 6, 3), np.nan, np.float32)), "albedo"),
        ((Z, N, np.zeros((4, 6), np.float32)), "albedo"),
    ],
)
def test_bad_input_is_named(arguments, message):
    with pytest.raises(gtao.ShapeError, match=message):
        gtao.GBuffer(*arguments[:2], CAMERA, *arguments[2:])


def test_camera_is_checked():
    with pytest.raises(gtao.ShapeError, match="camera"):
        gtao.GBuffer(Z, N, {"width": 6, "height": 4})


def test_inputs_are_not_aliased():
    z, n = good()
    g = gtao.GBuffer(z, n, CAMERA)
    z[:] = 7.0
    assert g.view_z.numpy() == pytest.approx(Z)


@pytest.mark.parametrize("arguments", [(change(Z, np.nan), N), (change(Z, -1.0), N), (Z, 2 * N), (Z, N, 2 + N)])
def test_the_caller_may_vouch_for_the_values(arguments):
    with pytest.raises(gtao.ShapeError):
        gtao.GBuffer(*arguments[:2], CAMERA, *arguments[2:])
    gtao.GBuffer(*arguments[:2], CAMERA, *arguments[2:], validate=False)


def test_shapes_and_types_are_checked_all_the_same():
    for wrong in ((Z[:3], N), (Z, N[..., :2]), (Z, N, Z), ([[1.0]], N)):
        with pytest.raises(gtao.ShapeError):
            gtao.GBuffer(*wrong[:2], CAMERA, *wrong[2:], validate=False)


def test_looking_at_the_values_does_not_change_them():
    z, n = change(Z, np.inf), N * np.float32(1.002)
    looked, vouched = (gtao.GBuffer(z, n, CAMERA, validate=validate) for validate in (True, False))
    for name in ("view_z", "normal_v", "mask"):
        np.testing.assert_array_equal(getattr(looked, name).numpy(), getattr(vouched, name).numpy())


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_unit_normals_keep_their_bits_and_others_are_normalised(dtype):
    rng = np.random.default_rng(4)
    n = rng.normal(size=N.shape)
    n = (n / np.linalg.norm(n, axis=-1, keepdims=True)).astype(dtype)
    z = Z.astype(dtype)
    np.testing.assert_array_equal(gtao.GBuffer(z, n, CAMERA).normal_v.numpy(), n)
    stretched = gtao.GBuffer(z, n * dtype(1.004), CAMERA).normal_v.numpy()
    # A square root and a division, each rounded.
    assert np.abs(stretched - n).max() <= 3 * np.finfo(dtype).eps


def worst_angle(field, mask=...):
    """Largest angle in radians between derived and true normals."""
    return normal_errors(field)[mask].max()


@pytest.mark.parametrize("tilt", [0, 45, 80])
def test_derived_normals_are_exact_on_planes(tilt):
    for off_axis in ((0.0, 0.0), (0.8, -0.5)):
        assert worst_angle(fields.tilted_plane(np.radians(tilt), 2.0, off_axis)) < 1e-7


@pytest.mark.parametrize("make", ["from_above", "in_perspective"])
def test_derived_normals_of_a_smooth_surface_are_first_order(make):
    """A one-sided difference is first order in the pixel size."""
    errors = [worst_angle(getattr(fields, make)(fields.waves(0.2, 3.0), size=size)) for size in (40, 80, 160)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders == pytest.approx([1.0, 1.0], abs=0.25)


def test_derived_normals_stay_on_their_side_of_an_edge():
    """Beside a wall, and on the two planes of a groove, the difference away from the edge is taken."""
    walls = fields.walls(0.4, 0.4, 2.0, 1.0, n_px=16, pixel=0.1, length_px=8)
    assert worst_angle(walls) < 1e-7
    groove = fields.groove(0.6, 0.9, n_px=16, pixel=0.1, length_px=8)
    assert worst_angle(groove) < 1e-7


def test_derived_normals_beside_the_background_and_on_lone_texels():
    field = fields.tilted_plane(0.5, 0.3, size=9)
    view_z = field.view_z.copy()
    view_z[:, 5:] = np.inf
    view_z[2, 7] = 2.0
    holed = fields.Field(view_z, field.normal_v, field.camera, orthographic=False)
    surface = np.zeros((9, 9), bool)
    surface[:, :5] = True
    assert worst_angle(holed, surface) < 1e-7
    normal = frame(holed, np.float64, normals=False).normal_v.numpy()
    assert normal[2, 7] == pytest.approx([0, 0, 1])
    assert np.isfinite(normal).all()
