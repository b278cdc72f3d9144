"""What a refit is asked to do."""

import math
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Literal, get_args

from gtao.config import GTAO
from gtao.errors import ConfigError
from gtao.fit import FitSettings

__all__ = ["QUICK", "RefitConfig"]

Regressor = Literal["ray", "screen"]

#: What ``quick`` changes: enough to see every part run, too noisy to keep.
QUICK: dict[str, Any] = {"resolution": 32, "spp": 64, "n_bootstrap": 200}


def parse_bounces(text: str | float) -> float:
    """Number of bounces from text; "inf" stands for all.

    Raises:
        ConfigError: it is no whole number from 2 and not "inf".
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (value >= 2 and (math.isinf(value) or value.is_integer())):
        raise ConfigError(f"bounces must be 2, 3, 4, … or inf, got {text!r}")
    return value


@dataclass(frozen=True, kw_only=True)
class RefitConfig:
    """Settings of :func:`gtao.workflows.refit`; every default is what a plain run uses.

    Args:
        scenes: Mitsuba XML files or names of embedded scenes; empty for all procedural embedded scenes.
        also_embedded: add the procedural embedded scenes to ``scenes``.
        all_sensors: use every camera of a scene instead of its first; a scene still counts once.
        resolution: longer side of the images in pixels.
        spp: paths per pixel, a multiple of ``n_batches``.
        n_batches: independent batches that the paths are split into; the fit needs them to handle noise.
        n_bounces: surfaces that a path may meet; what is left inside then is extrapolated.
        normals: "shading" or "geometric".
        seed: of paths and bootstrap.
        fit: the headline fit: form, bounces, procedure, constraints and the rest; the comparison of forms always
            holds 4 and infinitely many bounces as well.
        regressor: "ray" fits on traced visibility; "screen" on what ``screen_method`` estimates from the depth
            buffer, which is what an engine feeds to the fit.
        screen_method: the estimator of the "screen" regressor.

    Raises:
        ConfigError: a value is out of range.
    """

    scenes: tuple[str, ...] = ()
    also_embedded: bool = False
    all_sensors: bool = False
    resolution: int = 128
    spp: int = 256
    n_batches: int = 8
    n_bounces: int = 24
    normals: str = "shading"
    seed: int = 0
    fit: FitSettings = field(default_factory=FitSettings)
    regressor: Regressor = "ray"
    screen_method: GTAO = field(default_factory=lambda: GTAO(n_slices=16, n_steps=32))

    def __post_init__(self) -> None:
        if self.resolution < 8:
            raise ConfigError(f"resolution must be at least 8 pixels, got {self.resolution}")
        if self.regressor not in get_args(Regressor):
            raise ConfigError(f"regressor must be 'ray' or 'screen', got {self.regressor!r}")
        if self.screen_method.weighting != "cosine":
            raise ConfigError("the fit maps cosine-weighted visibility; screen_method must use weighting='cosine'")
        if self.spp % self.n_batches:
            raise ConfigError(f"spp must be a multiple of {self.n_batches}, got {self.spp}")
        if not math.isinf(self.fit.bounces) and self.fit.bounces > self.n_bounces:
            raise ConfigError(f"bounces is {self.fit.bounces:g}, but paths are traced through {self.n_bounces} only")

    @classmethod
    def from_options(cls, *, quick: bool = False, **options: Any) -> "RefitConfig":
        """The configuration of command-line options; those that are None keep their default."""
        values = {name: value for name, value in options.items() if value is not None}
        if "bounces" in values:
            values["bounces"] = parse_bounces(values["bounces"])
        if values.get("constraints") == ("none",):
            values["constraints"] = ()
        values = (QUICK if quick else {}) | values
        of_fit = {f.name for f in fields(FitSettings)}
        settings = FitSettings(**{name: value for name, value in values.items() if name in of_fit})
        # The seed serves both.
        rest = {name: value for name, value in values.items() if name not in of_fit or name == "seed"}
        return cls(fit=settings, **rest)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for a record."""
        values = asdict(self)
        values["screen_method"] = self.screen_method.to_dict() if self.regressor == "screen" else None
        return values
