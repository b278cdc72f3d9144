"""Packed directions: layouts bit by bit, errors within their bounds, and the bounds reached."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from _directions import bent, cone, estimate, random_directions

import gtao
from gtao.errors import ConfigError, ShapeError
from gtao.io import (
    PACKINGS,
    Directions,
    direction_channels,
    direction_manifest,
    directions_of,
    pack,
    packing_errors,
    unpack,
)
from gtao.io.octahedral import (
    angle_bound,
    levels,
    octahedral_decode,
    octahedral_encode,
    octahedral_quantize,
    octahedral_restore,
)

INTEGERS = [name for name, p in PACKINGS.items() if np.issubdtype(p.dtype, np.integer)]
HALVES = [name for name in PACKINGS if name not in INTEGERS]
BENT = [name for name, p in PACKINGS.items() if p.needs == "bent_normal"]


def angle(a, b):
    """Of unit vectors; the chord resolves small angles."""
    return 2 * np.arcsin(np.linalg.norm(np.asarray(a) - b, axis=-1) / 2)


def unfolded(u, v):
    """The octahedral map backwards, corner by corner: reflected at |u| + |v| = 1, not folded."""
    if abs(u) + abs(v) <= 1:
        d = (u, v, 1 - abs(u) - abs(v))
    else:
        d = (math.copysign(1 - abs(v), u), math.copysign(1 - abs(u), v), 1 - abs(u) - abs(v))
    return np.array(d) / math.hypot(*d)


class TestOctahedron:
    def test_there_and_back(self):
        d = random_directions(20000)
        p = octahedral_encode(d)
        assert np.abs(p).max() <= 1
        assert angle(octahedral_decode(p), d).max() < 1e-14

    def test_the_way_back_is_the_definition(self):
        p = np.random.default_rng(1).uniform(-1, 1, (2000, 2))
        expected = np.array([unfolded(u, v) for u, v in p])
        assert np.abs(octahedral_decode(p) - expected).max() < 1e-14

    def test_length_does_not_matter(self):
        d = random_directions(50)
        assert np.allclose(octahedral_encode(7 * d), octahedral_encode(d), rtol=0, atol=1e-15)

    @pytest.mark.parametrize("z", [0.0, -0.0, 1e-17, -1e-17, 1e-9, -1e-9])
    def test_the_outer_fold(self, z):
        phi = np.linspace(0, 2 * np.pi, 721)
        d = np.stack([np.cos(phi), np.sin(phi), np.full_like(phi, z)], -1)
        d /= np.linalg.norm(d, axis=-1, keepdims=True)
        assert angle(octahedral_decode(octahedral_encode(d)), d).max() < 1e-15
        assert angle(octahedral_restore(octahedral_quantize(d, 8), 8), d).max() < angle_bound(8)

    @pytest.mark.parametrize("zero", [0.0, -0.0])
    @pytest.mark.parametrize("n_bits", [8, 12, 16])
    def test_axes_are_exact(self, n_bits, zero):
        d = np.array([[x, y, z] for x, y, z in [*np.eye(3), *-np.eye(3)]])
        d[d == 0] = zero
        assert np.array_equal(octahedral_restore(octahedral_quantize(d, n_bits), n_bits), d)

    @pytest.mark.parametrize("corner", [(-1, -1), (-1, 1), (1, -1), (1, 1)])
    def test_every_corner_is_the_far_pole(self, corner):
        assert np.array_equal(octahedral_decode(np.array(corner, dtype=float)), [0, 0, -1])

    @pytest.mark.parametrize("n_bits", [8, 12, 16])
    def test_worst_case(self, n_bits):
        """The bound holds, and in the middle of a face it is reached: circumcentres of the grid's triangles there."""
        d = random_directions(100000, seed=n_bits)
        wrong = angle(octahedral_restore(octahedral_quantize(d, n_bits), n_bits), d)
        assert wrong.max() < angle_bound(n_bits)
        steps = levels(n_bits)
        third = steps // 3
        # In (u, v) with the metric 2 u² + 2 v² + 2 u v, the points (1/3, 1/3) of a cell.
        p = np.array([[third + 1 / 3, third + 1 / 3]]) / steps
        d = octahedral_decode(p)
        reached = angle(octahedral_restore(octahedral_quantize(d, n_bits), n_bits), d)[0]
        # The face is flat and its middle not on the grid: both shares vanish with the step.
        assert angle_bound(n_bits) * (1 - 4 / steps) < reached < angle_bound(n_bits)

    def test_published_errors_of_two_bytes(self):
        """Cigolle et al. 2014: mean 0.33709° and maximum 0.94424° rounded, 0.31485° and 0.63673° nearest."""
        d = random_directions(400000)
        grid = np.round((octahedral_encode(d) + 1) * levels(8))
        rounded = np.degrees(angle(octahedral_restore(grid, 8), d))
        nearest = np.degrees(angle(octahedral_restore(octahedral_quantize(d, 8), 8), d))
        # The standard error of the means is 3e-4; a sample does not quite find the maximum.
        assert rounded.mean() == pytest.approx(0.33709, abs=1.5e-3)
        assert nearest.mean() == pytest.approx(0.31485, abs=1.5e-3)
        assert 0.93 < rounded.max() < 0.9445
        assert 0.62 < nearest.max() < 0.6369

    def test_no_grid_point_is_nearer(self):
        d = random_directions(300)
        n = 2 * levels(7) + 1
        grid = octahedral_restore(np.stack(np.indices((n, n)), -1).reshape(-1, 2), 7)
        best = angle(grid[None], d[:, None]).min(axis=1)
        assert np.abs(angle(octahedral_restore(octahedral_quantize(d, 7), 7), d) - best).max() < 1e-12


class TestLayout:
    def test_rgba8_is_what_xegtao_packs(self):
        d, visibility = random_directions(500), np.random.default_rng(2).random(500)
        texels = pack(bent(d, visibility), "rgba8")[0]
        for texel, b, v in zip(texels.tolist(), d, visibility, strict=True):
            assert texel == [int((x * 0.5 + 0.5) * 255 + 0.5) for x in b] + [int(v * 255 + 0.5)]

    def test_toward_the_camera(self):
        ao = bent([0, 0, 1], 1.0)
        assert pack(ao, "rgba8").tolist() == [[[128, 128, 255, 255]]]
        assert pack(ao, "octahedral8").tolist() == [[[127, 127, 255]]]
        assert pack(ao, "octahedral12").tolist() == [[[2047 >> 4, (2047 & 15) << 4 | 2047 >> 8, 2047 & 255, 255]]]
        assert pack(ao, "octahedral16").tolist() == [[[32767, 32767, 65535]]]
        # The half step that 0.5 of 255 leaves tilts it; a grid with its centre on a point does not.
        assert packing_errors(ao, "rgba8").angle_max == pytest.approx(math.atan(math.sqrt(2) / 255))
        assert packing_errors(ao, "octahedral8").angle_max == 0

    def test_twelve_bits_lie_one_after_the_other(self):
        d = random_directions(500)
        r, g, b, _ = np.moveaxis(pack(bent(d), "octahedral12")[0].astype(int), -1, 0)
        word = r << 16 | g << 8 | b
        assert np.array_equal(np.stack([word >> 12, word & 4095], -1), octahedral_quantize(d, 12))

    def test_mean_direction_and_its_length(self):
        mean = np.array([[[0, 0, 2 / 3], [0.3, 0, 0], [0, 0, 0]]])
        ao = Directions(visibility=np.array([[1.0, 0.5, 0.0]]), mean_direction=mean)
        texels = pack(ao, "moments8")
        assert texels[0, :, 2:].tolist() == [[170, 255], [152, 128], [0, 0]]  # 0.3 is 152.4 / 255 of 128 / 255
        back = unpack(texels, "moments8")
        assert back.mean_direction[0, 0] == pytest.approx([0, 0, 2 / 3], abs=1e-15)
        assert back.mean_direction[0, 1] == pytest.approx([0.3, 0, 0], abs=0.25 / 255)
        assert np.array_equal(back.mean_direction[0, 2], [0, 0, 0])
        assert np.array_equal(np.linalg.norm(back.bent_normal, axis=-1), np.ones((1, 3)))

    @pytest.mark.parametrize("weighting", ["cosine", "uniform"])
    @pytest.mark.parametrize("x", [0.0, 0.3, 0.9])
    def test_coefficients_hold_visibility_and_mean_direction(self, weighting, x):
        axis = np.array([0.48, -0.6, 0.64])
        visibility, mean, sh = cone(axis, x, weighting)
        back = unpack(sh.reshape(1, 1, 9).astype(np.float16), "sh16", weighting)
        # Half floats have 11 bits.
        assert back.visibility[0, 0] == pytest.approx(visibility, rel=2**-11)
        assert back.mean_direction[0, 0] == pytest.approx(mean, rel=2**-11)
        assert back.bent_normal[0, 0] == pytest.approx(axis, abs=2**-10)
        assert back.visibility_sh[0, 0] == pytest.approx(sh, rel=2**-11)

    def test_half_floats_are_the_nearest(self):
        ao = estimate()
        assert np.array_equal(pack(ao, "sh16"), ao.visibility_sh.numpy().astype(np.float16))
        zh = pack(ao, "zh16")
        assert np.array_equal(zh[..., :3], ao.mean_direction.numpy().astype(np.float16))
        assert np.array_equal(zh[..., 3], ao.visibility.numpy().astype(np.float16))

    @pytest.mark.parametrize("name", INTEGERS)
    def test_visibility_is_clamped(self, name):
        ao = replace(bent(random_directions(3), [-0.5, 0.25, 1.5]), mean_direction=0.1 * random_directions(3)[None])
        assert unpack(pack(ao, name), name).visibility[0] == pytest.approx([0, 0.25, 1], abs=1 / 255)
        assert packing_errors(ao, name).clamped == pytest.approx(2 / 3)
        assert "67 % of the pixels clamped" in str(packing_errors(ao, name))

    @pytest.mark.parametrize("name", PACKINGS)
    def test_bits_and_channels(self, name):
        texels = pack(estimate(), name)
        assert texels.dtype == PACKINGS[name].dtype
        assert texels.shape == (20, 24, len(PACKINGS[name].channels))
        assert PACKINGS[name].bits == 8 * texels[0, 0].nbytes


class TestErrors:
    @pytest.mark.parametrize("weighting", ["cosine", "uniform"])
    @pytest.mark.parametrize("name", PACKINGS)
    def test_within_the_bounds(self, name, weighting):
        ao = estimate(weighting)
        ao = replace(ao, visibility=type(ao.visibility)(np.minimum(ao.visibility.numpy(), 1)))
        errors = packing_errors(ao, name)
        surface = np.any(ao.mean_direction.numpy(), axis=-1)
        assert errors.n == surface.sum() > 200
        assert 0 < errors.angle_mean < errors.angle_p99 <= errors.angle_max <= errors.angle_bound
        assert 0 < errors.visibility_rms < errors.visibility_max <= errors.visibility_bound * (1 + 1e-6)
        assert errors.clamped == 0
        if name in INTEGERS:  # the worst of a few hundred pixels is not far from the worst there is
            assert errors.angle_max > 0.7 * errors.angle_bound
        assert f"{name}: angle mean" in str(errors)

    @pytest.mark.parametrize("name", BENT)
    def test_many_directions(self, name):
        errors = packing_errors(bent(random_directions(200000)), name)
        assert 0.97 * errors.angle_bound < errors.angle_max < errors.angle_bound

    def test_against_numbers_made_by_hand(self):
        ao = estimate()
        b, v = ao.bent_normal.numpy().astype(np.float64), ao.visibility.numpy().astype(np.float64)
        seen = np.any(ao.mean_direction.numpy(), axis=-1)
        stored = np.floor((b * 0.5 + 0.5) * 255 + 0.5) / 255 * 2 - 1
        cosine = (b * stored).sum(-1) / np.linalg.norm(b, axis=-1) / np.linalg.norm(stored, axis=-1)
        angles = np.arccos(cosine[seen])
        error = (np.clip(np.floor(v * 255 + 0.5), 0, 255) / 255 - v)[seen]
        errors = packing_errors(ao, "rgba8")
        # The arc cosine of angles of 1e-3 has an error of 1e-13.
        assert errors.angle_mean == pytest.approx(angles.mean(), rel=1e-9)
        assert errors.angle_max == pytest.approx(angles.max(), rel=1e-9)
        assert errors.angle_p99 == pytest.approx(np.quantile(angles, 0.99), rel=1e-9)
        assert errors.visibility_rms == pytest.approx(np.sqrt((error**2).mean()), rel=1e-12)
        assert errors.visibility_max == pytest.approx(np.abs(error).max(), rel=1e-12)
        assert errors.clamped == (v[seen] > 1).mean()
        assert errors.length_max is None
        assert errors.sh_max is None

    def test_what_only_some_packings_store(self):
        ao = estimate()
        stored = ao.visibility_sh.numpy().astype(np.float16).astype(np.float64)
        seen = np.any(ao.mean_direction.numpy(), axis=-1)
        difference = (stored - ao.visibility_sh.numpy())[seen]
        errors = packing_errors(ao, "sh16")
        assert errors.sh_max == np.abs(difference).max() > 0
        assert errors.sh_rms == pytest.approx(np.sqrt((difference**2).mean()))
        # Half a step of the ratio; visibility above 1, of which there is some, does not matter.
        assert packing_errors(ao, "moments8").clamped > 0
        assert 0 < packing_errors(ao, "moments8").length_max < 1 / 510
        assert 0 < packing_errors(ao, "zh16").length_max < 2**-11

    def test_mask(self):
        ao = estimate()
        mask = np.zeros(ao.visibility.shape, bool)
        mask[-4:] = True
        errors = packing_errors(ao, "rgba8", mask)
        assert errors.n == 4 * 24
        assert errors.angle_mean != packing_errors(ao, "rgba8").angle_mean
        with pytest.raises(ShapeError, match=r"mask must have the shape \(20, 24\)"):
            packing_errors(ao, "rgba8", mask[1:])

    @pytest.mark.parametrize("name", PACKINGS)
    def test_a_frame_without_surfaces(self, name):
        z = np.full((4, 4), np.inf, np.float32)
        g = gtao.GBuffer(z, None, gtao.PerspectiveCamera(4, 4, 1.0))
        ao = gtao.ambient_occlusion(g, gtao.GTAO(directional=True))
        errors = packing_errors(ao, name)
        assert (errors.n, errors.angle_mean, errors.angle_max, errors.visibility_max) == (0, 0, 0, 0)
        if name in BENT:
            assert unpack(pack(ao, name), name).bent_normal[2, 2] == pytest.approx([0, 0, 1], abs=1 / 128)


class TestRefused:
    def test_unknown(self):
        words = "packing must be one of rgba8, octahedral8, .*, sh16, got 'bc5'"
        for call in (lambda: pack(estimate(), "bc5"), lambda: unpack(np.zeros((1, 1, 4), np.uint8), "bc5")):
            with pytest.raises(ConfigError, match=words):
                call()
        with pytest.raises(ConfigError, match="weighting must be 'cosine' or 'uniform', got 'both'"):
            unpack(np.zeros((1, 1, 9), np.float16), "sh16", "both")

    @pytest.mark.parametrize("name", PACKINGS)
    def test_what_the_estimate_lacks(self, name):
        p = PACKINGS[name]
        with pytest.raises(ConfigError, match=f"packing {name} stores {p.needs}, which this estimate lacks"):
            pack(Directions(visibility=np.ones((2, 2))), name)

    def test_the_average_horizon_has_no_length(self):
        config = gtao.GTAO(bent_normal="average_horizon")
        ones = np.ones((1, 1, 3))
        ao = SimpleNamespace(
            visibility=ones[..., 0], bent_normal=ones, mean_direction=ones, visibility_sh=None, config=config
        )
        assert pack(ao, "rgba8").shape == (1, 1, 4)
        assert set(direction_channels(directions_of(ao))) == {"visibility.mean", "bent"}
        with pytest.raises(ConfigError, match="stores mean_direction"):
            pack(ao, "moments8")

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"bent_normal": np.zeros((1, 2, 3))}, "bent_normal is zero somewhere"),
            ({"bent_normal": np.full((1, 2, 3), np.nan)}, "bent_normal is not finite at 6 values"),
            ({"visibility": np.array([[np.inf, 1]])}, "visibility is not finite at 1 values"),
            ({"visibility": np.ones((2, 2))}, r"must be \(H, W, 3\) beside \(H, W\) visibility"),
            ({"bent_normal": np.ones((1, 2, 2))}, r"must be \(H, W, 3\)"),
        ],
    )
    def test_arrays(self, change, message):
        with pytest.raises(ShapeError, match=message):
            pack(replace(bent(random_directions(2)), **change), "rgba8")

    def test_beyond_half_floats(self):
        with pytest.raises(ShapeError, match="half floats hold numbers up to 65504, got 70000"):
            pack(Directions(visibility=np.ones((1, 1)), visibility_sh=np.full((1, 1, 9), 7e4)), "sh16")

    @pytest.mark.parametrize("texels", [np.zeros((2, 2, 4)), np.zeros((2, 2, 3), np.uint8), np.zeros((2, 4), np.uint8)])
    def test_texels(self, texels):
        with pytest.raises(ShapeError, match=r"texels of rgba8 must be \(H, W, 4\) of uint8"):
            unpack(texels, "rgba8")


def test_manifest_says_how_to_read_the_channels():
    told = direction_manifest(directions_of(estimate("uniform")))["directions"]
    assert told["weighting"] == "uniform"
    assert told["visibility_sh"]["indices"] == [[0, 0], [1, -1], [1, 0], [1, 1], *([2, m] for m in range(-2, 3))]
    assert direction_manifest(Directions(visibility=np.ones((1, 1)))) == {}


@pytest.mark.parametrize("name", PACKINGS)
def test_what_comes_back_can_be_packed_again(name):
    """Also the background, where no direction is left: unit vectors everywhere."""
    z = np.full((6, 8), 3.0, np.float32)
    z[2:4, 3:6] = np.inf
    g = gtao.GBuffer(z, None, gtao.PerspectiveCamera(8, 6, 1.0))
    ao = gtao.ambient_occlusion(g, gtao.GTAO(directional=True))
    found = unpack(pack(ao, name), name)
    assert np.linalg.norm(found.bent_normal, axis=-1) == pytest.approx(1, abs=1e-6)
    assert found.bent_normal[3, 4, 2] > 0.99
    pack(found, "rgba8")
