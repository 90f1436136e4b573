"""Inverse of ``Frustum.flat_point``, with which tests ask where a point of a cut sheet comes to lie."""

import math

from coneskin.geometry.frustum import Frustum


def locate_flat(frustum: Frustum, x: float, y: float) -> tuple[float, float]:
    """Return the surface coordinates (u [m], phi [rad]) of a point of the flat pattern [m]."""
    sa, rho1 = frustum.sin_half_angle, frustum.radius1
    along, across = rho1 + sa * y, sa * x
    rho = math.hypot(across, along)
    if rho + rho1 == 0.0:
        return 0.0, 0.0
    u = (sa * (x * x + y * y) + 2.0 * rho1 * y) / (rho1 + rho)
    if along > 0.0 and abs(across) <= 1e-3 * along and frustum.wrap * abs(sa) < 1.0:
        t = across / along  # atan2(across, along) / sa, without the division by a vanishing sa
        return u, x / along * (math.atan(t) / t if t else 1.0)
    q = abs(sa)
    angle = math.atan2(math.copysign(1.0, sa) * across, along)
    return u, (angle - math.tau * round((angle - 0.5 * frustum.wrap * q) / math.tau)) / q
