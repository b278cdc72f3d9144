"""Directions as bits: which lie between two angles, and what they weigh."""

import numpy as np
import pytest
from scipy.integrate import quad

import drjit as dr  # isort: skip

from gtao.kernels.direction_nodes import PER_WORD, Nodes

# n_V and n_T of normals that face the viewer, turn away, and lie edge-on; their length is that of a projection.
NORMALS = [(1.0, 0.0), (0.6, 0.7), (0.3, -0.9), (0.05, 0.2), (-0.4, 0.5), (-0.2, -0.7), (-1.0, 0.0), (0.0, 0.8)]


def nodes(precision, nV, nT, offset, n_words):
    return Nodes.of(precision.lanes([nV]), precision.lanes([nT]), precision.lanes([offset]), n_words)


def angles(got):
    """The node angles that an object stands for, as the documentation of the class has them."""
    low, high, offset = (float(np.array(v)[0]) for v in (got.low + 0 * got.rate, got.high, got.offset))
    n = PER_WORD * got.n_words
    return low + (high - low) * (np.arange(n) + offset) / n


@pytest.mark.parametrize(("nV", "nT"), NORMALS)
def test_nodes_fill_the_normals_hemisphere(precision, nV, nT):
    theta = angles(nodes(precision, nV, nT, 0.3, 2))
    assert (nV * np.cos(theta) + nT * np.sin(theta) > -1e-6).all()
    # What is left out of [0, π] lies behind the normal.
    rest = np.linspace(0, np.pi, 1001)
    rest = rest[(rest < theta[0] - 0.05) | (rest > theta[-1] + 0.05)]
    assert (nV * np.cos(rest) + nT * np.sin(rest) < 1e-6).all()


@pytest.mark.parametrize("n_words", [1, 3])
def test_bits_between_two_angles(precision, n_words):
    rng = np.random.default_rng(1)
    T = precision.types
    for nV, nT in NORMALS:
        got = nodes(precision, nV, nT, rng.random(), n_words)
        theta = angles(got)
        if theta[-1] - theta[0] < 1e-3:
            continue
        first, last = rng.uniform(-0.2, np.pi + 0.2, (2, 200))
        first[:3], last[:3] = [-np.inf, np.inf, 0.5], [np.inf, -np.inf, 0.5]
        clear = np.abs(theta[:, None] - np.concatenate([first, last])).min(axis=0) > 1e-5
        clear = clear[:200] & clear[200:]
        words = got.between(precision.lanes(first), precision.lanes(last), T)
        bits = np.concatenate([(np.array(w)[:, None] >> np.arange(PER_WORD)) & 1 for w in words], axis=1)
        want = (theta >= first[:, None]) & (theta <= last[:, None])
        assert clear.sum() > 150
        assert want.any()
        assert np.array_equal(bits[clear] == 1, want[clear])


@pytest.mark.parametrize("cosine", [True, False], ids=["cosine", "uniform"])
@pytest.mark.parametrize(("nV", "nT"), NORMALS)
def test_weights_converge_to_the_integrals(precision, nV, nT, cosine):
    """The rectangle rule: the error of a jump at the hemisphere's end is of first order, else of second."""

    def integrand(theta):
        up = nV * np.cos(theta) + nT * np.sin(theta)
        return np.sin(theta) * (up if cosine else 1.0) * (up > 0)

    gamma = np.arctan2(nT, nV)
    kinks = [t for t in (gamma - np.pi / 2, gamma + np.pi / 2, gamma + 3 * np.pi / 2) if 0 < t < np.pi]
    want = quad(integrand, 0, np.pi, points=kinks or None)[0]
    T = precision.types
    errors = []
    for n_words in (1, 4):
        got = nodes(precision, nV, nT, 0.5, n_words)
        empty = [dr.zeros(T.UInt, 1) for _ in range(n_words)]
        seen, whole = (float(np.array(v)[0]) for v in got.weigh(empty, cosine, T))
        assert seen == whole
        errors.append(abs(whole - want))
    assert errors[0] < 2e-3
    # The midpoint rule: a sixteenth.
    assert errors[1] < errors[0] / 10 + 1e-6


def test_blocked_nodes_weigh_nothing(precision):
    T = precision.types
    got = nodes(precision, 0.7, 0.4, 0.25, 2)
    theta = angles(got)
    spacing = theta[1] - theta[0]
    rng = np.random.default_rng(2)
    for _ in range(5):
        blocked = rng.random(64) < 0.5
        words = [
            T.UInt(int(sum(1 << k for k in range(32) if blocked[32 * w + k]))) + dr.zeros(T.UInt, 1) for w in (0, 1)
        ]
        seen, whole = (float(np.array(v)[0]) for v in got.weigh(words, True, T))
        weight = np.sin(theta) * (0.7 * np.cos(theta) + 0.4 * np.sin(theta)) * spacing
        assert whole == pytest.approx(weight.sum(), rel=1e-5)
        assert seen == pytest.approx(weight[~blocked].sum(), rel=1e-5)
        moments = [float(np.array(v)[0]) for v in got.weigh(words, True, T, 5)]
        factors = np.stack([0 * theta + 1, np.sin(theta), np.cos(theta), np.sin(theta) ** 2])
        factors = np.concatenate([factors, [np.sin(theta) * np.cos(theta)]])
        assert moments == pytest.approx([*(factors @ (weight * ~blocked)), weight.sum()], abs=1e-5 * weight.sum())
