"""The estimators as functions on the arrays of PyTorch and JAX, with gradients.

``gtao.interop.torch`` and ``gtao.interop.jax`` load when they are first used. Each needs its framework, which the
extras ``gtao[torch]`` and ``gtao[jax]`` install.
"""

import importlib
from typing import Any

_MODULES = ("jax", "torch")


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return importlib.import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(_MODULES)
