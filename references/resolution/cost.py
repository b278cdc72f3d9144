"""What a smaller frame costs and saves: CPU time of one thread, and kernels."""

import time

import drjit as dr
import numpy as np

import gtao

WIDTH, HEIGHT, ROUNDS = 1920, 1080, 7
#: Slices and steps per side.
COUNTS = {"1 × 8": (1, 8), "3 × 8": (3, 8)}
FACTORS = (2, 4)
WAYS = {
    "bilinear": gtao.BilinearUpsample(),
    "nearest depth": gtao.NearestDepthUpsample(),
    "bilateral": gtao.BilateralUpsample(),
    "plane-aware": gtao.PlaneAwareUpsample(),
}


def scene(width, height):
    """Waves with steps and some background, as arrays of Dr.Jit."""
    camera = gtao.PerspectiveCamera(width, height, 0.9)
    y, x = np.mgrid[:height, :width] * (1080 / height)
    z = (5 + np.sin(x / 50) * np.cos(y / 70) + 2 * ((x // 200 + y // 150) % 2)).astype(np.float32)
    z[: height // 27] = np.inf
    g = gtao.GBuffer(z, None, camera)
    return g.view_z, dr.opaque(g.normal_v), camera


def kernels(work):
    """How many kernels the second call launches."""
    work()
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        work()
        dr.sync_thread()
        return sum(k["type"] is dr.KernelType.JIT for k in dr.kernel_history())


def least(works, rounds):
    """Name -> least CPU time in milliseconds, the works in turn in every round."""
    times = {name: [] for name in works}
    for _ in range(rounds):
        for name, work in works.items():
            dr.sync_thread()
            started = time.process_time()
            work()
            dr.sync_thread()
            times[name].append(1e3 * (time.process_time() - started))
    # The first compiles.
    return {name: min(t[1:]) for name, t in times.items()}


def works_of(view_z, normal_v, camera):
    def frame():
        # As new as the next one of an animation: nothing is kept from a frame before.
        return gtao.GBuffer(view_z, normal_v, camera, validate=False)

    def estimate(g, counts):
        method = gtao.GTAO(radius=0.5, n_slices=counts[0], n_steps=counts[1])
        ao = gtao.ambient_occlusion(g, method)
        dr.eval(ao.visibility)
        return ao

    works = {f"full, {n}": lambda c=c: estimate(frame(), c) for n, c in COUNTS.items()}
    for factor in FACTORS:
        how, g = gtao.Downsample(factor=factor), frame()
        small = gtao.downsample(g, how)
        ao = estimate(small, (1, 8))
        works[f"down, {factor}"] = lambda how=how: gtao.downsample(frame(), how)
        for name, way in WAYS.items():
            works[f"up, {factor}, {name}"] = lambda a=(ao, small, g, way): dr.eval(gtao.upsample(*a).visibility)
        for name, counts in COUNTS.items():

            def all_of_it(how=how, counts=counts):
                g = frame()
                small = gtao.downsample(g, how)
                dr.eval(gtao.upsample(estimate(small, counts), small, g).visibility)

            works[f"all, {factor}, {name}"] = all_of_it
    return works


def measured(quick):
    """Times in milliseconds and numbers of kernels by what is done, and the size of the frame."""
    size = (240, 135) if quick else (WIDTH, HEIGHT)
    works = works_of(*scene(*size))
    threads = dr.thread_count()
    dr.set_thread_count(1)
    try:
        times = least(works, 3 if quick else ROUNDS)
    finally:
        dr.set_thread_count(threads)
    return {"size": list(size), "ms": times, "kernels": {name: kernels(work) for name, work in works.items()}}
