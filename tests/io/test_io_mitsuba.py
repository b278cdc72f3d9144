"""An EXR that Mitsuba itself wrote, read and compared with our own G-buffer of the scene."""

import numpy as np
import pytest

from gtao.errors import ImageError, ShapeError
from gtao.io import read_gbuffer

AOVS = "tiefe:depth,nn:sh_normal,ort:position,albedo:albedo"


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    """``(path, our G-buffer, world-to-view rotation)`` of a wide view into an open box."""
    from gtao import render
    from gtao.render.variant import ensure_variant

    ensure_variant()
    import mitsuba as mi

    to_world = mi.ScalarTransform4f().look_at(origin=[0.3, 0.5, 2.5], target=[-0.1, 0.0, 0.0], up=[0.1, 1, 0.2])
    walls = {
        "back": mi.ScalarTransform4f().translate([0, 0, -1]).scale(2),
        "floor": mi.ScalarTransform4f().translate([0, -1, 0]).rotate([1, 0, 0], -90).scale(2),
        # Seen from behind: Mitsuba's normal points away from the camera.
        "side": mi.ScalarTransform4f().translate([-1, 0, 0]).rotate([0, 1, 0], -90).scale(2),
    }
    grey = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.3}}}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "aov", "aovs": AOVS, "img": {"type": "path", "max_depth": 2}},
            "sensor": {
                "type": "perspective",
                "fov": 70,
                "near_clip": 0.4,
                "to_world": to_world,
                "film": {"type": "hdrfilm", "width": 40, "height": 30, "rfilter": {"type": "box"}},
                "sampler": {"type": "independent", "sample_count": 64},
            },
            "light": {"type": "constant"},
            **{name: {"type": "rectangle", "to_world": t, "bsdf": grey} for name, t in walls.items()},
        }
    )
    mi.render(scene)
    path = tmp_path_factory.mktemp("mitsuba") / "frame.exr"
    scene.sensors()[0].film().bitmap().write(str(path))
    rotation = np.diag([-1, 1, -1]) @ np.linalg.inv(np.array(to_world.matrix))[:3, :3]
    return path, render.gbuffer(scene), rotation


def test_it_agrees_with_our_own(rendered):
    path, own, rotation = rendered
    g = read_gbuffer(path, own.camera, to_view=rotation)
    both = g.mask.numpy() & own.mask.numpy()
    assert both.mean() > 0.8
    z, expected = g.view_z.numpy()[both], own.view_z.numpy()[both]
    # Depth is the mean of 64 points inside the pixel: the error of a mean, much less than the step to the next pixel.
    assert np.median(np.abs(z / expected - 1)) < 2e-3
    cosine = (g.normal_v.numpy() * own.normal_v.numpy()).sum(-1)[both]
    assert np.mean(cosine > 1 - 1e-5) > 0.8  # all but the pixels on edges between walls
    assert np.median(g.albedo.numpy()[both]) == pytest.approx(0.3, abs=1e-6)


def test_the_offset_of_the_near_plane_is_what_is_corrected(rendered):
    path, own, _ = rendered
    right = read_gbuffer(path, own.camera, normals="derive")
    wrong = read_gbuffer(path, own.camera, normals="derive", depth="view_z")
    both = right.mask.numpy() & own.mask.numpy()
    assert np.median(np.abs(wrong.view_z.numpy()[both] / own.view_z.numpy()[both] - 1)) > 0.02


def test_the_frame_of_its_own_sensor_is_refused(rendered):
    path, own, rotation = rendered
    with pytest.raises(ShapeError, match=r"would fit its depth with diag\(-1, 1, -1\) @ to_view"):
        read_gbuffer(path, own.camera, to_view=np.diag([-1, 1, -1]) @ rotation)


def test_the_pose_is_asked_for(rendered):
    path, own, _ = rendered
    with pytest.raises(ImageError, match=r"normals nn of .* are in world space; give to_view"):
        read_gbuffer(path, own.camera)
