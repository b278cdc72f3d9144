"""Gradients of ``gtao.irradiance`` and ``gtao.diffuse_radiance`` against differences in float64."""

import numpy as np
import pytest
from gradients._functions import check, native, pullback, pushforward, unit_moves
from oracles.slice_oracle import unit

import gtao

N = 12
BACKGROUND = 5
RNG = np.random.default_rng(14)
METHODS = {
    "slices": gtao.SliceMoments(),
    "slices 4": gtao.SliceMoments(order=4),
    "moment zh": gtao.MomentZH(order=4),
    "cone": gtao.ConeSH(order=4),
    "matched cone": gtao.ConeSH(aperture="matched"),
    "cut cone": gtao.ClippedCone(),
    "cut cone 4": gtao.ClippedCone(order=4),
    "published cut cone": gtao.ClippedCone(aperture="seed", order=3),
    "triple": gtao.TripleProduct(order=3),
    "bent normal": gtao.BentNormalIrradiance(order=4),
    "occlusion": gtao.OcclusionTimesIrradiance(order=4),
}
#: What each method looks at.
READS = {name: {"A", "B", "normal", "sh"} for name in METHODS}
READS["slices"] = READS["slices 4"] = {"V", "sh"}
READS["moment zh"] = READS["cone"] = READS["bent normal"] = {"A", "B", "sh"}
READS["occlusion"] = {"A", "normal", "sh"}


def values():
    """Cones of all widths, whole and cut, with axes up to 60° from the normals."""
    normal = unit(RNG.standard_normal((N, 3)))
    across = unit(np.cross(normal, RNG.standard_normal((N, 3))))
    beta, A = RNG.uniform(0.1, 1, N), RNG.uniform(0.05, 0.9, N)
    b = np.cos(beta)[:, None] * normal + np.sin(beta)[:, None] * across
    B = b * (A * RNG.uniform(0.7, 0.95, N))[:, None]
    V = RNG.standard_normal((N, 9))
    # Band 0 and 1 of functions that could be: |B| / A between a hemisphere's and a ray's.
    V[:, 0], V[:, 1:4] = A * np.sqrt(np.pi) / 2, B[:, [1, 2, 0]] * np.sqrt(3 * np.pi) / 2
    return {"A": A[None], "B": B[None], "V": V[None], "normal": normal[None], "sh": RNG.standard_normal((25, 3))}


VALUES = values()


def lit(method, background=(BACKGROUND,), single=False):
    """Irradiance as a function of "A", "B", "V", "normal" and "sh"."""
    z = np.full((1, N), 2.0)
    z[0, list(background)] = np.inf

    def f(inputs):
        g = gtao.GBuffer(native(z, single), inputs["normal"], gtao.OrthographicCamera(N, 1, 1.0), validate=False)
        ao = gtao.AmbientOcclusion(visibility=inputs["A"], mean_direction=inputs["B"], visibility_sh=inputs["V"])
        return gtao.irradiance(inputs["sh"], g, ao, method)

    return f


@pytest.mark.parametrize("name", METHODS)
def test_everything_that_is_read(name):
    f, mask = lit(METHODS[name]), np.ones((1, N), bool)
    rng = np.random.default_rng(3)
    moves = {
        "A": list(unit_moves(mask, 6, 1)),
        "B": [rng.standard_normal((1, N, 3)) for _ in range(3)],
        "V": [rng.standard_normal((1, N, 9)) for _ in range(3)],
        "normal": list(unit_moves(mask, 6, 2, VALUES["normal"])),
        "sh": [rng.standard_normal((25, 3)) for _ in range(2)],
    }
    # The background moves nothing, and a check wants to see something.
    for key in ("A", "normal"):
        moves[key] = [m for m in moves[key] if not m[0, BACKGROUND].any()]
    for key in READS[name]:
        check(f, VALUES, key, moves[key])


@pytest.mark.parametrize("name", METHODS)
def test_nothing_else_and_no_background(name):
    weights = RNG.standard_normal((1, N, 3))
    gradient = pullback(lit(METHODS[name]), VALUES, weights)
    for key, g in gradient.items():
        assert np.isfinite(g).all()
        assert g.any() == (key in READS[name]), key
        if key != "sh":
            assert not g[0, BACKGROUND].any(), key


@pytest.mark.parametrize("name", METHODS)
def test_modes_are_each_others_transpose(name):
    f, rng = lit(METHODS[name]), np.random.default_rng(6)
    v = {key: rng.standard_normal(np.shape(value)) for key, value in VALUES.items()}
    w = rng.standard_normal((1, N, 3))
    forward = np.sum(pushforward(f, VALUES, v) * w)
    gradient = pullback(f, VALUES, w)
    # Sums of some thousand products of order 1 to 100 in double precision.
    assert forward == pytest.approx(sum(np.sum(gradient[key] * v[key]) for key in VALUES), rel=1e-10)


def corners():
    """Open, closed, beyond open, straight up, level with the plane, no direction at all, and rounding beside these."""
    n = np.array([0.0, 0, 1])
    side = np.array([1.0, 0, 0])
    A = [1, 1, 1 - 1e-7, 1.05, 0, 0, 1e-7, 0.5, 0.5, 0.5, 1, 0.5]
    B = [2 / 3 * n, 2 / 3 * unit(n + 1e-7 * side), 0.66 * n, 0.7 * unit(n + 0.01 * side), 0 * n, 1e-9 * side, 1e-7 * n]
    B += [0.4 * side, 0.5 * n, 0.6 * unit(n + side), 0.5 * side, -0.3 * n]
    inputs = {"A": np.array(A)[None], "B": np.array(B)[None], "normal": np.tile(n, (1, N, 1)), "sh": VALUES["sh"]}
    V = np.zeros((1, N, 9))
    V[..., 0], V[..., 1:4] = inputs["A"] * np.sqrt(np.pi) / 2, inputs["B"][..., [1, 2, 0]] * np.sqrt(3 * np.pi) / 2
    return inputs | {"V": V}


@pytest.mark.parametrize("single", [False, True], ids=["float64", "float32"])
@pytest.mark.parametrize("name", METHODS)
def test_gradients_are_finite_in_all_corners(name, single):
    f = lit(METHODS[name], background=(), single=single)
    gradient = pullback(f, corners(), np.ones((1, N, 3)), single=single)
    for key, g in gradient.items():
        assert np.isfinite(g).all(), key
        # Directions of a length of 1e-9 turn by as much as they are moved; everything else is bounded.
        assert key == "B" or np.abs(g).max() < 1e4, key


def test_albedo_and_irradiance():
    rng = np.random.default_rng(9)
    inputs = {"E": rng.uniform(0, 2, (3, 4, 3)), "rho": rng.uniform(0.1, 0.9, (3, 4, 3))}

    def f(values):
        return gtao.diffuse_radiance(values["E"], values["rho"])

    for key in inputs:
        check(f, inputs, key, [rng.standard_normal((3, 4, 3)) for _ in range(2)])
    grey = inputs | {"rho": inputs["rho"][..., 0]}
    check(f, grey, "rho", [rng.standard_normal((3, 4))])
    check(f, inputs | {"rho": 0.4}, "rho")


def test_from_the_light_back_to_the_depth():
    """Through search, directions and irradiance: a frame's depth, attached before the frame is made."""
    y, x = np.mgrid[:10, :12]
    z = 3 + 0.3 * np.sin(x / 2.1) * np.cos(y / 2.7) + 0.02 * x
    normal = np.tile([0.0, 0.0, 1.0], (10, 12, 1))
    method = gtao.GTAO(radius=1.5, n_slices=2, n_steps=4, directional=True, falloff=None)

    def f(inputs):
        g = gtao.GBuffer(inputs["z"], inputs["normal"], gtao.PerspectiveCamera(12, 10, 1.0), validate=False)
        return gtao.irradiance(inputs["sh"], g, gtao.ambient_occlusion(g, method))

    inputs = {"z": z, "normal": normal, "sh": VALUES["sh"][:9]}
    check(f, inputs, "z", unit_moves(np.ones((10, 12), bool), 12, 4))
    check(f, inputs, "normal", unit_moves(np.ones((10, 12), bool), 6, 4, normal))
    check(f, inputs, "sh", [RNG.standard_normal((9, 3))])
