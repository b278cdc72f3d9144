"""Soft horizons: accumulators whose maxima are smooth."""

from dataclasses import fields
from typing import Any

from gtao.kernels.accumulators import Horizon, SoftHorizon, SoftSphereCut, SphereCut

__all__ = ["softened"]

_SOFT: dict[type, Any] = {Horizon: SoftHorizon, SphereCut: SoftSphereCut}


def softened(accumulator: Horizon | SphereCut, temperature: Any) -> SoftHorizon | SoftSphereCut:
    """The accumulator with smooth maxima of a temperature, a kernel input of width one, in units of cosines."""
    options = {f.name: getattr(accumulator, f.name) for f in fields(accumulator)}
    return _SOFT[type(accumulator)](**options, temperature=temperature)
