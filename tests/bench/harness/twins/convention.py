"""Where implementations of the same estimator differ without differing in work."""

from dataclasses import dataclass

__all__ = ["PACKAGE", "REFERENCE", "Convention"]


@dataclass(frozen=True)
class Convention:
    """How azimuths turn, and what lies beyond the border of the frame.

    Attributes:
        y_down: azimuths count clockwise in the image, so that a pixel's noise picks the mirrored directions.
        held: a sample beyond the border is moved to the texel at the border; otherwise it stays where it is and only
            borrows that texel's depth.
    """

    y_down: bool
    held: bool


PACKAGE = Convention(y_down=False, held=False)
REFERENCE = Convention(y_down=True, held=True)
