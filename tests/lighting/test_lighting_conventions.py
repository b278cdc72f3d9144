"""Coefficients of other programs, put into their own published formulas."""

import numpy as np
import pytest
from _sphere import directions, harmonics

from gtao import lighting
from gtao.errors import ConfigError, ShapeError

#: The published constants have six decimals.
SIX_DIGITS = 5e-6

RNG = np.random.default_rng(4)
LIGHT = RNG.normal(size=(9, 3))
D = directions(30, seed=5)
X, Y, Z = D.T


def irradiance(light, d):
    """∫ L ⟨n, ω⟩₊ dω of the light with these coefficients, by the kernel of the cosine."""
    kernel = np.repeat([np.pi, 2 * np.pi / 3, np.pi / 4], [1, 3, 5])
    return harmonics(d, 2) @ (kernel[:, None] * light)


def test_irradiance_is_the_integral():
    """The kernel itself, by quadrature: azimuths about the normal, and the cosine in place of the polar angle."""
    x, w = np.polynomial.legendre.leggauss(20)
    x, w = (x + 1) / 2, w / 2
    phi = 2 * np.pi * np.arange(16) / 16
    s = np.sqrt(1 - x**2)[:, None]
    local = np.stack([s * np.cos(phi), s * np.sin(phi), x[:, None] + 0 * phi], axis=-1)
    for n in D[:4]:
        t = np.cross(n, [0.3, -0.5, 0.8])
        t /= np.linalg.norm(t)
        around = local @ np.stack([t, np.cross(n, t), n])
        radiance = (harmonics(around.reshape(-1, 3), 2) @ LIGHT).reshape(20, 16, 3)
        expected = np.einsum("i,ijc->c", w * x, radiance) * 2 * np.pi / 16
        stored = lighting.convert(LIGHT, "gtao", "irradiance")
        np.testing.assert_allclose(lighting.evaluate(stored, n), expected, atol=1e-12)
        np.testing.assert_allclose(irradiance(LIGHT, n[None])[0], expected, atol=1e-12)
        over_pi = lighting.convert(LIGHT, "gtao", "irradiance/pi")
        np.testing.assert_allclose(lighting.evaluate(over_pi, n) * np.pi, expected, atol=1e-12)


def test_ramamoorthi_and_hanrahan():
    """Equation 13 of the paper, with its five constants."""
    c1, c2, c3, c4, c5 = 0.429043, 0.511664, 0.743125, 0.886227, 0.247708
    l00, l1m1, l10, l11, l2m2, l2m1, l20, l21, l22 = lighting.convert(LIGHT, "gtao", "ramamoorthi-hanrahan")[:, None]
    x, y, z = D.T[..., None]
    e = c1 * l22 * (x**2 - y**2) + c3 * l20 * z**2 + c4 * l00 - c5 * l20
    e = e + 2 * c1 * (l2m2 * x * y + l21 * x * z + l2m1 * y * z) + 2 * c2 * (l11 * x + l1m1 * y + l10 * z)
    np.testing.assert_allclose(e, irradiance(LIGHT, D), atol=10 * SIX_DIGITS)


def test_three_js():
    """getBasisAt of SphericalHarmonics3."""
    basis = np.stack(
        [
            0.282095 + 0 * X, 0.488603 * Y, 0.488603 * Z, 0.488603 * X,
            1.092548 * X * Y, 1.092548 * Y * Z, 0.315392 * (3 * Z * Z - 1), 1.092548 * X * Z,
            0.546274 * (X * X - Y * Y),
        ],
        axis=-1,
    )  # fmt: skip
    stored = lighting.convert(LIGHT, "gtao", "three.js")
    np.testing.assert_allclose(basis @ stored, harmonics(D, 2) @ LIGHT, atol=10 * SIX_DIGITS)


@pytest.mark.parametrize("name", ["unreal", "directx", "condon-shortley"])
def test_the_phase(name):
    """SHBasisFunction of TSHVector<3>; D3DXSHEvalDirection has the same signs."""
    basis = np.stack(
        [
            0.282095 + 0 * X, -0.488603 * Y, 0.488603 * Z, -0.488603 * X,
            1.092548 * X * Y, -1.092548 * Y * Z, 0.315392 * (3 * Z * Z - 1), -1.092548 * X * Z,
            0.546274 * (X * X - Y * Y),
        ],
        axis=-1,
    )  # fmt: skip
    stored = lighting.convert(LIGHT, "gtao", name)
    np.testing.assert_allclose(basis @ stored, harmonics(D, 2) @ LIGHT, atol=10 * SIX_DIGITS)


def test_unity():
    """Its shader constants (x, y, z: 3, 1, 2; constant: 0 less 6; 4, 5, 3 times 6, 7; 8) give irradiance over π."""
    c = lighting.convert(LIGHT, "gtao", "unity")
    a = np.stack([c[3], c[1], c[2], c[0] - c[6]])
    b = np.stack([c[4], c[5], 3 * c[6], c[7]])
    one = np.ones_like(X)
    shaded = np.stack([X, Y, Z, one], -1) @ a + np.stack([X * Y, Y * Z, Z * Z, Z * X], -1) @ b
    shaded = shaded + (X * X - Y * Y)[:, None] * c[8]
    np.testing.assert_allclose(shaded * np.pi, irradiance(LIGHT, D), atol=1e-12)


def test_unity_ambient_light():
    """AddAmbientLight stores the colour itself."""
    ambient = lighting.convert(lighting.constant([0.2, 0.4, 0.6]).project(2), "gtao", "unity")
    np.testing.assert_allclose(ambient, [[0.2, 0.4, 0.6]] + [[0, 0, 0]] * 8, atol=1e-15)


def test_filament():
    """Its shader's polynomial gives irradiance over π."""
    c = lighting.convert(LIGHT, "gtao", "filament")
    polynomials = [1 + 0 * X, Y, Z, X, Y * X, Y * Z, 3 * Z * Z - 1, Z * X, X * X - Y * Y]
    np.testing.assert_allclose(np.stack(polynomials, -1) @ c * np.pi, irradiance(LIGHT, D), atol=1e-12)


@pytest.mark.parametrize("name", sorted(lighting.CONVENTIONS))
def test_there_and_back(name):
    for sh in (LIGHT, LIGHT[:, 0]):
        there = lighting.convert(sh, "gtao", name)
        np.testing.assert_allclose(lighting.convert(there, name), sh, atol=1e-14)
    assert lighting.CONVENTIONS[name].about


def test_between_two_others():
    through = lighting.convert(lighting.convert(LIGHT, "unity"), "gtao", "unreal")
    np.testing.assert_allclose(lighting.convert(LIGHT, "unity", "unreal"), through, atol=1e-14)


def test_high_bands():
    sh = RNG.normal(size=25)
    d = directions(3)
    phased = lighting.convert(sh, "gtao", "condon-shortley")
    m = np.concatenate([np.arange(-band, band + 1) for band in range(5)])
    np.testing.assert_allclose(phased, sh * (-1.0) ** np.abs(m), atol=0)
    e = lighting.convert(sh, "gtao", "irradiance")
    assert (e[9:16] == 0).all()
    np.testing.assert_array_equal(lighting.convert(e, "irradiance", "irradiance/pi")[9:16], 0)
    assert np.abs(lighting.evaluate(e, d) - lighting.evaluate(e[:9], d)).max() > 1e-3


def test_left_handed_worlds():
    """Unity's +z is away from a viewer who looks along our -z; Unreal looks along +x, +y to the right, +z up."""
    unity, unreal = lighting.axes("x y -z"), lighting.axes("y z -x")
    for ours, matrix, theirs in (
        ([0, 0, -1], unity, [0, 0, 1]),
        ([1, 0, 0], unity, [1, 0, 0]),
        ([0, 0, -1], unreal, [1, 0, 0]),
        ([1, 0, 0], unreal, [0, 1, 0]),
        ([0, 1, 0], unreal, [0, 0, 1]),
    ):
        light = lighting.von_mises_fisher(theirs, 3.0).project(2)
        expected = lighting.von_mises_fisher(ours, 3.0).project(2)
        np.testing.assert_allclose(lighting.rotate(light, matrix), expected, atol=1e-13)


@pytest.mark.parametrize(
    ("sh", "source", "target", "error", "words"),
    [
        (np.zeros(9), "godot", "gtao", ConfigError, "source must be one of condon-shortley, .*'godot'"),
        (np.zeros(9), "gtao", "godot", ConfigError, "target must be one of"),
        (np.zeros(16), "unity", "gtao", ConfigError, "'unity' has 9 coefficients, got 16"),
        (np.zeros(4), "gtao", "three.js", ConfigError, "'three.js' has 9 coefficients, got 4"),
        (np.zeros(16), "irradiance", "gtao", ConfigError, "no odd bands.*first 9 coefficients"),
        (np.zeros(7), "gtao", "unity", ShapeError, "got 7"),
    ],
)
def test_refusals(sh, source, target, error, words):
    with pytest.raises(error, match=words):
        lighting.convert(sh, source, target)
