"""Work in pieces of bounded size, so that memory stays low and progress can be told."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

__all__ = ["Chunk", "Progress", "chunks"]

#: Called as ``progress(done, total)`` after every piece of work.
Progress = Callable[[int, int], None]

#: Paths in one launch: about a second of work on two CPU cores, and enough lanes to fill a GPU.
PATHS_PER_CHUNK = 1 << 20


@dataclass(frozen=True)
class Chunk:
    """Lanes ``start`` to ``stop`` of batch number ``batch``."""

    batch: int
    start: int
    stop: int


def chunks(n_lanes: int, n_batches: int, spp_per_batch: int, progress: Progress | None) -> Iterator[Chunk]:
    """All batches of all lanes, those of the same lanes in turn; the caller must finish a piece before the next."""
    size = max(1, min(n_lanes, PATHS_PER_CHUNK // spp_per_batch))
    pieces = [
        Chunk(batch, start, min(start + size, n_lanes))
        for start in range(0, n_lanes, size)
        for batch in range(n_batches)
    ]
    for done, piece in enumerate(pieces, 1):
        yield piece
        if progress is not None:
            progress(done, len(pieces))
