"""Every method of irradiance against ray-traced light: tables, pictures, a record, a report."""

from .methods import IRRADIANCE_METHODS
from .run import CompareLightingOutcome, compare_lighting
from .settings import LIGHTS, CompareLightingConfig

__all__ = ["IRRADIANCE_METHODS", "LIGHTS", "CompareLightingConfig", "CompareLightingOutcome", "compare_lighting"]
