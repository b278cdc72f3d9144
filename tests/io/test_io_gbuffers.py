"""G-buffers through EXR: ours exactly, other programs' by name, and clear words where the names do not say enough."""

import json
import math

import numpy as np
import OpenEXR
import pytest
from _scene import FOCAL, HEIGHT, TO_VIEW, WIDTH, camera, depth_and_normals, trace, vector, write_exr, write_parts

import gtao
from gtao.errors import ConfigError, ImageError, ShapeError
from gtao.io import read_channels, read_gbuffer, write_gbuffer

Z, N = depth_and_normals()
SURFACE = np.isfinite(Z)
ONES = np.ones_like(Z)
N_WORLD = (N.astype(np.float64) @ TO_VIEW).astype(np.float32)
#: float32 normals rotated back and normalised again: a few roundings.
ROUNDING = 5e-7
HALF_ROUNDING = 1e-3


def assert_scene(g, *, depth=0.0, normal=ROUNDING):
    """The analytic scene, with the given relative error of depth and absolute error of normals."""
    z, n = g.view_z.numpy(), g.normal_v.numpy()
    assert np.array_equal(np.isfinite(z), SURFACE)
    assert np.abs(z[SURFACE] / Z[SURFACE] - 1).max() <= depth
    assert np.abs(n - N)[SURFACE].max() <= normal


def test_the_scene_of_these_tests_is_worth_it():
    assert 0.2 < SURFACE.mean() < 0.9
    assert np.abs(np.diff(Z[SURFACE])).max() > 1


class TestOwnFiles:
    def gbuffer(self, cam=None, **kwargs):
        albedo = np.random.default_rng(1).random((HEIGHT, WIDTH, 3), dtype=np.float32)
        return gtao.GBuffer(Z, N, cam or camera(near=0.25), albedo=albedo, **kwargs)

    def test_round_trip(self, tmp_path):
        g = self.gbuffer()
        write_gbuffer(tmp_path / "g.exr", g, manifest={"seed": 3})
        channels, metadata = read_channels(tmp_path / "g.exr")
        assert np.array_equal(channels["Z"], g.view_z.numpy())
        for i, c in enumerate("XYZ"):
            assert np.array_equal(channels[f"N.{c}"], g.normal_v.numpy()[..., i])
        assert metadata["manifest"]["seed"] == 3
        back = read_gbuffer(tmp_path / "g.exr")
        assert back.camera == g.camera
        assert np.array_equal(back.view_z.numpy(), g.view_z.numpy())
        assert np.array_equal(back.albedo.numpy()[SURFACE], g.albedo.numpy()[SURFACE])
        # The constructor normalises again: one unit in the last place.
        assert np.abs(back.normal_v.numpy() - g.normal_v.numpy()).max() <= 2**-23

    def test_writing_what_was_read_is_stable(self, tmp_path):
        write_gbuffer(tmp_path / "a.exr", self.gbuffer())
        write_gbuffer(tmp_path / "b.exr", read_gbuffer(tmp_path / "a.exr"))
        write_gbuffer(tmp_path / "c.exr", read_gbuffer(tmp_path / "b.exr"))
        b, c = read_channels(tmp_path / "b.exr")[0], read_channels(tmp_path / "c.exr")[0]
        assert b.keys() == c.keys()
        for name in b:
            finite = np.isfinite(b[name])
            assert np.array_equal(finite, np.isfinite(c[name]))
            assert np.abs(b[name][finite] - c[name][finite]).max() <= 2**-23

    def test_orthographic(self, tmp_path):
        cam = gtao.OrthographicCamera(WIDTH, HEIGHT, 4.0, cx=3.0, near=0.5)
        write_gbuffer(tmp_path / "g.exr", gtao.GBuffer(Z, N, cam))
        assert read_gbuffer(tmp_path / "g.exr").camera == cam

    def test_extra_channels(self, tmp_path):
        g = self.gbuffer()
        transport = {f"transport.{k:02d}": np.full((HEIGHT, WIDTH), k, np.float32) for k in (1, 2)}
        visibility = np.where(SURFACE, 0.5, 1).astype(np.float32)
        extra = {"visibility.mean": type(g.view_z)(visibility), "bent": g.normal_v, **transport}
        write_gbuffer(tmp_path / "g.exr", g, extra=extra, manifest={"config": gtao.GTAO(radius=2.0)})
        channels, metadata = read_channels(tmp_path / "g.exr")
        assert np.array_equal(channels["visibility.mean"], visibility)
        assert np.array_equal(channels["bent.Y"], g.normal_v.numpy()[..., 1])
        assert np.array_equal(channels["transport.02"], extra["transport.02"])
        assert gtao.method_from_dict(metadata["manifest"]["config"]) == gtao.GTAO(radius=2.0)
        assert_scene(read_gbuffer(tmp_path / "g.exr"))

    def test_a_channel_given_twice(self, tmp_path):
        with pytest.raises(ImageError, match="channel Z is given twice"):
            write_gbuffer(tmp_path / "g.exr", self.gbuffer(), extra={"Z": Z})

    def test_nan_is_refused(self, tmp_path):
        with pytest.raises(ImageError, match=r"'visibility\.var' is NaN"):
            write_gbuffer(tmp_path / "g.exr", self.gbuffer(), extra={"visibility.var": ONES * np.nan})
        assert list(tmp_path.iterdir()) == []

    def test_the_method_of_the_class(self, tmp_path):
        write_gbuffer(tmp_path / "g.exr", self.gbuffer())
        assert_scene(gtao.GBuffer.from_exr(tmp_path / "g.exr"))
        assert gtao.GBuffer.from_exr(tmp_path / "g.exr", normals="derive").normals_derived

    def test_a_damaged_camera(self, tmp_path):
        header = {"gtao": json.dumps({"camera": {"type": "perspective", "width": 24}})}
        path = write_exr(tmp_path / "g.exr", {"Z": Z, **vector("N", N)}, header)
        with pytest.raises(ImageError, match="holds a damaged camera"):
            read_gbuffer(path)
        assert_scene(read_gbuffer(path, camera()))


class TestMitsuba:
    NEAR = 0.3

    def channels(self, names=("dd", "nn"), back=False):
        """Distance from the near plane with 0 on the sky; world normals, of which a third points inward."""
        view_z, t, n = trace()
        stored = np.zeros_like(Z)
        stored[SURFACE] = t[SURFACE] * (1 - self.NEAR / view_z[SURFACE])
        world = (n @ TO_VIEW).astype(np.float32)
        if back:
            world[:, ::3] *= -1
        position = vector("pp", N_WORLD * 7)
        return {f"{names[0]}.T": stored, **vector(names[1], world), **position, "R": ONES}

    def write(self, tmp_path, channels):
        return write_exr(tmp_path / "m.exr", channels, {"generatedBy": "Mitsuba version 3.9.1"})

    @pytest.mark.parametrize("back", [False, True])
    @pytest.mark.parametrize("to_view", [TO_VIEW, np.block([[TO_VIEW, np.ones((3, 1))], [np.eye(4)[3:]]])])
    def test_distance_from_the_near_plane_and_world_normals(self, tmp_path, back, to_view):
        path = self.write(tmp_path, self.channels(back=back))
        # t is stored as float32 and the conversion has a handful of roundings.
        assert_scene(read_gbuffer(path, camera(self.NEAR), to_view=to_view), depth=1e-6)

    def test_names_of_the_user_are_found_by_their_unit_length(self, tmp_path):
        path = self.write(tmp_path, self.channels(("tiefe", "richtung")))
        assert_scene(read_gbuffer(path, camera(self.NEAR), to_view=TO_VIEW), depth=1e-6)

    def test_a_camera_without_near_plane(self, tmp_path):
        path = self.write(tmp_path, self.channels())
        with pytest.raises(ImageError, match=r"dd\.T of .* is measured from the near plane; give the camera its near="):
            read_gbuffer(path, camera(), to_view=TO_VIEW)

    def test_distance_from_the_camera(self, tmp_path):
        _, t, _ = trace()
        channels = {"Z": np.where(SURFACE, t, 0).astype(np.float32), **vector("N", N)}
        path = write_exr(tmp_path / "m.exr", channels)
        # The near plane does not matter to a distance from the camera.
        g = read_gbuffer(path, camera(near=0.4), depth="ray_t", normal_frame="view")
        assert_scene(g, depth=1e-6)

    def test_shading_and_geometric_normals_are_ambiguous(self, tmp_path):
        channels = {**self.channels(("dd", "sh_normal")), **vector("geo_normal", N_WORLD)}
        path = self.write(tmp_path, channels)
        with pytest.raises(ImageError, match="several layers of normals: geo_normal, sh_normal; choose with"):
            read_gbuffer(path, camera(self.NEAR), to_view=TO_VIEW)
        g = read_gbuffer(path, camera(self.NEAR), to_view=TO_VIEW, normal_layer="geo_normal")
        assert_scene(g, depth=1e-6)

    @pytest.mark.parametrize("back", [False, True])
    def test_its_own_camera_frame_is_recognised(self, tmp_path, back):
        path = self.write(tmp_path, self.channels(back=back))
        raw = np.diag([-1, 1, -1]) @ TO_VIEW
        message = r"would fit its depth with diag\(-1, 1, -1\) @ to_view: that camera looks along \+z with \+y up"
        with pytest.raises(ShapeError, match=message):
            read_gbuffer(path, camera(self.NEAR), to_view=raw)


BLENDER = {"BlenderMultiChannel": "Blender V2.55.1 and newer"}


class TestBlender:
    def channels(self, layer="ViewLayer", depth="Depth.Z"):
        z = np.where(SURFACE, Z, np.float32(1e10))
        length = np.random.default_rng(2).uniform(0.4, 1, Z.shape)
        averaged = N_WORLD * np.where(length < 0.5, length, 1)[..., None].astype(np.float32)
        return {
            f"{layer}.{depth}": z,
            **vector(f"{layer}.Normal", averaged),
            **vector(f"{layer}.Position", N_WORLD * 9),
            **vector(f"{layer}.DiffCol", np.full((*Z.shape, 3), 0.25, np.float32), "RGB"),
            **vector(f"{layer}.Combined", np.full((*Z.shape, 3), 2, np.float32), "RGB"),
        }

    @pytest.mark.parametrize("depth", ["Depth.Z", "Depth.V"])
    def test_planar_depth_averaged_world_normals_and_albedo(self, tmp_path, depth):
        path = write_exr(tmp_path / "b.exr", self.channels(depth=depth), BLENDER)
        g = read_gbuffer(path, camera(), to_view=TO_VIEW)
        assert_scene(g)
        assert np.all(g.albedo.numpy()[SURFACE] == 0.25)

    def test_half(self, tmp_path):
        channels = {k: np.minimum(v, 6e4).astype(np.float16) for k, v in self.channels().items()}
        channels["ViewLayer.Depth.Z"] = np.where(SURFACE, Z, np.inf).astype(np.float16)
        path = write_exr(tmp_path / "b.exr", channels, BLENDER)
        assert_scene(read_gbuffer(path, camera(), to_view=TO_VIEW), depth=HALF_ROUNDING, normal=4 * HALF_ROUNDING)

    def test_one_part_per_pass(self, tmp_path):
        parts = {}
        for name, values in self.channels().items():
            layer, _, component = name.rpartition(".")
            parts.setdefault(layer, {})[component] = values
        path = write_parts(tmp_path / "b.exr", parts)
        assert_scene(read_gbuffer(path, camera(), to_view=TO_VIEW))

    def test_two_view_layers(self, tmp_path):
        other = {k: ONES for k, v in self.channels("Fog").items()}
        path = write_exr(tmp_path / "b.exr", {**self.channels("Main"), **other}, BLENDER)
        message = r"several depth channels: Fog\.Depth\.Z, Main\.Depth\.Z; choose with layer or depth_channel"
        with pytest.raises(ImageError, match=message):
            read_gbuffer(path, camera(), to_view=TO_VIEW)
        assert_scene(read_gbuffer(path, camera(), to_view=TO_VIEW, layer="Main"))

    def test_without_the_pose_it_says_what_to_give(self, tmp_path):
        path = write_exr(tmp_path / "b.exr", self.channels(), BLENDER)
        with pytest.raises(ImageError, match=r"normals ViewLayer\.Normal of .* are in world space; give to_view"):
            read_gbuffer(path, camera())
        assert read_gbuffer(path, camera(), normals="derive").normals_derived

    @pytest.mark.parametrize(
        "wrong",
        [TO_VIEW.T, TO_VIEW[[1, 2, 0]], np.diag([-1, -1, 1]) @ TO_VIEW],
        ids=["transposed", "axes in another order", "upside down"],
    )
    def test_a_wrong_pose_is_recognised(self, tmp_path, wrong):
        path = write_exr(tmp_path / "b.exr", self.channels(), BLENDER)
        with pytest.raises(ShapeError, match=r"(contradict|would fit) its depth"):
            read_gbuffer(path, camera(), to_view=wrong)

    def test_the_frame_of_computer_vision_is_recognised(self, tmp_path):
        path = write_exr(tmp_path / "b.exr", self.channels(), BLENDER)
        with pytest.raises(ShapeError, match=r"diag\(1, -1, -1\) @ to_view: that camera looks along \+z with \+y down"):
            read_gbuffer(path, camera(), to_view=np.diag([1, -1, -1]) @ TO_VIEW)


class TestOthers:
    def test_frame_must_be_said(self, tmp_path):
        path = write_exr(tmp_path / "n.exr", {"depth.Z": Z, **vector("N", N)})
        with pytest.raises(ImageError, match="does not say whether its normals N are in view or world space"):
            read_gbuffer(path, camera())
        assert_scene(read_gbuffer(path, camera(), normal_frame="view"))

    def test_a_pose_implies_world_space(self, tmp_path):
        path = write_exr(tmp_path / "n.exr", {"depth.Z": Z, **vector("normals", N_WORLD)})
        assert_scene(read_gbuffer(path, camera(), to_view=TO_VIEW))

    @pytest.mark.parametrize("background", [0.0, -0.0, np.inf, 1e10, 3e38])
    def test_backgrounds(self, tmp_path, background):
        z, n = depth_and_normals(background)
        path = write_exr(tmp_path / "n.exr", {"Z": z, **vector("N", n)})
        assert_scene(read_gbuffer(path, camera(), normal_frame="view"))

    @pytest.mark.parametrize(
        ("names", "expected"),
        [
            (["Z", "character.Z", "left.Z", "ZBack"], "Z"),
            (["depth.Z", "character.Z", "other.ZBack"], "depth.Z"),
            (["rgba.Z", "character.Z"], "rgba.Z"),
            (["customDepth.Z"], "customDepth.Z"),
            (["depth.Y"], "depth.Y"),
            (["Depth"], "Depth"),
            (["V"], "V"),
            (["a.T", "b.R"], "a.T"),
        ],
    )
    def test_which_channel_is_depth(self, tmp_path, names, expected):
        channels = {name: ONES * (1 + (name == expected)) for name in names}
        path = write_exr(tmp_path / "n.exr", channels)
        g = read_gbuffer(path, camera(), normals="derive", depth="view_z")
        assert np.all(g.view_z.numpy() == 2)

    @pytest.mark.parametrize(
        ("names", "message"),
        [
            (["R", "G", "B"], "has no depth channel; it has B, G, R; name one with depth_channel"),
            (["uv.S", "uv.T"], "has no depth channel"),
            (["P.X", "P.Y", "P.Z"], "has no depth channel"),
            (["a.Z", "b.Z"], r"several depth channels: a\.Z, b\.Z; choose with layer or depth_channel"),
        ],
    )
    def test_no_or_several_depths(self, tmp_path, names, message):
        path = write_exr(tmp_path / "n.exr", dict.fromkeys(names, ONES))
        with pytest.raises(ImageError, match=message):
            read_gbuffer(path, camera(), normals="derive")

    def test_channels_by_name(self, tmp_path):
        path = write_exr(tmp_path / "n.exr", {"far": Z, "near.Z": Z, **vector("dir", N, "RGB")})
        options = {"depth_channel": "far", "normal_layer": "dir", "normal_frame": "view"}
        assert_scene(read_gbuffer(path, camera(), **options))
        with pytest.raises(ImageError, match=r"has no channel 'fog'; it has dir\.B, dir\.G, dir\.R, far, near\.Z"):
            read_gbuffer(path, camera(), depth_channel="fog")
        with pytest.raises(ImageError, match="has no layer 'fog' with X Y Z or R G B"):
            read_gbuffer(path, camera(), normal_layer="fog", depth_channel="far")
        with pytest.raises(ImageError, match="has no layer 'fog'; it has"):
            read_gbuffer(path, camera(), layer="fog")

    def test_missing_normals_and_the_way_out(self, tmp_path):
        path = write_exr(tmp_path / "n.exr", {"Z": Z, "R": ONES})
        with pytest.raises(ImageError, match=r"has no normals; its channels are R, Z; .* normals='derive'"):
            read_gbuffer(path, camera())
        assert read_gbuffer(path, camera(), normals="derive").normals_derived

    def test_overscan(self, tmp_path):
        corners = (np.array([3, 2], np.int32), np.array([WIDTH - 5, HEIGHT - 4], np.int32))
        data = (np.array([0, 0], np.int32), np.array([WIDTH - 1, HEIGHT - 1], np.int32))
        header = {"displayWindow": corners, "dataWindow": data}
        path = write_exr(tmp_path / "o.exr", {"Z": Z, **vector("N", N)}, header)
        frame = gtao.PerspectiveCamera(WIDTH - 7, HEIGHT - 5, fx=FOCAL, cx=11.0 - 3, cy=10.5 - 2)
        whole = read_gbuffer(path, frame, normal_frame="view", window="data")
        assert whole.camera == camera()
        assert_scene(whole)
        g = read_gbuffer(path, frame, normal_frame="view")
        assert np.array_equal(g.view_z.numpy(), Z[2 : HEIGHT - 3, 3 : WIDTH - 4])


class TestImpossible:
    def refuse(self, tmp_path, error, message, *, z=Z, n=N, cam=None, **options):
        path = write_exr(tmp_path / "i.exr", {"Z": z, **vector("N", n)})
        with pytest.raises(error, match=message) as caught:
            read_gbuffer(path, cam or camera(), **{"normal_frame": "view", **options})
        assert "\n" not in str(caught.value)

    def test_no_camera(self, tmp_path):
        path = write_exr(tmp_path / "i.exr", {"Z": Z, **vector("N", N)})
        with pytest.raises(ImageError, match="does not say which camera made it; give the camera"):
            read_gbuffer(path)

    def test_camera_of_another_size(self, tmp_path):
        cam = gtao.PerspectiveCamera(32, 16, fov_y=1.0)
        self.refuse(tmp_path, ShapeError, "the camera is 32x16, but the frame of .* is 24x20", cam=cam)

    def test_nan_depth(self, tmp_path):
        z = Z.copy()
        z[4, 4] = np.nan
        self.refuse(tmp_path, ShapeError, "view_z is NaN at 1 pixels", z=z, normals="derive")

    def test_negative_depth(self, tmp_path):
        self.refuse(tmp_path, ShapeError, "must be positive", z=np.where(SURFACE, -Z, np.inf), normals="derive")

    def test_nan_normals(self, tmp_path):
        n = N.copy()
        n[tuple(np.argwhere(SURFACE)[5])] = np.nan
        self.refuse(tmp_path, ShapeError, "normals N of .* are not finite at 1 surface pixels", n=n)

    def test_nan_normals_on_the_background_do_not_matter(self, tmp_path):
        n = np.where(SURFACE[..., None], N, np.float32(np.nan))
        path = write_exr(tmp_path / "i.exr", {"Z": Z, **vector("N", n)})
        assert_scene(read_gbuffer(path, camera(), normal_frame="view"))

    def test_encoded_normals(self, tmp_path):
        self.refuse(tmp_path, ShapeError, "does not hold unit normals .* undo an encoding", n=N / 2 + np.float32(0.5))

    def test_short_normals(self, tmp_path):
        self.refuse(tmp_path, ShapeError, "does not hold unit normals", n=N * np.float32(0.5))

    def test_vanishing_normals(self, tmp_path):
        n = N.copy()
        n[tuple(np.argwhere(SURFACE)[5])] = 0
        self.refuse(tmp_path, ShapeError, "vanish at 1 surface pixels; use normals='derive'", n=n)

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            ({"depth": "z"}, "depth must be one of 'auto', 'view_z', 'ray_t', got 'z'"),
            ({"normals": "none"}, "normals must be one of"),
            ({"normal_frame": "camera"}, "normal_frame must be one of"),
            ({"to_view": np.eye(2)}, "to_view must be a finite 3x3 or 4x4 matrix"),
            ({"to_view": np.eye(3) * math.nan}, "finite"),
            ({"to_view": np.eye(3) * 2}, "must be a rotation"),
            ({"to_view": np.diag([1, 1, -1])}, "without scale or mirror"),
            ({"to_view": "identity"}, "matrix of numbers"),
        ],
    )
    def test_options(self, tmp_path, options, message):
        self.refuse(tmp_path, ConfigError, message, **options)

    def test_everything_background(self, tmp_path):
        path = write_exr(tmp_path / "i.exr", {"Z": ONES * np.inf, **vector("N", N)})
        g = read_gbuffer(path, camera(), normal_frame="view")
        assert not g.mask.numpy().any()


def test_tiled_multi_part_half(tmp_path):
    header = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
    parts = {"depth": {"Z": Z}, "normals": {k[2:]: v.astype(np.float16) for k, v in vector("N", N).items()}}
    path = write_parts(tmp_path / "t.exr", parts, header)
    assert_scene(read_gbuffer(path, camera(), normal_frame="view"), normal=HALF_ROUNDING)
