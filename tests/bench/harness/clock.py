"""What a call costs: CPU time, wall time, or the time of its kernels; rounds in turns, ratios between neighbours.

On the CPU the time of the process over all threads is the steadiest number on a machine that others use too. On a GPU
the host only waits, and what counts is the time that the device reports for its kernels.
"""

import statistics
import time

import drjit as dr

__all__ = ["CLOCKS", "compare", "interleave", "seconds", "summary"]

CLOCKS = ("cpu", "kernels", "wall")


def seconds(run, clock):
    """Seconds of one call of ``run``, which evaluates what it computes.

    Args:
        run: called without arguments.
        clock: "cpu", time of the process on all its threads; "kernels", the sum over Dr.Jit's launches; or "wall".
    """
    if clock == "kernels":
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            run()
            dr.sync_thread()
            return 1e-3 * sum(kernel.get("execution_time", 0.0) for kernel in dr.kernel_history())
    read = {"cpu": time.process_time, "wall": time.perf_counter}[clock]
    start = read()
    run()
    dr.sync_thread()
    return read() - start


def interleave(runs, clock, rounds, budget_s):
    """Name -> seconds of every round A B C A B C …, after two rounds that compile and settle.

    Args:
        runs: name -> callable.
        rounds: as many at most; at least three, however long they take.
        budget_s: no further round begins after so many seconds.
    """
    for run in (*runs.values(), *runs.values()):
        seconds(run, "wall")
    times = {name: [] for name in runs}
    start = time.perf_counter()
    for done in range(rounds):
        if done >= 3 and time.perf_counter() - start > budget_s:
            break
        for name, run in runs.items():
            times[name].append(seconds(run, clock))
    return times


def summary(times, base):
    """Name -> best and median seconds, and the ratio to ``base``: of the bests, and over pairs of the same round."""
    rows = {}
    for name, values in times.items():
        paired = sorted(a / b for a, b in zip(values, times[base], strict=True))
        quarter = len(paired) // 4
        rows[name] = {
            "best_s": min(values),
            "median_s": statistics.median(values),
            "ratio": {
                "best": min(values) / min(times[base]),
                "median": statistics.median(paired),
                "low": paired[quarter],
                "high": paired[-1 - quarter],
            },
            "rounds": len(values),
        }
    return rows


def compare(runs, base, options):
    """:func:`summary` of :func:`interleave` by the clock and within the budget of ``options``."""
    return summary(interleave(runs, options.clock, options.rounds, options.budget_s), base)
