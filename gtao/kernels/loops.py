"""Symbolic loops that are traced once."""

from collections.abc import Callable
from typing import Any

import drjit as dr

__all__ = ["while_loop"]


def while_loop(start: tuple[Any, ...], more: Callable[..., Any], body: Callable[..., Any], **options: Any):
    """``dr.while_loop``, but that what the body leaves alone stays in the state.

    Dr.Jit would trace the body for a second time without it: a kernel of slices gains nothing from that, and tracing is
    most of what a call costs on small frames.
    """
    with dr.scoped_set_flag(dr.JitFlag.OptimizeLoops, False):
        return dr.while_loop(start, more, body, **options)
