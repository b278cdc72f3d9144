"""Images of other programs, if there is a folder of them: read right, or refused in one line."""

import json
import math
import os
from pathlib import Path

import _child
import numpy as np
import pytest

import gtao
from gtao.errors import ImageError, ShapeError
from gtao.io import read_channels, read_gbuffer

FOLDER = Path(os.environ.get("GTAO_SCENES", Path(__file__).resolve().parents[3] / "shared" / "scenes"))

pytestmark = pytest.mark.skipif(
    not (FOLDER / "exr").is_dir(), reason=f"no folder of EXR images at {FOLDER}; set GTAO_SCENES"
)

READ_ALL = """
from pathlib import Path
from gtao.errors import GtaoError
from gtao.io import read_channels, read_gbuffer
folder = Path(sys.argv[1])
result = {}
for path in sorted(p for p in folder.rglob("*") if p.is_file()):
    outcomes = []
    for window in ("display", "data"):
        try:
            channels, metadata = read_channels(path, window=window)
            shape = (metadata["height"], metadata["width"])
            assert channels and all(values.shape == shape for values in channels.values())
            outcomes.append("read")
        except GtaoError as error:
            assert "\\n" not in str(error)
            outcomes.append(str(error).replace(str(path), "X"))
            continue
        if shape[0] * shape[1] > 2**20:
            continue  # a G-buffer of every file would take long
        try:
            camera = gtao.PerspectiveCamera(*metadata["display_window"][2:], fov_y=0.8)
            g = read_gbuffer(path, camera, normals="derive", window=window)
            outcomes[-1] = "G-buffer" if g.shape == shape else "wrong shape"
        except GtaoError as error:
            assert "\\n" not in str(error)
    result[path.relative_to(folder).as_posix()] = outcomes
print(json.dumps(result))
"""

REFUSED = {
    "openexr-images/Chromaticities_Rec709_YC.exr": "is subsampled",
    "openexr-images/v2_LowResLeftView_Trunks.exr": "deep data",
    "openimageio/deep-nosamples.exr": "deep data",
    "openimageio/incomplete.exr": "damaged or cut short",
}


@pytest.fixture(scope="module")
def outcomes():
    return _child.run(READ_ALL, FOLDER / "exr")


def test_every_sound_file_is_read_and_every_other_one_refused(outcomes):
    assert len(outcomes) > 20
    for name, (display, data) in outcomes.items():
        if "damaged" in name:
            assert display.startswith("cannot read X: "), name
            assert data.startswith("cannot read X: "), name
        elif name in REFUSED:
            assert REFUSED[name] in display, name
            assert REFUSED[name] in data, name
        else:
            assert data in ("read", "G-buffer"), (name, data)
            apart = "no data inside its display window" in display
            assert display in ("read", "G-buffer") or apart, (name, display)


@pytest.mark.parametrize(
    ("name", "channel", "covered"),
    [
        ("gaffer/multipart.exr", "customDepth.Z", 0.25),
        ("gaffer/imitateProductionLayers2.exr", "depth_main.depth.Z", 1),
        ("gaffer/channelTestSinglePart.exr", "Z", 1),
        ("gaffer/channelTestPartPerLayer.exr", "rgba.Z", 1),
        ("gaffer/channelTestNukeSinglePart.exr", "depth.Z", 1),
        ("openimageio/rgbaz.exr", "Z", (38 / 40) ** 2),
    ],
)
def test_depth_is_found(name, channel, covered):
    path = FOLDER / "exr" / name
    if not path.exists():
        pytest.skip(f"{name} is not in the folder")
    channels, metadata = read_channels(path)
    camera = gtao.PerspectiveCamera(metadata["width"], metadata["height"], fov_y=0.8)
    g = read_gbuffer(path, camera, normals="derive")
    surface = g.mask.numpy()
    assert surface.mean() == pytest.approx(covered)
    assert np.array_equal(g.view_z.numpy()[surface], channels[channel].astype(np.float32)[surface])
    with pytest.raises(ImageError, match="has no normals; its channels are"):
        read_gbuffer(path, camera)


def look_at(entry):
    """``(to_view, origin)`` of a camera given by origin, target and up."""
    origin, target, up = (np.array(entry[key], dtype=np.float64) for key in ("origin", "target", "up"))
    back = (origin - target) / np.linalg.norm(origin - target)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back]), origin


BLENDER = ["blender45_head_lps_cam0.exr", "blender45_dutch_ship_cam1.exr", "blender45_country_kitchen_cam0.exr"]


@pytest.mark.parametrize("name", BLENDER)
class TestBlenderFrames:
    def load(self, name):
        path = FOLDER / "exr" / "blender" / name
        listing = FOLDER / "scenes.json"
        if not path.exists() or not listing.exists():
            pytest.skip(f"{name} or scenes.json is not in the folder")
        scene, _, cam = name.removeprefix("blender45_").removesuffix(".exr").rpartition("_")
        scenes = {s["id"]: s for s in json.loads(listing.read_text())["scenes"]}
        entry = {c["name"]: c for c in scenes[scene]["cameras"]}[cam]
        channels, metadata = read_channels(path)
        width, height = metadata["width"], metadata["height"]
        focal = 0.5 * width / math.tan(0.5 * math.radians(entry["fov"]))
        to_view, origin = look_at(entry)
        return path, channels, gtao.PerspectiveCamera(width, height, fx=focal), to_view, origin

    def test_positions_and_normals_agree_with_blenders_own(self, name):
        path, channels, camera, to_view, origin = self.load(name)
        g = read_gbuffer(path, camera, to_view=to_view)
        surface = g.mask.numpy()
        assert np.array_equal(surface, channels["ViewLayer.Depth.Z"] < 1e9)
        position = np.stack([channels[f"ViewLayer.Position.{c}"] for c in "XYZ"], -1)[surface]
        ours = g.position_v.numpy()[surface] @ to_view + origin
        error = np.linalg.norm(ours - position, axis=-1) / g.view_z.numpy()[surface]
        # Position is averaged over a filter of 1.5 pixels, depth is one sample: they differ by about a pixel.
        assert np.median(error) < 1 / camera.fx
        normal = np.stack([channels[f"ViewLayer.Normal.{c}"] for c in "XYZ"], -1)[surface]
        cosine = (g.normal_v.numpy()[surface] @ to_view * normal).sum(-1) / np.linalg.norm(normal, axis=-1)
        assert cosine.min() > 1 - 1e-5
        assert g.albedo is not None

    @pytest.mark.parametrize("signs", [(-1, 1, -1), (1, -1, -1)])
    def test_frames_of_other_programs_are_recognised(self, name, signs):
        path, _, camera, to_view, _ = self.load(name)
        with pytest.raises(ShapeError, match=r"would fit its depth with diag|contradict its depth"):
            read_gbuffer(path, camera, to_view=np.diag(signs) @ to_view)

    def test_without_pose(self, name):
        path, _, camera, _, _ = self.load(name)
        with pytest.raises(ImageError, match="are in world space; give to_view"):
            read_gbuffer(path, camera)
        assert read_gbuffer(path, camera, normals="derive").normals_derived
