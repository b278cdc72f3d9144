"""Thickness heuristic: a depth buffer does not know how thick an occluder is, so farther samples may lower the horizon.

Samples come in the order of marching, outward; another order gives another horizon. Horizons are cosines ⟨ω, V⟩.
"""

import drjit as dr

__all__ = ["from_previous", "running"]


def running(c, horizon, tau):
    """The horizon after a sample of cosine c: c if it rises above the horizon, else moved toward c by the share τ.

    H ← c >= H ? c : H + τ (c - H). Jimenez et al. 2016, Eq. 9, in cosines and compared with the horizon itself.

    Args:
        tau: share in [0, 1]; 0 is the plain maximum. The paper gives no value.
    """
    return dr.select(c >= horizon, c, dr.fma(tau, c - horizon, horizon))


def from_previous(c, previous, horizon, tau):
    """The horizon after a sample of cosine c, by whether c rises above the sample before it.

    H ← c >= c_previous ? max(H, c) : H + τ (c - H). Jimenez et al. 2016, Eq. 9 as printed, in cosines. A sample
    below the horizon then leaves it where it is if it rises from its predecessor.

    Args:
        previous: cosine of the sample before; -1 for the first.
        tau: share in [0, 1].
    """
    highest = dr.select(c >= horizon, c, horizon)
    return dr.select(c >= previous, highest, dr.fma(tau, c - horizon, horizon))
