"""The subcommands of ``gtao``: thin wrappers that turn options into calls of :mod:`gtao.workflows` and friends."""

from .animate import animate
from .files import export, export_packing, occlusion, render
from .glossy import compare_specular, fit_aperture
from .inspection import doctor, methods, scenes
from .studies import compare, compare_lighting, refit
from .tables import bake
from .tuning import tune

__all__ = ["COMMANDS"]

#: In the order of the help.
COMMANDS = (
    doctor,
    render,
    occlusion,
    refit,
    compare,
    compare_lighting,
    compare_specular,
    animate,
    tune,
    fit_aperture,
    bake,
    export,
    export_packing,
    scenes,
    methods,
)
