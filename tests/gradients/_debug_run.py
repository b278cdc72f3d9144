"""Run in a process of its own: what Dr.Jit's debug mode finds goes to the standard error stream of the process."""

import sys

import gtao  # isort: skip

import drjit as dr
import numpy as np
from drjit.llvm.ad import Float, TensorXf, UInt32

SHAPE = (12, 16)
LINEAR = gtao.LinearFalloff(start=0.3, end=0.9)
METHODS = [
    gtao.GTAO(n_slices=2, n_steps=4, **options)
    for options in (
        {},
        {"radius": 0.9, "weighting": "uniform"},
        {"radius": 0.9, "falloff": LINEAR, "step_law": "beyond", "border": "replicate"},
        {"radius": 0.9, "fetch": "linear", "step_law": "offset", "border": "clamp"},
        {"radius": 0.9, "fetch": "bilinear", "pyramid": gtao.DepthPyramid(filter="average", level_offset=0.0)},
        {"radius": 0.9, "fetch": "nearest_of_four", "zenith": "optical_axis", "falloff": gtao.NoCut()},
        {"radius": 0.9, "fetch": "floor", "noise": "white"},
        {"radius": 0.9, "pyramid": gtao.DepthPyramid(level_offset=-2.0)},
        {"radius": 0.9, "falloff": LINEAR, "thickness": gtao.RunningThickness(blend=0.2)},
    )
] + [gtao.HBAO(radius=0.9, n_directions=4, n_steps=4, attenuation=a) for a in ("none", "sample", "horizon")]
METHODS.append(gtao.GTAO(radius=0.9, n_slices=1, n_steps=40))
ONLY_FORWARD = [
    gtao.VisibilityBitmask(radius=0.9, n_slices=2, n_steps=4, thickness=gtao.ConstantThickness(thickness=0.2)),
    gtao.HeightfieldRayMarch(radius=0.9, n_directions=2),
    gtao.HeightfieldHorizon(radius=0.9, n_slices=2),
]


def frames():
    """Holes, silhouettes and samples off the frame in both projections."""
    rng = np.random.default_rng(0)
    z = (3 + 0.5 * rng.random(SHAPE)).astype(np.float32)
    z[3:6, 5:8], z[:, 12] = np.inf, np.inf
    height, width = SHAPE
    for camera in (gtao.PerspectiveCamera(width, height, 1.0), gtao.OrthographicCamera(width, height, 2.0)):
        yield z, camera


def main():
    done = 0
    for z, camera in frames():
        for method in ONLY_FORWARD:
            dr.eval(gtao.ambient_occlusion(gtao.GBuffer(z, None, camera), method).visibility)
            done += 1
        for method in METHODS:
            depth = TensorXf(z)
            dr.enable_grad(depth)
            visibility = gtao.ambient_occlusion(gtao.GBuffer(depth, None, camera), method).visibility
            dr.backward(dr.sum(visibility, axis=None))
            dr.eval(dr.grad(depth))
            done += 1
    dr.sync_thread()
    print(done)


dr.set_flag(dr.JitFlag.Debug, True)
if "--out-of-bounds" in sys.argv:
    dr.eval(dr.gather(Float, dr.opaque(Float, 1, 4), UInt32(2, 9)))
    dr.sync_thread()
else:
    main()
