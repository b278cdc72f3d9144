"""What each method makes of the samples of a slice; see :mod:`gtao.kernels.march` for the three functions."""

from .horizon import Horizon
from .sectors import Sectors
from .soft import SoftHorizon, SoftSphereCut
from .sphere import SphereCut
from .tangent import TangentToHorizon

__all__ = ["Horizon", "Sectors", "SoftHorizon", "SoftSphereCut", "SphereCut", "TangentToHorizon"]
