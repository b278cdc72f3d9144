"""What engines do to a visibility after it is estimated; none of it has a physical meaning."""

import drjit as dr

__all__ = ["shape", "small_radius_fade"]


def small_radius_fade(radius_px, n_slices):
    """What XeGTAO adds where the search is short, ½ clamp((10 - radius_px)/100, 0, 1) to the sum of the slices."""
    lacking = (10 - radius_px) * 0.01
    return dr.select(lacking > 0, dr.select(lacking < 1, lacking, 1), 0) * (0.5 / n_slices)


def shape(visibility, exponent, floor, ceiling):
    """min(max(visibilityᵖ, floor), ceiling); negative rounding errors count as 0."""
    positive = visibility > 0
    # Zero to any power has no logarithm, which the derivative would ask for.
    raised = dr.select(positive, dr.select(positive, visibility, 1) ** exponent, 0)
    raised = dr.select(raised > floor, raised, floor)
    return dr.select(raised < ceiling, raised, ceiling)
