"""Cost of one transport render against one render with the stock path tracer.

Same scene, same number of bounces, same number of walks per pixel, and the path tracer with a stratified sampler as
well as with its default one. The two alternate, and CPU time on one thread is counted, so that a busy machine does
not decide. Run as

    python tests/bench/transport_vs_path.py [--scenes stairs pile …] [--spp 256] [--bounces 4] [--rounds 5]
"""

import argparse
import statistics
import time

from gtao import render

import drjit as dr  # isort: skip
import mitsuba as mi  # isort: skip


def cpu_seconds(work, *arguments):
    start = time.process_time()
    work(*arguments)
    dr.sync_thread()
    return time.process_time() - start


def load(name, resolution, sampler):
    """An embedded scene with the wanted sampler; a file keeps its own."""
    if name not in render.scenes.names():
        return render.load_scene(name, resolution=resolution)
    description = render.scenes.build(name, width=resolution, height=resolution)
    description["sensor"]["sampler"]["type"] = sampler
    return render.load_scene(description)


def compare(name, sampler, options):
    scene = load(name, options.resolution, sampler)
    integrator = mi.load_dict({"type": "path", "max_depth": options.bounces + 1, "rr_depth": 1000})

    def transport(seed):
        render.transport(scene, n_bounces=options.bounces, spp=options.spp, seed=seed)

    def path(seed):
        dr.eval(integrator.render(scene, 0, seed=seed, spp=options.spp))

    rounds = [(cpu_seconds(transport, seed), cpu_seconds(path, seed)) for seed in range(options.rounds + 1)]
    # The first round compiles.
    ours, stock = zip(*rounds[1:], strict=True)
    ratios = [a / b for a, b in zip(ours, stock, strict=True)]
    print(
        f"{name:<12} {sampler:<12} {min(ours):>9.2f}s {min(stock):>9.2f}s {statistics.median(ratios):>7.2f}"
        f"   {min(ratios):.2f} .. {max(ratios):.2f}",
        flush=True,
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--scenes", nargs="+", default=["cornell", "stairs", "pile", "cloth"])
    parser.add_argument("--samplers", nargs="+", default=["independent", "multijitter"])
    parser.add_argument("--resolution", type=int, default=128)
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--bounces", type=int, default=4)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    dr.set_thread_count(1)
    print(f"{'scene':<12} {'sampler':<12} {'transport':>10} {'path':>10} {'ratio':>7}   lowest .. highest round")
    for name in options.scenes:
        for sampler in options.samplers:
            compare(name, sampler, options)


if __name__ == "__main__":
    main()
