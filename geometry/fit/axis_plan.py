"""Sheets about one axis: full wraps, partial wraps, and both together, that cover most with a number of sheets."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .cone_fit import InfiniteCone
from .intervals import balance_borders, choose_intervals, longest_intervals
from .partial_wrap import largest_region
from .profile import RadialProfile
from .side import StraightSide, azimuth_columns, fit_side
from .touch_weights import TouchWeights

__all__ = ["AxisPlan", "SheetRequirements", "SideLine", "largest_partial_wrap", "plan_sheets", "side_lines"]

Floats = NDArray[np.float64]
SideLine = tuple[float, float]  #: radius at z = 0 of the profile's frame [m], and dr/dz

TURN = 2.0 * math.pi
_BIN = 0.0005  # m; of the histogram of radii
_MAX_PEAKS = 3  # radii tried for each slope
_HARDLY = 0.97  # of the largest side so far: fewer cells near a line hold no larger one
_APART = 0.002  # m; least distance between two of them


@dataclass(frozen=True, slots=True)
class SheetRequirements:
    """Requirements on the sheets: the arguments of ``find_cones``, and what a further sheet must add [m2].

    With weights, that area and every other one is weighed by them.
    """

    tolerance: float
    max_sheets: int
    wrap: float | None
    min_length: float
    min_wrap: float
    max_bridge: float
    seam_direction: Floats
    min_radius: float
    thickness: float
    gap: float
    least_gain: float
    weights: TouchWeights | None = None
    min_arc: float = 0.0

    def least_radius(self, wrap: float) -> float:
        """Return the smallest radius [m] of a side at least so wide [rad]; its fit may lie a tolerance inside."""
        return max(self.min_radius, self.min_arc / wrap + self.tolerance) if self.min_arc else self.min_radius


@dataclass(frozen=True, slots=True, eq=False)
class AxisPlan:
    """Straight sides about one axis that are to become sheets.

    Attributes:
        profile: the hull about the axis; cells on which no sheet may lie have the weight 0.
        sides: the sides, in order along the axis; empty where none is within the tolerance.
    """

    profile: RadialProfile
    sides: list[StraightSide]

    @property
    def area(self) -> float:
        """Area of all sheets, by the weights of the profile [m2]."""
        return sum(side.area(self.profile) for side in self.sides)

    def score(self, requirements: SheetRequirements) -> float:
        """Return the area, less what each sheet has to add to be worth its wires [m2]."""
        return self.area - requirements.least_gain * len(self.sides)


def side_lines(profile: RadialProfile, cones: tuple[InfiniteCone, ...]) -> list[SideLine]:
    """Return the straight sides near which partial wraps are looked for: those of the cones, and frequent radii.

    Args:
        profile: the hull about the axis.
        cones: about the same axis.
    """
    lines: list[SideLine] = []
    for cone in cones:
        slope = math.tan(cone.half_angle)
        lines.append((cone.radius - slope * float((cone.origin - profile.frame.origin) @ profile.frame.axis), slope))
    for slope in {0.0, *(slope for _, slope in lines)}:
        radii = (profile.radius - slope * profile.z[:, None])[profile.radius > 0.0]
        if len(radii) == 0:
            continue
        low = float(radii.min())
        places = ((radii - low) / _BIN).astype(np.int64)
        counts = np.convolve(np.bincount(places, weights=np.abs(radii)), np.ones(3), "same")
        for _ in range(_MAX_PEAKS):
            top = int(counts.argmax())
            near = radii[np.abs(radii - low - (top + 0.5) * _BIN) <= 1.5 * _BIN]
            if len(near) == 0 or len(near) < 0.01 * profile.radius.size:
                break
            line = (float(np.median(near)), slope)
            if all(abs(line[0] - r) > 0.5 * _BIN or s != slope for r, s in lines):
                lines.append(line)
            counts[max(0, top - round(_APART / _BIN)) : top + round(_APART / _BIN) + 1] = 0.0
    return lines


def plan_sheets(
    profile: RadialProfile,
    lines: list[SideLine],
    requirements: SheetRequirements,
    count: int,
    rise: float = 0.0,
    exactly: tuple[int, int] | None = None,
) -> list[AxisPlan]:
    """Return the plan that covers most for each number of sheets from 1 on; shorter where more add nothing.

    Args:
        profile: the hull about the axis.
        lines: straight sides near which partial wraps are looked for.
        requirements: on the sheets.
        count: number of sheets at most.
        rise: added to the radii, because facets lie inside the true surface [m].
        exactly: numbers of full and of partial wraps, to plan no others.
    """
    rows = max(2, math.ceil(requirements.min_length / profile.step))
    best: dict[int, AxisPlan] = {}
    for full in _full_wraps(profile, requirements, rows, count, rise):
        if exactly is not None and len(full) != exactly[0]:
            continue
        sides = list(full)
        while True:
            plan = AxisPlan(profile, sorted(sides, key=lambda side: (side.first, side.column)))
            known = best.get(len(sides))
            if sides and (known is None or plan.area > known.area):
                best[len(sides)] = plan
            wanted = count if exactly is None else sum(exactly)
            if len(sides) == wanted or requirements.wrap == TURN:
                break
            held = profile
            for side in sides:
                held = held.blocked(_neighbourhood(profile, side, requirements.gap))
            part = largest_partial_wrap(held, lines, requirements, rows, rise)
            if part is None:
                break
            sides = [*sides, part]
    plans: list[AxisPlan] = []
    for number in range(1, count + 1):
        if number in best:
            plans.append(best[number])
    return plans


def _full_wraps(
    profile: RadialProfile, requirements: SheetRequirements, rows: int, count: int, rise: float
) -> list[list[StraightSide]]:
    """Return the sides of none, one, two ... full wraps that cover most, each list longer than the one before."""
    found: list[list[StraightSide]] = [[]]
    if requirements.wrap is not None and requirements.wrap != TURN:
        return found
    high, low = profile.bounds(requirements.tolerance)
    low = np.where(low >= requirements.least_radius(TURN), low, 0.0)
    ends = longest_intervals(profile.z, high, low, requirements.tolerance, rows)
    worth = profile.radius.mean(axis=1) if profile.weight is None else (profile.radius * profile.weight).mean(axis=1)
    for number in range(1, count + 1):
        chosen = choose_intervals(ends, number, rows, worth)
        if len(chosen) < number:
            break
        chosen = balance_borders(profile.z, high, low, chosen, rows)
        sides = [fit_side(profile, a, b, 0, len(profile.phi), requirements.tolerance, rise) for a, b in chosen]
        sides = [side for side in sides if side.end - side.first >= rows]
        if len(sides) <= len(found[-1]):
            break
        found.append(sides)
    return found


def largest_partial_wrap(
    profile: RadialProfile, lines: list[SideLine], requirements: SheetRequirements, rows: int, rise: float
) -> StraightSide | None:
    """Return the largest side near one of the lines; None where none is large enough."""
    around = len(profile.phi)
    exact = requirements.wrap is not None
    columns = min(math.ceil((requirements.wrap or requirements.min_wrap) / TURN * around), around)
    free, floor = profile.free(), profile.floor(requirements.tolerance)
    least = requirements.least_radius(columns * TURN / around)
    best: StraightSide | None = None
    area = 0.0
    for radius, slope in lines:
        line = radius + slope * profile.z + rise
        limit = requirements.tolerance * math.hypot(1.0, slope)
        good = free & (profile.radius <= (line + limit)[:, None]) & (floor >= (line - limit)[:, None])
        good &= (line >= least)[:, None]
        filled = good.sum(axis=1)
        if int(filled.sum()) < rows * columns:
            continue
        most = float(filled @ line) * profile.step * TURN / around * math.hypot(1.0, slope)
        if requirements.weights is None and most < _HARDLY * area:
            continue
        worth = None if requirements.weights is None else profile.weight
        region = largest_region(good, rows, columns, exact, worth)
        if region is None:
            continue
        side = fit_side(profile, *region, requirements.tolerance, rise)
        if side.end - side.first >= rows and side.area(profile) > area:
            best, area = side, side.area(profile)
    return best


def _neighbourhood(profile: RadialProfile, side: StraightSide, gap: float) -> NDArray[np.bool_]:
    """Return the cells of a side and those nearer to it than a gap [m], shape (k, p)."""
    cells = np.zeros(profile.radius.shape, bool)
    rows = math.ceil(gap / profile.step)
    around = len(profile.phi)
    least = float(side.radii(profile.z[side.first : side.end]).min())
    wide = min(math.ceil(gap / (TURN / around * max(least, 1e-3))), around)
    columns = azimuth_columns(profile, side.column - wide, min(side.columns + 2 * wide, around))
    cells[np.ix_(np.arange(max(0, side.first - rows), min(len(profile.z), side.end + rows)), columns)] = True
    return cells
