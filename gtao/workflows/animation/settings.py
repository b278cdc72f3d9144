"""What an animation is asked to show."""

from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Literal, Self, get_args

from gtao.errors import ConfigError
from gtao.workflows.lighting.settings import UPS
from gtao.workflows.study_settings import StudySettings
from gtao.workflows.truths import N_BATCHES

__all__ = ["DEFAULT_METHODS", "AnimateConfig"]

VideoFormat = Literal["auto", "mp4", "gif"]

#: What a plain run shows: the pipelines that remember, and the best that a single frame gives.
DEFAULT_METHODS = ("published-pipeline", "recommended-temporal", "recommended")


@dataclass(frozen=True, kw_only=True)
class AnimateConfig(StudySettings):
    """Settings of :func:`gtao.workflows.animate`; every default is what a plain run uses.

    Args:
        animation: name of an embedded animation, or a scene: the name of an embedded one or a Mitsuba XML file, whose
            first camera stands still unless ``path`` or ``orbit`` moves it.
        methods: what to run, each "published-pipeline", "recommended-temporal", a name from
            :data:`gtao.config.NAMED`, or a JSON file that describes a method, with options behind commas:
            ``published-pipeline,temporal.clamp=false``.
        settings: options of all methods, ``key=value``.
        frames: number of frames; None for the animation's own.
        path: JSON file that moves a scene, see :func:`gtao.workflows.animation.sources.read_path`.
        orbit: degrees that the camera of a scene goes around what it looks at, over the whole animation.
        up: axis of the scene about which ``orbit`` goes, "x", "y" or "z"; None for z in embedded scenes and y in files.
        radius: reach of occluders in scene units; None for the animation's own.
        resolution: longer side of the images in pixels.
        spp: rays per pixel of the truth of each frame.
        fps: frames per second of the videos, up to 240, and to 50 in GIFs.
        video: "mp4", "gif", or "auto": MP4 where there is an FFmpeg to write it.
        exr: also write every frame as EXR, truth and results with all their channels.
        error_limit: |error| at the bright end of the scale of pictures and videos.
        seed: of the random numbers of the truth.

    Raises:
        ConfigError: a setting is out of range.
    """

    QUICK = MappingProxyType({"resolution": 96, "spp": 32, "frames": 16})

    animation: str = "passing_object"
    methods: tuple[str, ...] = DEFAULT_METHODS
    settings: tuple[str, ...] = ()
    frames: int | None = None
    path: str | None = None
    orbit: float | None = None
    up: str | None = None
    radius: float | None = None
    resolution: int = 320
    spp: int = 128
    fps: float = 24.0
    video: VideoFormat = "auto"
    exr: bool = False
    error_limit: float = 0.25
    seed: int = 0

    def __post_init__(self) -> None:
        if not self.methods:
            raise ConfigError("there is no method to animate; give at least one")
        if len(set(self.methods)) < len(self.methods):
            raise ConfigError(f"methods given more than once: {', '.join(self.methods)}")
        if self.frames is not None and self.frames < 1:
            raise ConfigError(f"frames must be at least 1, got {self.frames}")
        if self.radius is not None and not self.radius > 0:
            raise ConfigError(f"radius must be positive (inf for no limit), got {self.radius}")
        if self.path is not None and self.orbit is not None:
            raise ConfigError("give a path or an orbit, not both")
        if self.orbit is not None and not abs(self.orbit) <= 3600:
            raise ConfigError(f"orbit must be an angle of at most 3600 degrees, got {self.orbit}")
        if self.up not in (None, *UPS):
            raise ConfigError(f"up must be one of {', '.join(UPS)}, got {self.up!r}")
        if self.up is not None and self.orbit is None:
            raise ConfigError(f"up is the axis of an orbit: give --orbit too, or leave --up {self.up} out")
        if self.resolution < 16:
            raise ConfigError(f"resolution must be at least 16 pixels, got {self.resolution}")
        if self.spp < 2 * N_BATCHES or self.spp % N_BATCHES:
            raise ConfigError(f"spp must be a multiple of {N_BATCHES}, {2 * N_BATCHES} at least, got {self.spp}")
        if self.video not in get_args(VideoFormat):
            raise ConfigError(f"video must be one of {', '.join(get_args(VideoFormat))}, got {self.video!r}")
        if not 0 < self.error_limit <= 1:
            raise ConfigError(f"error_limit must lie in (0, 1], got {self.error_limit}")
        if not 0 <= self.seed < 2**32:
            raise ConfigError(f"seed must lie in [0, 2**32), got {self.seed}")

    @classmethod
    def from_options(cls, *, quick: bool = False, **options: Any) -> Self:
        """As of any study; but a path itself says how many frames there are."""
        found = super().from_options(quick=quick, **options)
        return found if found.path is None else replace(found, frames=options.get("frames"))

    def of_frames(self) -> dict[str, Any]:
        """The settings that frames depend on, and not only what becomes of them."""
        return {name: value for name, value in self.to_dict().items() if name not in ("fps", "video")}
