"""The stages of a pipeline: each is the public function of its name; a history moves on when all are through."""

import copy

import drjit as dr
import numpy as np
import pytest

import gtao
from gtao.estimators import pipeline as driver

WIDTH, HEIGHT = 32, 24
CAMERA = gtao.PerspectiveCamera(WIDTH, HEIGHT, 0.9)
METHOD = gtao.GTAO(radius=1.5, n_slices=1, n_steps=4, bent_normal=True)
FULL = gtao.Pipeline(
    occlusion=METHOD,
    downsample=gtao.Downsample(),
    spatial=gtao.SpatialFilter(),
    temporal=gtao.TemporalFilter(),
    upsample=gtao.BilateralUpsample(),
)
STAGES = ("downsample", "spatial", "temporal", "upsample")


def frame(k=0, dtype=np.float32):
    """Steps and hills that move to the right by a pixel from frame to frame, before a background."""
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    z = 4 + 0.3 * np.sin(0.5 * (x - k)) * np.cos(0.4 * y) + np.where((x - k) % 16 < 6, 1.0, 0.0)
    z[:3] = np.inf
    motion = np.zeros((HEIGHT, WIDTH, 3))
    motion[..., 0] = 1.0 if k else 0.0
    return gtao.GBuffer(z.astype(dtype), None, CAMERA, motion=motion.astype(dtype))


def same(a, b):
    np.testing.assert_array_equal(a.visibility.numpy(), b.visibility.numpy())
    np.testing.assert_array_equal(a.mean_direction.numpy(), b.mean_direction.numpy())


def test_stages_are_the_functions_one_after_the_other():
    history, by_hand = gtao.History(), gtao.History()
    for k in range(3):
        g = frame(k)
        stages = FULL.stages(g, history)
        small = gtao.downsample(g, FULL.downsample)
        np.testing.assert_array_equal(stages.frame.view_z.numpy(), small.view_z.numpy())
        ao = gtao.ambient_occlusion(small, METHOD, frame_index=k)
        same(stages.occlusion, ao)
        ao = gtao.denoise(ao, small, FULL.spatial, frame_index=k)
        same(stages.spatial, ao)
        ao = FULL.temporal.step(ao, small, by_hand)
        same(stages.temporal, ao)
        ao = gtao.upsample(ao, small, g, FULL.upsample)
        same(stages.upsampled, ao)
        clamped = np.clip(ao.visibility.numpy(), 0, 1)
        assert k or (clamped != ao.visibility.numpy()).any()
        np.testing.assert_array_equal(stages.result.visibility.numpy(), clamped)
        np.testing.assert_array_equal(stages.result.mean_direction.numpy(), ao.mean_direction.numpy())
    assert history.frame_index == 3


@pytest.mark.parametrize(
    "left_out", [(), ("spatial",), ("temporal",), ("upsample",), ("downsample", "upsample"), STAGES]
)
def test_every_stage_is_optional(left_out):
    pipeline = gtao.Pipeline(
        **({name: getattr(FULL, name) for name in STAGES if name not in left_out}), occlusion=METHOD
    )
    history = gtao.History()
    for k in range(2):
        stages = pipeline.stages(frame(k), history)
    for name, stage in (("spatial", "spatial"), ("temporal", "temporal"), ("upsample", "upsampled")):
        assert (getattr(stages, stage) is None) == (name in left_out)
    small = "downsample" not in left_out
    assert stages.frame.shape == ((HEIGHT // 2, WIDTH // 2) if small else (HEIGHT, WIDTH))
    full = not small or "upsample" not in left_out
    assert stages.result.visibility.shape == ((HEIGHT, WIDTH) if full else (HEIGHT // 2, WIDTH // 2))
    # The noise moves on with the history, whether or not it is accumulated.
    assert history.frame_index == 2
    assert history.is_empty == ("temporal" in left_out)


def test_noise_and_footprints_follow_the_history_or_a_given_index():
    alone = [FULL.stages(frame(), frame_index=k) for k in (0, 5)]
    assert (alone[0].occlusion.visibility.numpy() != alone[1].occlusion.visibility.numpy()).any()
    same(FULL.stages(frame()).spatial, alone[0].spatial)
    history = gtao.History()
    history.frame_index = 5
    same(FULL.stages(frame(), history).spatial, alone[1].spatial)
    assert history.frame_index == 6
    same(FULL.stages(frame(), history, frame_index=0).spatial, alone[0].spatial)
    assert history.frame_index == 7


def test_an_error_in_the_last_stage_leaves_the_history_as_it_was(monkeypatch):
    history = gtao.History()
    FULL.step(frame(0), history)
    before, image = copy.copy(history), history.visibility.numpy()

    def broken(*_):
        raise gtao.ConfigError("broken")

    with monkeypatch.context() as patch:
        patch.setattr(driver, "upsample", broken)
        with pytest.raises(gtao.ConfigError, match="broken"):
            FULL.step(frame(1), history)
    assert (history.frame_index, history.contents) == (before.frame_index, before.contents)
    np.testing.assert_array_equal(history.visibility.numpy(), image)


def test_a_sequence_goes_on_from_a_file_as_if_nothing_had_happened(tmp_path):
    history, images = gtao.History(), []
    for k in range(8):
        images.append(FULL.step(frame(k), history).visibility.numpy())
        gtao.io.write_history(tmp_path / f"{k}.npz", history)
    for start in range(7):
        again = gtao.io.read_history(tmp_path / f"{start}.npz")
        for k in range(start + 1, 8):
            np.testing.assert_array_equal(FULL.step(frame(k), again).visibility.numpy(), images[k])


def kernels(run):
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        run()
        dr.sync_thread()
        return [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]


def test_each_stage_is_one_kernel_and_none_is_compiled_twice():
    history = gtao.History()
    frames = [frame(k) for k in range(5)]
    for g in frames[:3]:
        # Footprints change sides, so that two frames know all kernels of the third.
        dr.eval(FULL.step(g, history).visibility, FULL.step(g, history).visibility)
    launched = kernels(lambda: dr.eval(FULL.step(frames[3], history).visibility))
    assert all(k["cache_hit"] for k in launched)
    # Smaller frame, estimate, two filters, back to full size with the clamp.
    assert len(launched) <= 6, [k["size"] for k in launched]


def test_memory_stays_the_same_over_a_thousand_frames():
    history, frames = gtao.History(), [frame(k) for k in range(4)]
    pipeline = gtao.Pipeline.as_published(1.5)
    backend = dr.backend_v(gtao.backend.default_float())

    def run(n):
        """Peak of the memory over n frames, and the table of live variables after them, their names and sizes."""
        dr.detail.malloc_clear_statistics()
        for k in range(n):
            dr.eval(pipeline.step(frames[k % 4], history).visibility)
        dr.sync_thread()
        table = dr.whos(as_string=True).split("=====\n")[1]
        return dr.detail.malloc_watermark(backend), sorted(
            line.split()[1:] for line in table.splitlines() if line.strip()
        )

    run(40)
    early = run(60)
    run(800)
    assert run(100) == early
    assert history.frame_index == 1000


def test_the_published_pipeline():
    pipeline = gtao.Pipeline.as_published(3.0)
    assert pipeline.occlusion == gtao.GTAO.as_published(3.0)
    assert (pipeline.occlusion.n_slices, pipeline.occlusion.n_steps, pipeline.occlusion.noise) == (1, 8, "spatial_4x4")
    assert (pipeline.downsample.factor, pipeline.downsample.choice) == (2, "nearest")
    assert pipeline.upsample == gtao.BilateralUpsample(threshold=0.1)
    assert pipeline.temporal.clamp
    assert pipeline.temporal.velocity_weighting
    for each in (pipeline, FULL):
        assert gtao.method_from_dict(each.to_dict()) == each


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: gtao.Pipeline(upsample=gtao.BilateralUpsample()), gtao.ConfigError, "upsample without downsample"),
        (
            lambda: gtao.Pipeline(occlusion=3),
            gtao.ConfigError,
            r"occlusion must be a method of gtao\.ambient_occlusion, got 3",
        ),
        (lambda: gtao.Pipeline(temporal=gtao.SpatialFilter()), gtao.ConfigError, "temporal must be None or one of"),
        (lambda: gtao.Pipeline(spatial="4x4"), gtao.ConfigError, "spatial must be None or one of"),
        (lambda: gtao.Pipeline(downsample=2), gtao.ConfigError, "downsample must be None or one of Downsample"),
        (lambda: FULL.step("frame"), gtao.ConfigError, r"g must be a gtao\.GBuffer"),
        (lambda: FULL.step(frame(), {}), gtao.ConfigError, r"history must be a gtao\.History or None, got dict"),
        (lambda: FULL.step(frame(), frame_index=-1), gtao.ConfigError, "frame_index must be"),
    ],
)
def test_refusals_of_stages(make, error, words):
    with pytest.raises(error, match=words):
        make()


def test_a_history_of_another_size_is_refused_and_kept():
    history = gtao.History()
    FULL.step(frame(), history)
    wider = gtao.Pipeline(occlusion=METHOD, temporal=gtao.TemporalFilter())
    with pytest.raises(gtao.ShapeError, match=r"16x12 pixels, this one has 32x24; call history\.reset"):
        wider.step(frame(), history)
    assert history.frame_index == 1
    history.reset()
    wider.step(frame(), history)
    assert history.shape == (HEIGHT, WIDTH)
