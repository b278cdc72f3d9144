"""Rotated coefficients describe the rotated function."""

import numpy as np
import pytest
from _sphere import directions, harmonics, rotation

from gtao import lighting
from gtao.errors import ConfigError, ShapeError

QUARTER_ABOUT_Z = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])


@pytest.mark.parametrize("order", [0, 1, 2, 4, 9])
@pytest.mark.parametrize("mirrored", [False, True])
def test_the_function_turns(order, mirrored):
    r = rotation(order) * (-1 if mirrored else 1)
    c = np.random.default_rng(order).normal(size=((order + 1) ** 2, 3))
    d = directions(20)
    turned = harmonics(d @ r.T, order) @ lighting.rotate(c, r)
    np.testing.assert_allclose(turned, harmonics(d, order) @ c, atol=1e-12)


def test_orthogonal_by_bands():
    m = lighting.rotation_matrix(rotation(5), 10)
    np.testing.assert_allclose(m @ m.T, np.eye(121), atol=1e-12)
    band = np.repeat(np.arange(11), 2 * np.arange(11) + 1)
    assert (m[band[:, None] != band] == 0).all()


def test_rotations_compose():
    a, b = rotation(1), rotation(2)
    both = lighting.rotation_matrix(a, 5) @ lighting.rotation_matrix(b, 5)
    np.testing.assert_allclose(both, lighting.rotation_matrix(a @ b, 5), atol=1e-12)


def test_x_becomes_y():
    """A quarter turn about z takes +x to +y: index 3 of band 1 to index 1."""
    turned = lighting.rotate([0, 0, 0, 1.0], QUARTER_ABOUT_Z)
    np.testing.assert_allclose(turned, [0, 1, 0, 0], atol=1e-14)


def test_single_precision_matrices_lose_nothing():
    """What rounding leaves of a rotation is taken for the nearest rotation, so that energy is kept."""
    c = np.random.default_rng(0).normal(size=25)
    turned = lighting.rotate(c, rotation(3).astype(np.float32))
    assert np.linalg.norm(turned) == pytest.approx(np.linalg.norm(c), rel=1e-13)


def test_to_view():
    """Light from where the camera looks comes from -z in its frame, light from its right from +x."""
    view_to_world = np.eye(4)
    view_to_world[:3, :3] = rotation(7)
    view_to_world[:3, 3] = [5, 6, 7]
    for axis in ([0, 0, -1], [1, 0, 0], [0, 1, 0]):
        world = lighting.von_mises_fisher(view_to_world[:3, :3] @ axis, 5.0).project(4)
        view = lighting.von_mises_fisher(axis, 5.0).project(4)
        np.testing.assert_allclose(lighting.to_view(world, view_to_world), view, atol=1e-13)
        np.testing.assert_allclose(lighting.to_view(world, view_to_world[:3, :3]), view, atol=1e-13)


def test_axes():
    """Up from z to y, both right-handed: the old +z is the new +y."""
    np.testing.assert_array_equal(lighting.axes("x z -y") @ [1, 2, 3], [1, 3, -2])
    assert np.linalg.det(lighting.axes("+x z -y")) == 1
    assert np.linalg.det(lighting.axes("x y -z")) == -1


@pytest.mark.parametrize("text", ["x y", "x y y", "x y --z", "a b c", "", "xyz"])
def test_axes_in_other_words(text):
    with pytest.raises(ConfigError, match="axes must name x, y and z once each"):
        lighting.axes(text)


@pytest.mark.parametrize(
    ("matrix", "error", "words"),
    [
        (2 * np.eye(3), ConfigError, "rotation must be a rotation or a reflection.*remove its scale"),
        (np.full((3, 3), np.nan), ConfigError, "rotation"),
        (np.eye(2), ShapeError, r"3x3 or 4x4 matrix, got shape \(2, 2\)"),
    ],
)
def test_refusals(matrix, error, words):
    with pytest.raises(error, match=words):
        lighting.rotate(np.zeros(9), matrix)
