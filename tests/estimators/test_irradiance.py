"""``gtao.irradiance`` and ``gtao.diffuse_radiance`` on frames: golden values, limits, shapes, refusals, launches."""

import importlib.util
import json

import drjit as dr
import numpy as np
import pytest
from oracles import golden, harmonics
from oracles.slice_oracle import unit

import gtao
from gtao.kernels.sh import CLAMPED_COSINE

METHODS = [
    gtao.SliceMoments(),
    gtao.SliceMoments(order=4),
    gtao.MomentZH(),
    gtao.MomentZH(order=4),
    gtao.ConeSH(),
    gtao.ConeSH(aperture="matched", order=4),
    gtao.ClippedCone(),
    gtao.ClippedCone(aperture="seed", order=3),
    gtao.ClippedCone(order=4),
    gtao.TripleProduct(),
    gtao.TripleProduct(order=4),
    gtao.BentNormalIrradiance(),
    gtao.BentNormalIrradiance(order=4),
    gtao.OcclusionTimesIrradiance(),
    gtao.OcclusionTimesIrradiance(order=4),
]
GOLDEN = {
    "ao_times_irradiance": gtao.OcclusionTimesIrradiance(),
    "bent_normal": gtao.BentNormalIrradiance(),
    "zh_cone_n_is_b": gtao.ConeSH(),
    "coupled_cone_seed_alpha": gtao.ClippedCone(aperture="seed"),
    "coupled_cone_matched_alpha": gtao.ClippedCone(aperture="matched"),
    "triple_product_l2": gtao.TripleProduct(),
    "moment_zh": gtao.MomentZH(),
}
RNG = np.random.default_rng(8)
SH = RNG.standard_normal((25, 3))
NAMES = [f"{type(m).__name__}{m.order}" for m in METHODS]
each_method = pytest.mark.parametrize("method", METHODS, ids=[f"{i}-{n}" for i, n in enumerate(NAMES)])


def frame(normals, dtype=np.float64, background=()):
    """A frame of one row with these normals; the pixels ``background`` show none."""
    z = np.full((1, len(normals)), 2.0, dtype)
    z[0, list(background)] = np.inf
    camera = gtao.OrthographicCamera(len(normals), 1, 1.0)
    return gtao.GBuffer(z, np.asarray(normals, dtype)[None], camera)


def estimate(g, A, B, v=None, config=None):
    T, dtype = g.types.Tensor, g.view_z.numpy().dtype
    A, B, v = (None if a is None else T(np.asarray(a, dtype)[None]) for a in (A, B, v))
    return gtao.AmbientOcclusion(visibility=A, mean_direction=B, visibility_sh=v, normal_v=g.normal_v, config=config)


def random_estimate(n=40, dtype=np.float64, seed=3, background=()):
    """(g, ao) of points that could be: A and |B| of some cone, B within the normal's hemisphere, any harmonics."""
    rng = np.random.default_rng(seed)
    normals = unit(rng.standard_normal((n, 3)))
    A = rng.uniform(0.05, 1, n)
    b = unit(normals + 0.5 * rng.standard_normal((n, 3)) * np.sqrt(1 - A)[:, None])
    B = b * (A * rng.uniform(0.67, 0.98, n))[:, None]
    g = frame(normals, dtype, background)
    return g, estimate(g, A, B, rng.standard_normal((n, 9)))


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_radiance_golden(dtype):
    cases = golden.cases("C.radiance")
    n = np.array([unit(i["n"]) for i, _ in cases])
    B = np.array([unit(i["b"]) * i["m1_len"] / np.pi for i, _ in cases])
    g = frame(n, dtype)
    ao = estimate(g, [i["A"] for i, _ in cases], B)
    tolerance = golden.FLOAT64_TOLERANCE if dtype is np.float64 else golden.FLOAT32_TOLERANCE
    sh = np.transpose([i["env"] for i, _ in cases])
    for name, method in GOLDEN.items():
        radiance = gtao.diffuse_radiance(gtao.irradiance(sh, g, ao, method), 1.0).numpy()[0]
        want = [o[name] for _, o in cases]
        # The lights of the cases are the channels: case k is pixel k in channel k.
        assert np.diagonal(radiance) == pytest.approx(want, abs=tolerance), name


def test_slice_moments_are_a_scalar_product():
    g, ao = random_estimate()
    got = gtao.irradiance(SH, g, ao).numpy()
    assert got == pytest.approx(ao.visibility_sh.numpy() @ SH[:9], abs=1e-12)


@each_method
def test_open_surfaces_are_lit_like_any(method):
    """A = 1, B = 2/3 N and the harmonics of the clamped cosine: the irradiance of Ramamoorthi and Hanrahan."""
    normals = unit(RNG.standard_normal((20, 3)))
    g = frame(normals)
    bands = method.order + 1
    kernel = np.repeat(CLAMPED_COSINE, 2 * np.arange(5) + 1) * harmonics.basis(normals, 4)
    ao = estimate(g, np.ones(20), 2 / 3 * normals, kernel[:, :9])
    got = gtao.irradiance(SH, g, ao, method).numpy()[0]
    want = kernel[:, : bands**2] @ SH[: bands**2]
    if isinstance(method, gtao.TripleProduct):
        # A hemisphere cut to a few bands is none: the product is wrong by up to a fourth even here.
        assert 0.01 < np.abs(got - want).max() < 0.4 * np.abs(want).max()
    else:
        # The equivalent cone's aperture hangs on a root near 0: √ of the last digit.
        assert got == pytest.approx(want, abs=1e-7)


@each_method
def test_black_surfaces_and_background_are_black(method):
    g, ao = random_estimate(n=6, background=[1, 4])
    dark = np.zeros((1, 6), bool)
    dark[0, 2] = True
    A, B, v = (t.numpy().copy() for t in (ao.visibility, ao.mean_direction, ao.visibility_sh))
    A[dark], B[dark], v[dark] = 0, 0, 0
    # What an estimate has on the background.
    A[0, [1, 4]], B[0, [1, 4]], v[0, [1, 4]] = 1, 0, 0
    E = gtao.irradiance(SH, g, estimate(g, A[0], B[0], v[0]), method).numpy()[0]
    assert (E[[1, 4]] == 0).all()
    assert E[2] == pytest.approx(np.zeros(3), abs=1e-7)
    assert np.isfinite(E).all()
    assert (E[[0, 3, 5]] != 0).all()


@each_method
def test_shapes_bands_and_channels(method):
    """One channel is a grey light; bands above the method's are not looked at, and missing ones are 0."""
    g, ao = random_estimate()
    E = gtao.irradiance(SH, g, ao, method)
    assert tuple(E.shape) == (1, 40, 3)
    grey = gtao.irradiance(SH[:, 1], g, ao, method)
    assert tuple(grey.shape) == (1, 40)
    assert grey.numpy() == pytest.approx(E.numpy()[..., 1], abs=1e-12)
    assert tuple(gtao.irradiance(SH[:, :1], g, ao, method).shape) == (1, 40, 1)
    five = gtao.irradiance(np.tile(SH[:, :1], (1, 5)), g, ao, method)
    assert tuple(five.shape) == (1, 40, 5)
    used = SH[: (method.order + 1) ** 2]
    assert np.array_equal(gtao.irradiance(used, g, ao, method).numpy(), E.numpy())
    for n in (1, 4, 9):
        padded = np.zeros((25, 3))
        padded[:n] = SH[:n]
        short, long = (gtao.irradiance(s, g, ao, method).numpy() for s in (SH[:n], padded))
        assert short == pytest.approx(long, abs=1e-12)


@each_method
def test_single_precision(method):
    wide, narrow = (gtao.irradiance(SH, *random_estimate(dtype=t), method).numpy() for t in (np.float64, np.float32))
    assert narrow.dtype == np.float32
    assert wide.dtype == np.float64
    # Sums of up to 25 coefficients of order 1.
    assert narrow == pytest.approx(wide, abs=5e-5)


def test_lights_of_all_kinds_of_arrays():
    g, ao = random_estimate()
    want = gtao.irradiance(SH, g, ao).numpy()
    lights = [SH.astype(np.float32), np.asfortranarray(SH), g.types.Tensor(SH)]
    if importlib.util.find_spec("torch"):
        import torch

        lights.append(torch.tensor(SH))
    for light in lights:
        assert gtao.irradiance(light, g, ao).numpy() == pytest.approx(want, abs=1e-5)
    single = random_estimate(dtype=np.float32)
    assert gtao.irradiance(SH, *single).numpy().dtype == np.float32


def test_the_length_of_the_mean_direction_matters_to_moments_only():
    g, ao = random_estimate()
    shorter = replace_images(ao, mean_direction=ao.mean_direction * 0.9)
    for method in METHODS:
        a, b = (gtao.irradiance(SH, g, x, method).numpy() for x in (ao, shorter))
        if isinstance(method, gtao.MomentZH):
            assert np.abs(a - b).max() > 0.01
        else:
            assert a == pytest.approx(b, abs=1e-12)


def replace_images(ao, **images):
    values = {
        name: getattr(ao, name) for name in ("visibility", "mean_direction", "visibility_sh", "normal_v", "config")
    }
    return gtao.AmbientOcclusion(**(values | images))


@pytest.mark.parametrize("method", [gtao.ConeSH(), gtao.ClippedCone(aperture="seed"), gtao.TripleProduct()])
def test_uniform_weighting_opens_cones_by_solid_angle(method):
    """cos α = 1 - A: the cone of visibility 1 - cos α about the normal is that of visibility sin² α with cosine."""
    normals = unit(RNG.standard_normal((10, 3)))
    alpha = np.linspace(0.1, 1.5, 10)
    g = frame(normals)
    uniform = estimate(g, 1 - np.cos(alpha), normals, config=gtao.GTAO(weighting="uniform"))
    cosine = estimate(g, np.sin(alpha) ** 2, normals, config=gtao.GTAO())
    got, want = (gtao.irradiance(SH, g, ao, method).numpy() for ao in (uniform, cosine))
    assert got == pytest.approx(want, abs=1e-9)


def test_a_matched_cone_that_stands_for_its_own_normal_is_at_most_a_hemisphere():
    """More visibility than a hemisphere about the bent normal leaves above the true plane: a hemisphere, dimmed."""
    beta, A = np.array([0.5, 0.8, 1.2]), 0.97
    assert np.max(1 + np.cos(beta)) < 2 * A
    g = frame(np.tile([0, 0, 1.0], (3, 1)))
    ao = estimate(g, np.full(3, A), 0.6 * np.stack([np.sin(beta), 0 * beta, np.cos(beta)], axis=-1))
    pair = gtao.ConeSH(aperture="matched", order=4), gtao.BentNormalIrradiance(order=4)
    got, want = (gtao.irradiance(SH, g, ao, method).numpy() for method in pair)
    assert got == pytest.approx(want, abs=1e-12)


class TestRefusals:
    g, ao = random_estimate(n=4)

    def check(self, error, match, *, sh=SH, g=None, ao=None, method=None):
        with pytest.raises(error, match=match):
            gtao.irradiance(sh, self.g if g is None else g, self.ao if ao is None else ao, method)

    @each_method
    def test_estimates_without_directions(self, method):
        plain = replace_images(self.ao, mean_direction=None, visibility_sh=None)
        if isinstance(method, gtao.OcclusionTimesIrradiance):
            assert np.isfinite(gtao.irradiance(SH, self.g, plain, method).numpy()).all()
            return
        need = "directional=True" if isinstance(method, gtao.SliceMoments) else "bent_normal=True"
        self.check(gtao.ConfigError, need, ao=plain, method=method)

    def test_moments_of_another_weighting(self):
        uniform = replace_images(self.ao, config=gtao.GTAO(weighting="uniform"))
        for method in (gtao.SliceMoments(), gtao.MomentZH()):
            self.check(gtao.ConfigError, "weighting='cosine'", ao=uniform, method=method)
        for kind in (gtao.ConeSH, gtao.ClippedCone):
            self.check(gtao.ConfigError, "aperture='seed'", ao=uniform, method=kind(aperture="matched"))
        angle = replace_images(self.ao, config=gtao.VisibilityBitmask(weighting="angle", thickness=None))
        self.check(gtao.ConfigError, "not 'angle'", ao=angle, method=gtao.TripleProduct())

    def test_the_length_of_average_horizons(self):
        average = replace_images(self.ao, config=gtao.GTAO(bent_normal="average_horizon"))
        self.check(gtao.ConfigError, "average_horizon", ao=average, method=gtao.MomentZH())
        assert np.isfinite(gtao.irradiance(SH, self.g, average, gtao.ClippedCone()).numpy()).all()

    @pytest.mark.parametrize("shape", [(8,), (36, 3), (9, 3, 1), (), (9, 0), (0,)])
    def test_lights_of_other_shapes(self, shape):
        self.check(gtao.ShapeError, r"n = 1, 4, 9, 16 or 25", sh=np.zeros(shape))

    def test_lights_that_are_no_numbers(self):
        self.check(gtao.ShapeError, "finite", sh=np.full((9, 3), np.nan))
        self.check(gtao.ShapeError, "got list", sh=[1.0])
        self.check(gtao.ShapeError, "real numbers", sh=np.array(["a"] * 9))

    def test_things_of_the_wrong_kind(self):
        self.check(gtao.ConfigError, "method must be one of gtao.SliceMoments", method=gtao.GTAO())
        self.check(gtao.ConfigError, "ao must be", ao=self.ao.visibility)
        self.check(gtao.ConfigError, "g must be", g=self.ao)
        self.check(gtao.ShapeError, "pass its own frame", g=frame(np.tile([0, 0, 1.0], (5, 1))))

    @pytest.mark.parametrize("order", [-1, 5, 2.0, True])
    def test_orders_that_there_are_not(self, order):
        for kind in {type(m) for m in METHODS}:
            with pytest.raises(gtao.ConfigError, match="order"):
                kind(order=order)

    def test_apertures_that_there_are_not(self):
        for kind in (gtao.ConeSH, gtao.ClippedCone):
            with pytest.raises(gtao.ConfigError, match="aperture must be one of 'seed', 'matched'"):
                kind(aperture="wide")


@each_method
def test_plain_values_and_back(method):
    assert gtao.method_from_dict(json.loads(json.dumps(method.to_dict()))) == method


def kernels(work):
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        work()
        dr.sync_thread()
        return [k for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT and k["size"] >= 1000]


@each_method
def test_one_kernel_over_the_image(method):
    g, ao = random_estimate(n=1000, dtype=np.float32)
    dr.eval(ao.visibility, ao.planes("mean_direction").arrays, ao.planes("visibility_sh").arrays, g.normal_v)
    assert len(kernels(lambda: dr.eval(gtao.irradiance(SH, g, ao, method)))) == 1
    # Other lights are other numbers for the same kernel.
    again = kernels(lambda: dr.eval(gtao.irradiance(2 * SH, g, ao, method)))
    assert [k["cache_hit"] for k in again] == [True]


@each_method
def test_two_runs_are_the_same_bits(method):
    g, ao = random_estimate(n=1000, dtype=np.float32)
    a, b = (gtao.irradiance(SH, g, ao, method).numpy().copy() for _ in range(2))
    assert np.array_equal(a, b)


def test_gradients_of_the_light_need_one_kernel():
    g, ao = random_estimate(n=1000, dtype=np.float32)
    dr.eval(ao.planes("visibility_sh").arrays)
    light = g.types.Tensor(SH.astype(np.float32))

    def work():
        dr.enable_grad(light)
        dr.backward(gtao.irradiance(light, g, ao).array)
        dr.eval(dr.grad(light))

    assert len(kernels(work)) <= 2


class TestEstimates:
    """With the estimates of a frame, from the search to the light."""

    @staticmethod
    def scene(dtype=np.float64):
        y, x = np.mgrid[:18, :24]
        z = 3 + 0.3 * np.sin(x / 2.5) * np.cos(y / 3) + 0.02 * x
        z[2, 3] = np.inf
        return gtao.GBuffer(z.astype(dtype), None, gtao.PerspectiveCamera(24, 18, 1.0))

    def test_directional_estimates_light_up(self):
        g = self.scene()
        ao = gtao.ambient_occlusion(g, gtao.GTAO(radius=1.0, n_slices=4, n_steps=6, directional=True))
        want = ao.visibility_sh.numpy() @ SH[:9]
        assert gtao.irradiance(SH, g, ao).numpy() == pytest.approx(want, abs=1e-12)
        sky = np.array([np.sqrt(4 * np.pi)])
        surface = np.isfinite(g.view_z.numpy())
        # A constant sky of radiance 1: π A by every method that is made for it.
        for method in (gtao.SliceMoments(), gtao.MomentZH(), gtao.ConeSH(), gtao.OcclusionTimesIrradiance()):
            lit = gtao.irradiance(sky, g, ao, method).numpy()
            assert lit == pytest.approx(np.where(surface, np.pi * ao.visibility.numpy(), 0), abs=1e-12)

    def test_the_estimate_is_evaluated_once(self):
        g = self.scene(np.float32)
        ao = gtao.ambient_occlusion(g, gtao.GTAO(radius=1.0, n_slices=2, n_steps=4, directional=True))
        dr.eval(gtao.irradiance(SH, g, ao))
        assert ao.visibility.array.state is dr.VarState.Evaluated
        assert all(a.state is dr.VarState.Evaluated for a in ao.planes("mean_direction").arrays)

    def test_filtered_estimates(self):
        g = self.scene()
        ao = gtao.ambient_occlusion(g, gtao.GTAO(radius=1.0, n_slices=2, n_steps=4, directional=True))
        smooth = gtao.denoise(ao, g, gtao.PlaneAwareFilter())
        for method in METHODS:
            assert np.isfinite(gtao.irradiance(SH, g, smooth, method).numpy()).all()


class TestDiffuseRadiance:
    E = RNG.uniform(0, 3, (4, 5, 3))
    rho = RNG.uniform(0, 1, (4, 5, 3))

    def test_albedo_over_pi(self):
        for albedo in (0.5, self.rho, self.rho[..., 0], np.float64(0.3)):
            wide = albedo[..., None] if np.ndim(albedo) == 2 else albedo
            assert gtao.diffuse_radiance(self.E, albedo).numpy() == pytest.approx(self.E * wide / np.pi, abs=1e-12)
        grey = self.E[..., 0]
        assert gtao.diffuse_radiance(grey, 0.2).numpy() == pytest.approx(grey * 0.2 / np.pi, abs=1e-12)
        assert gtao.diffuse_radiance(grey, self.rho[..., 1]).numpy() == pytest.approx(
            grey * self.rho[..., 1] / np.pi, abs=1e-12
        )
        coloured = gtao.diffuse_radiance(grey, self.rho).numpy()
        assert coloured == pytest.approx(grey[..., None] * self.rho / np.pi, abs=1e-12)

    @pytest.mark.parametrize("albedo", [1.2, -0.1, np.full((4, 5), 1.5), np.full((4, 5, 3), np.nan)])
    def test_albedos_outside_the_unit_interval(self, albedo):
        with pytest.raises(gtao.ShapeError, match=r"\[0, 1\]"):
            gtao.diffuse_radiance(self.E, albedo)

    def test_other_shapes(self):
        for albedo in (np.ones((5, 4, 3)), np.ones((4, 5, 2)), np.ones(3)):
            with pytest.raises(gtao.ShapeError, match="albedo must be a number"):
                gtao.diffuse_radiance(self.E, albedo)
        with pytest.raises(gtao.ShapeError, match="irradiance must be"):
            gtao.diffuse_radiance(np.ones(3), 0.5)
        with pytest.raises(gtao.ShapeError, match="array or a number"):
            gtao.diffuse_radiance(self.E, "grey")
