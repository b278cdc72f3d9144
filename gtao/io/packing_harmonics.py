"""Spherical harmonics of visibility out of its mean direction, as shader code."""

import math

from .codecs import sh_scales
from .statements import Writer

__all__ = ["harmonics"]


def harmonics(w: Writer, weighting: str) -> list[str]:
    """Nine coefficients from mean direction and visibility: theory, eq. (115); bands 0 and 1 are the stored ones.

    ``cone`` is the cosine of the half angle of the cone about the normal that has the same ``ratio`` of mean direction
    to visibility; ``second`` is the visible part integrated with the Legendre polynomial of band 2 along the axis.
    """
    n, zero, one = w.number, w.number(0), w.number(1)
    zeroth, first = sh_scales(weighting)
    xy, zz = math.sqrt(15 / math.pi) / 2, math.sqrt(5 / math.pi) / 4
    axes = [w.let(axis, w.read("moments", i)) for i, axis in enumerate("xyz")]
    length = w.let("length_of_mean", w.L.call("root", "x * x + y * y + z * z"))
    ratio = w.let("ratio", f"length_of_mean / {w.L.max('visibility', n(1e-30))}")
    if weighting == "cosine":
        cone = [
            w.let("k", w.L.max(f"{n(1.5)} * ratio - {one}", zero)),
            w.let("cone", f"{n(0.5)} * (k + {w.L.call('root', f'k * k + {n(4)} * k')})"),
            w.let("second", f"{n(math.pi / 4)} * visibility * ({one} + {n(3)} * cone * cone)"),
        ]
    else:
        cone = [
            w.let("cone", w.L.max(f"{n(2)} * ratio - {one}", zero)),
            w.let("second", f"{n(math.pi)} * visibility * cone * ({one} + cone)"),
        ]
    # Band 2 takes the direction squared, which the length is divided out of.
    square = w.L.max("length_of_mean * length_of_mean", n(1e-30))
    products = ["x * y", "y * z", "", "x * z", "x * x - y * y"]
    factors = [xy, xy, 0.0, xy, xy / 2]
    return [
        *axes,
        w.let("visibility", w.read("moments", 3)),
        length,
        ratio,
        *cone,
        w.let("along", f"second / {square}"),
        f"sh[0] = {n(1 / zeroth)} * visibility;",
        *(f"sh[{i}] = {n(1 / first)} * {axis};" for i, axis in ((1, "y"), (2, "z"), (3, "x"))),
        *(
            f"sh[{i + 4}] = {n(zz)} * ({n(3)} * z * z * along - second);"
            if not product
            else f"sh[{i + 4}] = {n(factor)} * along * ({product});"
            for i, (product, factor) in enumerate(zip(products, factors, strict=True))
        ),
    ]
