"""Search for the axis near a given one about which one sheet covers most.

A fit by least squares follows the mean of a crowned or dented body. The axis of the largest sheet within a tolerance is
another one, near it, and that sheet may be twice as large.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .axis_plan import SheetRequirements, SideLine, largest_partial_wrap, plan_sheets
from .profile import AxisFrame, RadialProfile
from .side import StraightSide

__all__ = ["search_axis"]

Floats = NDArray[np.float64]

_STEPS = (0.0006, 0.0003, 0.00015)  # m; of the surface, by a shift or by a tilt, one after another
_MAX_ROUNDS = 4  # at one step
_LOOSE = 1.6  # times the tolerance, where nothing fits within it
_ENOUGH = 0.97  # of the sheet within the looser tolerance; more is hardly to be found


def search_axis(
    profile: RadialProfile, side: StraightSide, lines: list[SideLine], requirements: SheetRequirements
) -> AxisFrame | None:
    """Return an axis about which a single sheet covers more; None where none is found.

    The axis is shifted and tilted in steps that become smaller. A small shift s and tilt t change the radii by
    (s + t (z + r dr/dz)) cos(phi) (``refine_axis``), so no ray is cast.

    Args:
        profile: the hull about the axis so far.
        side: the largest sheet about it within a looser tolerance.
        lines: straight sides near which partial wraps are looked for.
        requirements: on the sheet.
    """
    middle = 0.5 * float(profile.z[side.first] + profile.z[side.end - 1])
    reach = max(0.5 * float(profile.z[side.end - 1] - profile.z[side.first]), requirements.min_length)
    own = side.radius + side.slope * middle
    beside = sorted(lines, key=lambda line: abs(line[0] + line[1] * middle - own))[:2]
    full = side.columns == len(profile.phi)
    rows = max(2, math.ceil(requirements.min_length / profile.step))

    def area(moved: RadialProfile, wanted: SheetRequirements) -> float:
        if full:
            return max((plan.area for plan in plan_sheets(moved, [], wanted, 1)), default=0.0)
        found = largest_partial_wrap(moved, [(side.radius, side.slope), *beside], wanted, rows, 0.0)
        return 0.0 if found is None else found.area(moved)

    tight = replace(requirements, wrap=2.0 * math.pi) if full else requirements
    loose = replace(tight, tolerance=_LOOSE * tight.tolerance)

    def worth(move: Floats) -> tuple[float, float]:
        moved = _moved(profile, move[:2], move[2:] / reach, middle, side.slope)
        within = area(moved, tight)
        return (within, 0.0) if within > 0.0 else (0.0, area(moved, loose))

    here = np.zeros(4)
    start = best = worth(here)
    if start[0] >= _ENOUGH * side.area(profile):
        return None
    for step in _STEPS:
        for _ in range(_MAX_ROUNDS):
            before = best
            for way in step * np.eye(4):
                for move in (here + way, here - way):
                    found = worth(move)
                    if found > best:
                        here, best = move, found
                        break
            if best <= (1.01 * before[0], 1.01 * before[1]):
                break
    if best <= (1.02 * start[0], start[1]):
        return None
    tilt = here[2:] / reach
    columns = profile.frame.columns
    axis = columns[:, 2] + columns[:, :2] @ tilt
    origin = profile.frame.origin + columns[:, :2] @ (here[:2] - tilt * middle)
    return AxisFrame.along(origin, axis / math.sqrt(float(axis @ axis)), columns[:, 0])


def _moved(profile: RadialProfile, shift: Floats, tilt: Floats, middle: float, slope: float) -> RadialProfile:
    """Return the profile about an axis that is shifted [m] and tilted about its middle, to first order."""
    waves = np.stack([np.cos(profile.phi), np.sin(profile.phi)])
    lever = profile.z[:, None] - middle + profile.radius * slope
    change = shift @ waves + lever * (tilt @ waves)
    there = profile.radius > 0.0
    return replace(
        profile,
        radius=np.where(there, np.maximum(profile.radius - change, 1e-6), 0.0),
        bridged=np.where(profile.bridged > 0.0, np.maximum(profile.bridged - change, 1e-6), 0.0),
    )
