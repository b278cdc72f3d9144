"""The two ground truths of a depth buffer through the public door: options, noise, refusals."""

import ast
import math
from dataclasses import replace
from pathlib import Path

import drjit as dr
import numpy as np
import pytest
from analytic._frames import frame
from oracles import fields

import gtao

FIELD = fields.in_perspective(fields.waves(0.3, 5.0), size=24, slope=(0.3, -0.2))
RADIUS = 0.8
METHODS = [gtao.HeightfieldRayMarch, gtao.HeightfieldHorizon]
TRUTHS = ["ray_march", "ray_path", "strata", "dense_horizon", "blocked_angles", "direction_nodes", "open_directions"]


def run(g, method, frame_index=0):
    ao = gtao.ambient_occlusion(g, method, frame_index=frame_index)
    variance = None if ao.variance is None else ao.variance.numpy().astype(np.float64)
    return ao.visibility.numpy().astype(np.float64), variance


@pytest.mark.parametrize("kind", METHODS)
def test_types_and_shapes(kind):
    for dtype in (np.float32, np.float64):
        ao = gtao.ambient_occlusion(frame(FIELD, dtype), kind(radius=RADIUS))
        assert ao.visibility.numpy().dtype == dtype
        assert ao.visibility.shape == (24, 24)
        assert ao.config == kind(radius=RADIUS)
        assert ao.mean_direction is None
        assert ao.visibility_sh is None
        if kind is gtao.HeightfieldRayMarch:
            assert ao.variance.shape == (24, 24)
            assert ao.variance.numpy().dtype == dtype
        else:
            assert ao.variance is None


@pytest.mark.parametrize("kind", METHODS)
def test_single_precision_decides_as_double_does(kind):
    """Both see the same random numbers; a direction that grazes may go either way."""
    single, double = (run(frame(FIELD, t), kind(radius=RADIUS))[0] for t in (np.float32, np.float64))
    assert np.mean(single != pytest.approx(double, abs=1e-5)) < 0.01 or np.mean(np.abs(single - double)) < 1e-5


@pytest.mark.parametrize("kind", METHODS)
def test_seed_and_frame_select_the_noise(kind):
    g = frame(FIELD)
    first, again = (run(g, kind(radius=RADIUS, seed=4), 2)[0] for _ in "ab")
    assert np.array_equal(first, again)
    for other in (run(g, kind(radius=RADIUS, seed=5), 2)[0], run(g, kind(radius=RADIUS, seed=4), 3)[0]):
        assert np.mean(first != other) > 0.3
        assert first.mean() == pytest.approx(other.mean(), abs=0.01)


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
@pytest.mark.parametrize("counts", [(2, 1), (8, 4), (16, 3)])
def test_the_variance_is_that_of_repetitions(counts, weighting):
    """Unbiased: over 40 runs of 576 pixels the two mean variances differ by chance only, below 2 %."""
    g = frame(FIELD)
    options = {"radius": RADIUS, "weighting": weighting, "n_directions": counts[0], "rays_per_direction": counts[1]}
    runs = [run(g, gtao.HeightfieldRayMarch(seed=s, **options)) for s in range(40)]
    values, variances = (np.array(v) for v in zip(*runs, strict=True))
    assert variances.mean() == pytest.approx(values.var(axis=0, ddof=1).mean(), rel=0.04)


def test_stratified_rays_are_better_than_independent_ones():
    """Independent rays have the variance p (1 - p) / N. Of strata only those that a silhouette crosses count, a share
    that falls like their width: sixteen times the rays halve it, or better."""
    shares = []
    for n in (8, 32):
        v, variance = run(frame(FIELD), gtao.HeightfieldRayMarch(radius=RADIUS, n_directions=n, rays_per_direction=n))
        shares.append(variance.mean() / (np.mean(v * (1 - v)) / n**2))
    assert shares[0] < 0.7
    assert shares[1] < shares[0] / 2


def test_more_rays_leave_less_noise_and_the_same_mean():
    g = frame(FIELD)
    (few, few_variance), (many, many_variance) = (
        run(g, gtao.HeightfieldRayMarch(radius=RADIUS, n_directions=n, rays_per_direction=n)) for n in (4, 32)
    )
    # 64 times the rays, and better stratified.
    assert many_variance.mean() < few_variance.mean() / 128
    assert few.mean() == pytest.approx(many.mean(), abs=4 * np.sqrt(few_variance.mean() / few.size))


def test_nodes_and_slices_take_the_noise_away():
    """Nodes alone are not enough, nor are slices: each has its own share. Together they go below 1e-3."""
    g = frame(FIELD)

    def noise(**options):
        a, b = (run(g, gtao.HeightfieldHorizon(radius=RADIUS, seed=s, **options))[0] for s in (0, 1))
        return np.sqrt(np.mean((a - b) ** 2) / 2)

    coarse = noise(n_slices=4)
    assert noise(n_slices=32) < coarse / 3
    assert noise(n_slices=4, n_nodes=512) < coarse
    assert noise(n_slices=256, n_nodes=512) < 2e-4


@pytest.mark.parametrize(("radius", "factor"), [(math.inf, 4), (3.0, 2)])
def test_shorter_steps_change_little_and_converge(radius, factor):
    """Angles along a piece of surface bend less the shorter it is, but near the rim of the sphere by its root."""
    g = frame(FIELD, np.float64)
    method = gtao.HeightfieldHorizon(radius=radius, n_slices=16, n_nodes=1024)
    images = [run(g, replace(method, steps_per_pixel=s))[0] for s in (1.0, 4.0, 16.0, 64.0)]
    errors = [np.mean(np.abs(image - images[-1])) for image in images[:-1]]
    assert errors[0] < 1e-4
    assert errors[1] < errors[0] / factor
    assert errors[2] < errors[1] / factor


def test_sampled_rays_converge_to_followed_ones():
    g = frame(FIELD)
    options = {"radius": RADIUS, "n_directions": 16, "rays_per_direction": 8}
    exact, _ = run(g, gtao.HeightfieldRayMarch(**options))
    sampled = [run(g, gtao.HeightfieldRayMarch(n_steps=n, **options))[0] for n in (2, 8, 32, 256)]
    errors = [np.mean(image - exact) for image in sampled]
    # What a ray passes between two samples is missed, so fewer steps are brighter.
    assert errors == sorted(errors, reverse=True)
    assert errors[0] > 0.005
    assert 0 <= errors[-1] < 1e-3


@pytest.mark.parametrize("fetch", ["linear", "nearest"])
def test_sampled_rays_read_what_the_fetch_says(fetch):
    g = frame(FIELD)
    options = {"radius": RADIUS, "n_directions": 16, "rays_per_direction": 8, "fetch": fetch}
    exact, _ = run(g, gtao.HeightfieldRayMarch(**options))
    sampled, _ = run(g, gtao.HeightfieldRayMarch(n_steps=256, **options))
    assert np.mean(sampled - exact) == pytest.approx(0, abs=2e-3)


@pytest.mark.parametrize("kind", METHODS)
def test_visibility_grows_as_the_radius_shrinks(kind):
    means = [run(frame(FIELD), kind(radius=r))[0].mean() for r in (math.inf, 1.0, 0.3, 0.05, 1e-3)]
    assert means == sorted(means)
    assert means[0] < 0.97
    # What is left is the cells' own slope beside that of the normals.
    assert means[-1] > 0.99


@pytest.mark.parametrize("kind", METHODS)
def test_the_background_is_open_and_certain(kind):
    view_z = FIELD.view_z.copy()
    view_z[:, 12:] = np.inf
    field = fields.Field(view_z, FIELD.normal_v, FIELD.camera, orthographic=False)
    v, variance = run(frame(field), kind())
    assert (v[:, 12:] == 1).all()
    assert np.isfinite(v).all()
    assert variance is None or (variance[:, 12:] == 0).all()


@pytest.mark.parametrize("kind", METHODS)
def test_normals_that_face_into_the_solid_see_nothing(kind):
    """But for what the cells' own slope leaves of the hemisphere, beside that of the normals."""
    field = fields.Field(FIELD.view_z, -FIELD.normal_v, FIELD.camera, orthographic=False)
    values = run(frame(field), kind(radius=RADIUS))[0]
    assert values.mean() < 0.02
    assert values.max() < 0.2


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (5, 1), (2, 2)])
@pytest.mark.parametrize("fetch", ["nearest", "linear"])
@pytest.mark.parametrize("orthographic", [False, True], ids=["perspective", "orthographic"])
@pytest.mark.parametrize("kind", METHODS)
def test_tiny_images(kind, shape, fetch, orthographic):
    """A wall that faces the camera is open."""
    height, width = shape
    camera = gtao.OrthographicCamera(width, height, 1.0) if orthographic else gtao.PerspectiveCamera(width, height, 0.5)
    normal = np.tile(np.float32([0, 0, 1]), (*shape, 1))
    g = gtao.GBuffer(np.full(shape, 2.0, np.float32), normal, camera)
    for radius in (0.5, math.inf):
        assert run(g, kind(radius=radius, fetch=fetch))[0] == pytest.approx(np.ones(shape), abs=1e-4)


@pytest.mark.parametrize("attached", ["view_z", "normal_v"])
@pytest.mark.parametrize("kind", METHODS)
def test_gradients_are_refused_in_words(kind, attached):
    g = frame(FIELD)
    inputs = {"view_z": type(g.view_z)(g.view_z), "normal_v": type(g.view_z)(g.normal_v)}
    dr.enable_grad(inputs[attached])
    g = gtao.GBuffer(inputs["view_z"], inputs["normal_v"], g.camera)
    with pytest.raises(gtao.ConfigError, match=f"{kind.__name__} has no gradients"):
        gtao.ambient_occlusion(g, kind())


@pytest.mark.parametrize(
    ("kind", "options", "message"),
    [
        (gtao.HeightfieldRayMarch, {"n_directions": 7}, "n_directions must be even"),
        (gtao.HeightfieldRayMarch, {"n_directions": 0}, "n_directions must be an integer from 2"),
        (gtao.HeightfieldRayMarch, {"rays_per_direction": 0}, "rays_per_direction"),
        (gtao.HeightfieldRayMarch, {"n_steps": 0}, "n_steps must be an integer from 1"),
        (gtao.HeightfieldRayMarch, {"n_steps": 2.0}, "n_steps"),
        (gtao.HeightfieldHorizon, {"n_slices": 0}, "n_slices"),
        (gtao.HeightfieldHorizon, {"n_nodes": 100}, "n_nodes must be a multiple of 64"),
        (gtao.HeightfieldHorizon, {"steps_per_pixel": 0.5}, r"steps_per_pixel must lie in \[1, 64\]"),
        *((kind, {"radius": -1.0}, "radius must be positive") for kind in METHODS),
        *((kind, {"weighting": "solid"}, "weighting must be one of 'cosine', 'uniform'") for kind in METHODS),
        *((kind, {"fetch": "floor"}, "fetch must be one of 'linear', 'nearest'") for kind in METHODS),
        *((kind, {"seed": -1}, "seed") for kind in METHODS),
    ],
)
def test_wrong_options(kind, options, message):
    with pytest.raises(gtao.ConfigError, match=message):
        kind(**options)


@pytest.mark.parametrize(
    "method",
    [
        gtao.HeightfieldRayMarch(radius=2.0, n_steps=8, fetch="nearest"),
        gtao.HeightfieldHorizon(n_nodes=128, weighting="uniform", seed=3),
    ],
)
def test_configurations_survive_being_written(method):
    assert gtao.method_from_dict(method.to_dict()) == method


@pytest.mark.parametrize("kind", METHODS)
def test_values_change_without_recompiling(kind):
    def hashes(method, camera_shift=0.0):
        camera = FIELD.camera | {"cx": FIELD.camera["cx"] + camera_shift}
        g = frame(fields.Field(FIELD.view_z, FIELD.normal_v, camera, orthographic=False))
        # The field of depth edges is made once per frame, by kernels of its own.
        g.affine_field()
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            run(g, method)
            history = dr.kernel_history()
        return {k["hash"] for k in history if k["type"] is dr.KernelType.JIT}

    base = hashes(kind(radius=1.0))
    assert hashes(kind(radius=0.7, seed=9), camera_shift=2.5) == base
    assert hashes(kind(radius=1.0, weighting="uniform")) != base


@pytest.mark.parametrize("module", TRUTHS)
def test_a_truth_shares_nothing_with_what_it_judges(module):
    """It knows the surface between texels and random numbers; no horizons, no arcs, no slices, no march."""
    path = Path(gtao.__file__).parent / "kernels" / f"{module}.py"
    imported = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            imported |= {node.module} if node.module else {alias.name for alias in node.names}
    assert imported <= {*TRUTHS, "depth_bounds", "depth_cells", "noise"}


def test_visibility_and_variance_come_from_one_march():
    g = frame(FIELD)
    ao = gtao.ambient_occlusion(g, gtao.HeightfieldRayMarch())
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        ao.visibility.numpy(), ao.variance.numpy()
        assert not [k for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]


@pytest.mark.cuda
@pytest.mark.parametrize("kind", METHODS)
def test_the_gpu_decides_as_the_processor_does(kind):
    from drjit.cuda.ad import TensorXf as OnGpu
    from drjit.llvm.ad import TensorXf as OnCpu

    g = frame(FIELD)
    depth, normal = FIELD.view_z.astype(np.float32), FIELD.normal_v.astype(np.float32)
    images = [run(gtao.GBuffer(T(depth), T(normal), g.camera), kind(radius=RADIUS))[0] for T in (OnGpu, OnCpu)]
    assert np.mean(np.abs(images[0] - images[1])) < 1e-4
