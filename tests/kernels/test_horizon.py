"""What one depth sample says about the horizon: golden values and brute force along the eye ray."""

import numpy as np
import pytest
from oracles import golden, slice_oracle

from gtao.kernels import horizon


def vector(precision, rows):
    return tuple(precision.lanes(column) for column in np.asarray(rows).T)


@pytest.mark.parametrize(("inputs", "outputs"), golden.cases("A.falloff"))
def test_attenuation_golden(precision, inputs, outputs):
    low = precision.Float(outputs["low_cos"])
    assert outputs["low_cos"] == pytest.approx(np.cos(inputs["gamma"] + inputs["side"] * np.pi / 2))
    scale = -1 / (inputs["r1"] - inputs["r0"])
    weight = horizon.weight(precision.Float(inputs["dist"] ** 2), scale, -scale * inputs["r1"])
    assert weight[0] == pytest.approx(outputs["weight"], abs=precision.tolerance)
    got = horizon.attenuate(precision.Float(inputs["cos_s"]), low, weight)
    assert got[0] == pytest.approx(outputs["attenuated_cos"], abs=precision.tolerance)


def test_attenuation_ends_at_the_tangent_plane(precision):
    distances = [0.0, 0.5, 1.0, 1.5, 2.0, 3.0]
    weight = horizon.weight(precision.lanes(np.square(distances)), -1.0, 2.0)
    got = horizon.attenuate(precision.Float(0.7), precision.Float(-0.2), weight)
    assert np.array(got) == pytest.approx([0.7, 0.7, 0.7, 0.25, -0.2, -0.2], abs=precision.tolerance)


def test_squared_weight_is_the_parabola(precision):
    distances = np.array([0.0, 0.5, 1.0, 1.5, 3.0])
    got = horizon.weight(precision.lanes(np.square(distances)), -0.5, 1.0, squared=True)
    assert np.array(got) == pytest.approx(np.clip(1 - 0.5 * distances**2, 0, 1), abs=precision.tolerance)


def test_cosine_and_distances(precision):
    rng = np.random.default_rng(0)
    D, V = rng.normal(size=(50, 3)), slice_oracle.unit(rng.normal(size=(50, 3)))
    c, d2, dV = horizon.cosine(vector(precision, D), vector(precision, V))
    want = np.sum(D * V, axis=1)
    scale = 10 * precision.tolerance
    assert np.array(dV) == pytest.approx(want, abs=scale)
    assert np.array(d2) == pytest.approx(np.sum(D * D, axis=1), rel=scale)
    assert np.array(c) == pytest.approx(want / np.linalg.norm(D, axis=1), abs=scale)


def solid_within(P, S, V, e, radius):
    """Largest and smallest ⟨ω, V⟩ over the points of S + t e, t >= 0, within ``radius`` of P; -1 and 1 if none.

    The ray is sampled over eight radii; where it enters and leaves the sphere is then bisected to rounding.
    """
    t = np.linspace(0, 8 * radius, 20_001)

    def within(t):
        return np.linalg.norm(S + np.multiply.outer(t, e) - P, axis=-1) <= radius

    inside = within(t)
    if not inside.any():
        return -1.0, 1.0
    first, last = np.flatnonzero(inside)[[0, -1]]

    def border(inner, outer):
        for _ in range(60):
            middle = 0.5 * (inner + outer)
            inner, outer = (middle, outer) if within(middle) else (inner, middle)
        return inner

    ends = [border(t[first], t[first - 1]) if first else 0.0, border(t[last], t[last + 1])]
    offsets = S + np.concatenate([ends, t[inside]])[:, None] * e - P
    cosines = offsets @ V / np.linalg.norm(offsets, axis=1)
    return float(cosines.max()), float(cosines.min())


def eye_rays(orthographic, radius, n=200, seed=2):
    """Points P, samples S on eye rays that pass P at up to 1.3 radii, in front of the sphere, inside and behind it."""
    rng = np.random.default_rng(seed)
    while n:
        P = np.array([*rng.uniform(-1, 1, 2), -rng.uniform(2, 4)])
        V = np.array([0.0, 0.0, 1.0]) if orthographic else slice_oracle.unit(-P)
        beside = P + 1.3 * radius * np.sqrt(rng.random()) * slice_oracle.unit(np.cross(V, rng.normal(size=3)))
        e = -V if orthographic else slice_oracle.unit(beside)
        S = beside + rng.uniform(-1.5, 1.2) * e
        closest = np.linalg.norm((S - P) - ((S - P) @ e) * e)
        # A graze is ill-conditioned: the entry moves with the square root of a rounding error.
        if abs(closest / radius - 1) > 0.01:
            n -= 1
            yield P, V, S, e


def cut(precision, P, V, S, radius, orthographic):
    """Both ends of the blocked arc, from points as the kernel meets them: image-plane coordinates and depths."""
    a, b = (P[:2], S[:2]) if orthographic else (P[:2] / -P[2], S[:2] / -S[2])
    (X0, Y0), (X, Y), (dX, dY) = (tuple(map(precision.Float, map(float, v))) for v in (a, b, b - a))
    rcp_a2 = 1 / (X0 * X0 + Y0 * Y0 + 1)
    c, d2, dV = horizon.cosine(vector(precision, [S - P]), vector(precision, [V]))
    # Texels are as wide as an image-plane coordinate in x, and twice as high, and upside down.
    form = horizon.apart_form(precision.Float(1), precision.Float(-2), X0, Y0, rcp_a2, orthographic)
    apart2 = horizon.apart_squared(dX, -0.5 * dY, form, X, Y, orthographic)
    p = precision.Float(float(np.linalg.norm(P)))
    upper, lower, blocks = horizon.cut_at_sphere(c, d2, dV, apart2, p, precision.Float(radius), orthographic)
    return upper[0], lower[0] if blocks[0] else 1.0


@pytest.mark.parametrize("orthographic", [False, True], ids=["perspective", "orthographic"])
def test_samples_far_in_front_of_a_small_sphere_keep_their_digits(precision, orthographic):
    """An occluder a thousand radii in front: the eye ray's passage decides, the sample's distance must not."""
    radius = 0.3
    P = np.array([40.0, -30.0, -1000.0])
    V = np.array([0.0, 0.0, 1.0]) if orthographic else slice_oracle.unit(-P)
    for share in (0.2, 0.5, 0.9):
        beside = P + share * radius * slice_oracle.unit(np.cross(V, [0.3, 1.0, 0.2]))
        S = beside + 900 * V if orthographic else 0.1 * beside
        e = -V if orthographic else slice_oracle.unit(beside)
        offset = beside - P
        foot = offset - (offset @ e) * e
        half = np.sqrt(radius**2 - foot @ foot)
        want = [((foot - side * half * e) @ V) / radius for side in (1, -1)]
        # The offset of 0.3 beside coordinates of 40 keeps 17 bits in float32.
        assert cut(precision, P, V, S, radius, orthographic) == pytest.approx(want, abs=100 * precision.tolerance)


@pytest.mark.parametrize("orthographic", [False, True], ids=["perspective", "orthographic"])
def test_cut_at_sphere_against_sampling(precision, orthographic):
    radius = 0.7
    kinds = {"inside": 0, "entering": 0, "missing": 0}
    for P, V, S, e in eye_rays(orthographic, radius):
        want = solid_within(P, S, V, e, radius)
        inside = np.linalg.norm(S - P) <= radius
        kinds["inside" if inside else "entering" if want[0] > -1 else "missing"] += 1
        # A percent away from a graze the square root amplifies rounding by at most ten.
        assert cut(precision, P, V, S, radius, orthographic) == pytest.approx(want, abs=10 * precision.tolerance)
    assert min(kinds.values()) > 20
