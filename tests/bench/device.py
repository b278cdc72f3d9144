"""Device: times of kernels alone, whole frames of a frozen function, and the share of the memory's bandwidth.

The kernel history of Dr.Jit exists on the CPU as well; a GPU is where its times are what counts. The floor is the time
in which the memory could bring every input once and take every output once.

python -m tests.bench.device [--quick] [--bandwidth GB/s]
"""

import drjit as dr

import gtao

from .harness import package
from .harness.clock import interleave, seconds
from .harness.options import run_section
from .harness.table import milliseconds
from .harness.work import COUNTS, Work, frame

#: Bytes per pixel that no implementation can do without: depth, normals and visibility; and the four gradients.
BYTES = {"estimate": 20, "estimate and gradients": 36, "estimate and gradients, fused": 36}
STREAMED = 1 << 26


def bandwidth():
    """Bytes per second of a kernel that reads and writes 256 MiB, the best of ten."""
    Float = gtao.backend.default_float()
    source = dr.full(Float, 1, STREAMED) + dr.opaque(Float, 0)
    dr.eval(source)

    def copy():
        dr.eval(source + 1)

    copy()
    return 8 * STREAMED / min(seconds(copy, "kernels") for _ in range(10))


def measure(options):
    rate = options.bandwidth or bandwidth()
    entries = []
    for name in ("1x8", "9x3") if options.quick else COUNTS:
        work = Work.of("540p" if options.quick else "1080p", COUNTS[name])
        g, method = frame(work).gbuffer(work), work.method()
        made = {
            "estimate": (package.estimate, package.frozen_estimate),
            "estimate and gradients": (package.gradient, package.frozen_gradient),
            "estimate and gradients, fused": (package.fused, package.frozen_fused),
        }
        for what, (plain, frozen) in made.items():
            kernels = interleave({what: plain(g, method)}, "kernels", options.rounds, options.budget_s / 4)
            walls = interleave(
                {"plain": plain(g, method), "frozen": frozen(g, method)}, "wall", options.rounds, options.budget_s / 4
            )
            floor = BYTES[what] * work.n_pixels / rate
            entries.append(
                {
                    "what": what,
                    "counts": name,
                    "pixels": work.n_pixels,
                    "kernels_s": min(kernels[what]),
                    "plain_s": min(walls["plain"]),
                    "frozen_s": min(walls["frozen"]),
                    "floor_s": floor,
                    "share": floor / min(kernels[what]),
                }
            )
    return {"backend": gtao.backend.require(), "bandwidth": rate, "entries": entries}


def tables(numbers):
    rows = [
        (
            f"{e['what']}, {e['counts']}",
            *(milliseconds(e[key]) for key in ("kernels_s", "plain_s", "frozen_s", "floor_s")),
            f"{e['share']:.1%}",
        )
        for e in numbers["entries"]
    ]
    pixels = numbers["entries"][0]["pixels"] / 1e6
    title = f"{numbers['backend']}, {pixels:.2f} M pixels, {numbers['bandwidth'] / 1e9:.0f} GB/s"
    yield title, ("ms", "kernels", "call", "frozen call", "floor", "floor / kernels"), rows


if __name__ == "__main__":
    run_section(measure, tables, __doc__)
