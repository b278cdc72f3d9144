"""Noise-free gates on the estimator: launches, operation counts and recompilation, never seconds."""

import drjit as dr
import numpy as np
import pytest

import gtao
from gtao.kernels.sampler import Sampler

# Operations of the traced kernel as built now, with 2 % for changes inside Dr.Jit. A larger count is a slower kernel.
SLACK = 1.02
OPERATIONS = {
    "1x8 falloff": (942, {"n_slices": 1, "n_steps": 8, "radius": 0.5, "falloff": (0.2, 0.5)}),
    "1x8 sphere": (1412, {"n_slices": 1, "n_steps": 8, "radius": 0.5}),
    "9x3 sphere": (798, {"n_slices": 9, "n_steps": 3, "radius": 0.5}),
    "1x8 falloff, bent": (1005, {"bent_normal": True, "n_slices": 1, "radius": 0.5, "falloff": (0.2, 0.5)}),
    "1x8 falloff, directional": (1125, {"directional": True, "n_slices": 1, "radius": 0.5, "falloff": (0.2, 0.5)}),
    "9x3 sphere, directional": (1023, {"directional": True, "n_slices": 9, "n_steps": 3, "radius": 0.5}),
    "16x32 unlimited": (2295, {"n_slices": 16, "n_steps": 32}),
}


def buffer(width=64, height=48):
    z = 3 + 0.1 * np.random.default_rng(1).random((height, width))
    return gtao.GBuffer(z.astype(np.float32), None, gtao.PerspectiveCamera(width, height, 1.0))


def method(options):
    options = dict(options)
    if "falloff" in options:
        start, end = options["falloff"]
        options["falloff"] = gtao.LinearFalloff(start=start, end=end)
    return gtao.GTAO(**options)


def kernels(g, m, frame_index=0):
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        ao = gtao.ambient_occlusion(g, m, frame_index=frame_index)
        planes = [ao.planes(name) for name in ("mean_direction", "visibility_sh")]
        dr.eval(ao.visibility, [p.arrays for p in planes if p is not None])
        dr.sync_thread()
        return [k for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]


@pytest.mark.parametrize("name", OPERATIONS)
def test_one_kernel_of_the_recorded_size(name):
    expected, options = OPERATIONS[name]
    (kernel,) = kernels(buffer(), method(options))
    assert kernel["operation_count"] <= expected * SLACK


@pytest.mark.parametrize("n_slices", [1, 9])
@pytest.mark.parametrize("attached", [False, True])
@pytest.mark.parametrize("options", [{}, {"step_jitter": "pixel"}, {"noise": "none"}])
def test_every_sample_is_traced_once(n_slices, attached, options, monkeypatch):
    """On small frames a call costs what tracing costs. Where slices share one offset, Dr.Jit would trace them twice."""
    traced, look = [], Sampler.read

    def read(self, sl, places):
        traced.extend(places)
        return look(self, sl, places)

    monkeypatch.setattr(Sampler, "read", read)
    g = buffer()
    if attached:
        dr.enable_grad(g.view_z)
    dr.eval(gtao.ambient_occlusion(g, gtao.GTAO(n_slices=n_slices, n_steps=3, radius=0.5, **options)).visibility)
    # Of a loop over slices there is one body, three steps on both sides of a slice.
    assert len(traced) == 6


@pytest.mark.parametrize(("measure", "saved"), [("screen", 8), ("view", 0)])
def test_square_pixels_keep_unit_directions_of_the_image(measure, saved):
    """Directions that are even in the image then need no normalising; those about the view vector always do."""
    m = gtao.GTAO(slice_measure=measure, radius=0.5, n_slices=3, falloff=gtao.NoCut())
    square, other = (
        gtao.GBuffer(buffer().view_z, None, gtao.PerspectiveCamera(64, 48, fx=40.0, fy=fy)) for fy in (40.0, 41.0)
    )
    (few,), (more,) = kernels(square, m), kernels(other, m)
    assert more["operation_count"] - few["operation_count"] >= saved
    assert (few["hash"] == more["hash"]) == (saved == 0)


def test_the_linear_fetch_prepares_its_field_once():
    g = buffer()
    m = gtao.GTAO(fetch="linear")
    kernels(g, m)
    assert len(kernels(g, m, frame_index=1)) == 1


@pytest.mark.parametrize(
    "changes",
    [
        {"radius": 0.7},
        {"falloff": (0.25, 0.5)},
        {"max_radius_px": 9.0},
        {"seed": 5},
        {},
    ],
    ids=["radius", "falloff", "max_radius_px", "seed", "frame"],
)
def test_values_change_without_recompiling(changes):
    g = buffer()
    base = {"radius": 0.5, "n_slices": 2, "n_steps": 4, "max_radius_px": 12.0, "noise": "white"}
    if "falloff" in changes:
        base["falloff"] = (0.2, 0.5)
    kernels(g, method(base))
    (kernel,) = kernels(g, method(base | changes), frame_index=3)
    assert kernel["cache_hit"]


def test_the_camera_changes_without_recompiling():
    first = buffer()
    second = gtao.GBuffer(first.view_z, first.normal_v, gtao.PerspectiveCamera(64, 48, 0.7, cx=20.0, cy=30.0))
    m = gtao.GTAO(n_slices=3)
    kernels(first, m)
    (kernel,) = kernels(second, m)
    assert kernel["cache_hit"]


def test_a_switch_does_compile_anew():
    """The gate above can fail: a static parameter makes another kernel."""
    g = buffer()
    hashes = {kernels(g, gtao.GTAO(n_slices=2, n_steps=n))[0]["hash"] for n in (4, 5)}
    assert len(hashes) == 2
