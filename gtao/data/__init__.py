"""Published and refitted coefficients, each with its provenance."""

from .multibounce import FORM_PARAMETERS, JIMENEZ2016, REFIT_2026_11, SPHERE, MultibounceFit

__all__ = ["FORM_PARAMETERS", "JIMENEZ2016", "REFIT_2026_11", "SPHERE", "MultibounceFit"]
