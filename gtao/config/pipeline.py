"""A method together with what happens to its result."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from gtao.errors import ConfigError

from ._checks import check_flag, check_instance
from .codec import to_dict
from .filters import EdgeAwareFilter, PlaneAwareFilter, SpatialFilter
from .gtao import GTAO
from .heightfield import HeightfieldHorizon, HeightfieldRayMarch
from .resolution import BilateralUpsample, BilinearUpsample, Downsample, NearestDepthUpsample, PlaneAwareUpsample
from .slices import SliceMethod
from .temporal import TemporalFilter

if TYPE_CHECKING:
    from gtao.gbuffer import GBuffer
    from gtao.history import History
    from gtao.results import AmbientOcclusion, Stages

__all__ = ["Pipeline"]

_METHODS = (SliceMethod, HeightfieldRayMarch, HeightfieldHorizon)
_SPATIAL = (SpatialFilter, EdgeAwareFilter, PlaneAwareFilter)
_UPSAMPLE = (BilinearUpsample, NearestDepthUpsample, BilateralUpsample, PlaneAwareUpsample)


@dataclass(frozen=True, kw_only=True)
class Pipeline:
    """From frames to images of ambient occlusion, as an application would show them; every stage but one may be None.

    Args:
        occlusion: what :func:`gtao.ambient_occlusion` is to do.
        downsample: a :class:`gtao.Downsample`: the smaller frame that is estimated and filtered.
        spatial: filter for :func:`gtao.denoise`.
        temporal: a :class:`gtao.TemporalFilter`, which goes on from the frames before.
        upsample: method for :func:`gtao.upsample`, back to the size of the frame; without it the result keeps the size
            of the smaller frame.
        clamp: limit the final result to [0, 1].

    Raises:
        ConfigError: a stage is of another kind, or there is nothing to upsample.
    """

    occlusion: Any = field(default_factory=GTAO)
    downsample: Any = None
    spatial: Any = None
    temporal: Any = None
    upsample: Any = None
    clamp: bool = True

    def __post_init__(self) -> None:
        if not isinstance(self.occlusion, _METHODS):
            raise ConfigError(f"occlusion must be a method of gtao.ambient_occlusion, got {self.occlusion!r}")
        check_instance("downsample", self.downsample, Downsample)
        check_instance("spatial", self.spatial, _SPATIAL)
        check_instance("temporal", self.temporal, TemporalFilter)
        check_instance("upsample", self.upsample, _UPSAMPLE)
        if self.upsample is not None and self.downsample is None:
            raise ConfigError("upsample without downsample: there is no smaller frame to come back from; leave it out")
        check_flag("clamp", self.clamp)

    @classmethod
    def as_published(cls, radius: float = 200.0) -> "Pipeline":
        """The pipeline of Jimenez et al. (2016), as their slides describe it.

        Half resolution by the nearest of 2×2 depths, one slice of eight steps per side in a pattern of 4×4 pixels and
        6×4 frames, the bilateral filter over 4×4 pixels that changes sides, exponential accumulation. How they came
        back to full resolution they do not say; here it is bilateral, with the threshold of their spatial filter.
        ``docs/departures`` lists what they left open.

        Args:
            radius: reach of an occluder in scene units; the slides' is 200 inches.
        """
        return cls(
            occlusion=GTAO.as_published(radius),
            downsample=Downsample(choice="nearest", place="texel"),
            spatial=SpatialFilter(),
            temporal=TemporalFilter.as_published(),
            upsample=BilateralUpsample(threshold=SpatialFilter().threshold),
        )

    @classmethod
    def recommended(
        cls, radius: float, *, temporal: bool = False, bent_normal: bool = False, directional: bool = False
    ) -> "Pipeline":
        """What to take where nothing is known of a scene; see :func:`gtao.config.recommended.recommended`.

        Args:
            radius: reach of an occluder in scene units, finite.
            temporal: for sequences: fewer samples a frame, and a history.
            bent_normal, directional: also give directions, as :class:`gtao.VisibilityBitmask` does; the visibility
                stays what it is.
        """
        from .recommended import recommended

        return recommended(radius, temporal=temporal, bent_normal=bent_normal, directional=directional)

    def step(
        self, g: "GBuffer", history: "History | None" = None, *, frame_index: int | None = None
    ) -> "AmbientOcclusion":
        """The result of one frame.

        Args:
            g: the frame. Temporal filters follow its ``motion``, or its ``view_to_world``; without either they take
                camera and scene for still.
            history: what is remembered of the frames before; this frame goes into it when all stages are through, so
                that an error leaves it as it was. None: a frame on its own.
            frame_index: position in the sequences of noise and filters; by default that of the history, 0 without.

        Raises:
            ConfigError: ``frame_index`` is negative, or ``g`` or ``history`` is something else.
            ShapeError: the history is of frames of another size.
        """
        return self.stages(g, history, frame_index=frame_index).result

    def stages(self, g: "GBuffer", history: "History | None" = None, *, frame_index: int | None = None) -> "Stages":
        """What every stage made of one frame; arguments as for :meth:`step`."""
        from gtao.estimators.pipeline import run_pipeline

        return run_pipeline(g, self, history, frame_index)

    def to_dict(self) -> dict[str, Any]:
        """Plain values that :func:`gtao.method_from_dict` turns back into the same configuration."""
        return to_dict(self)
