"""``gtao.TemporalFilter`` on whole frames: against loops from the definition, and what it promises of sequences."""

import copy
import gc
import json
from dataclasses import asdict, replace

import numpy as np
import pytest
from oracles import fields
from oracles import temporal as oracle
from scipy.spatial.transform import Rotation

import gtao

import drjit as dr  # isort: skip  (after gtao, which chooses the LLVM library)

HEIGHT, WIDTH = 14, 17
CAMERA = gtao.PerspectiveCamera(WIDTH, HEIGHT, fx=19.0, fy=17.0, cx=8.1, cy=7.4)
PARALLEL = gtao.OrthographicCamera(WIDTH, HEIGHT, 3.0)
STILL = np.zeros((HEIGHT, WIDTH, 3))
# A hundred roundings in double precision of numbers of order one, divided by thresholds of a tenth.
EXACT = 1e-11


def terrain(seed=0, holes=True):
    rng = np.random.default_rng(seed)
    z = fields.in_perspective(fields.gaussians(0.3, 0.4, seed=4), size=WIDTH, slope=(0.4, -0.2)).view_z[:HEIGHT]
    z = z * (1 + 0.01 * rng.random(z.shape))
    z[:, 9:] *= 1.15
    if holes:
        z[2:4, 3:6] = z[-1, -1] = np.inf
    return z


def everywhere(x, y, z=0.0):
    return np.broadcast_to([x, y, z], STILL.shape).copy()


def frame(z, motion=None, pose=None, camera=CAMERA):
    return gtao.GBuffer(z, None, camera, motion=motion, view_to_world=pose)


def images_of(z, seed, directions=True):
    rng, surface = np.random.default_rng(seed), np.isfinite(z)
    found = {"visibility": np.where(surface, rng.random(z.shape), 1.0)}
    if directions:
        found["mean_direction"] = np.where(surface[..., None], rng.standard_normal((*z.shape, 3)), 0.0)
        found["visibility_sh"] = np.where(surface[..., None], rng.standard_normal((*z.shape, 9)), 0.0)
        found["unshaped"] = np.where(surface, rng.random(z.shape), 1.0)
    return found


def estimate(g, images):
    tensors = {name: g.types.Tensor(np.ascontiguousarray(image)) for name, image in images.items()}
    return gtao.AmbientOcclusion(**tensors, normal_v=g.normal_v, config=gtao.GTAO())


def arrays(ao, names):
    return {name: getattr(ao, name).numpy().copy() for name in names}


def pose(rotation_vector=(0, 0, 0), position=(0, 0, 0)):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = Rotation.from_rotvec(rotation_vector).as_matrix(), position
    return matrix


OPTIONS = {
    "defaults": {},
    "no clamp": {"clamp": False},
    "no velocity weight": {"velocity_weighting": False, "clamp_window": 0.1},
    "tight window": {"clamp_window": 0.0},
    "window of deviations": {"clamp_window": 0.1, "deviation_window": 0.4},
    "no slopes": {"derivatives": "none"},
    "covering": {"covering": 0.05, "disocclusion": 0.2},
    "creases": {"crease": 0.6, "clamp": False},
    "short": {"frames": 3.0, "moving_frames": 2.0, "moving_speed_px": 2.0, "clamp": False},
}
MOTIONS = {
    "nothing": lambda rng: STILL,
    "whole pixels": lambda rng: everywhere(2.0, -1.0),
    "a share of a pixel": lambda rng: everywhere(0.3, 0.6, 0.02),
    "every pixel its own": lambda rng: rng.uniform(-3, 3, STILL.shape) * [1, 1, 0.05],
    "out of the frame": lambda rng: everywhere(0.25 * WIDTH, 2.0**20),
}


@pytest.mark.parametrize("orthographic", [False, True], ids=["perspective", "parallel"])
@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)
def test_three_frames_against_the_definition(options, motion, orthographic):
    rng = np.random.default_rng(3)
    temporal, history, state = gtao.TemporalFilter(**options), gtao.History(), None
    o = oracle.Options(**options, orthographic=orthographic)
    for k in range(3):
        z, moved = terrain(seed=k), motion(rng)
        images = images_of(z, seed=10 + k)
        g = frame(z, moved, camera=PARALLEL if orthographic else CAMERA)
        result = temporal.step(estimate(g, images), g, history)
        state = oracle.step(images, z, moved, state, o, g.normal_v.numpy())
        for name, want in state.images.items():
            np.testing.assert_allclose(getattr(result, name).numpy(), want, atol=EXACT, err_msg=f"{name} of {k}")
        np.testing.assert_allclose(history.count.numpy(), state.count, rtol=1e-10)
    assert history.frame_index == 3
    # Some of the history was used, but for what comes from outside.
    assert (history.count.numpy().max() > 1.2) == (motion is not MOTIONS["out of the frame"])


def test_options_are_those_of_the_definition():
    """The oracle has no default of its own that could hide one of the filter's."""
    want = {k: v for k, v in asdict(oracle.Options()).items() if k not in ("orthographic", "turn")}
    assert {k: v for k, v in gtao.TemporalFilter().to_dict().items() if k != "type"} == want


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"frames": 0.5}, "frames must be at least 1"),
        ({"moving_frames": np.nan}, "moving_frames must be at least 1"),
        ({"frames": 4.0}, "moving_frames must not exceed frames, got 8.0 and 4.0; give both"),
        ({"disocclusion": 0.0}, "disocclusion must be positive and finite"),
        ({"disocclusion": np.inf}, "disocclusion must be positive and finite"),
        ({"covering": -1.0}, "covering must be positive, got"),
        ({"moving_speed_px": 0}, "moving_speed_px must be positive, got"),
        ({"velocity_scale_px": np.inf}, "velocity_scale_px must be positive and finite"),
        ({"clamp_window": -0.1}, "clamp_window must be finite and not negative"),
        ({"deviation_window": np.nan}, "deviation_window must be finite and not negative"),
        ({"clamp": 1}, "clamp must be True or False"),
        ({"crease": 0.0}, "crease must be None or an angle from 0.01 to pi"),
        ({"crease": 4.0}, "crease must be None or an angle from 0.01 to pi"),
        ({"velocity_weighting": None}, "velocity_weighting must be True or False"),
        ({"derivatives": "second"}, "derivatives must be one of 'none', 'first'"),
    ],
)
def test_options_out_of_range_are_refused(wrong, message):
    with pytest.raises(gtao.ConfigError, match=message):
        gtao.TemporalFilter(**wrong)


def test_configurations_come_back_from_plain_values():
    for f in (gtao.TemporalFilter.as_published(), gtao.TemporalFilter(frames=np.inf, covering=0.1, clamp=False)):
        text = gtao.io.canonical_json(f.to_dict())
        assert gtao.method_from_dict(gtao.io.with_infinities(json.loads(text))) == f
    differing = gtao.config.deviations(gtao.TemporalFilter.as_published())
    assert [d.label for d in differing] == ["derivatives = none"]
    # The numbers are those of a search; what it is about is stricter depth, in both directions, and another window.
    differing = {d.option: d.value for d in gtao.config.deviations(gtao.TemporalFilter.recommended())}
    assert differing.keys() == {"disocclusion", "covering", "crease", "clamp_window", "deviation_window"}
    assert differing["disocclusion"] < gtao.TemporalFilter().disocclusion
    assert differing["covering"] < np.inf
    assert differing["deviation_window"] > 0


def world_frame(camera, view_to_world, plane):
    """Depth of a plane n·X = d of the world, and what each pixel shows of it."""
    y, x = np.mgrid[: camera.height, : camera.width] + 0.5
    rays = np.stack([(x - camera.cx) / camera.fx, (camera.cy - y) / camera.fy, -np.ones_like(x)], axis=-1)
    n, d = np.asarray(plane[:3]), plane[3]
    turn, place = view_to_world[:3, :3], view_to_world[:3, 3]
    t = (d - n @ place) / (rays @ turn.T @ n)
    z = np.where(t > 0, t, np.inf)
    with np.errstate(invalid="ignore"):
        points = place + (rays @ turn.T) * z[..., None]
    return z, points


PATHS = {
    "translation": [pose(position=(0.05 * k, 0.02 * k, 0)) for k in range(6)],
    "dolly": [pose(position=(0, 0, -0.1 * k)) for k in range(6)],
    "turn": [pose((0.01 * k, 0.02 * k, 0.015 * k)) for k in range(6)],
    "orbit": [pose((0, 0.02 * k, 0), (0.05 * k, 0, 0.01 * k)) for k in range(6)],
}


@pytest.mark.parametrize("path", PATHS.values(), ids=PATHS)
def test_a_linear_function_of_the_world_follows_the_camera(path):
    """Bilinear interpolation of an image that is affine in a plane's 1/z is exact: no drift along any path."""
    camera = gtao.PerspectiveCamera(40, 30, 0.9)
    # A plane facing the first camera, in whose pixels X and Y are nearly affine; rotated little, they stay so.
    temporal, history = gtao.TemporalFilter(clamp=False, frames=np.inf, moving_frames=np.inf), gtao.History()
    for view_to_world in path:
        z, points = world_frame(camera, view_to_world, (0, 0, 1, -3.0))
        image = 0.5 + points[..., :2] @ [0.1, 0.2]
        g = frame(z, pose=view_to_world, camera=camera)
        result = temporal.step(estimate(g, {"visibility": image}), g, history).visibility.numpy()
    inside = (slice(8, -8), slice(8, -8))
    # Curvature of X and Y over a pixel, where the camera turns, over five steps.
    assert np.abs(result - image)[inside].max() < 1e-4
    assert np.abs(history.count.numpy()[inside] - 6).max() < 0.1
    # Without motion it would be far off.
    first = 0.5 + world_frame(camera, path[0], (0, 0, 1, -3.0))[1][..., :2] @ [0.1, 0.2]
    assert np.abs(first - image).max() > 0.02


def test_motion_of_poses_is_camera_motion():
    path, results = PATHS["orbit"], []
    for given in (False, True):
        temporal, history = gtao.TemporalFilter(), gtao.History()
        for k, view_to_world in enumerate(path):
            z = terrain(seed=k)
            g = frame(z, pose=view_to_world)
            if given and k:
                g = g.with_motion(gtao.camera_motion(g, CAMERA, path[k - 1]))
            elif given:
                g = g.with_motion(STILL)
            result = temporal.step(estimate(g, images_of(z, seed=k)), g, history)
        results.append(arrays(result, ("visibility", "mean_direction", "visibility_sh")))
    for name in results[0]:
        np.testing.assert_allclose(results[0][name], results[1][name], atol=EXACT)


@pytest.mark.parametrize("kind", ["turn", "orbit"])
def test_directions_turn_with_the_camera(kind):
    """A world that shines the same everywhere: what is accumulated in turned frames is that of this frame."""
    rng = np.random.default_rng(5)
    world, sh = rng.standard_normal(3), rng.standard_normal(9)
    temporal, history = gtao.TemporalFilter(clamp=False), gtao.History()
    for view_to_world in PATHS[kind]:
        turn = view_to_world[:3, :3]
        z = np.full((HEIGHT, WIDTH), 50.0)
        g = frame(z, pose=view_to_world)
        images = {
            "visibility": np.full(z.shape, 0.5),
            "mean_direction": np.broadcast_to(world @ turn, (*z.shape, 3)),
            "visibility_sh": oracle.turned(np.broadcast_to(sh, (*z.shape, 9)), turn.T),
        }
        result = temporal.step(estimate(g, images), g, history)
    assert history.count.numpy().max() > 5
    np.testing.assert_allclose(result.mean_direction.numpy(), images["mean_direction"], atol=EXACT)
    np.testing.assert_allclose(result.visibility_sh.numpy(), images["visibility_sh"], atol=EXACT)


def test_normals_turn_with_the_camera():
    """A wall that is seen from camera to camera keeps its history however far they turn in all; without poses not."""
    counts = []
    for posed in (True, False):
        temporal, history, before = gtao.TemporalFilter(clamp=False, crease=0.05), gtao.History(), None
        for k in range(6):
            view_to_world = pose((0.0, 0.04 * k, 0.0))
            z, points = world_frame(CAMERA, view_to_world, (0, 0, 1, -3.0))
            normal = np.broadcast_to(np.array([0.0, 0.0, 1.0]) @ view_to_world[:3, :3], points.shape)
            g = gtao.GBuffer(z, normal, CAMERA, view_to_world=view_to_world)
            if not posed:
                moved = gtao.camera_motion(g, CAMERA, before) if k else STILL
                g = gtao.GBuffer(z, normal, CAMERA, motion=moved)
            temporal.step(estimate(g, {"visibility": np.full(z.shape, 0.5)}), g, history)
            before = view_to_world
        counts.append(history.count.numpy()[HEIGHT // 2, WIDTH // 2])
    assert counts[0] > 5.9
    # 0.04 of 0.05 rad are trusted by 1 - (0.04 / 0.05)², a third, from each frame to the next.
    assert counts[1] < 2


def test_nothing_crosses_a_crease():
    """Floor and wall of equal depth at the crease, seen by a camera that moves along: depth alone cannot tell them."""
    x = np.arange(WIDTH) + 0.5
    z = np.broadcast_to(3 + 0.05 * np.abs(x - 8), (HEIGHT, WIDTH))
    image = np.broadcast_to(np.where(x < 8, 0.2, 0.8), z.shape)
    slope = np.where(x < 8, 0.5, -0.5)
    normal = np.stack([slope, np.zeros(WIDTH), np.ones(WIDTH)], axis=-1) / np.sqrt(1.25)
    normal = np.broadcast_to(normal, (HEIGHT, WIDTH, 3))
    worst = {}
    for crease in (None, 0.3):
        temporal, history = gtao.TemporalFilter(clamp=False, crease=crease), gtao.History()
        for k in range(8):
            # Half a pixel to and fro: the history is interpolated between both sides of the crease.
            motion = everywhere(0.5 * (-1) ** k, 0.0) if k else STILL
            g = gtao.GBuffer(z, normal, CAMERA, motion=motion)
            result = temporal.step(estimate(g, {"visibility": image}), g, history).visibility.numpy()
        worst[crease] = np.abs(result - image)[:, 4:12].max()
    assert worst[None] > 0.1
    assert worst[0.3] < 1e-12


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_camera_at_rest_gives_the_mean_of_its_frames(dtype):
    temporal, history, frames = gtao.TemporalFilter(frames=100.0, clamp=False), gtao.History(), []
    z = terrain().astype(dtype)
    surface = np.isfinite(z)
    for k in range(60):
        g = frame(z, pose=pose((0.3, 0.2, 0.1), (1, 2, 3)))
        frames.append({name: image.astype(dtype) for name, image in images_of(z, seed=k).items()})
        result = temporal.step(estimate(g, frames[-1]), g, history)
    for name in frames[0]:
        want = np.mean([f[name].astype(np.float64) for f in frames], axis=0)
        np.testing.assert_allclose(getattr(result, name).numpy(), want, atol=1e-6)
    np.testing.assert_allclose(history.count.numpy()[surface], 60, rtol=1e-5)
    assert (history.count.numpy()[~surface] == 0).all()


def test_from_then_on_an_exponential_mean():
    temporal, history, want = gtao.TemporalFilter(frames=5.0, moving_frames=5.0, clamp=False), gtao.History(), None
    z = np.full((HEIGHT, WIDTH), 2.0)
    for k in range(20):
        image = np.random.default_rng(k).random(z.shape)
        want = image if want is None else want + (image - want) / min(k + 1, 5)
        g = frame(z)
        result = temporal.step(estimate(g, {"visibility": image}), g, history)
    np.testing.assert_allclose(result.visibility.numpy(), want, atol=EXACT)


def test_noise_does_not_call_the_clamp_where_its_window_is_as_wide():
    """White noise around one value at rest: the slides' clamp brings back what the mean has taken away."""
    z, flicker = np.full((24, 24), 2.0), {}
    camera = gtao.PerspectiveCamera(24, 24, 0.9)
    for name, temporal in (
        ("slides", gtao.TemporalFilter()),
        ("deviations", gtao.TemporalFilter(clamp_window=0.0, deviation_window=1.0)),
    ):
        history, results = gtao.History(), []
        for k in range(64):
            image = 0.5 + 0.05 * np.random.default_rng(k).standard_normal(z.shape)
            g = frame(z, camera=camera)
            results.append(temporal.step(estimate(g, {"visibility": image}), g, history).visibility.numpy())
        flicker[name] = np.std(results[32:], axis=0).mean()
    # Of a mean of 47 frames' weight, whose noise is 0.05 / √47, nothing else is left.
    assert flicker["deviations"] < 1.3 * 0.05 / np.sqrt(47)
    assert flicker["slides"] > 1.5 * flicker["deviations"]
    # A change of three deviations of the noise in all of the image still gets through at once.
    g = frame(z, camera=camera)
    after = temporal.step(estimate(g, {"visibility": np.full(z.shape, 0.9)}), g, history).visibility.numpy()
    assert after.min() > 0.8


def test_a_surface_that_was_hidden_starts_anew():
    """Disocclusion: a near square at rest goes away; what lies behind has not been seen."""
    far, near = np.full((HEIGHT, WIDTH), 3.0), np.full((HEIGHT, WIDTH), 3.0)
    near[4:9, 5:11] = 2.0
    temporal, history = gtao.TemporalFilter(), gtao.History()
    for z, value in ((near, 0.0), (far, 1.0)):
        g = frame(z)
        result = temporal.step(estimate(g, {"visibility": np.full(z.shape, value)}), g, history)
    hidden = near < 3
    assert (result.visibility.numpy()[hidden] == 1).all()
    assert (history.count.numpy()[hidden] == 1).all()
    assert (history.count.numpy()[~hidden] == 2).all()


@pytest.mark.parametrize(("covering", "share"), [(np.inf, 0.5), (0.1, 0.0)])
def test_what_comes_in_front_keeps_the_history_unless_it_is_to_be_rejected(covering, share):
    """The slides test one direction only: a surface that now lies in front takes over what was seen behind it."""
    far, near = np.full((HEIGHT, WIDTH), 3.0), np.full((HEIGHT, WIDTH), 2.0)
    temporal, history = gtao.TemporalFilter(covering=covering, clamp=False), gtao.History()
    for z, value in ((far, 0.0), (near, 1.0)):
        g = frame(z)
        result = temporal.step(estimate(g, {"visibility": np.full(z.shape, value)}), g, history)
    np.testing.assert_allclose(result.visibility.numpy(), 1 - share, atol=EXACT)


def grazing_floor(derivatives, n_frames=24):
    """Depth of a floor half a unit below a camera that has walked over it, and how many frames are kept of it."""
    camera, step = gtao.PerspectiveCamera(64, 48, 1.0), np.array([0.03, 0.0, -0.04])
    temporal = gtao.TemporalFilter(derivatives=derivatives, clamp=False, frames=np.inf, moving_frames=np.inf)
    history = gtao.History()
    for k in range(n_frames):
        z, _ = world_frame(camera, pose(position=k * step), (0, 1, 0, -0.5))
        g = gtao.GBuffer(z.astype(np.float32), None, camera, view_to_world=pose(position=k * step))
        temporal.step(estimate(g, {"visibility": np.ones(z.shape, np.float32)}), g, history)
    seen = np.isfinite(z)
    # Rows near the bottom and columns at the sides came into view on the way.
    seen[-10:], seen[:, :10], seen[:, -10:] = False, False, False
    return z[seen], history.count.numpy()[seen]


def test_a_grazing_floor_keeps_its_history():
    z, count = grazing_floor("first")
    # Up to the row below the horizon, which lies three times as far as the next one.
    assert z.max() > 40
    assert count.min() > 23.9
    # Where slopes count as disocclusions, each step drops half of what is nearer.
    assert grazing_floor("none")[1].min() < 10


def test_history_comes_back_where_nothing_was_kept():
    """Texels that enter the frame, and those that showed the background, begin with one frame."""
    z = np.full((HEIGHT, WIDTH), 2.0)
    open_, temporal, history = z.copy(), gtao.TemporalFilter(), gtao.History()
    open_[3:6] = np.inf
    motion = everywhere(-1.0, 0.0)
    for depth in (open_, z):
        g = frame(depth, motion)
        temporal.step(estimate(g, {"visibility": np.where(np.isfinite(depth), 0.5, 1)}), g, history)
    want = np.full(z.shape, 2.0)
    want[3:6] = want[:, -1] = 1
    assert np.array_equal(history.count.numpy(), want)


def test_the_background_is_1_and_never_read():
    z = terrain()
    surface, results = np.isfinite(z), []
    for poison in (1.0, 1e6):
        temporal, history = gtao.TemporalFilter(), gtao.History()
        for k in range(3):
            images = {
                name: np.where(surface.reshape(*z.shape, *[1] * (v.ndim - 2)), v, poison)
                for name, v in images_of(z, seed=k).items()
            }
            g = frame(z, everywhere(0.4, 0.3))
            result = temporal.step(estimate(g, images), g, history)
        results.append(arrays(result, images))
    for name in images:
        assert np.array_equal(results[0][name], results[1][name])
        assert (results[0][name][~surface] == (1 if results[0][name].ndim == 2 else 0)).all()


def test_what_is_not_finite_stays_in_its_frame():
    z, broken = np.full((HEIGHT, WIDTH), 2.0), (5, 6)
    temporal, history = gtao.TemporalFilter(), gtao.History()
    for k in range(3):
        images = images_of(z, seed=k)
        for name in images if k == 1 else ():
            images[name][broken] = np.nan if name != "visibility" else np.inf
        g = frame(z, everywhere(0.5, 0.5))
        result = arrays(temporal.step(estimate(g, images), g, history), images)
        finite = np.ones(z.shape, bool)
        finite[broken] = k != 1
        assert all(np.isfinite(image[finite]).all() for image in result.values())
        assert (history.count.numpy()[~finite] == 0).all()
    assert np.isfinite(history.visibility.numpy()).all()


def test_the_first_frame_is_the_estimate_itself():
    z = terrain()
    g = frame(z)
    ao, history = estimate(g, images_of(z, 0)), gtao.History()
    assert gtao.TemporalFilter().step(ao, g) is ao
    assert history.is_empty
    assert gtao.TemporalFilter().step(ao, g, history) is ao
    assert (history.frame_index, history.shape, history.is_empty) == (1, (HEIGHT, WIDTH), False)
    surface = np.isfinite(z)
    assert np.array_equal(history.visibility.numpy()[surface], ao.visibility.numpy()[surface])
    history.reset()
    assert (history.frame_index, history.shape, history.is_empty, history.count) == (0, None, True, None)


def test_nobody_writes_into_the_history_through_a_result():
    z, history = np.full((HEIGHT, WIDTH), 2.0), gtao.History()
    for k in range(2):
        g = frame(z)
        result = gtao.TemporalFilter().step(estimate(g, images_of(z, k)), g, history)
        kept = history.visibility.numpy().copy()
        result.visibility.numpy()[:] = 7
        history.visibility.numpy()[:] = 7
        assert np.array_equal(history.visibility.numpy(), kept)


def test_errors_leave_the_history_as_it_was():
    z, history, temporal = terrain(), gtao.History(), gtao.TemporalFilter()
    g = frame(z)
    ao = estimate(g, images_of(z, 0))
    temporal.step(ao, g, history)
    before = copy.copy(history)
    smaller = g.crop(0, 0, 8, 6)
    with pytest.raises(gtao.ShapeError, match=r"17x14 pixels, this one has 8x6; call history\.reset\(\)"):
        temporal.step(ao.crop(0, 0, 8, 6), smaller, history)
    with pytest.raises(gtao.ShapeError, match="pass its own frame"):
        temporal.step(ao, smaller, history)
    plain = estimate(g, images_of(z, 0, directions=False))
    with pytest.raises(gtao.ConfigError, match=r"holds visibility, mean_direction.*the estimate visibility; call"):
        temporal.step(plain, g, history)
    with pytest.raises(gtao.ConfigError, match=r"must be a gtao\.History, got dict"):
        temporal.step(ao, g, {})
    assert (history.contents, history.frame_index) == (before.contents, 1)
    history.reset()
    temporal.step(ao.crop(0, 0, 8, 6), smaller, history)
    assert history.shape == (6, 8)


def test_a_history_is_not_frozen():
    """What dr.freeze recorded would be replayed with the history of the first frame."""
    z, history = np.full((HEIGHT, WIDTH), 2.0), gtao.History()
    view_z, image = (dr.opaque(dr.tensor_t(gtao.backend.default_float())(v)) for v in (z, z / 4))

    @dr.freeze
    def step(view_z, image, history):
        g = gtao.GBuffer(view_z, None, CAMERA, validate=False)
        return gtao.TemporalFilter().step(gtao.AmbientOcclusion(visibility=image), g, history).visibility

    assert np.array_equal(step(view_z, image, None).numpy(), z / 4)
    with pytest.raises(RuntimeError) as caught:
        step(view_z, image, history)
    assert isinstance(caught.value.__cause__, gtao.ConfigError)
    assert history.is_empty


def test_a_copy_is_a_state_to_come_back_to():
    z, history, results = terrain(), gtao.History(), []
    g = frame(z)
    gtao.TemporalFilter().step(estimate(g, images_of(z, 0)), g, history)
    for branch in (copy.copy(history), history):
        result = gtao.TemporalFilter().step(estimate(g, images_of(z, 1)), g, branch)
        results.append(result.visibility.numpy())
        assert branch.frame_index == 2
    assert np.array_equal(*results)


def test_one_kernel_per_step_and_no_new_one():
    history, hashes = gtao.History(), []
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        z = terrain().astype(np.float32)
        for k in range(6):
            g = frame(z, pose=pose((0.01 * k, 0, 0), (0.02 * k, 0, 0)))
            ao = estimate(g, {"visibility": images_of(z, k)["visibility"].astype(np.float32)})
            options = {"frames": 20.0 + k, "clamp_window": 0.1 * k, "disocclusion": 0.1 + 0.01 * k}
            # Where NumPy's memory lies would be part of the kernel.
            ao = replace(ao, visibility=dr.opaque(ao.visibility))
            dr.eval(g.mask, g.normal_v)
            dr.sync_thread()
            dr.kernel_history_clear()
            gtao.TemporalFilter(**options).step(ao, g, history)
            dr.sync_thread()
            hashes.append([e["hash"] for e in dr.kernel_history() if e["type"] is dr.KernelType.JIT])
    assert [len(found) for found in hashes] == [1] * 6
    # The first frame, the second, before which nothing moved, and all others.
    assert len({found[0] for found in hashes[2:]}) == 1


def n_variables():
    """Arrays that Dr.Jit holds, evaluated or not."""
    lines = (line.split() for line in dr.whos(True).splitlines())
    return sum(len(words) > 2 and words[0].isdigit() for words in lines)


def test_memory_stays_over_two_hundred_frames():
    temporal, history, used, watermarks = gtao.TemporalFilter(), gtao.History(), [], []
    camera, z = gtao.PerspectiveCamera(8, 6, 0.9), np.full((6, 8), 2.0, np.float32)
    image = np.random.default_rng(0).random(z.shape, np.float32)
    for k in range(200):
        g = frame(z, camera=camera, pose=pose((0.001 * k, 0, 0), (0, 0, 0.001 * k)))
        temporal.step(estimate(g, {"visibility": image}), g, history)
        if k % 20 == 9:
            gc.collect()
            dr.sync_thread()
            used.append(n_variables())
            watermarks.append(dr.detail.malloc_watermark(dr.backend_v(g.view_z)))
            dr.detail.malloc_clear_statistics()
    assert used[0] > 5
    assert set(used) == {used[0]}
    assert max(watermarks[1:]) == min(watermarks[1:]) > 0
    assert history.frame_index == 200
