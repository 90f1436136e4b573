"""Flat sector of a cone in words that a workshop can measure."""

from __future__ import annotations

import math

from coneskin.geometry.frustum import Frustum
from coneskin.geometry.sector import Sector, unroll

__all__ = ["polar_text", "sector_text"]

_FLAT = 1e4  # m; an arc of such a radius is a straight line within a micrometre
_FAR = 5.0  # m; no compass draws a larger radius: how far the arc rises says more


def sector_text(cone: Frustum) -> str:
    """Return what a flat pattern is."""
    flat = unroll(cone)
    if flat.r1 > _FLAT:
        return f"rectangle {flat.arc1 * 1e3:.3f} x {flat.slant * 1e3:.3f} mm"
    return polar_text(flat)


def polar_text(flat: Sector) -> str:
    """Return radii and angle of a sector; of a nearly straight one how far its arcs rise above their chords."""
    if flat.r1 > _FLAT:
        return "a rectangle"
    theta = f"theta0 {math.degrees(flat.theta0):.4f} deg"
    if max(flat.r1, flat.r2) < _FAR:
        return f"r1 {flat.r1 * 1e3:.3f} mm, r2 {flat.r2 * 1e3:.3f} mm, {theta}"
    rises = [2.0 * radius * math.sin(0.25 * flat.theta0) ** 2 for radius in (flat.r1, flat.r2)]
    return (
        f"r1 {flat.r1:.3f} m, r2 {flat.r2:.3f} m, {theta}: the arcs rise by {rises[0] * 1e3:.3f} and "
        f"{rises[1] * 1e3:.3f} mm"
    )
