"""What engines do to a visibility after it is estimated; none of it has a physical meaning."""

import drjit as dr

__all__ = ["shape"]


def shape(visibility, exponent, floor):
    """max(floor, visibilityᵖ); negative rounding errors count as 0."""
    raised = dr.select(visibility > 0, visibility, 0) ** exponent
    return dr.select(raised > floor, raised, floor)
