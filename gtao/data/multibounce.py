"""Multi-bounce coefficients: the type that carries them, the published set, and our refits."""

import math
from dataclasses import dataclass
from typing import Any

from gtao.config import plain
from gtao.errors import ConfigError

__all__ = ["FORM_PARAMETERS", "JIMENEZ2016", "REFIT_2026_11", "SPHERE", "MultibounceFit"]

#: Names of the coefficients of every form, in order; the formulas are in :mod:`gtao.kernels.multibounce`.
FORM_PARAMETERS: dict[str, tuple[str, ...]] = {
    "linear_cubic": ("a1", "a0", "b1", "b0", "c1", "c0"),
    "four_parameter": ("k0", "k1", "k2", "k3"),
    "one_parameter": ("kappa",),
    "two_parameter": ("kappa0", "kappa1"),
    "sphere": (),
    "sphere_truncated": ("n",),
}


def _is_number(value: Any) -> bool:
    return not hasattr(value, "__len__") or len(value) == 1


@dataclass(frozen=True, kw_only=True)
class MultibounceFit:
    """A function that maps visibility and albedo to multi-bounce visibility.

    Attributes:
        form: key of :data:`FORM_PARAMETERS`.
        coefficients: one number per name in :attr:`names`: a float, or a Dr.Jit float of width 1, which may carry a
            gradient.
        bounces: surface bounces that the fit stands for, counting the visible point; ``math.inf`` for all.
        source: publication or record that the numbers come from.
        standard_errors: one per coefficient, or None where the source gives none.
        intervals: ``(low, high)`` per coefficient at confidence ``level``, or None.
        level: confidence level of ``intervals``, in (0, 1).
    """

    form: str
    coefficients: tuple[Any, ...]
    bounces: float
    source: str
    standard_errors: tuple[float, ...] | None = None
    intervals: tuple[tuple[float, float], ...] | None = None
    level: float | None = None

    def __post_init__(self) -> None:
        if self.form not in FORM_PARAMETERS:
            raise ConfigError(f"unknown form {self.form!r}; choose one of {', '.join(FORM_PARAMETERS)}")
        n = len(self.names)
        for name in ("coefficients", "standard_errors", "intervals"):
            values = getattr(self, name)
            if values is not None and len(values) != n:
                raise ConfigError(f"form {self.form!r} has {n} {name}, got {len(values)}")
        if not all(_is_number(c) and math.isfinite(plain(c)) for c in self.coefficients):
            raise ConfigError(
                f"coefficients must be finite numbers or Dr.Jit floats of width 1, got {self.coefficients}"
            )
        if not self.bounces >= 1:
            raise ConfigError(f"bounces must be at least 1, got {self.bounces}")
        if self.intervals is not None and (self.level is None or not 0 < self.level < 1):
            raise ConfigError(f"intervals need a confidence level in (0, 1), got {self.level}")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coefficients."""
        return FORM_PARAMETERS[self.form]

    @property
    def numbers(self) -> tuple[float, ...]:
        """The coefficients as Python numbers."""
        return tuple(map(plain, self.coefficients))

    def _repr_html_(self) -> str:
        rows = []
        for i, (name, value) in enumerate(zip(self.names, self.numbers, strict=True)):
            error = f"{self.standard_errors[i]:.2g}" if self.standard_errors else ""
            low_high = "[{:.4f}, {:.4f}]".format(*self.intervals[i]) if self.intervals else ""
            rows.append(f"<tr><td>{name}</td><td>{value:.5f}</td><td>{error}</td><td>{low_high}</td></tr>")
        bounces = "infinitely many bounces" if math.isinf(self.bounces) else f"{self.bounces:g} bounces"
        level = f"{self.level:.0%} interval" if self.level else "interval"
        return (
            f"<table><caption>{self.form}, {bounces} ({self.source})</caption>"
            f"<tr><th></th><th>value</th><th>standard error</th><th>{level}</th></tr>{''.join(rows)}</table>"
        )


JIMENEZ2016 = MultibounceFit(
    form="linear_cubic",
    coefficients=(2.0404, -0.3324, -4.7951, 0.6417, 2.7552, 0.6903),
    bounces=4.0,
    source="Jimenez et al. 2016, Practical Realtime Strategies for Accurate Indirect Occlusion, Eq. 10",
)

REFIT_2026_11 = MultibounceFit(
    form="linear_cubic",
    coefficients=(2.3579, -0.3275, -5.1689, 0.6250, 2.8110, 0.7025),
    bounces=4.0,
    source="fits/multibounce/2026-11: twelve embedded scenes, f(1) = 1",
    standard_errors=(0.2777, 0.0167, 0.4305, 0.0243, 0.1586, 0.0080),
    intervals=(
        (1.8113, 3.0276),
        (-0.3634, -0.2915),
        (-6.2168, -4.3072),
        (0.5698, 0.6779),
        (2.4869, 3.1950),
        (0.6856, 0.7209),
    ),
    level=0.95,
)

SPHERE = MultibounceFit(
    form="sphere",
    coefficients=(),
    bounces=math.inf,
    source="closed form of the integrating sphere",
)
