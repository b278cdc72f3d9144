"""HBAO against ray marching with as many directions and steps, 4 rays per direction: the comparison of its sketch.

Bavoil et al. 2008 report 67 against 15 million pixels per second, a ratio of 4.5, on a GPU of their time; samples are
4 to 1. Both run on the same frame in turns, and what counts is the time of the kernels, compiled before. Run as

    python tests/bench/hbao_vs_ray_march.py [--scenes stairs pile …] [--resolution 768] [--rounds 7] [-o RECORD.json]
"""

import argparse
import json
import platform
import statistics
from pathlib import Path

import numpy as np

import gtao
from gtao import render

import drjit as dr  # isort: skip

#: The sketch's numbers: directions, steps per direction, rays per direction, and million pixels per second.
N_DIRECTIONS, N_STEPS, N_RAYS = 8, 8, 4
PUBLISHED = (67, 15)


def kernel_ms(g, method):
    """Time of all kernels of one estimate in milliseconds."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        dr.eval(gtao.ambient_occlusion(g, method).visibility)
        dr.sync_thread()
        return sum(kernel.get("execution_time", 0.0) for kernel in dr.kernel_history())


def compare(name, options):
    scene = render.load_scene(name, resolution=options.resolution)
    g = render.gbuffer(scene)
    view_z = g.view_z.numpy()
    radius = options.radius * float(np.median(view_z[np.isfinite(view_z)]))
    methods = (
        gtao.HBAO(radius=radius, n_directions=N_DIRECTIONS, n_steps=N_STEPS),
        gtao.HeightfieldRayMarch(
            radius=radius,
            n_directions=N_DIRECTIONS,
            rays_per_direction=N_RAYS,
            n_steps=N_STEPS,
            weighting="uniform",
            fetch="nearest",
        ),
    )
    rounds = [[kernel_ms(g, method) for method in methods] for _ in range(options.rounds + 1)]
    # The first round compiles.
    hbao, march = zip(*rounds[1:], strict=True)
    ratios = [b / a for a, b in zip(hbao, march, strict=True)]
    pixels = view_z.size
    return {
        "scene": name,
        "width": view_z.shape[1],
        "height": view_z.shape[0],
        "radius": radius,
        "hbao_ms": hbao,
        "ray_march_ms": march,
        "hbao_mpixel_per_s": pixels / min(hbao) / 1e3,
        "ray_march_mpixel_per_s": pixels / min(march) / 1e3,
        "ratio": statistics.median(ratios),
        "ratio_lowest": min(ratios),
        "ratio_highest": max(ratios),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--scenes", nargs="+", default=["stairs", "pile", "foliage"])
    parser.add_argument("--resolution", type=int, default=768)
    parser.add_argument("--radius", type=float, default=0.1, help="as a share of the scene's median distance")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--threads", type=int, default=1, help="on a busy machine one thread is disturbed the least")
    parser.add_argument("-o", "--output", type=Path, help="write the numbers as JSON")
    options = parser.parse_args()
    dr.set_thread_count(options.threads)
    print(f"{'scene':<12} {'HBAO':>10} {'ray march':>10} {'Mpixel/s':>14} {'ratio':>7}   lowest .. highest round")
    results = []
    for name in options.scenes:
        r = compare(name, options)
        results.append(r)
        print(
            f"{name:<12} {min(r['hbao_ms']):>7.1f} ms {min(r['ray_march_ms']):>7.1f} ms"
            f" {r['hbao_mpixel_per_s']:>6.1f} {r['ray_march_mpixel_per_s']:>7.1f} {r['ratio']:>7.2f}"
            f"   {r['ratio_lowest']:.2f} .. {r['ratio_highest']:.2f}",
            flush=True,
        )
    print(f"published    {PUBLISHED[0]:>34} {PUBLISHED[1]:>7} {PUBLISHED[0] / PUBLISHED[1]:>7.2f}")
    if options.output:
        record = {
            "gtao": gtao.__version__,
            "drjit": dr.__version__,
            "machine": platform.processor() or platform.machine(),
            "cuda": gtao.backend.report().cuda,
            "threads": options.threads,
            "published_mpixel_per_s": PUBLISHED,
            "results": results,
        }
        options.output.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
