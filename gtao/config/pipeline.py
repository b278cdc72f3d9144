"""A method together with what happens to its result."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ._checks import check_flag
from .codec import to_dict
from .gtao import GTAO

if TYPE_CHECKING:
    from gtao.gbuffer import GBuffer
    from gtao.results import AmbientOcclusion

__all__ = ["Pipeline"]


@dataclass(frozen=True, kw_only=True)
class Pipeline:
    """From a frame to an image of ambient occlusion, as an application would show it.

    Args:
        occlusion: what :func:`gtao.ambient_occlusion` is to do.
        spatial: filter for :func:`gtao.denoise`, or None.
        clamp: limit the final result to [0, 1].
    """

    occlusion: Any = field(default_factory=GTAO)
    spatial: Any = None
    clamp: bool = True

    def __post_init__(self) -> None:
        check_flag("clamp", self.clamp)

    @classmethod
    def recommended(cls, radius: float, *, bent_normal: bool = False, directional: bool = False) -> "Pipeline":
        """What to take where nothing is known of a scene; see :func:`gtao.config.recommended.recommended`.

        Args:
            radius: reach of an occluder in scene units, finite.
            bent_normal, directional: also give directions, as :class:`gtao.VisibilityBitmask` does; the visibility
                stays what it is.
        """
        from .recommended import recommended

        return recommended(radius, bent_normal=bent_normal, directional=directional)

    def step(self, g: "GBuffer", *, frame_index: int = 0) -> "AmbientOcclusion":
        """Estimate, filter and clamp the visibility of one frame.

        Raises:
            ConfigError: a stage is no configuration of that stage, or ``frame_index`` is negative.
        """
        from gtao.estimators.pipeline import run_pipeline

        return run_pipeline(g, self, frame_index=frame_index)

    def to_dict(self) -> dict[str, Any]:
        """Plain values that :func:`gtao.method_from_dict` turns back into the same configuration."""
        return to_dict(self)
