"""What a rough surface reflects of a white dome that is seen through a cone: the full BRDF by quadrature, no table.

:mod:`gtao.kernels.brdf_planes` sums over one plane through the view vector; here planes are chosen and summed.
"""

import math

import drjit as dr

from .brdf_planes import Cone, Surface, in_plane
from .gauss import legendre
from .loops import while_loop
from .microfacet import LEAST_ALPHA

__all__ = ["cone_brdf", "hemisphere_brdf"]

RIGHT_ANGLE = 0.5 * math.pi
#: Nodes on each side of a plane beyond half the number of planes.
EXTRA = 2


def cone_brdf(alpha_v, beta, chi, alpha, theta_o, n_nodes=16):
    """(A_V, B_V), of which F₀ A_V + B_V is reflected of a white dome seen through a cone; theory, eq. (165).

    The normal is z, the reflected direction ω_r = (sin θ_o, 0, cos θ_o). The cone's axis is at the angle β from ω_r:
    for χ = 0 on the normal's side of it in the plane of incidence, for χ = ½π toward y. Differentiable in all numbers,
    with the derivatives of the integral, theory, eq. (168).

    Args:
        alpha_v: half angle of the cone, in [0, ½π]; wider cones count as hemispheres.
        beta: angle between its axis and the reflected direction, in [0, π].
        chi: azimuth of its axis about the reflected direction.
        alpha: width of the slopes of microfacets, in [0, 1]; from 0.0001 down that of 0.0001.
        theta_o: angle between the normal and the view vector, in [0, ½π]; larger ones count as ½π.
        n_nodes: planes, each with about as many nodes. With 16 the error of A_V is 5e-4 of A (root mean square).
    """
    attached = any(map(dr.grad_enabled, (alpha_v, beta, chi, alpha, theta_o)))
    alpha_v, theta_o = (dr.select(x < RIGHT_ANGLE, x, RIGHT_ANGLE) for x in (alpha_v, theta_o))
    surface = _surface(alpha, theta_o)
    sin_v, cos_v = dr.sincos(alpha_v)
    (sin_b, cos_b), (sin_x, cos_x) = dr.sincos(beta), dr.sincos(chi)
    # The reflected direction is 2 θ_o from the view vector.
    sin_2, cos_2 = dr.sincos(2 * theta_o)
    inward = sin_b * cos_x
    cone = Cone(
        cos_v, sin_v, dr.fma(cos_b, cos_2, inward * sin_2), dr.fma(cos_b, sin_2, -inward * cos_2), sin_b * sin_x
    )
    with dr.suspend_grad():
        fixed = Cone(*(x * 1 for x in cone))
        # Planes within Δ of the axis meet the cone, or all do.
        distance2 = dr.fma(fixed.across, fixed.across, fixed.aside * fixed.aside)
        ratio2 = fixed.sin_v * fixed.sin_v
        full = ratio2 >= distance2
        ratio2 = ratio2 / dr.select(full, 1, distance2)
        spread = dr.atan2(dr.sqrt(ratio2), dr.sqrt(1 - ratio2))
        # A plane has two sides: either of two azimuths will do.
        middle = dr.atan2(dr.select(fixed.across < 0, -fixed.aside, fixed.aside), abs(fixed.across))
        peak = _peak(surface)
        low, high = (_to_unit(angle, peak) for angle in (middle - spread, middle + spread))
        low, high = dr.select(full, -RIGHT_ANGLE, low), dr.select(full, RIGHT_ANGLE, high)
    sums = _sum_of_planes(surface, fixed, (low, high, full), peak, n_nodes, n_nodes // 2 + EXTRA, attached)
    if not attached:
        return tuple(sums)
    A, B, *by = sums
    moves = surface.a2, theta_o, cone.cos_v, *cone[2:]
    return _with_slopes(A, [*by[0:4:2], *by[4:8]], moves), _with_slopes(B, [*by[1:4:2], *by[8:12]], moves)


def hemisphere_brdf(alpha, theta_o, n_nodes=16):
    """(A, B), of which F₀ A + B is reflected of a white dome, theory, eq. (165): :func:`cone_brdf` without a cone.

    Args:
        alpha: width of the slopes of microfacets, in [0, 1].
        theta_o: angle between the normal and the view vector, in [0, ½π]; larger ones count as ½π.
        n_nodes: as in :func:`cone_brdf`. Half of the planes are enough: both sides of that of incidence are alike.
    """
    theta_o = dr.select(theta_o < RIGHT_ANGLE, theta_o, RIGHT_ANGLE)
    surface = _surface(alpha, theta_o)
    attached = dr.grad_enabled(alpha) or dr.grad_enabled(theta_o)
    with dr.suspend_grad():
        peak = _peak(surface)
        low = dr.zeros(type(peak), dr.width(peak))
        planes = low, low + RIGHT_ANGLE, low >= 0
    sums = _sum_of_planes(surface, None, planes, peak, n_nodes // 2, n_nodes // 2 + EXTRA, attached)
    A, B, *by = (2 * x for x in sums)
    if not attached:
        return A, B
    moves = surface.a2, theta_o
    return _with_slopes(A, by[0::2], moves), _with_slopes(B, by[1::2], moves)


def _with_slopes(value, slopes, arguments):
    return dr.replace_grad(value, sum(s * x for s, x in zip(slopes, arguments, strict=True)))


def _surface(alpha, theta_o):
    width = dr.select(alpha > LEAST_ALPHA, alpha, LEAST_ALPHA)
    sin_o, cos_o = dr.sincos(theta_o)
    a2 = width * width
    return Surface(a2, cos_o, sin_o, dr.sqrt(dr.fma(1 - a2, cos_o * cos_o, a2)))


def _peak(surface):
    """ρ of tan ψ = ρ tan η: planes at azimuths within ρ of that of incidence see the peak of the lobe."""
    a2 = surface.a2
    return dr.sqrt(a2 / dr.fma(1 - a2, surface.sin_o * surface.sin_o, a2))


def _to_unit(psi, peak):
    """η of ψ, both counted on beyond ±½π."""
    s, c = dr.sincos(psi)
    return psi + dr.atan2((1 - peak) * s * c, dr.fma(peak * c, c, s * s))


def _sum_of_planes(surface, cone, planes, peak, n_planes, n_inner, slopes):
    with dr.suspend_grad():
        low, high, full = planes
        Float = type(low)
        UInt = dr.uint32_array_t(Float)
        nodes, weights = (Float(list(column)) for column in zip(*legendre(n_planes), strict=True))
        half, middle = 0.5 * (high - low), 0.5 * (high + low)
        surface = Surface(*(x * 1 for x in surface))

        def body(i, *sums):
            x = dr.fma(2, dr.gather(Float, nodes, i), -1)
            # Where planes stop meeting the cone, what is in them starts like a root.
            s, c = dr.sincos(RIGHT_ANGLE * x)
            weight = 2 * half * dr.gather(Float, weights, i) * dr.select(full, 1, RIGHT_ANGLE * c)
            s, c = dr.sincos(dr.fma(half, dr.select(full, x, s), middle))
            s = s * peak
            scale = dr.rcp(dr.fma(c, c, s * s))
            length = dr.sqrt(scale)
            weight = weight * peak * scale
            new = in_plane(surface, cone, s * length, c * length, n_inner, slopes)
            return i + 1, *(dr.fma(weight, x, old) for x, old in zip(new, sums, strict=True))

        n_sums = 2 if not slopes else 6 if cone is None else 14
        zeros = [dr.zeros(Float, dr.width(low)) for _ in range(n_sums)]
        _, *sums = while_loop((UInt(0), *zeros), lambda i, *_: i < n_planes, body, label="planes")
    return sums
