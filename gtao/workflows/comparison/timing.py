"""Times of several jobs in one interleaved run."""

import time
from collections.abc import Callable, Mapping
from typing import Any

import drjit as dr

__all__ = ["interleaved"]


def interleaved(jobs: Mapping[str, Callable[[], Any]], rounds: int) -> dict[str, float]:
    """Seconds of the fastest of ``rounds`` runs of each job, the jobs taking turns (A B C A B C …).

    A job returns what must be evaluated. Compilation is left out: every job runs once before the clock starts.
    """
    for job in jobs.values():
        dr.eval(job())
    dr.sync_thread()
    best = dict.fromkeys(jobs, float("inf"))
    for _ in range(rounds):
        for name, job in jobs.items():
            start = time.perf_counter()
            dr.eval(job())
            dr.sync_thread()
            best[name] = min(best[name], time.perf_counter() - start)
    return best
