"""From weighted taps to values."""

import drjit as dr

__all__ = ["local_plane", "weighted_mean"]


def weighted_mean(centre_weight, taps, grid, channels):
    """Σ w v / Σ w over the pixel itself (weight ``centre_weight``, positive) and its taps, for each channel.

    Args:
        channels: an :class:`Image` each.
    """
    total, sums = centre_weight, [centre_weight * v.own for v in channels]
    for tap in taps:
        total = total + tap.weight
        sums = [dr.fma(tap.weight, grid.gather(v, tap.index), s) for v, s in zip(channels, sums, strict=True)]
    return tuple(s / total for s in sums)


def local_plane(centre_weight, taps, grid, channels, *, ridge):
    """Value at the pixel of the plane v = a + b dx + c dy that fits its taps best; theory, the linear fit.

    Args:
        channels: an :class:`Image` each.
        ridge: added to the second moments of both slopes, positive: little support means little slope.
    """
    zero = grid.types.Float(0)
    w, wx, wy, wxx, wxy, wyy = centre_weight, zero, zero, zero, zero, zero
    moments = [(centre_weight * v.own, zero, zero) for v in channels]
    for tap in taps:
        k, x, y = tap.weight, tap.dx, tap.dy
        w, wx, wy = w + k, dr.fma(k, x, wx), dr.fma(k, y, wy)
        wxx, wxy, wyy = dr.fma(k, x * x, wxx), dr.fma(k, x * y, wxy), dr.fma(k, y * y, wyy)
        values = [k * grid.gather(v, tap.index) for v in channels]
        moments = [(m + v, dr.fma(v, x, mx), dr.fma(v, y, my)) for v, (m, mx, my) in zip(values, moments, strict=True)]
    rcp = 1 / w
    mx, my = wx * rcp, wy * rcp
    sxx, sxy, syy = dr.fma(-wx, mx, wxx) + ridge, dr.fma(-wx, my, wxy), dr.fma(-wy, my, wyy) + ridge
    # At least ridge²: the matrix without the ridge is positive semidefinite.
    rcp_det = 1 / dr.fma(sxx, syy, -sxy * sxy)
    result = []
    for v, vx, vy in moments:
        mean = v * rcp
        cx, cy = dr.fma(-wx, mean, vx), dr.fma(-wy, mean, vy)
        b, c = (syy * cx - sxy * cy) * rcp_det, (sxx * cy - sxy * cx) * rcp_det
        result.append(mean - b * mx - c * my)
    return tuple(result)
