"""What a fit of the reflection cone's aperture is asked to do."""

from dataclasses import dataclass
from types import MappingProxyType

from gtao.config import ConeCone
from gtao.errors import ConfigError
from gtao.fit.apertures import METRICS
from gtao.workflows.study_settings import StudySettings

from .methods import DENSE, TRACED

__all__ = ["SOURCES", "FitApertureConfig"]

#: Name of the option -> where visibility and directions come from.
SOURCES = {"traced": TRACED, "dense": DENSE}
#: What occlusion is fitted to.
REFERENCES = ("traced", "cone")
ROUGHNESS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)


@dataclass(frozen=True, kw_only=True)
class FitApertureConfig(StudySettings):
    """Settings of :func:`gtao.workflows.fit_aperture`; every default is what a plain run uses.

    Args:
        scenes: Mitsuba XML files, names of embedded scenes, or folders of such files; empty for all procedural
            embedded scenes.
        roughness: perceptual, each in [0, 1].
        f0: reflectance at normal incidence of the truth, in [0, 1].
        reference: what is to be met: "traced", the scene's specular occlusion; or "cone", that of the same cone of
            visibility, by :class:`gtao.ConeBRDF`: what replacing the lobe by a cone costs alone.
        source: where visibility and bent normals come from: "traced", or "dense" slices of the depth buffer.
        weighting: of visibility and directions, "cosine" or "uniform".
        aperture: of the visibility cone, as of :class:`gtao.ConeCone`; "seed" as published.
        metric: "dssim" as published, or "rmse".
        radius: reach of occluders in scene units; None for the scene's own (embedded), or a tenth of the frame's
            height at the median depth.
        resolution: longer side of the images in pixels.
        spp: rays per pixel of the truth, and of ray-traced visibility.
        all_sensors: every camera of a scene, not only the first.
        n_bootstrap: draws of the bootstrap over scenes; 0 for none.
        seed: of the random numbers.

    Raises:
        ConfigError: a setting is out of range.
    """

    QUICK = MappingProxyType({"resolution": 48, "spp": 64, "roughness": (0.3, 0.6), "n_bootstrap": 100})

    scenes: tuple[str, ...] = ()
    roughness: tuple[float, ...] = ROUGHNESS
    f0: float = 0.04
    reference: str = "traced"
    source: str = "traced"
    weighting: str = "cosine"
    aperture: str = "seed"
    metric: str = "dssim"
    radius: float | None = None
    resolution: int = 192
    spp: int = 512
    all_sensors: bool = False
    n_bootstrap: int = 1000
    seed: int = 0

    def __post_init__(self) -> None:
        choices = {
            "reference": REFERENCES,
            "source": SOURCES,
            "metric": METRICS,
            "weighting": ("cosine", "uniform"),
        }
        for name, allowed in choices.items():
            if getattr(self, name) not in allowed:
                raise ConfigError(f"{name} must be one of {', '.join(allowed)}, got {getattr(self, name)!r}")
        ConeCone(aperture=self.aperture)  # type: ignore[arg-type]  # it is what looks at the text
        for name, values in (("roughness", self.roughness), ("f0", (self.f0,))):
            if not values or not all(0 <= value <= 1 for value in values):
                raise ConfigError(f"{name} must lie in [0, 1], got {values}")
        if len(set(self.roughness)) < len(self.roughness):
            raise ConfigError(f"roughness given more than once: {self.roughness}")
        if self.radius is not None and not self.radius > 0:
            raise ConfigError(f"radius must be positive (inf for no limit), got {self.radius}")
        if self.spp < 16 or self.spp % 4:
            raise ConfigError(f"spp must be a multiple of 4, 16 at least: it is dealt to batches; got {self.spp}")
        if self.resolution < 16:
            raise ConfigError(f"resolution must be at least 16 pixels, got {self.resolution}")
        if self.n_bootstrap < 0:
            raise ConfigError(f"n_bootstrap must be 0 or more, got {self.n_bootstrap}")
        if not 0 <= self.seed < 2**32:
            raise ConfigError(f"seed must lie in [0, 2**32), got {self.seed}")
