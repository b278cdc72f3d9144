"""What a comparison is asked to do."""

from dataclasses import dataclass
from types import MappingProxyType

from gtao.config import NAMED
from gtao.errors import ConfigError
from gtao.workflows.study_settings import StudySettings

__all__ = ["CompareConfig"]


@dataclass(frozen=True, kw_only=True)
class CompareConfig(StudySettings):
    """Settings of :func:`gtao.workflows.compare`; every default is what a plain run uses.

    Args:
        scenes: Mitsuba XML files, names of embedded scenes, EXR files that ``gtao render`` wrote, or folders of such
            files; empty for all procedural embedded scenes.
        methods: names from :data:`gtao.config.NAMED`; empty for all.
        radius: reach of occluders in scene units; None for the scene's own (embedded), that of the file's truth (EXR,
            which allows no other), or a tenth of the frame's height at the median depth.
        resolution: longer side of the images in pixels; None keeps the scene's own. EXR files keep theirs.
        spp: rays per pixel of the ray-traced truth.
        budgets: (slices, steps per side) that all methods are given alike.
        curve: (slices, steps per side) of the error against samples.
        n_directions, rays_per_direction: rays of the height field's ray march.
        guard: width of the guard band, as a share of the longer side; 0 for none.
        all_sensors: every camera of a scene, not only the first.
        rounds: interleaved rounds of the timing.
        seed: of the random numbers.

    Raises:
        ConfigError: a setting is out of range.
    """

    QUICK = MappingProxyType({"resolution": 64, "spp": 64, "rays_per_direction": 4})

    scenes: tuple[str, ...] = ()
    methods: tuple[str, ...] = ()
    radius: float | None = None
    resolution: int | None = 512
    spp: int = 256
    budgets: tuple[tuple[int, int], ...] = ((3, 3), (9, 3))
    curve: tuple[tuple[int, int], ...] = ((1, 2), (2, 2), (3, 3), (9, 3), (8, 8), (16, 16))
    n_directions: int = 8
    rays_per_direction: int = 8
    guard: float = 0.25
    all_sensors: bool = False
    rounds: int = 5
    seed: int = 0

    def __post_init__(self) -> None:
        for name in self.methods:
            if name not in NAMED:
                raise ConfigError(f"method must be one of {', '.join(NAMED)}, got {name!r}")
        if len(set(self.methods)) < len(self.methods):
            raise ConfigError(f"methods given more than once: {', '.join(self.methods)}")
        if self.radius is not None and not self.radius > 0:
            raise ConfigError(f"radius must be positive (inf for no limit), got {self.radius}")
        for name, low in (("spp", 16), ("n_directions", 1), ("rays_per_direction", 1), ("rounds", 1), ("seed", 0)):
            if getattr(self, name) < low:
                raise ConfigError(f"{name} must be at least {low}, got {getattr(self, name)}")
        if self.seed >= 2**32:
            raise ConfigError(f"seed must be below 2**32, got {self.seed}")
        if self.spp % 8:
            raise ConfigError(f"spp must be a multiple of 8, the number of batches, got {self.spp}")
        if self.resolution is not None and self.resolution < 16:
            raise ConfigError(f"resolution must be at least 16 pixels, got {self.resolution}")
        if not 0 <= self.guard <= 1:
            raise ConfigError(f"guard must be a share of the image from 0 to 1, got {self.guard}")
        for counts in (*self.budgets, *self.curve):
            if len(counts) != 2 or min(counts) < 1:
                raise ConfigError(f"a budget is (slices, steps per side), both at least 1, got {counts}")

    @property
    def names(self) -> tuple[str, ...]:
        """The methods to compare."""
        return self.methods or tuple(NAMED)
