"""What a tuning is asked to do."""

import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from gtao import fit
from gtao.config import NAMED, Pipeline
from gtao.errors import ConfigError
from gtao.workflows.study_settings import StudySettings

from .options import pipeline_from_options
from .truths import N_BATCHES

__all__ = ["TuneConfig"]

#: XeGTAO's constants, but for the offset of the pyramid: it trades error for time, and time is not in the loss.
DEFAULT_PARAMETERS = ("radius_multiplier", "falloff.start", "step_exponent", "thin_occluder_compensation", "power")


@dataclass(frozen=True, kw_only=True)
class TuneConfig(StudySettings):
    """Settings of :func:`gtao.workflows.tune`; every default is what a plain run uses.

    Args:
        scenes: Mitsuba XML files, names of embedded scenes, EXR files that ``gtao render`` wrote, or folders of such
            files; empty for all procedural embedded scenes.
        held_out: more of them that nothing is fitted to, only scored.
        method: name from :data:`gtao.config.NAMED` to start from.
        settings: options of it as ``key=value``.
        parameters: what is tuned: ``path`` or ``path=low:high``; empty for XeGTAO's constants, as far as the method
            has them.
        search: discrete options to try around it, ``key=value,value,…``; all combinations are tuned.
        max_taps: combinations that read more depth samples per pixel are left out.
        rival: name of the method to compare with, at the same numbers of slices and steps.
        radius: reach of occluders in scene units; None for the scene's own (embedded), or a tenth of the frame's
            height at the median depth. EXR files keep theirs.
        radii: factors of it; every view counts once with each.
        resolution: longer side of the images in pixels.
        spp: rays per pixel of the truth.
        all_sensors: every camera of a scene instead of its first.
        folds: parts that the scenes are split into; each is scored by a tuning on the others. 0 for none; None for
            four, or as many as there are scenes.
        n_frames: noise frames per view.
        n_bootstrap: draws of the bootstrap over scenes; 0 for none; None for 1000 if there are scenes enough.
        max_rounds: of gradient steps and searches.
        seed: of the random numbers.

    Raises:
        ConfigError: a setting is out of range.
    """

    QUICK = MappingProxyType({"resolution": 48, "spp": 64, "max_rounds": 3})

    scenes: tuple[str, ...] = ()
    held_out: tuple[str, ...] = ()
    method: str = "xegtao-high"
    settings: tuple[str, ...] = ()
    parameters: tuple[str, ...] = ()
    search: tuple[str, ...] = ()
    max_taps: int | None = None
    rival: str = "xegtao-high"
    radius: float | None = None
    radii: tuple[float, ...] = (1.0,)
    resolution: int = 192
    spp: int = 256
    all_sensors: bool = True
    folds: int | None = None
    n_frames: int = 1
    n_bootstrap: int | None = None
    max_rounds: int = 20
    seed: int = 0

    def __post_init__(self) -> None:
        for name, low in (("resolution", 16), ("spp", 16), ("n_frames", 1), ("max_rounds", 1), ("seed", 0)):
            if getattr(self, name) < low:
                raise ConfigError(f"{name} must be at least {low}, got {getattr(self, name)}")
        if self.seed >= 2**32:
            raise ConfigError(f"seed must be below 2**32, got {self.seed}")
        if self.spp % N_BATCHES:
            raise ConfigError(f"spp must be a multiple of {N_BATCHES}, the number of batches, got {self.spp}")
        given = () if self.radius is None else (self.radius,)
        for what, values in (("radius", given or (1.0,)), ("radii", self.radii)):
            if not values or not all(0 < value < math.inf for value in values):
                raise ConfigError(f"{what} must be positive and finite, got {getattr(self, what)}")
        if self.rival not in NAMED:
            raise ConfigError(f"rival must be one of {', '.join(NAMED)}, got {self.rival!r}")
        fit.check_tuning(self.start(), self.bounds(), self.choices(), self.max_taps)

    def start(self) -> Pipeline:
        """The pipeline that tuning begins with, at radius 1."""
        return pipeline_from_options(self.method, self.settings, 1.0)

    def bounds(self) -> dict[str, tuple[float, float] | None]:
        """Path -> bounds of what is tuned."""
        if not self.parameters:
            known = fit.continuous(self.start())
            return dict.fromkeys(path for path in DEFAULT_PARAMETERS if path in known)
        return dict(map(_parameter, self.parameters))

    def choices(self) -> dict[str, tuple[Any, ...]]:
        """Path -> values of what is searched."""
        found = {}
        for text in self.search:
            path, equals, values = text.partition("=")
            path, words = path.strip(), [word.strip() for word in values.split(",")]
            if not equals or not all(words):
                raise ConfigError(f"a search is written key=value,value,…, got {text!r}")
            made = [pipeline_from_options(self.method, (*self.settings, f"{path}={word}"), 1.0) for word in words]
            found[path] = tuple(fit.option(pipeline, path) for pipeline in made)
        return found


def _parameter(text: str) -> tuple[str, tuple[float, float] | None]:
    """``path`` or ``path=low:high``."""
    path, equals, bounds = text.partition("=")
    if not equals:
        return path.strip(), None
    try:
        low, high = map(float, bounds.split(":"))
    except ValueError:
        raise ConfigError(f"a parameter is written path or path=low:high, got {text!r}") from None
    return path.strip(), (low, high)
