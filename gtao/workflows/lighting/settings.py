"""What a comparison under light is asked to do."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from gtao.errors import ConfigError
from gtao.workflows.study_settings import StudySettings
from gtao.workflows.views import all_values, value_of

from .methods import IRRADIANCE_METHODS

__all__ = ["LIGHTS", "UPS", "CompareLightingConfig"]

#: Light that needs no file: smooth to sharp.
LIGHTS = ("gradient", "vmf:4", "vmf:20", "vmf:80", "disc:5", "sunsky")
#: Directions that may point upward in a scene.
UPS = ("x", "y", "z")


@dataclass(frozen=True, kw_only=True)
class CompareLightingConfig(StudySettings):
    """Settings of :func:`gtao.workflows.compare_lighting`; every default is what a plain run uses.

    Args:
        scenes: Mitsuba XML files, names of embedded scenes, or folders of such files; empty for all procedural
            embedded scenes.
        environments: light from afar: latitude-longitude images (.hdr, .exr; up is their upper edge), "gradient" (a
            sky), "vmf:κ" (a von Mises-Fisher lobe of concentration κ), "disc:DEGREES" (a disc of that angular radius)
            or "sunsky" (Mitsuba's); empty for all that need no file.
        methods: names from :data:`gtao.workflows.IRRADIANCE_METHODS`; empty for all.
        radius: reach of occluders in scene units, also by name of the scene; None, or no entry, for the scene's own
            (embedded), or a tenth of the frame's height at the median depth.
        up: axis of the scenes that points to the top of the light, "x", "y" or "z", also by name of the scene; None, or
            no entry, for z in embedded scenes and y in files.
        turn: degrees by which the light is turned about the vertical from each frame to the next.
        resolution: longer side of the images in pixels; None keeps the scene's own.
        spp: rays per pixel of the truth, and of the ray-traced visibility.
        all_sensors: every camera of a scene, not only the first.
        seed: of the random numbers.

    Raises:
        ConfigError: a setting is out of range.
    """

    QUICK = MappingProxyType({"resolution": 48, "spp": 64, "environments": ("gradient", "vmf:20")})

    scenes: tuple[str, ...] = ()
    environments: tuple[str, ...] = ()
    methods: tuple[str, ...] = ()
    radius: float | Mapping[str, float] | None = None
    up: str | Mapping[str, str] | None = None
    turn: float = 0.0
    resolution: int | None = 256
    spp: int = 256
    all_sensors: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        for name in self.methods:
            if name not in IRRADIANCE_METHODS:
                raise ConfigError(f"method must be one of {', '.join(IRRADIANCE_METHODS)}, got {name!r}")
        for name, given in (("methods", self.methods), ("environments", self.environments)):
            if len(set(given)) < len(given):
                raise ConfigError(f"{name} given more than once: {', '.join(given)}")
        for value in all_values(self.radius):
            if not value > 0:
                raise ConfigError(f"radius must be positive (inf for no limit), got {value}")
        for value in all_values(self.up):
            if value not in UPS:
                raise ConfigError(f"up must be one of {', '.join(UPS)}, got {value!r}")
        if not abs(self.turn) <= 360:
            raise ConfigError(f"turn must be an angle of at most 360 degrees, got {self.turn}")
        if self.spp < 32 or self.spp % 16:
            raise ConfigError(f"spp must be a multiple of 16, 32 at least: it is dealt to batches; got {self.spp}")
        if not 0 <= self.seed < 2**32:
            raise ConfigError(f"seed must lie in [0, 2**32), got {self.seed}")
        if self.resolution is not None and self.resolution < 16:
            raise ConfigError(f"resolution must be at least 16 pixels, got {self.resolution}")

    @property
    def names(self) -> tuple[str, ...]:
        """The methods to compare."""
        return self.methods or tuple(IRRADIANCE_METHODS)

    @property
    def lights(self) -> tuple[str, ...]:
        """The light to compare under."""
        return self.environments or LIGHTS

    def radius_of(self, scene: str) -> float | None:
        """The radius that is set for a scene, or None."""
        return value_of(self.radius, scene)

    def up_of(self, scene: str, default: str) -> str:
        """The axis that points upward in a scene."""
        return value_of(self.up, scene) or default
