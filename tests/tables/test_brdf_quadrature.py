"""Quadrature of the reflection of cones: golden values, brute force, limits, honest errors, the same bits."""

import functools
import itertools

import drjit as dr
import numpy as np
import pytest
from oracles.golden import FLOAT64_TOLERANCE, cases
from oracles.reflection import cone_terms as brute_force
from oracles.reflection import frame

import gtao
from gtao.kernels import microfacet
from gtao.tables.brdf import LEVELS, cone_shares, cone_terms, hemisphere_terms
from gtao.tables.brdf_sums import panel_sums

HALF = np.pi / 2


def corners(n, seed=0, chi=0.0):
    """Arguments where nodes are short: narrow lobes, cones that end on them, grazing angles, b near ω_r."""
    rng = np.random.default_rng(seed)
    alpha = 10 ** rng.uniform(-6, 0, n)
    beta = np.where(rng.random(n) < 0.3, 10 ** rng.uniform(-6, 0, n), rng.uniform(0, np.pi, n))
    on_edge = np.clip(beta + 3 * alpha * rng.normal(size=n), 0, np.pi)
    alpha_v = np.where(rng.random(n) < 0.5, on_edge, rng.uniform(0, np.pi, n))
    grazing = HALF - 10 ** rng.uniform(-4, 0, n)
    theta_o = np.where(rng.random(n) < 0.5, grazing, rng.uniform(0, HALF, n))
    return alpha_v, beta, alpha, theta_o, np.full(n, chi) if np.isscalar(chi) else chi(rng, n)


@functools.cache
def reference(kind):
    """Corners and their terms with more nodes than the tests use."""
    arguments = corners(600, chi=(lambda rng, n: rng.uniform(-np.pi, np.pi, n)) if kind == "any" else 0.0)
    return arguments, cone_terms(*arguments, tolerance=1e-11).values


class TestValues:
    def test_golden(self):
        found = cases("E.full_brdf")
        arguments = [np.array([i[name] for i, _ in found]) for name in ("alpha_v", "beta", "alpha", "theta_o", "chi")]
        cone = cone_terms(*arguments, tolerance=1e-9)
        whole = hemisphere_terms(arguments[2], arguments[3], tolerance=1e-9)
        expected = np.array([[o[name] for name in ("A_V", "B_V", "A", "B")] for _, o in found])
        got = np.concatenate([cone.values, whole.values], axis=-1)
        np.testing.assert_allclose(got, expected, rtol=0, atol=FLOAT64_TOLERANCE)
        shares = cone_shares(*arguments, tolerance=1e-9).values
        np.testing.assert_allclose(shares, expected[:, :2] / expected[:, 2:], rtol=1e-8)

    @pytest.mark.parametrize("chi", [0.0, 1.1, np.pi, -2.5])
    @pytest.mark.parametrize(
        ("alpha_v", "beta", "alpha", "theta_o"),
        [
            (1.0, 0.7, 0.3, 0.5),
            (0.9, 0.9, 0.05, 1.2),
            (1.3, 0.4, 1.0, 1.5),
            (2.5, 1.4, 0.02, 0.1),
            (0.3, 0.3, 1e-3, 1.4),
        ],
    )
    def test_brute_force(self, alpha_v, beta, alpha, theta_o, chi):
        got = cone_terms(alpha_v, beta, alpha, theta_o, chi).values
        # A cell that the edge of the cone cuts counts whole: 1 / n of cells, half of them too many.
        np.testing.assert_allclose(got, brute_force(alpha_v, beta, alpha, theta_o, chi, n=1000), rtol=0, atol=5e-4)

    def test_hemisphere_as_a_cone(self):
        _, beta, alpha, theta_o, _ = corners(100, seed=3)
        whole = hemisphere_terms(alpha, theta_o, tolerance=1e-8).values
        for chi in (0.0, 0.8):
            got = cone_terms(np.pi, beta, alpha, theta_o, chi, tolerance=1e-8).values
            np.testing.assert_allclose(got, whole, rtol=0, atol=1e-7)

    def test_whole_visibility_is_one(self):
        """n = b: the cone of a right angle is the hemisphere."""
        theta_o = np.linspace(0, 1.55, 20)
        np.testing.assert_allclose(cone_shares(HALF, theta_o, 0.3, theta_o).values, 1.0, atol=1e-9)

    def test_environment_brdf(self):
        """Nearly a mirror loses nothing; seen from above, the roughest surface reflects 1 - ln 2."""
        smooth = hemisphere_terms(1e-4, np.array([0.0, 1.0])).values
        k = (1 - np.cos([0.0, 1.0])) ** 5
        np.testing.assert_allclose(smooth, np.stack([1 - k, k], -1), atol=1e-6)
        rough = hemisphere_terms(1.0, 0.0, tolerance=1e-10).values
        assert rough.sum() == pytest.approx(1 - np.log(2), abs=1e-12)


class TestLimits:
    def test_mirror(self):
        k = (1 - np.cos(1.2)) ** 5
        got = cone_terms(np.array([0.5, 0.7, 0.6]), 0.6, 0.0, 1.2).values
        np.testing.assert_allclose(got, [[0, 0], [1 - k, k], [(1 - k) / 2, k / 2]])
        np.testing.assert_array_equal(cone_shares(np.array([0.5, 0.7]), 0.6, 0.0, 0.0).values, [[0, 0], [1, 1]])

    def test_narrow_lobes_near_the_mirror(self):
        """Beyond its width the lobe ends as (α / angle)²."""
        for alpha in (1e-3, 1e-5, 1e-7):
            got = cone_terms(np.array([0.5, 0.7]), 0.6, alpha, 0.4, np.array([0.3, -2.0])).values[:, 0]
            np.testing.assert_allclose(got, [0, 1], atol=1e3 * alpha**2 + 1e-5)

    def test_edge_through_the_lobe(self):
        """A narrow lobe is halved; in units of its width the share is a function of the distance alone."""
        for chi in (0.0, 1.0):
            at = [cone_terms(0.8 + x * alpha, 0.8, alpha, 1.0, chi).values[0] for alpha in (1e-5, 1e-6) for x in (0, 2)]
            assert at[0] == pytest.approx(0.5 * (1 - (1 - np.cos(1.0)) ** 5), abs=1e-4)
            assert at[1] > at[0] + 0.2
            np.testing.assert_allclose(at[:2], at[2:], atol=1e-4)

    def test_grazing(self):
        """Up to the last angle, where cos θ_o is rounding."""
        angles = HALF - np.array([1e-3, 1e-5, 1e-7, 0])
        got = cone_terms(1.0, 1.2, 0.3, angles)
        assert np.all(got.error < 1e-5)
        np.testing.assert_allclose(np.diff(got.values[1:], axis=0), 0, atol=1e-4)

    @pytest.mark.parametrize("beta", [0.0, np.pi])
    def test_axis_on_the_reflected_direction(self, beta):
        """Its azimuth has no meaning then, and none next to it either."""
        chi = np.array([0.0, 1.3, np.pi, -0.5])
        alpha_v = 1.0 if beta == 0 else 2.5
        at, near = (cone_terms(alpha_v, x, 0.2, 0.9, chi, tolerance=1e-9).values for x in (beta, abs(beta - 1e-9)))
        np.testing.assert_allclose(np.concatenate([at, near]), np.tile(at[:1], (8, 1)), atol=1e-8)

    def test_more_with_wider_cones(self):
        alpha_v = np.linspace(0, np.pi, 60)
        for alpha in (1e-3, 0.1, 1.0):
            values = cone_terms(alpha_v, 0.7, alpha, 1.3, 0.5, tolerance=1e-9).values
            assert np.all(np.diff(values, axis=0) > -1e-9)
            np.testing.assert_array_equal(values[0], 0)


class TestErrors:
    @pytest.mark.parametrize("kind", ["in the plane", "any"])
    def test_estimate_is_above_the_error(self, kind):
        arguments, truth = reference(kind)
        got = cone_terms(*arguments)
        error = np.max(np.abs(got.values - truth), axis=-1)
        assert np.all(got.error <= 1e-5)
        # 1e-10: that of the truth.
        assert np.all(error <= got.error + 1e-10)

    @pytest.mark.parametrize("tolerance", [1e-3, 1e-4])
    def test_no_estimate_is_low_by_chance(self, tolerance):
        """Of thousands of cones, where changes of different parts, or of one, often cancel."""
        arguments = corners(6000, seed=7)
        got, truth = (cone_terms(*arguments, tolerance=x) for x in (tolerance, 1e-8))
        error = np.max(np.abs(got.values - truth.values), axis=-1)
        assert np.all(error <= 0.7 * got.error + 1e-8)
        assert np.max(got.error) <= tolerance

    @pytest.mark.parametrize("kind", ["in the plane", "any"])
    def test_converges_geometrically(self, kind):
        """Each level has half as many nodes again; the error of all but a hundredth falls by more than 5 each time."""
        arguments, truth = reference(kind)
        levels = []
        for n_nodes in LEVELS[1:5]:
            owner, parts = panel_sums(*arguments, in_plane=kind != "any", n_nodes=n_nodes)
            levels.append(np.stack([np.bincount(owner, channel, len(truth)) for channel in parts.T], -1))
        worst = [np.quantile(np.max(np.abs(x - truth), axis=-1), 0.99) for x in levels]
        assert all(fine < 0.2 * coarse for coarse, fine in itertools.pairwise(worst)), worst
        assert worst[-1] < 1e-5

    def test_tolerance(self):
        arguments = corners(60, seed=2)
        loose, tight = (cone_terms(*arguments, tolerance=x) for x in (1e-3, 1e-8))
        assert np.all(loose.error < 1e-3)
        assert np.all(tight.error < 1e-8)
        assert np.max(np.abs(loose.values - tight.values)) < 1e-3

    def test_shares_are_held_to_their_own_scale(self):
        """Seen from above B is a millionth of A, and S_B no less exact."""
        arguments = np.linspace(0.1, 1.5, 20), 0.3, 0.01, 0.0
        loose, tight = (cone_shares(*arguments, tolerance=x) for x in (1e-5, 1e-9))
        assert hemisphere_terms(0.01, 0.0).values[1] < 1e-4
        assert np.max(np.abs(loose.values - tight.values)) < 1e-5
        assert np.all(loose.error < 1e-5)


def test_bits_do_not_depend_on_threads():
    arguments = corners(400, seed=5)
    before = dr.thread_count()
    try:
        results = []
        for n in (1, 2, 3):
            dr.set_thread_count(n)
            results.append(cone_shares(*arguments).values.tobytes())
    finally:
        dr.set_thread_count(before)
    assert results[0] == results[1] == results[2]


def test_a_cone_does_not_feel_its_company():
    arguments = corners(40, seed=6)
    together = cone_terms(*arguments).values
    alone = np.stack([cone_terms(*(a[i] for a in arguments)).values for i in range(0, 40, 13)])
    np.testing.assert_array_equal(together[::13], alone)


class TestAnyBRDF:
    def test_lambert(self):
        """Share of a cosine in a cone about the normal; nodes crowd at a lobe that is not there."""
        alpha_v = np.linspace(0.1, HALF, 7)
        got = cone_terms(alpha_v, 0.9, 0.3, 0.9, brdf=lambda wi, wo: wi[2] / np.pi)
        np.testing.assert_allclose(got.values[:, 0], np.sin(alpha_v) ** 2, atol=1e-6)

    @pytest.mark.parametrize("chi", [0.0, 0.7])
    def test_ggx_as_a_function(self, chi):
        arguments = np.array([0.5, 1.0]), np.array([0.8, 0.4]), np.array([0.2, 0.5]), np.array([0.3, 1.2]), chi

        def brdf(wi, wo):
            assert dr.type_v(wi) is dr.VarType.Float64
            alpha = 0.2
            return sum(microfacet.brdf_terms(wi, wo, alpha))

        got = cone_terms(*(a if np.isscalar(a) else a[:1] for a in arguments), brdf=brdf)
        expected = cone_terms(*(a if np.isscalar(a) else a[:1] for a in arguments)).values.sum(-1, keepdims=True)
        np.testing.assert_allclose(got.values, expected, atol=1e-6)
        share = cone_shares(*(a if np.isscalar(a) else a[:1] for a in arguments), brdf=brdf).values
        np.testing.assert_allclose(share, expected / hemisphere_terms(0.2, 0.3).values.sum(), atol=1e-5)

    def test_narrower_than_said(self):
        """More nodes find a lobe ten times as narrow; the estimate tells what they do not reach."""
        got = cone_terms(0.8, 0.8, 0.5, 0.6, brdf=lambda wi, wo: sum(microfacet.brdf_terms(wi, wo, 0.05)))
        expected = cone_terms(0.8, 0.8, 0.05, 0.6).values.sum()
        assert abs(got.values[0] - expected) <= max(got.error, 1e-5)

    def test_directions(self):
        """The function is given ω_o, and unit directions above the horizon that lie in the cone."""
        b, _, wo = frame(0.7, 1.1, 0.4)

        def brdf(wi, wo_given):
            inside = sum(wi[i] * float(b[i]) for i in range(3)) >= np.cos(0.9) - 1e-12
            same = sum(abs(wo_given[i] - float(wo[i])) for i in range(3)) < 1e-12
            unit = abs(dr.squared_norm(wi) - 1) < 1e-12
            return dr.select(inside & same & unit & (wi[2] > -1e-12), wi[2], dr.nan)

        assert np.isfinite(cone_terms(0.9, 0.7, 0.2, 1.1, 0.4, brdf=brdf).values[0])

    def test_bsdf_of_mitsuba(self):
        """In single precision; without Fresnel's term a diffuse surface and a mirror-like one lose what they should."""
        diffuse = gtao.render.brdf({"type": "diffuse", "reflectance": 0.6})
        got = cone_terms(0.8, 0.5, 0.5, 0.5, brdf=diffuse).values[0]
        assert got == pytest.approx(0.6 * np.sin(0.8) ** 2, abs=1e-6)
        glossy = gtao.render.brdf({"type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": 0.02})
        assert hemisphere_terms(0.02, 0.3, brdf=glossy).values[0] == pytest.approx(1, abs=2e-3)
        narrow = cone_shares(np.array([0.4, 0.8]), 0.6, 0.02, 0.3, brdf=glossy).values[:, 0]
        np.testing.assert_allclose(narrow, cone_shares(np.array([0.4, 0.8]), 0.6, 0.02, 0.3).values[:, 0], atol=1e-3)


class TestArguments:
    def test_shapes(self):
        got = cone_terms(np.full((3, 1, 4), 0.5), np.full((2, 1), 0.4), 0.3, 0.2)
        assert got.values.shape == (3, 2, 4, 2)
        assert got.error.shape == (3, 2, 4)
        assert hemisphere_terms(0.3, 0.2).values.shape == (2,)

    def test_progress(self):
        seen = []
        cone_terms(np.full(5, 0.5), 0.4, np.array([0, 0.1, 0.2, 0.3, 0]), 0.2, progress=lambda *x: seen.append(x))
        assert seen[-1] == (5, 5)

    @pytest.mark.parametrize(
        ("arguments", "named"),
        [
            ((-0.1, 0.5, 0.5, 0.5), "alpha_v"),
            ((0.1, 3.5, 0.5, 0.5), "beta"),
            ((0.1, 0.5, 1.5, 0.5), "alpha must"),
            ((0.1, 0.5, 0.5, 1.6), "theta_o"),
            ((0.1, 0.5, 0.5, 0.5, np.nan), "chi"),
        ],
    )
    def test_ranges(self, arguments, named):
        with pytest.raises(gtao.ConfigError, match=named):
            cone_terms(*arguments)

    def test_mirror_of_ones_own(self):
        with pytest.raises(gtao.ConfigError, match="above 0"):
            cone_terms(0.1, 0.5, 0.0, 0.5, brdf=lambda wi, wo: wi[2])

    def test_broadcast(self):
        with pytest.raises(gtao.ShapeError, match="broadcast"):
            cone_terms(np.zeros(3), np.zeros(2), 0.5, 0.5)
