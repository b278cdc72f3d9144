"""The embedded animations: what they are said to be, and what they have to show."""

import inspect

import numpy as np
import pytest

from gtao import ConfigError, SceneError, render
from gtao.render import animations

NAMES = ("still", "orbit", "fast_rotation", "cut", "passing_object", "thin_bars", "waves")


def frame_of(name, index, size=64, **options):
    (frame,) = render.sequence(animations.build(name, width=size, height=size), range(index, index + 1), **options)
    return frame


def speed(frame):
    return np.hypot(*np.moveaxis(frame.g.motion.numpy()[..., :2], -1, 0))


def test_names():
    assert animations.names() == NAMES
    for name in NAMES:
        info = animations.get(name)
        assert info.name == name
        assert info.function is getattr(animations, name)
        assert info.description
        assert "\n" not in info.description
        assert list(inspect.signature(info.function).parameters)[:2] == ["width", "height"]


@pytest.mark.parametrize("name", NAMES)
def test_what_is_said_of_them_is_so(name):
    info = animations.get(name)
    built = animations.build(name, width=30, height=20, reflectance=0.7)
    for key in ("name", "description", "radius", "n_frames", "cut", "static_camera", "static_scene"):
        assert getattr(built, key) == getattr(info, key), key
    frame = next(iter(render.sequence(built)))
    assert frame.g.shape == (20, 30)
    assert frame.moving.numpy().any() != info.static_scene
    np.testing.assert_allclose(frame.g.albedo.numpy()[frame.g.mask.numpy()], 0.7, atol=1e-6)
    poses = [built.state(i).camera for i in range(info.n_frames)]
    assert (poses[0] is None) == info.static_camera
    assert len({str(pose) for pose in poses}) == (1 if info.static_camera else 2 if info.cut else info.n_frames)


@pytest.mark.parametrize("name", NAMES)
def test_they_show_occlusion_in_every_frame(name):
    n = animations.get(name).n_frames
    for index in (0, n // 2, n - 1):
        frame = frame_of(name, index, size=48, truth_spp=64)
        surface = frame.g.mask.numpy()
        visibility = frame.truth.mean.numpy()[surface]
        assert surface.mean() > 0.6
        assert 0.6 < visibility.mean() < 0.93
        assert (visibility < 0.6).mean() > 0.02


def test_other_names_and_parameters():
    for ask in (animations.get, animations.build):
        with pytest.raises(SceneError, match=r"no embedded animation 'pan'; there are: still, orbit, .*waves"):
            ask("pan")
    with pytest.raises(ConfigError, match="animation 'orbit' has no parameter 'speed'; it has: width, height"):
        animations.build("orbit", speed=2)
    with pytest.raises(ConfigError, match="width must be"):
        animations.build("orbit", width=0)


def test_the_same_call_makes_the_same_frames():
    a, b = (frame_of("fast_rotation", 11, size=32, truth_spp=8) for _ in range(2))
    np.testing.assert_array_equal(a.truth.mean.numpy(), b.truth.mean.numpy())
    np.testing.assert_array_equal(a.g.motion.numpy(), b.g.motion.numpy())


def test_an_orbit_is_slow():
    for index in (1, 40, 71):
        frame = frame_of("orbit", index, size=256)
        values = speed(frame)[frame.g.mask.numpy()]
        assert values.max() < 3
        assert np.median(values) > 0.5


def test_a_fast_rotation_is_fast():
    for index in (1, 30):
        frame = frame_of("fast_rotation", index, size=128)
        # Of every pixel but those few about the axis in the lowest rows.
        assert np.quantile(speed(frame), 0.01) > 5
        assert speed(frame).max() < 40


def test_all_is_new_after_a_cut():
    cut = animations.get("cut").cut
    assert frame_of("cut", cut).disoccluded.numpy().mean() > 0.9
    for index in (1, cut - 1, cut + 1):
        assert not frame_of("cut", index).disoccluded.numpy().any()
        assert not speed(frame_of("cut", index)).any()


def test_a_passing_object_darkens_a_floor_that_does_not_move():
    near, far = (frame_of("passing_object", i, size=96, truth_spp=64) for i in (30, 0))
    still = ~near.moving.numpy() & ~far.moving.numpy()
    assert not speed(near)[still].any()
    shadow = (far.truth.mean.numpy() - near.truth.mean.numpy())[still]
    assert shadow.max() > 0.7
    assert (shadow > 0.15).mean() > 0.02
    moving = speed(near)[near.moving.numpy()]
    # Wheels that roll: their top moves twice as fast as the cart, their lowest point stands still.
    body = np.median(moving)
    assert 1 < body < 5
    assert moving.max() > 1.7 * body
    assert moving.min() < 0.3 * body


@pytest.mark.parametrize(("size", "low", "high"), [(128, 1.0, 2.0), (256, 1.5, 3.0)])
def test_thin_bars_are_one_to_three_pixels_wide(size, low, high):
    frame = frame_of("thin_bars", 20, size=size)
    moving = frame.moving.numpy()
    # Below the rail and left of the wheel, rows cut the bars at right angles.
    rows = moving[size // 3 : 2 * size // 3, : size // 2].astype(int)
    edges = np.diff(np.pad(rows, ((0, 0), (1, 1))), axis=1)
    starts, ends = (np.argwhere(edges == sign)[:, 1] for sign in (1, -1))
    widths = (ends - starts)[(starts > 0) & (ends < size // 2)]
    assert len(widths) > 2 * len(rows)
    assert low <= np.mean(widths) <= high
    assert np.quantile(widths, 0.95) <= 3 * size / 128
    assert 1 < np.median(speed(frame)[moving]) < 5


def test_waves_deform():
    frame = frame_of("waves", 5)
    values = speed(frame)[frame.moving.numpy()]
    assert values.max() > 1
    # No rigid motion: what crosses the image quickly lies beside what hardly moves.
    assert np.quantile(values, 0.1) < 0.3 * values.max()
