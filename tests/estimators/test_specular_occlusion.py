"""``gtao.specular_occlusion`` and its kin on frames: definitions, golden values, limits, shapes, refusals, launches."""

import json
from dataclasses import replace

import drjit as dr
import numpy as np
import pytest
from oracles import golden, specular
from oracles import specular_frames as oracle
from oracles.slice_oracle import unit

import gtao
from gtao.data.specular import KINDS, SpecularTable
from gtao.kernels.table_axes import AXES, table_axes

RNG = np.random.default_rng(21)


def random_table(size=(5, 6, 7), channels=1, kind="cone-cone", axes="linear"):
    values = np.random.default_rng(5).uniform(0.1, 1, (*size[::-1], channels)).astype(np.float32)
    return SpecularTable(kind=kind, axes=axes, values=values)


#: Of a surface that there is not.
ENVIRONMENT = random_table((4, 3), 2, "environment-brdf", "root")
METHODS = {
    "table": gtao.ConeTable(table=random_table()),
    "brdf table": gtao.ConeTable(table=random_table((3, 4, 5, 3), 2, "brdf-4d", "lobe"), environment=ENVIRONMENT),
    "flat table": gtao.ConeTable(table=random_table((3, 4, 5), 2, "brdf-3d", "linear"), environment=ENVIRONMENT),
    "deep table": gtao.ConeTable(table=random_table((3, 4, 2, 3, 2), 1, "brdf-5d", "lobe"), aperture="matched"),
    "cones": gtao.ConeCone(),
    "matched cones": gtao.ConeCone(aperture="matched"),
    "tilted cones": gtao.ConeCone(aperture="tilted", u=0.05),
    "smoothstep": gtao.ConeCone(intersection="oat"),
    "drobot": gtao.ConeCone(reflection="drobot"),
    "uludag": gtao.ConeCone(reflection="uludag"),
    "lobe": gtao.ConeLobe(),
    "phong": gtao.ConeLobe(distribution="phong", aperture="matched"),
    "brdf": gtao.ConeBRDF(n_nodes=8),
    "lagarde": gtao.Lagarde2014(),
    "visibility": gtao.VisibilityAsSpecular(),
}
DIRECTIONAL = {name: m for name, m in METHODS.items() if hasattr(m, "aperture")}
each_method = pytest.mark.parametrize("name", METHODS)
each_directional = pytest.mark.parametrize("name", DIRECTIONAL)
CAMERAS = {
    "perspective": gtao.PerspectiveCamera(8, 5, 1.2),
    "orthographic": gtao.OrthographicCamera(8, 5, 2.0),
}
UNIFORM = gtao.GTAO(weighting="uniform", bent_normal=True)


def scene(camera, dtype=np.float64, seed=3, background=(), uniform=False):
    """(g, ao, values) of points that could be: normals toward the viewer, cones about axes that lean away."""
    rng, shape = np.random.default_rng(seed), camera.shape
    v = oracle.view_directions(camera)
    n = unit(v + 0.8 * unit(rng.standard_normal((*shape, 3))))
    A = rng.uniform(0.05, 0.95, shape)
    b = unit(n + 0.5 * rng.standard_normal((*shape, 3)) * np.sqrt(1 - A)[..., None])
    z = np.full(shape, 2.0)
    for pixel in background:
        z[pixel] = np.inf
    g = gtao.GBuffer(z.astype(dtype), n.astype(dtype), camera)
    T = g.types.Tensor
    ao = gtao.AmbientOcclusion(
        visibility=T(A.astype(dtype)),
        mean_direction=T((b * (0.8 * A)[..., None]).astype(dtype)),
        normal_v=g.normal_v,
        config=UNIFORM if uniform else gtao.GTAO(bent_normal=True),
    )
    return g, ao, {"v": v, "n": n, "b": b, "A": A}


def occlusion(name, g, ao, roughness=0.5, **options):
    return gtao.specular_occlusion(ao, g, roughness, method=METHODS.get(name, name), **options).numpy()


def angles(values, aperture, uniform=False):
    """(alpha_v, beta, theta_o) of every pixel."""
    v, n, b, A = (values[k] for k in "vnbA")
    alpha_v = np.array(
        [oracle.aperture(aperture, A[i], n[i], b[i], uniform) for i in np.ndindex(A.shape)], float
    ).reshape(A.shape)
    return alpha_v, oracle.angle(b, oracle.mirrored(v, n)), oracle.angle(n, v)


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
@pytest.mark.parametrize("uniform", [False, True], ids=["cosine", "uniform"])
@pytest.mark.parametrize("aperture", ["seed", "tilted", "matched"])
def test_cones_that_meet(aperture, uniform, camera):
    """Aperture, reflected direction and the angle to it, against quadrature over the reflection cone."""
    g, ao, values = scene(camera, uniform=uniform)
    roughness = RNG.uniform(0.2, 1, camera.shape)
    alpha_v, beta, _ = angles(values, aperture, uniform)
    alpha_s = np.arccos(0.02 ** (roughness**4 / 2))
    want = [specular.cap_share(*x) for x in zip(alpha_v.flat, alpha_s.flat, beta.flat, strict=True)]
    got = occlusion(gtao.ConeCone(aperture=aperture, u=0.02), g, ao, roughness)
    # The quadrature of the oracle has a kink that starts like a root.
    assert got.ravel() == pytest.approx(np.array(want), abs=1e-7)


@pytest.mark.parametrize("distribution", ["ggx", "phong"])
def test_lobes_in_cones(distribution):
    camera = CAMERAS["perspective"]
    g, ao, values = scene(camera)
    roughness = RNG.uniform(0.2, 1, camera.shape)
    alpha_v, beta, _ = angles(values, "seed")
    rows = zip(alpha_v.flat, beta.flat, roughness.flat, strict=True)
    kind = {"ggx": specular.lobe_ggx, "phong": lambda alpha: specular.lobe_phong(2 / alpha**2 - 2)}[distribution]
    want = [specular.cone_lobe(a, b, kind(r * r), r * r) for a, b, r in rows]
    got = occlusion(gtao.ConeLobe(distribution=distribution), g, ao, roughness)
    # What 16 nodes along the rim are good for.
    assert got.ravel() == pytest.approx(np.array(want), abs=2e-5)


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
@pytest.mark.parametrize("aperture", ["seed", "matched"])
def test_a_white_dome_through_a_cone(aperture, camera):
    """Where what is visible is a cone, the occlusion is that of quadrature: for any F0, whatever the azimuth."""
    g, ao, values = scene(camera)
    roughness, f0 = RNG.uniform(0.3, 1, camera.shape), RNG.uniform(0, 1, (*camera.shape, 3))
    f0[0, 0], f0[0, 1] = 0, 1
    alpha_v, beta, theta_o = angles(values, aperture)
    alpha_v = np.minimum(alpha_v, np.pi / 2)
    chi = oracle.azimuth(values["n"], values["v"], values["b"])
    rows = np.stack([alpha_v, beta, chi, roughness**2, theta_o], axis=-1)

    def terms(function, rows):
        return np.moveaxis(np.apply_along_axis(lambda x: function(*x), -1, rows), -1, 0)[..., None]

    (A_V, B_V), (A, B) = terms(specular.cone_brdf, rows), terms(specular.environment_brdf, rows[..., 3:])
    method = gtao.ConeBRDF(aperture=aperture, n_nodes=48)
    reflected = gtao.specular_reflectance(ao, g, roughness, f0, method).numpy()
    # What 48 nodes are good for.
    assert reflected == pytest.approx(f0 * A_V + B_V, abs=1e-5)
    got = occlusion(method, g, ao, roughness, f0=f0)
    assert got == pytest.approx((f0 * A_V + B_V) / (f0 * A + B), abs=1e-4)


def test_golden_lagarde():
    cases = golden.cases("E.lagarde")
    nv, A, roughness = (np.array([i[name] for i, _ in cases]) for name in ("NdotV", "AO", "roughness"))
    want = np.array([o["SO"] for _, o in cases])
    camera = gtao.OrthographicCamera(len(nv), 1, 1.0)
    n = np.stack([np.sqrt(1 - nv**2), 0 * nv, nv], axis=-1)[None]
    g = gtao.GBuffer(np.full((1, len(nv)), 2.0), n, camera)
    ao = gtao.AmbientOcclusion(visibility=g.types.Tensor(A[None]))
    got = gtao.specular_occlusion(ao, g, roughness[None], method=gtao.Lagarde2014()).numpy()[0]
    assert got == pytest.approx(want, abs=golden.FLOAT64_TOLERANCE)


def table_of_kind(kind, axes, channels=1):
    return random_table(tuple(range(3, 3 + KINDS[kind][0])), channels, kind, axes)


TABLES = [(*pair, n) for pair in AXES for n in KINDS[pair[0]][1] if pair[0] != "environment-brdf"]


@pytest.mark.parametrize(("kind", "axes", "channels"), TABLES, ids=["-".join(map(str, t)) for t in TABLES])
def test_tables_are_looked_up(kind, axes, channels):
    """The right angles reach the axes; texels of random numbers are interpolated, scaled and put together."""
    camera = CAMERAS["perspective"]
    g, ao, values = scene(camera)
    roughness, f0 = RNG.uniform(0.2, 1, camera.shape), RNG.uniform(0, 1, camera.shape)
    alpha_v, beta, theta_o = angles(values, "seed")
    chi = oracle.azimuth(values["n"], values["v"], values["b"])
    arguments = {"alpha_v": alpha_v, "beta": beta, "alpha": roughness**2, "theta_o": theta_o, "chi": chi}

    def found(table, arguments=arguments):
        parametrisation = table_axes(table.kind, table.axes)
        lanes = {name: g.types.Float(x.ravel()) for name, x in arguments.items()}
        unit_cube = np.array([np.array(u) for u in parametrisation.to_unit(**lanes)])
        texels = np.array([oracle.interpolated(table.values, u) for u in unit_cube.T])
        return (texels.T * np.ravel(parametrisation.scale(**lanes))).reshape(-1, *camera.shape)

    table, environment = table_of_kind(kind, axes, channels), table_of_kind("environment-brdf", "root", 2)
    method = gtao.ConeTable(table=table, environment=environment, aperture="seed")
    shares, (A, B) = found(table), found(environment)
    whole = f0 * A + B
    if kind == "brdf-3d" and channels == 2:
        # A surface with the bent normal for its normal is seen at the angle β; only the ratio is taken from it.
        A, B = found(environment, arguments | {"theta_o": np.minimum(beta, np.pi / 2)})
        visible = (f0 * A * shares[0] + B * shares[1]) / (f0 * A + B) * whole
    else:
        visible = shares[0] * whole if channels == 1 else f0 * A * shares[0] + B * shares[1]
    assert occlusion(method, g, ao, roughness, f0=f0) == pytest.approx(visible / whole, abs=1e-12)
    got = gtao.specular_reflectance(ao, g, roughness, f0, method).numpy()
    assert got == pytest.approx(visible, abs=1e-12)


@each_method
@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_background_is_open_and_nothing_is_dark(name, camera):
    background = [(0, 0), (3, 5)]
    g, ao, _ = scene(camera, background=background)
    A, B = ao.visibility.numpy().copy(), ao.mean_direction.numpy().copy()
    A[1, 2], B[1, 2] = 0, 0
    for pixel in background:
        A[pixel], B[pixel] = 1, 0
    T = g.types.Tensor
    ao = gtao.AmbientOcclusion(visibility=T(A), mean_direction=T(B), normal_v=g.normal_v)
    for roughness in (0.0, 0.3, 1.0):
        S = occlusion(name, g, ao, roughness)
        assert [S[p] for p in background] == [1, 1]
        assert S[1, 2] == 0
        assert np.isfinite(S).all()
        assert S.min() >= 0
        assert S.max() <= 1


@each_method
@pytest.mark.parametrize("roughness", [0.0, 0.02, 0.5, 1.0])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_estimates_at_and_beyond_their_ends(name, roughness, dtype):
    """Visibility below 0 and above 1, no direction, directions below the surface, normals that face away."""
    camera = gtao.PerspectiveCamera(4, 4, 1.2)
    A = np.repeat([-0.2, 1.0, 1.3, 0.5], 4).reshape(4, 4)
    b = np.tile([[0, 0, 0], [0, 0, 1], [0.5, 0, -0.1], [0.2, 0.3, 0.5]], (4, 1, 1))
    n = np.broadcast_to(unit(np.array([0.3, 0.2, 1])), (4, 4, 3)).copy()
    n[:, 2] = unit(np.array([0.9, 0, -0.3]))
    g = gtao.GBuffer(np.full((4, 4), 2, dtype), n.astype(dtype), camera)
    T = g.types.Tensor
    ao = gtao.AmbientOcclusion(visibility=T(A.astype(dtype)), mean_direction=T(b.astype(dtype)), normal_v=g.normal_v)
    S = occlusion(name, g, ao, roughness)
    assert S.dtype == dtype
    assert np.isfinite(S).all()
    assert ((S >= 0) & (S <= 1)).all()
    assert (S[0] == 0).all()
    inside = gtao.AmbientOcclusion(visibility=T(np.clip(A, 0, 1).astype(dtype)), mean_direction=ao.mean_direction)
    assert np.array_equal(S, occlusion(name, g, inside, roughness))


@each_method
def test_single_precision(name):
    camera = CAMERAS["perspective"]
    wide, narrow = (occlusion(name, *scene(camera, dtype)[:2]) for dtype in (np.float64, np.float32))
    assert wide.dtype == np.float64
    assert narrow.dtype == np.float32
    # Random texels: an angle's rounding times their steepness.
    assert narrow == pytest.approx(wide, abs=5e-5)


def test_uniform_estimates_know_the_cosine_visibility():
    """The same horizons: one uniform estimate with bent normals has both visibilities."""
    y, x = np.mgrid[:18, :24]
    z = 3 + 0.3 * np.sin(x / 2.5) * np.cos(y / 3) + 0.02 * x
    z[2, 3] = np.inf
    g = gtao.GBuffer(z, None, gtao.PerspectiveCamera(24, 18, 1.0))
    method = gtao.GTAO(radius=1.0, n_slices=4, n_steps=6, bent_normal=True)
    cosine = gtao.ambient_occlusion(g, method, frame_index=3)
    uniform = gtao.ambient_occlusion(g, replace(method, weighting="uniform"), frame_index=3)
    assert cosine.cosine_visibility is cosine.visibility
    assert uniform.cosine_visibility.numpy() == pytest.approx(cosine.visibility.numpy(), abs=1e-12)
    assert np.abs(uniform.visibility.numpy() - cosine.visibility.numpy()).max() > 0.05
    for kind in (gtao.Lagarde2014(), gtao.VisibilityAsSpecular()):
        pair = [gtao.specular_occlusion(ao, g, 0.1, method=kind).numpy() for ao in (cosine, uniform)]
        assert pair[0] == pytest.approx(pair[1], abs=1e-12)
    shaped = gtao.ambient_occlusion(g, replace(method, weighting="uniform", power=2.0), frame_index=3)
    assert shaped.cosine_visibility.numpy() == pytest.approx(cosine.visibility.numpy(), abs=1e-12)
    # A floor lifts the visibility of what is closed, not what is known of its directions.
    T = g.types.Tensor
    closed = gtao.AmbientOcclusion(
        visibility=T(np.full((1, 2), 0.1)),
        mean_direction=T(np.zeros((1, 2, 3))),
        normal_v=T(np.tile([0, 0, 1.0], (1, 2, 1))),
        unshaped=T(np.zeros((1, 2))),
        config=UNIFORM,
    )
    assert (closed.cosine_visibility.numpy() == 0).all()
    for unknown in (
        gtao.ambient_occlusion(g, replace(method, weighting="uniform", bent_normal=False)),
        gtao.ambient_occlusion(g, replace(method, weighting="uniform", bent_normal="average_horizon")),
    ):
        assert unknown.cosine_visibility is None


@each_directional
def test_a_cone_without_a_direction_stands_upright(name):
    g, ao, _ = scene(CAMERAS["perspective"])
    nowhere, upright = (
        gtao.AmbientOcclusion(visibility=ao.visibility, mean_direction=B) for B in (0 * ao.mean_direction, g.normal_v)
    )
    assert occlusion(name, g, nowhere) == pytest.approx(occlusion(name, g, upright), abs=1e-9)


@each_method
def test_normals_that_face_away_are_turned_until_they_are_seen_edge_on(name):
    """As the estimators do: the occlusion is that of a frame whose normals are turned already."""
    camera = CAMERAS["perspective"]
    g, ao, values = scene(camera)
    n, v = values["n"].copy(), values["v"]
    n[2] = unit(-0.4 * v[2] + unit(np.cross(v[2], [0.3, 1, 0])))
    cosine = np.sum(n * v, axis=-1, keepdims=True)
    turned = np.where(cosine < 1e-3, unit(n + (1e-3 - cosine) * v), n)
    assert (np.sum(n * turned, axis=-1)[2] < 0.95).all()
    same = {"visibility": ao.visibility, "mean_direction": ao.mean_direction}
    frames = (gtao.GBuffer(g.view_z, normals, camera) for normals in (n, turned))
    found = [occlusion(name, frame, gtao.AmbientOcclusion(**same)) for frame in frames]
    assert found[0] == pytest.approx(found[1], abs=1e-9)


def test_without_reflectance_what_grazes_is_left():
    """F0 = 0: the term B alone; and where that is 0 too, a mirror seen along its normal, the limit of small F0."""
    camera = gtao.OrthographicCamera(4, 1, 1.0)
    n = unit(np.array([[0, 0, 1.0], [0.6, 0, 1], [0, 0, 1], [0.6, 0, 1]]))
    g = gtao.GBuffer(np.full((1, 4), 2.0), n[None], camera)
    T = g.types.Tensor
    ao = gtao.AmbientOcclusion(visibility=T(np.full((1, 4), 0.6)), mean_direction=T(n[None]))
    roughness = np.array([[0, 0, 0.7, 0.7]])
    black, little = (occlusion("brdf", g, ao, roughness, f0=f0)[0] for f0 in (0.0, 1e-12))
    assert black == pytest.approx(little, abs=1e-6)
    assert black[0] == pytest.approx(1, abs=1e-6)


@each_directional
def test_shaped_estimates_have_the_cone_of_their_directions(name):
    g, ao, _ = scene(CAMERAS["perspective"])
    shaped = gtao.AmbientOcclusion(
        visibility=ao.visibility * 0.3, mean_direction=ao.mean_direction, normal_v=g.normal_v, unshaped=ao.visibility
    )
    assert np.array_equal(occlusion(name, g, shaped), occlusion(name, g, ao))


class TestShapes:
    g, ao, _ = scene(CAMERAS["perspective"], background=[(1, 1)])

    @each_method
    def test_reflectances_have_the_channels_of_f0(self, name):
        H, W = self.g.shape
        image = RNG.uniform(0, 1, (H, W, 3))
        for f0, shape in ((0.04, (H, W)), (image[..., 0], (H, W)), (image[0, 0], (H, W, 3)), (image, (H, W, 3))):
            assert occlusion(name, self.g, self.ao, f0=f0).shape == shape

    @each_method
    def test_a_number_is_an_image_of_it(self, name):
        number, image = (occlusion(name, self.g, self.ao, r) for r in (0.4, np.full(self.g.shape, 0.4)))
        assert number == pytest.approx(image, abs=1e-12)


class TestRefusals:
    g, ao, _ = scene(CAMERAS["perspective"])

    def check(self, error, match, *, ao=None, g=None, roughness=0.5, **options):
        with pytest.raises(error, match=match):
            gtao.specular_occlusion(self.ao if ao is None else ao, self.g if g is None else g, roughness, **options)

    def test_estimates_without_directions(self):
        plain = gtao.AmbientOcclusion(visibility=self.ao.visibility)
        for name in DIRECTIONAL:
            self.check(gtao.ConfigError, "bent_normal=True.*Lagarde2014", ao=plain, method=METHODS[name])
        for name in METHODS.keys() - DIRECTIONAL.keys():
            assert np.isfinite(occlusion(name, self.g, plain)).all()

    def test_weightings_without_an_aperture(self):
        bitmask = gtao.VisibilityBitmask(weighting="angle", thickness=None)
        angle = gtao.AmbientOcclusion(
            visibility=self.ao.visibility, mean_direction=self.ao.mean_direction, config=bitmask
        )
        assert angle.cosine_visibility is None
        for name in DIRECTIONAL:
            self.check(gtao.ConfigError, "not 'angle'", ao=angle, method=METHODS[name])

    @pytest.mark.parametrize("value", [-0.1, 1.01, np.nan, np.full((5, 8), 2.0)])
    def test_numbers_outside_of_the_unit_interval(self, value):
        self.check(gtao.ShapeError, r"roughness must be in \[0, 1\]", roughness=value, method=gtao.Lagarde2014())
        self.check(gtao.ShapeError, r"f0 must be in \[0, 1\]", f0=value, method=gtao.Lagarde2014())

    @pytest.mark.parametrize("value", [np.ones((8, 5)), np.ones(4), "rough", None, True])
    def test_other_shapes(self, value):
        self.check(gtao.ShapeError, "roughness must be a number", roughness=value, method=gtao.Lagarde2014())
        self.check(gtao.ShapeError, "f0 must be a number", f0=value, method=gtao.Lagarde2014())

    def test_things_of_the_wrong_kind(self):
        self.check(gtao.ConfigError, "method must be one of gtao.ConeTable", method=gtao.GTAO())
        self.check(gtao.ConfigError, "ao must be", ao=self.ao.visibility)
        self.check(gtao.ConfigError, "g must be", g=self.ao)
        other = scene(gtao.PerspectiveCamera(4, 4, 1.0))[0]
        self.check(gtao.ShapeError, "pass its own frame", g=other)
        with pytest.raises(gtao.ConfigError, match="g must be"):
            gtao.environment_brdf(self.ao, 0.5)

    def test_options_that_there_are_not(self):
        with pytest.raises(gtao.ConfigError, match="aperture must be one of 'seed', 'tilted', 'matched'"):
            gtao.ConeCone(aperture="wide")
        with pytest.raises(gtao.ConfigError, match="u must lie between"):
            gtao.ConeCone(u=1.0)
        with pytest.raises(gtao.ConfigError, match="intersection"):
            gtao.ConeCone(intersection="lens")
        for n in (3, 65, 8.0):
            with pytest.raises(gtao.ConfigError, match="n_nodes must be an integer from 4 to 64"):
                gtao.ConeBRDF(n_nodes=n)
        with pytest.raises(gtao.ConfigError, match="distribution"):
            gtao.ConeLobe(distribution="beckmann")
        with pytest.raises(gtao.ConfigError, match="reflection"):
            gtao.ConeCone(reflection="mirror")
        with pytest.raises(gtao.ConfigError, match="table must be None"):
            gtao.ConeTable(table=np.ones((3, 3, 3, 1)))
        with pytest.raises(gtao.ConfigError, match="table must be of another kind"):
            gtao.ConeTable(table=random_table((4, 4), 2, "environment-brdf"))
        with pytest.raises(gtao.ConfigError, match="environment must be of another kind"):
            gtao.ConeTable(environment=random_table())

    def test_tables_of_another_make(self):
        method = gtao.ConeTable(table=random_table(axes="diagonal"))
        self.check(gtao.ConfigError, "axes 'diagonal' of a table 'cone-cone' are not known", method=method)
        # It has a kind too.
        method = gtao.ConeTable(table=CAMERAS["perspective"])
        self.check(gtao.ConfigError, "table must be None or a SpecularTable, got PerspectiveCamera", method=method)
        values = np.full((3, 3, 3, 1), np.nan)
        method = gtao.ConeTable(table=SpecularTable(kind="cone-cone", axes="linear", values=values))
        self.check(gtao.ShapeError, "values of the table 'cone-cone' must be finite", method=method)


@pytest.mark.parametrize("method", [m for m in METHODS.values() if getattr(m, "table", None) is None])
def test_plain_values_and_back(method):
    assert gtao.method_from_dict(json.loads(json.dumps(method.to_dict()))) == method


def test_of_a_table_plain_values_tell_what_it_is():
    described = METHODS["table"].to_dict()
    assert json.loads(json.dumps(described))["table"]["kind"] == "cone-cone"
    with pytest.raises(gtao.ConfigError, match="SpecularTable"):
        gtao.method_from_dict(described)


def kernels(work):
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        work()
        dr.sync_thread()
        return [k for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT and k["size"] >= 1000]


@each_method
def test_one_kernel_over_the_image(name):
    g, ao, _ = scene(gtao.PerspectiveCamera(50, 40, 1.2), np.float32)
    dr.eval(ao.planes("mean_direction").arrays, g.normal_v)
    METHODS[name] and occlusion(name, g, ao)
    assert len(kernels(lambda: dr.eval(gtao.specular_occlusion(ao, g, 0.5, method=METHODS[name])))) == 1
    # Another roughness is another number for the same kernel.
    again = kernels(lambda: dr.eval(gtao.specular_occlusion(ao, g, 0.6, method=METHODS[name])))
    assert [k["cache_hit"] for k in again] == [True]


@each_method
def test_two_runs_are_the_same_bits(name):
    g, ao, _ = scene(gtao.PerspectiveCamera(50, 40, 1.2), np.float32)
    assert np.array_equal(occlusion(name, g, ao), occlusion(name, g, ao))


def test_a_table_is_uploaded_once():
    g, ao, _ = scene(CAMERAS["perspective"])
    table = random_table()
    method = gtao.ConeTable(table=table)
    first = occlusion(method, g, ao)
    table.values[:] = 0
    assert np.array_equal(occlusion(method, g, ao), first)


#: A table's values must be an argument, as everything that a recording depends on: one table stands for all.
RECORDED = [name for name in METHODS if name not in ("brdf", "brdf table", "flat table", "deep table")]


@pytest.mark.parametrize("name", RECORDED)
def test_frozen(name):
    camera = gtao.PerspectiveCamera(12, 10, 1.2)

    def reflected(n, A, B, roughness, texels):
        g = gtao.GBuffer(dr.full(type(A), 2, A.shape), n, camera, validate=False)
        method = METHODS[name]
        if name == "table":
            method = gtao.ConeTable(table=SpecularTable(kind="cone-cone", axes="linear", values=texels))
        ao = gtao.AmbientOcclusion(visibility=A, mean_direction=B)
        return gtao.specular_occlusion(ao, g, roughness, method=method)

    frozen, found = dr.freeze(reflected), []
    for seed in (1, 2):
        g, ao, _ = scene(camera, np.float32, seed)
        T = g.types.Tensor
        rng = np.random.default_rng(seed)
        roughness, texels = (T(np.float32(rng.uniform(0, 1, shape))) for shape in (camera.shape, (4, 3, 5, 1)))
        inputs = [dr.opaque(T(x)) for x in (g.normal_v, ao.visibility, ao.mean_direction, roughness, texels)]
        found.append(frozen(*inputs).numpy())
        assert np.array_equal(found[-1], reflected(*inputs).numpy())
    assert frozen.n_recordings == 1
    assert np.abs(found[0] - found[1]).max() > 0.01


def test_what_cannot_be_recorded():
    g, ao, _ = scene(CAMERAS["perspective"])

    @dr.freeze
    def reflected(A):
        with pytest.raises(gtao.ShapeError, match="the values of the table 'cone-cone' must be a Dr"):
            gtao.specular_occlusion(ao, g, A, method=METHODS["table"])
        with pytest.raises(gtao.ConfigError, match="ConeBRDF cannot be recorded"):
            gtao.specular_occlusion(ao, g, A, method=METHODS["brdf"])
        return A + 1

    reflected(ao.visibility)
