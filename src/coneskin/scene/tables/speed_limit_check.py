"""Check of permissible speeds: whether a table is as it was written, fits together, and covers a scene's sheets."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from coneskin.scene.values.speed_limit import LimitedPatch, SpeedLimitScene

if TYPE_CHECKING:
    from coneskin.geometry.frustum import Frustum

__all__ = ["limit_digest", "uncovered", "unfit"]

_STEEPER = 1.05  # of the lever's growth by which a speed may grow; the search leaves 1 %, rounding another
_ROUNDED = 2e-5  # m/s that rounding leaves of two speeds
_WIDEST = math.radians(90.0)  # between two patches around a sheet; beyond, no factor makes up for what lies between
_SLACK = 1e-7  # m and rad that the rounding of a file leaves


def limit_digest(table: Mapping[str, Any]) -> str:
    """Return the hash of a table [speed_limit], as it is in the file, without its own digest."""
    facts = {name: value for name, value in table.items() if name != "digest"}
    return hashlib.sha256(json.dumps(facts, sort_keys=True, default=str).encode()).hexdigest()


def unfit(limit: SpeedLimitScene) -> list[str]:
    """Return what in a table does not fit together; nothing where all does."""
    lines = []
    levers = limit.levers
    if not levers or any(b <= a for a, b in pairwise(levers)):
        lines.append("speed_limit.levers_mm must rise")
    if not limit.curves:
        lines.append("speed_limit.curve: there must be one")
    if {len(limit.lowest), len(limit.highest)} not in ({0}, {6}):
        lines.append("speed_limit: lowest_deg and highest_deg have six numbers each, or none")
    for joint, (low, high) in enumerate(zip(limit.lowest, limit.highest, strict=False), 1):
        if low > high:
            lines.append(
                f"speed_limit: joint {joint} has a lowest_deg of {math.degrees(low):.6g} deg, above its highest_deg of "
                f"{math.degrees(high):.6g} deg: no joint position is between them"
            )
    for number, curve in enumerate(limit.curves):
        where = f"speed_limit.curve {number}"
        if len(curve) != len(levers):
            lines.append(f"{where} needs one speed for each of levers_mm: {len(levers)}, got {len(curve)}")
        elif not lines:
            lines += [f"{where}: {line}" for line in _bends(levers, curve)]
    if not limit.patches:
        lines.append("speed_limit.patch: there must be one")
    for number, patch in enumerate(limit.patches):
        if max(patch.curve, patch.any_curve) >= len(limit.curves):
            lines.append(f"speed_limit.patch {number} needs a curve that there is, 0 to {len(limit.curves) - 1}")
    return lines


def _bends(levers: tuple[float, ...], curve: tuple[float, ...]) -> list[str]:
    """Return where a curve is none that a computation gives."""
    if curve[-1] <= 0.0:
        return ["the last of speeds_mm_s must be above 0 mm/s: the arm could not move"]
    for (before, low), (after, high) in pairwise(zip(levers, curve, strict=True)):
        at = f"{1e3 * high:.6g} mm/s after {1e3 * low:.6g} mm/s"
        if high < low:
            return [f"speeds_mm_s must not fall with a longer lever, got {at}"]
        if low > 0.0 and high > _STEEPER * low * after / before + _ROUNDED:
            return [
                f"speeds_mm_s must not grow more than the lever does, from {1e3 * before:.6g} to {1e3 * after:.6g} mm "
                f"here, got {at}: the straight line between them would be above what is permissible"
            ]
    return []


def uncovered(name: str, sheet: Frustum, patches: list[LimitedPatch]) -> list[str]:
    """Return what patches leave of a sheet without a speed, and which of them are not on it.

    The speed along the normal changes evenly between the ends of a sheet: both ends covered, all is.

    Args:
        name: of the sensor.
        sheet: its frustum.
        patches: of that sensor.
    """
    for patch in patches:
        if patch.u > sheet.slant + _SLACK:
            return [f"{name}: u_mm = {1e3 * patch.u:.6g} is off the sheet, which ends at {1e3 * sheet.slant:.6g} mm"]
        if patch.phi > sheet.wrap + _SLACK:
            wrap = math.degrees(sheet.wrap)
            return [f"{name}: phi_deg = {math.degrees(patch.phi):.6g} is off the sheet, which ends at {wrap:.6g} deg"]
    for u in (0.0, sheet.slant):
        around = sorted(patch.phi for patch in patches if abs(patch.u - u) <= _SLACK)
        if not around:
            return [f"{name}: no patch at its end u_mm = {1e3 * u:.6g}"]
        for start, end in _gaps(around, sheet.wrap):
            part = f"from {math.degrees(start):.6g} to {math.degrees(end):.6g} deg"
            return [f"{name}: no patch {part} at its end u_mm = {1e3 * u:.6g}"]
    return []


def _gaps(around: list[float], wrap: float) -> list[tuple[float, float]]:
    """Return where patches are too far apart, or an edge has none [rad]."""
    gaps = [(a, b) for a, b in pairwise(around) if b - a > _WIDEST + _SLACK]
    if wrap > 2.0 * math.pi - 1e-9:
        beyond = around[0] + 2.0 * math.pi
        return gaps + [(around[-1], beyond)] * (beyond - around[-1] > _WIDEST + _SLACK)
    return gaps + [(a, b) for a, b in ((0.0, around[0]), (around[-1], wrap)) if b - a > _SLACK]
