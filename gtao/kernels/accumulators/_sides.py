"""States that hold one value per side of a slice."""

__all__ = ["with_side"]


def with_side(pair, side, value):
    """The pair with one of its two sides replaced."""
    return (value, pair[1]) if side == 0 else (pair[0], value)
