"""The method to take where nothing is known of a scene but its depth buffer."""

from ._checks import check_positive
from .bitmask import VisibilityBitmask
from .filters import PlaneAwareFilter
from .pipeline import Pipeline
from .temporal import TemporalFilter
from .thickness import ContinuityThickness

__all__ = ["recommended"]


def recommended(
    radius: float, *, temporal: bool = False, bent_normal: bool = False, directional: bool = False
) -> Pipeline:
    """A visibility bitmask with thickness by continuity, and the filter that stays on the surface.

    One set of numbers for all scenes, in units of the radius; ``fits/occlusion/2026-11`` in the repository holds the
    search that chose them and what they cost and gain on every scene; ``fits/temporal/2026-11`` that of sequences.

    Args:
        radius: reach of an occluder in scene units, finite.
        temporal: for sequences: one slice a frame in place of three, and a history that takes neither what was hidden
            nor what has come before it.
        bent_normal, directional: also give directions, as :class:`gtao.VisibilityBitmask` does; the visibility stays
            what it is.

    Raises:
        ConfigError: the radius is not positive and finite.
    """
    check_positive("radius", radius)
    thickness = ContinuityThickness(continuing=1.0 * radius, isolated=0.4 * radius, gap=0.25 * radius)
    method = VisibilityBitmask(
        radius=radius,
        n_slices=1 if temporal else 3,
        n_steps=8,
        thickness=thickness,
        noise="interleaved_gradient_golden" if temporal else "spatial_4x4",
        bent_normal=bent_normal,
        directional=directional,
    )
    history = TemporalFilter.recommended() if temporal else None
    return Pipeline(occlusion=method, spatial=PlaneAwareFilter(), temporal=history)
