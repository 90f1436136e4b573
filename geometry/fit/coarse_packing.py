"""Coarse packings of sheets about one or several axes: which ones cover most without running into each other.

A fit by least squares follows the mean of a crowned or dented body. The axis of the largest sheet within a tolerance is
another one, near it, and that sheet may be twice as large. So the axes near a candidate are searched too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from coneskin.core.arrays import Floats

from .axis_plan import AxisPlan, SheetRequirements, SideLine, kept_clear, largest_partial_wrap, plan_sheets
from .candidates import SampledLink
from .cone_fit import InfiniteCone
from .profile import AxisFrame, RadialProfile, axes_apart
from .side import StraightSide

_AXIS_STEPS = (0.0006, 0.0003, 0.00015)  # m; of the surface, by a shift or by a tilt, one after another
_MAX_ROUNDS = 4  # at one step
_LOOSE_FACTOR = 1.6  # times the tolerance, where nothing fits within it
_ENOUGH_SHARE = 0.97  # of the sheet within the looser tolerance; more is hardly to be found
_LEAST_BETTER = 1.01  # times the area about the axis from which the search begins
_RADIUS_BIN = 0.0005  # m; of the histogram of radii
_MAX_PEAKS = 3  # radii tried for each slope
_LINE_BINS = 4  # least distance between two of them: 2 mm


def search_axis(
    profile: RadialProfile, side: StraightSide, lines: list[SideLine], requirements: SheetRequirements
) -> AxisFrame | None:
    """Return an axis about which a single sheet covers more; None where none is found.

    Args:
        profile: the hull about the axis from which the search begins.
        side: on that profile, near which a sheet is looked for.
        lines: straight sides near which partial wraps are looked for besides.
        requirements: on the sheet.

    The axis is shifted and tilted in steps that become smaller. A small shift s and tilt t change the radii by
    (s + t (z + r dr/dz)) cos(phi) (``refine_axis``), so no ray is cast.
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
    loose = replace(tight, tolerance=_LOOSE_FACTOR * tight.tolerance)

    def worth(move: Floats) -> tuple[float, float]:
        moved = _moved(profile, move[:2], move[2:] / reach, middle, side.slope)
        within = area(moved, tight)
        return (within, 0.0) if within > 0.0 else (0.0, area(moved, loose))

    here = np.zeros(4)
    start = best = worth(here)
    if start[0] > 0.0 and start[0] >= _ENOUGH_SHARE * area(profile, loose):
        return None
    for step in _AXIS_STEPS:
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
    if best <= (_LEAST_BETTER * start[0], start[1]):
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


_COARSE_GRID = (120, 53)  # slices, and rays in each; odd, so that the rays do not hit facets in step
_STARTING_PLANS = 3  # plans of each number of sheets about one axis, none beside another, from which packings are grown
_SEARCHED_AXES = 5  # axes, no two beside each other, from which a better one is looked for
_SAME_AXIS = (0.005, 0.0005)  # rad, m
_PROMISING_FACTOR = 1.6  # times the tolerance within which an axis is promising


@dataclass(frozen=True, slots=True, eq=False)
class AxisSurvey:
    """An axis with its coarse profile, and the lines near which partial wraps are looked for."""

    profile: RadialProfile
    lines: list[SideLine]


@dataclass(frozen=True, slots=True)
class Choice:
    """Sheets about one axis in a packing: number of the axis, and the coarse plan."""

    axis: int
    plan: AxisPlan


def survey_axes(link: SampledLink, requirements: SheetRequirements) -> list[AxisSurvey]:
    """Measure a coarse profile about every axis; ``FineStage`` packs sheets on them for any tolerance."""
    surveys = []
    for candidate in link.axes:
        frame = AxisFrame.along(candidate.origin, candidate.axis, requirements.seam)
        profile = link.profile(frame, _COARSE_GRID, requirements.max_bridge)
        surveys.append(AxisSurvey(profile, _side_lines(profile, candidate.cones)))
    return surveys


def survey_about(link: SampledLink, plan: AxisPlan, requirements: SheetRequirements) -> AxisSurvey:
    """Measure a coarse profile about the axis of a plan, whose sides are among its lines."""
    frame = plan.profile.frame
    cones = (InfiniteCone(frame.origin, frame.axis, side.radius, math.atan(side.slope)) for side in plan.sides)
    profile = link.profile(frame, _COARSE_GRID, requirements.max_bridge)
    return AxisSurvey(profile, _side_lines(profile, tuple(cones)))


def widest_side(plan: AxisPlan, profile: RadialProfile) -> StraightSide:
    """Return the side of a plan that covers most, on another profile about the same axis."""
    side = max(plan.sides, key=lambda side: side.area(plan.profile))
    rows, columns = (len(a) / len(b) for a, b in ((profile.z, plan.profile.z), (profile.phi, plan.profile.phi)))
    return replace(
        side,
        first=round(rows * side.first),
        end=round(rows * side.end),
        column=round(columns * side.column),
        columns=min(len(profile.phi), round(columns * side.columns)),
    )


def _side_lines(profile: RadialProfile, cones: tuple[InfiniteCone, ...]) -> list[SideLine]:
    """Return the straight sides near which partial wraps are looked for: those of the cones, and frequent radii."""
    lines: list[SideLine] = []
    for cone in cones:
        slope = math.tan(cone.half_angle)
        lines.append((cone.radius - slope * float((cone.origin - profile.frame.origin) @ profile.frame.axis), slope))
    for slope in {0.0, *(slope for _, slope in lines)}:
        radii = (profile.radius - slope * profile.z[:, None])[profile.radius > 0.0]
        if len(radii) == 0:
            continue
        low = float(radii.min())
        places = ((radii - low) / _RADIUS_BIN).astype(np.int64)
        counts = np.convolve(np.bincount(places, weights=np.abs(radii)), np.ones(3), "same")
        for _ in range(_MAX_PEAKS):
            top = int(counts.argmax())
            near = radii[np.abs(radii - low - (top + 0.5) * _RADIUS_BIN) <= 1.5 * _RADIUS_BIN]
            if len(near) == 0 or len(near) < 0.01 * profile.radius.size:
                break
            line = (float(np.median(near)), slope)
            if all(abs(line[0] - r) > 0.5 * _RADIUS_BIN or s != slope for r, s in lines):
                lines.append(line)
            counts[max(0, top - _LINE_BINS) : top + _LINE_BINS + 1] = 0.0
    return lines


def better_surveys(link: SampledLink, surveys: list[AxisSurvey], requirements: SheetRequirements) -> list[AxisSurvey]:
    """Return surveys about axes near the best ones about which a sheet covers more, within a tolerance.

    Args:
        link: the link.
        surveys: of the axes, as ``survey_axes`` returns them.
        requirements: on the sheets.
    """
    coarse = replace(requirements.loose, tolerance=requirements.tolerance)
    near = replace(coarse, tolerance=_PROMISING_FACTOR * requirements.tolerance)
    alone = [(plan, one) for one in surveys for plan in plan_sheets(one.profile, one.lines, near, 1)]
    found: list[AxisSurvey] = []
    kept: list[AxisFrame] = []
    for plan, one in sorted(alone, key=lambda pair: -pair[0].area):
        frame = one.profile.frame
        if len(kept) == _SEARCHED_AXES or any(_beside(frame, other) for other in kept):
            continue
        kept.append(frame)
        (side,) = plan.sides
        better = search_axis(one.profile, side, one.lines, coarse)
        if better is not None:
            profile = link.profile(better, _COARSE_GRID, requirements.max_bridge)
            moved = float((better.origin - frame.origin) @ frame.axis)
            cone = InfiniteCone(better.origin, better.axis, side.radius + side.slope * moved, math.atan(side.slope))
            found.append(AxisSurvey(profile, _side_lines(profile, (cone,))))
    return found


def _beside(frame: AxisFrame, other: AxisFrame) -> bool:
    """Tell whether two axes are so near each other that a search from one finds what it finds from the other."""
    tilt, shift = axes_apart((frame.origin, frame.axis), (other.origin, other.axis))
    return tilt < _SAME_AXIS[0] and shift < _SAME_AXIS[1]


def packings(
    surveys: list[AxisSurvey], alone: list[list[AxisPlan]], requirements: SheetRequirements
) -> list[list[Choice]]:
    """Return packings of sheets on coarse profiles, the one that covers most first.

    Args:
        surveys: of the axes.
        alone: the plans about each axis by itself, as ``plan_sheets`` returns them.
        requirements: on the sheets.
    """
    singles = [Choice(number, plan) for number, plans in enumerate(alone) for plan in plans]
    singles.sort(key=lambda choice: -choice.plan.score(requirements))
    found: dict[frozenset[tuple[int, tuple[int, int]]], list[Choice]] = {}
    seen: list[Choice] = []
    for start in singles:
        frame = start.plan.profile.frame
        alike = [other for other in seen if len(other.plan.sides) == len(start.plan.sides)]
        if len(alike) == _STARTING_PLANS or any(_beside(frame, other.plan.profile.frame) for other in alike):
            continue
        seen.append(start)
        packing = grown([start], surveys, alone, requirements)
        key = frozenset((choice.axis, choice.plan.kinds) for choice in packing)
        if key not in found or _score(packing, requirements) > _score(found[key], requirements):
            found[key] = packing
    return sorted(found.values(), key=lambda packing: -_score(packing, requirements))


def _score(packing: list[Choice], requirements: SheetRequirements) -> float:
    return sum(choice.plan.score(requirements) for choice in packing)


def grown(
    packing: list[Choice], surveys: list[AxisSurvey], alone: list[list[AxisPlan]], requirements: SheetRequirements
) -> list[Choice]:
    """Return a packing with the sheets about further axes that add most, one axis after another."""
    while (left := requirements.max_sheets - sum(len(choice.plan.sides) for choice in packing)) > 0:
        best: Choice | None = None
        gain = 0.0
        used = {choice.axis for choice in packing}
        hopes = [
            (max((plan.score(requirements) for plan in plans[:left]), default=0.0), number)
            for number, plans in enumerate(alone)
            if number not in used
        ]
        for hope, number in sorted(hopes, reverse=True):
            if hope <= gain:  # what is there already can only take from it
                break
            profile = kept_clear(surveys[number].profile, [choice.plan for choice in packing], requirements)
            for plan in plan_sheets(profile, surveys[number].lines, requirements, left):
                if plan.score(requirements) > gain:
                    best, gain = Choice(number, plan), plan.score(requirements)
        if best is None:
            break
        packing = [*packing, best]
    return packing
