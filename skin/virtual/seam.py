"""Seam of a sensor: what a body over the gap between its two straight edges presses on the other side."""

from __future__ import annotations

import math

from coneskin.geometry.frustum import Frustum

__all__ = ["across_seam"]

_LEAST = 0.01  # part of a contact; less on the other side does nothing


def across_seam(cone: Frustum, u: float, phi: float, reach: float) -> tuple[float, float] | None:
    """Return the part of a round contact that lies beyond the gap.

    Args:
        cone: the active area.
        u: slant distance of its middle from end 1 [m].
        phi: azimuth of its middle [rad].
        reach: its radius [m].

    Returns:
        azimuth of that part's centroid [rad] and how much of the contact it is; None where nothing reaches so far.
    """
    radius = cone.radius_at(u)
    gap = 2.0 * math.pi - cone.wrap
    over_start = phi <= 0.5 * cone.wrap
    distance = radius * (gap + (phi if over_start else cone.wrap - phi))
    if not distance < reach:
        return None
    ratio = distance / reach
    sine = math.sqrt(1.0 - ratio * ratio)
    share = (math.acos(ratio) - ratio * sine) / math.pi
    if share < _LEAST:
        return None
    inside = (2.0 / 3.0 * sine**3 / (math.pi * share) - ratio) * reach / radius  # from the other edge
    return (cone.wrap - inside if over_start else inside), share
