"""Published and refitted coefficients, each with its provenance."""

from .multibounce import FORM_PARAMETERS, JIMENEZ2016, SPHERE, MultibounceFit

__all__ = ["FORM_PARAMETERS", "JIMENEZ2016", "SPHERE", "MultibounceFit"]
