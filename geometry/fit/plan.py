"""Plan of the sheets of a link: the sheets about one or several axes that cover most and do not run into each other.

Candidates are packed on coarse profiles, and the best packings are made anew on fine ones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from coneskin.geometry.mesh import Mesh
from coneskin.geometry.ray_casting import RayCaster

from .axis_plan import AxisPlan, SheetRequirements, SideLine, plan_sheets, side_lines
from .axis_refinement import refine_axis
from .axis_search import search_axis
from .candidates import AxisCandidate
from .clearance import clashing_cells
from .cone_fit import InfiniteCone, fit_cone
from .profile import AxisFrame, RadialProfile, measure_profile
from .side import covered_points, facet_offset
from .surface_samples import SurfaceSamples

__all__ = ["AxisSurvey", "SheetPlan", "best_plan", "better_surveys", "kept_clear", "survey_axes"]

Floats = NDArray[np.float64]

_COARSE_GRID = (120, 53)  # slices, and rays in each; odd, so that the rays do not hit facets in step
_FINE_GRID = (512, 149)  # slices, and rays in each; odd for the same reason
_STARTS = 5  # plans about one axis from which packings are grown
_STARTS_APART = 3  # more of them, about axes that are not beside those
_FINE_PACKINGS = 3  # packings made anew on fine profiles
_SEARCHED = 5  # axes, no two beside each other, from which a better one is looked for
_BESIDE = (0.005, 0.0005)  # rad, m
_NEAR = 1.6  # times the tolerance within which an axis is promising


@dataclass(frozen=True, slots=True, eq=False)
class AxisSurvey:
    """An axis with its coarse profile, and the lines near which partial wraps are looked for."""

    profile: RadialProfile
    lines: list[SideLine]


@dataclass(frozen=True, slots=True, eq=False)
class SheetPlan:
    """Sheets about one or several axes.

    Attributes:
        axes: the plan about each axis, the one that covers most first.
    """

    axes: tuple[AxisPlan, ...]

    @property
    def area(self) -> float:
        """Area of all sheets, by the weights of the profiles [m2]."""
        return sum(plan.area for plan in self.axes)

    @property
    def count(self) -> int:
        """Number of sheets."""
        return sum(len(plan.sides) for plan in self.axes)

    def score(self, requirements: SheetRequirements) -> float:
        """Return the area, less what each sheet has to add to be worth its wires [m2]."""
        return sum(plan.score(requirements) for plan in self.axes)


@dataclass(frozen=True, slots=True)
class _Choice:
    """Sheets about one axis in a packing: number of the axis, and of full and partial wraps, with the coarse sides."""

    axis: int
    plan: AxisPlan

    @property
    def kinds(self) -> tuple[int, int]:
        full = sum(side.columns == len(self.plan.profile.phi) for side in self.plan.sides)
        return full, len(self.plan.sides) - full


def survey_axes(
    mesh: Mesh, rays: RayCaster, candidates: list[AxisCandidate], requirements: SheetRequirements
) -> list[AxisSurvey]:
    """Measure a coarse profile about every candidate; ``best_plan`` packs sheets on them for any tolerance."""
    surveys = []
    for candidate in candidates:
        frame = AxisFrame.along(candidate.origin, candidate.axis, requirements.seam_direction)
        profile = _profile(mesh, rays, frame, _COARSE_GRID, requirements)
        surveys.append(AxisSurvey(profile, side_lines(profile, candidate.cones)))
    return surveys


def better_surveys(
    mesh: Mesh, rays: RayCaster, surveys: list[AxisSurvey], requirements: SheetRequirements
) -> list[AxisSurvey]:
    """Return surveys about axes near the best ones about which a sheet covers more, within a tolerance.

    Args:
        mesh: the link.
        rays: a ray caster of the same mesh.
        surveys: of the axes, as ``survey_axes`` returns them.
        requirements: on the sheets.
    """
    near = replace(requirements, tolerance=_NEAR * requirements.tolerance)
    alone = [(plan, one) for one in surveys for plan in plan_sheets(one.profile, one.lines, near, 1)]
    found: list[AxisSurvey] = []
    kept: list[AxisFrame] = []
    for plan, one in sorted(alone, key=lambda pair: -pair[0].area):
        frame = one.profile.frame
        if len(kept) == _SEARCHED or any(_beside(frame, other) for other in kept):
            continue
        kept.append(frame)
        (side,) = plan.sides
        better = search_axis(one.profile, side, one.lines, requirements)
        if better is not None:
            profile = _profile(mesh, rays, better, _COARSE_GRID, requirements)
            moved = float((better.origin - frame.origin) @ frame.axis)
            cone = InfiniteCone(better.origin, better.axis, side.radius + side.slope * moved, math.atan(side.slope))
            found.append(AxisSurvey(profile, side_lines(profile, (cone,))))
    return found


def _beside(frame: AxisFrame, other: AxisFrame) -> bool:
    """Tell whether two axes are so near each other that a search from one finds what it finds from the other."""
    gap = frame.origin - other.origin
    tilt = float(np.linalg.norm(np.cross(frame.axis, other.axis)))
    return tilt < _BESIDE[0] and float(np.linalg.norm(gap - (gap @ other.axis) * other.axis)) < _BESIDE[1]


def best_plan(
    mesh: Mesh, rays: RayCaster, hull: SurfaceSamples, surveys: list[AxisSurvey], requirements: SheetRequirements
) -> SheetPlan | None:
    """Return the plan that covers most; None where nothing fits.

    Args:
        mesh: the link.
        rays: a ray caster of the same mesh.
        hull: samples of it.
        surveys: of the axes, as ``survey_axes`` returns them.
        requirements: on the sheets.
    """
    loose = replace(requirements, tolerance=1.1 * requirements.tolerance, min_length=0.75 * requirements.min_length)
    best: SheetPlan | None = None
    for number, packing in enumerate(_packings(surveys, loose)):
        if number >= _FINE_PACKINGS and (best is not None or number >= 2 * _FINE_PACKINGS):
            break
        plan = _made_fine(mesh, rays, hull, packing, requirements)
        if plan is not None and (best is None or plan.score(requirements) > 1.002 * best.score(requirements)):
            best = plan
    return best


def _packings(surveys: list[AxisSurvey], requirements: SheetRequirements) -> list[list[_Choice]]:
    """Return packings of sheets on coarse profiles, the one that covers most first."""
    most = requirements.max_sheets
    alone = [plan_sheets(one.profile, one.lines, requirements, most) for one in surveys]
    singles = [_Choice(number, plan) for number, plans in enumerate(alone) for plan in plans]
    singles.sort(key=lambda choice: -choice.plan.score(requirements))
    packings: list[list[_Choice]] = []
    seen: list[_Choice] = []
    for start in singles:
        if len(seen) >= _STARTS + _STARTS_APART:
            break
        alike = [other for other in seen if len(other.plan.sides) == len(start.plan.sides)]
        if any(other.axis == start.axis for other in alike):
            continue
        frame = start.plan.profile.frame
        if len(seen) >= _STARTS and any(_beside(frame, other.plan.profile.frame) for other in alike):
            continue
        seen.append(start)
        packings.append(_grown([start], surveys, alone, requirements))
    return sorted(packings, key=lambda packing: -sum(choice.plan.score(requirements) for choice in packing))


def _grown(
    packing: list[_Choice], surveys: list[AxisSurvey], alone: list[list[AxisPlan]], requirements: SheetRequirements
) -> list[_Choice]:
    """Return a packing with the sheets about further axes that add most, one axis after another."""
    while (left := requirements.max_sheets - sum(len(choice.plan.sides) for choice in packing)) > 0:
        best: _Choice | None = None
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
                    best, gain = _Choice(number, plan), plan.score(requirements)
        if best is None:
            break
        packing = [*packing, best]
    return packing


def kept_clear(profile: RadialProfile, plans: list[AxisPlan], requirements: SheetRequirements) -> RadialProfile:
    """Return a profile on which no sheet may lie where it would run into those of plans about other axes.

    Args:
        profile: the hull about an axis.
        plans: about other axes.
        requirements: on the sheets.
    """
    for plan in plans:
        for side in plan.sides:
            cells = clashing_cells(profile, plan.profile, side, requirements.thickness, requirements.gap)
            if cells.any():
                profile = profile.blocked(cells)
    return profile


def _made_fine(
    mesh: Mesh, rays: RayCaster, hull: SurfaceSamples, packing: list[_Choice], requirements: SheetRequirements
) -> SheetPlan | None:
    """Return a packing made anew on fine profiles; None where nothing of it is within the tolerance."""
    done: list[AxisPlan] = []
    for choice in sorted(packing, key=lambda choice: -choice.plan.area):
        frame = choice.plan.profile.frame
        lines = [(side.radius, side.slope) for side in choice.plan.sides]
        profile = kept_clear(_profile(mesh, rays, frame, _FINE_GRID, requirements), done, requirements)
        plan = _fullest(profile, lines, requirements, choice.kinds)
        if plan is None:
            continue
        plan = _refined(mesh, rays, hull, plan, requirements, done, choice.kinds)
        if not done or plan.score(requirements) > 0.0:
            done.append(plan)
    return SheetPlan(tuple(sorted(done, key=lambda plan: -plan.area))) if done else None


def _fullest(
    profile: RadialProfile,
    lines: list[SideLine],
    requirements: SheetRequirements,
    kinds: tuple[int, int],
    rise: float = 0.0,
) -> AxisPlan | None:
    """Return the plan of certain numbers of full and partial wraps, or of fewer, that is worth most."""
    plans = plan_sheets(profile, lines, requirements, sum(kinds), rise, kinds)
    if not plans:  # what was a full wrap on the coarse profile is none on the fine one
        plans = plan_sheets(profile, lines, requirements, sum(kinds), rise)
    return max(plans, key=lambda plan: plan.score(requirements), default=None)


def _profile(
    mesh: Mesh, rays: RayCaster, frame: AxisFrame, grid: tuple[int, int], requirements: SheetRequirements
) -> RadialProfile:
    slices, around = grid
    length = float(np.ptp(frame.local(mesh.vertices)[:, 2]))
    profile = measure_profile(mesh, rays, frame, max(length / slices, 0.0005), around, requirements.max_bridge)
    return profile if requirements.weights is None else profile.weighed(requirements.weights)


def _refined(
    mesh: Mesh,
    rays: RayCaster,
    hull: SurfaceSamples,
    plan: AxisPlan,
    requirements: SheetRequirements,
    others: list[AxisPlan],
    kinds: tuple[int, int],
) -> AxisPlan:
    """Refit the axis to the region that the sheets cover, and raise the sides from the facets to the corners."""
    frame, grid = plan.profile.frame, (len(plan.profile.z), len(plan.profile.phi))
    full = [side for side in plan.sides if side.columns == grid[1]]
    lines = [(side.radius, side.slope) for side in plan.sides]
    if full:
        frame = refine_axis(plan.profile, full, requirements.tolerance, requirements.seam_direction)
    else:
        side = max(plan.sides, key=lambda side: side.area(plan.profile))
        cone = InfiniteCone(frame.origin, frame.axis, side.radius, math.atan(side.slope))
        below = hull.subset(covered_points(plan.profile, side, hull, requirements.tolerance))
        fitted = fit_cone(below, cone, (requirements.tolerance,))
        if fitted is not None:
            frame = AxisFrame.along(fitted.origin, fitted.axis, requirements.seam_direction)
            moved = float((fitted.origin - plan.profile.frame.origin) @ fitted.axis)
            slope = math.tan(fitted.half_angle)
            lines = [(fitted.radius, slope), *((r + s * moved, s) for r, s in lines)]
    rises, areas = [], []
    for side in plan.sides:
        below = hull.subset(covered_points(plan.profile, side, hull, requirements.tolerance))
        near = InfiniteCone(frame.origin, frame.axis, side.radius, math.atan(side.slope))
        if not full:
            away = float((frame.origin - plan.profile.frame.origin) @ frame.axis)
            near = replace(near, radius=side.radius + side.slope * away)
        rises.append(facet_offset(mesh, below, near, requirements.tolerance))
        areas.append(side.area(plan.profile))
    profile = kept_clear(_profile(mesh, rays, frame, grid, requirements), others, requirements)
    again = _fullest(profile, lines, requirements, kinds, float(np.average(rises, weights=areas)))
    return again if again is not None and again.area > 0.99 * plan.area else plan
