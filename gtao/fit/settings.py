"""What is asked of a multi-bounce fit, checked before anything is traced."""

from dataclasses import dataclass, replace

import numpy as np

from gtao.errors import ConfigError

from .constraints import CONSTRAINTS
from .forms import Polynomial, fitted_form
from .samples import Samples

__all__ = ["REPORT_ALBEDOS", "FitSettings", "check"]

#: Albedos of Jimenez et al. 2016.
REPORT_ALBEDOS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9)

PROCEDURES = ("joint", "two-step")
WEIGHTINGS = ("scene", "pixel", "uniform")

LABELS = {
    "linear_cubic": "linear cubic",
    "four_parameter": "four parameters",
    "one_parameter": "one parameter",
    "two_parameter": "two parameters",
    "above_visibility": "f ≥ V",
    "monotone": "monotone",
    "energy": "energy bound",
}

#: What a cubic of one albedo can hold; the inequalities tie the albedos together.
TWO_STEP_CONSTRAINTS = {"zero_at_zero", "unit_at_one"}


@dataclass(frozen=True, kw_only=True)
class FitSettings:
    """The arguments of :func:`gtao.fit.multibounce`, which explains them.

    Raises:
        ConfigError: A value outside its range, or a combination that makes no sense.
    """

    form: str = "linear_cubic"
    bounces: float = 4
    albedos: tuple[float, ...] = REPORT_ALBEDOS
    procedure: str = "joint"
    constraints: tuple[str, ...] = ("unit_at_one",)
    weighting: str = "scene"
    n_bootstrap: int = 1000
    level: float = 0.95
    seed: int = 0

    def __post_init__(self) -> None:
        fitted_form(self.form)
        if isinstance(self.constraints, str):
            raise ConfigError(f"constraints must be a tuple of names, got the string {self.constraints!r}")
        unknown = [name for name in self.constraints if name not in CONSTRAINTS]
        if unknown:
            raise ConfigError(
                f"unknown constraint {', '.join(map(repr, unknown))}; choose from {', '.join(CONSTRAINTS)}"
            )
        for name, choices in (("procedure", PROCEDURES), ("weighting", WEIGHTINGS)):
            if getattr(self, name) not in choices:
                raise ConfigError(f"unknown {name} {getattr(self, name)!r}; choose one of {', '.join(choices)}")
        if self.procedure == "two-step":
            if self.form != "linear_cubic":
                raise ConfigError(f"procedure 'two-step' fits 'linear_cubic' only, got {self.form!r}; use 'joint'")
            extra = sorted(set(self.constraints) - TWO_STEP_CONSTRAINTS)
            if extra:
                raise ConfigError(f"procedure 'two-step' cannot hold {', '.join(extra)}; use 'joint'")
        if self.n_bootstrap < 0 or self.n_bootstrap == 1:
            raise ConfigError(f"n_bootstrap must be 0 (none) or at least 2, got {self.n_bootstrap}")
        if not 0 < self.level < 1:
            raise ConfigError(f"level must lie in (0, 1), got {self.level}; 0.95 is usual")

    @property
    def label(self) -> str:
        """Form, equations, inequalities and procedure in a few words: the row of a comparison."""
        parts = [LABELS.get(self.form, self.form)]
        if self.form == "linear_cubic":  # the others have it built in
            parts.append("f(1) = 1" if "unit_at_one" in self.constraints else "free")
        parts += [LABELS[name] for name in CONSTRAINTS if name in self.constraints and name in LABELS]
        return ", ".join([*parts, "two-step"] if self.procedure == "two-step" else parts)


def check(samples: Samples, settings: FitSettings) -> FitSettings:
    """Check settings against the samples.

    Returns:
        The settings with plain numbers in them.

    Raises:
        ConfigError: More bounces than were counted, or albedos outside (0, 1) or too few for the form.
    """
    albedos = samples.check(settings.bounces, settings.albedos)
    if isinstance(fitted_form(settings.form), Polynomial) and albedos.size < 2:
        raise ConfigError(f"form {settings.form!r} needs at least 2 albedos, got {albedos.tolist()}")
    return replace(
        settings,
        bounces=float(settings.bounces),
        albedos=tuple(np.asarray(albedos).tolist()),
        constraints=tuple(settings.constraints),
    )
