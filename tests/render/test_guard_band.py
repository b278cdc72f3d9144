"""A frame with a guard band is the same frame with its surroundings."""

import numpy as np
import pytest

import gtao
from gtao import ConfigError, ShapeError, render

import _scenes as S  # isort: skip

W, H, BAND = 26, 18, 9


def _balls(**film):
    d = S.balls()
    d["sensor"] = S.perspective((0.3, -5, 3), (0.1, 0, 0.2), fov=35, size=(W, H), principal_point_offset_x=0.1)
    d["sensor"]["film"].update(film)
    return d


def _orthographic():
    d = S.balls()
    to_world = S.look_at((0.3, -5, 3), (0.1, 0, 0.2)) @ S.transform().scale([1.3, 1.4, 1])
    d["sensor"] = {"type": "orthographic", "near_clip": 0.2, "to_world": to_world, "film": S.film(W, H)}
    return d


CROP = {"width": 60, "height": 44, "crop_offset_x": 20, "crop_offset_y": 15, "crop_width": W, "crop_height": H}
SCENES = {"perspective": _balls, "orthographic": _orthographic, "crop": lambda: _balls(**CROP)}


@pytest.mark.parametrize("make", SCENES.values(), ids=SCENES.keys())
def test_within_the_frame_every_bit_stays(make):
    scene = render.load_scene(make())
    frame = render.gbuffer(scene)
    wide = render.gbuffer(scene, guard_px=BAND)
    assert wide.shape == (H + 2 * BAND, W + 2 * BAND)
    inner = wide.crop(BAND, BAND, W, H)
    for name in ("view_z", "normal_v", "albedo"):
        np.testing.assert_array_equal(getattr(inner, name).numpy(), getattr(frame, name).numpy(), err_msg=name)
    ours, theirs = inner.camera.to_dict(), frame.camera.to_dict()
    assert ours.pop("type") == theirs.pop("type")
    assert ours == pytest.approx(theirs, rel=1e-15)
    assert np.isfinite(frame.view_z.numpy()).any()


def test_the_band_is_what_a_larger_film_sees():
    """A film grown by the band at the same focal length shows the same pixels, up to the rounding of its lens."""
    scene = render.load_scene(SCENES["crop"]())
    wide = render.gbuffer(scene, guard_px=BAND)
    grown = dict(CROP, crop_offset_x=20 - BAND, crop_offset_y=15 - BAND, crop_width=W + 18, crop_height=H + 18)
    other = render.gbuffer(render.load_scene(_balls(**grown)))
    assert wide.camera.to_dict() == pytest.approx(other.camera.to_dict())
    a, b = wide.view_z.numpy(), other.view_z.numpy()
    same = np.isclose(a, b, rtol=1e-5)
    # Rounding of the rays moves a silhouette across a pixel centre here and there.
    assert same.mean() > 0.99
    assert len(np.unique(a[same])) > 500


def test_occlusion_no_longer_depends_on_the_frames_edge():
    """An estimator sees through the guard band what the plain frame hides: a wall just outside of it."""
    floor = S.rectangle(S.transform().scale([S.FAR, S.FAR, 1]))
    wall = S.cube((-9, 1.05, 0), (9, 1.5, 2))
    d = S.scene(S.perspective((0, 0, 3), (0, 0, 0), fov=36, up=(0, 1, 0), size=(32, 32)), floor=floor, wall=wall)
    scene = render.load_scene(d)
    method = gtao.GTAO(radius=1.0, n_slices=8, n_steps=16)
    plain = gtao.ambient_occlusion(render.gbuffer(scene), method).visibility.numpy()
    g = render.gbuffer(scene, guard_px=16)
    whole = gtao.ambient_occlusion(g, method)
    inner = whole.crop(16, 16, 32, 32)
    guarded = inner.visibility.numpy()
    np.testing.assert_array_equal(guarded, whole.visibility.numpy()[16:-16, 16:-16])
    assert inner.config == method
    with pytest.raises(
        ShapeError, match="a window of 32x32 pixels at \\(40, 0\\) does not lie within an image of 64x64"
    ):
        whole.crop(40, 0, 32, 32)
    assert plain[0].min() > 0.99  # nothing but floor in the frame
    assert guarded[0].mean() < 0.75
    assert guarded[-1].min() > 0.99  # more than the radius away from the wall


def test_bad_bands():
    scene = render.load_scene(_balls())
    with pytest.raises(ConfigError, match="a guard band is a whole number of pixels from 0 on, got -3"):
        render.gbuffer(scene, guard_px=-3)
    with pytest.raises(ConfigError, match=r"a guard band of 3000 pixels widens the view to 89\.\d+ degrees"):
        render.gbuffer(scene, guard_px=3000)
