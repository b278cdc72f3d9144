"""What a comparison of specular occlusion is asked to do."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from gtao.errors import ConfigError
from gtao.workflows.lighting.settings import UPS
from gtao.workflows.study_settings import StudySettings
from gtao.workflows.views import all_values, value_of

from .methods import SPECULAR_METHODS

__all__ = ["NO_LIGHT", "SPECULAR_LIGHTS", "CompareSpecularConfig"]

ROUGHNESS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
#: Light that needs no file, and the roughness of surfaces under it.
SPECULAR_LIGHTS = ("gradient", "vmf:20")
LIT_ROUGHNESS = (0.2, 0.5)
#: Word for no light at all.
NO_LIGHT = "none"


@dataclass(frozen=True, kw_only=True)
class CompareSpecularConfig(StudySettings):
    """Settings of :func:`gtao.workflows.compare_specular`; every default is what a plain run uses.

    Args:
        scenes: Mitsuba XML files, names of embedded scenes, or folders of such files; empty for all procedural
            embedded scenes.
        roughness: under the white dome; perceptual, each in [0, 1].
        f0: reflectance at normal incidence, in [0, 1].
        environments: light from afar of the images that are put together, as for
            :class:`gtao.workflows.CompareLightingConfig`; ("none",) for no images, empty for :data:`SPECULAR_LIGHTS`.
        lit_roughness: under these lights.
        methods: names from :data:`gtao.workflows.SPECULAR_METHODS`; empty for all.
        radius: reach of occluders in scene units, also by name of the scene; None, or no entry, for the scene's own
            (embedded), or a tenth of the frame's height at the median depth.
        up: axis of the scenes that points to the top of the light, "x", "y" or "z", also by name of the scene; None, or
            no entry, for z in embedded scenes and y in files.
        turn: degrees by which the light is turned about the vertical from each frame to the next.
        resolution: longer side of the images in pixels.
        spp: rays per pixel under the white dome, and of the ray-traced visibility that methods are given.
        lit_spp: pairs of rays per pixel under each of the lights.
        all_sensors: every camera of a scene, not only the first.
        seed: of the random numbers.

    Raises:
        ConfigError: a setting is out of range.
    """

    QUICK = MappingProxyType(
        {
            "resolution": 48,
            "spp": 64,
            "lit_spp": 32,
            "roughness": (0.2, 0.5),
            "lit_roughness": (0.5,),
            "environments": ("vmf:20",),
        }
    )

    scenes: tuple[str, ...] = ()
    roughness: tuple[float, ...] = ROUGHNESS
    f0: float = 0.04
    environments: tuple[str, ...] = ()
    lit_roughness: tuple[float, ...] = LIT_ROUGHNESS
    methods: tuple[str, ...] = ()
    radius: float | Mapping[str, float] | None = None
    up: str | Mapping[str, str] | None = None
    turn: float = 0.0
    resolution: int = 192
    spp: int = 256
    lit_spp: int = 128
    all_sensors: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        for name in self.methods:
            if name not in SPECULAR_METHODS:
                raise ConfigError(f"method must be one of {', '.join(SPECULAR_METHODS)}, got {name!r}")
        for name, values in (("roughness", self.roughness), ("lit_roughness", self.lit_roughness), ("f0", (self.f0,))):
            if not values or not all(0 <= value <= 1 for value in values):
                raise ConfigError(f"{name} must lie in [0, 1], got {values}")
        for name in ("methods", "environments", "roughness", "lit_roughness"):
            given = getattr(self, name)
            if len(set(given)) < len(given):
                raise ConfigError(f"{name} given more than once: {', '.join(map(str, given))}")
        if NO_LIGHT in self.environments and len(self.environments) > 1:
            raise ConfigError(f"environment {NO_LIGHT!r} goes with no other, got {', '.join(self.environments)}")
        if any(not value > 0 for value in all_values(self.radius)):
            raise ConfigError(f"radius must be positive (inf for no limit), got {self.radius}")
        if any(value not in UPS for value in all_values(self.up)):
            raise ConfigError(f"up must be one of {', '.join(UPS)}, got {self.up!r}")
        if not abs(self.turn) <= 360:
            raise ConfigError(f"turn must be an angle of at most 360 degrees, got {self.turn}")
        for name in ("spp", "lit_spp"):
            value = getattr(self, name)
            if value < 32 or value % 16:
                raise ConfigError(f"{name} must be a multiple of 16, 32 at least: it is dealt to batches; got {value}")
        if self.resolution < 16:
            raise ConfigError(f"resolution must be at least 16 pixels, got {self.resolution}")
        if not 0 <= self.seed < 2**32:
            raise ConfigError(f"seed must lie in [0, 2**32), got {self.seed}")

    @property
    def names(self) -> tuple[str, ...]:
        """The methods to compare."""
        return self.methods or tuple(SPECULAR_METHODS)

    @property
    def lights(self) -> tuple[str, ...]:
        """The light to put images together under."""
        return () if self.environments == (NO_LIGHT,) else self.environments or SPECULAR_LIGHTS

    def up_of(self, scene: str, default: str) -> str:
        """The axis that points upward in a scene."""
        return value_of(self.up, scene) or default
