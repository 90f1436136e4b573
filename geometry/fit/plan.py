"""Plan of the sheets of a link: the best packings made again on fine profiles, and completed there.

An axis is refined by the centers of its slices, which do not depend on the normals of the mesh.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from coneskin.core.arrays import Floats

from .axis_plan import AxisPlan, SheetRequirements, SideLine, kept_clear, plan_sheets
from .candidates import SampledLink
from .coarse_packing import AxisSurvey, Choice, packings
from .cone_fit import InfiniteCone, fit_cone
from .profile import AxisFrame, RadialProfile
from .side import StraightSide, facet_offset


def refine_axis(profile: RadialProfile, sides: list[StraightSide], tolerance: float, seam: Floats) -> AxisFrame:
    """Shift and tilt an axis so that the slices under full wraps are centred on it.

    A shift s and a tilt t of the axis appear in the slice at height z as (s + t (z + r dr/dz)) cos(phi), the first
    harmonic of R(z, phi), for any profile.

    Args:
        profile: the hull about the axis so far.
        sides: full wraps about it; only their slices count.
        tolerance: cells further than twice this from the median of their slice, such as holes, are left out [m].
        seam: direction of azimuth 0.

    Returns:
        the refined axis; the given one where the correction exceeds 0.2 rad or is not finite.
    """
    heights, levers, harmonics = [], [], []
    for side in sides:
        z = profile.z[side.first : side.end]
        radius = profile.radius[side.first : side.end]
        middle = np.median(radius, axis=1, keepdims=True)
        radius = np.where(np.abs(radius - middle) <= 2.0 * tolerance, radius, middle)
        waves = np.stack([np.cos(profile.phi), np.sin(profile.phi)], axis=1)
        harmonics.append(radius @ waves * (2.0 / len(profile.phi)))
        levers.append(z + middle[:, 0] * side.slope)
        heights.append(z)
    lever, harmonic = np.concatenate(levers), np.concatenate(harmonics)
    weights = np.ones(len(lever))
    solution = np.zeros((2, 2))
    for _ in range(10):
        total = float(weights.sum())
        lm = float(weights @ lever) / total
        hm = weights @ harmonic / total
        spread = float(weights @ (lever - lm) ** 2)
        if spread <= 0.0:
            return profile.frame
        tilt = (weights * (lever - lm)) @ (harmonic - hm) / spread
        solution = np.stack([hm - tilt * lm, tilt])
        miss = np.linalg.norm(harmonic - solution[0] - lever[:, None] * solution[1], axis=1)
        scale = max(4.0 * float(np.median(miss)), 1e-3 * tolerance)
        weights = np.where(miss < scale, (1.0 - (miss / scale) ** 2) ** 2, 0.0)
    shift, tilt = solution
    if not np.isfinite(solution).all() or math.hypot(*tilt) > 0.2:
        return profile.frame
    columns = profile.frame.columns
    axis = columns[:, 2] + columns[:, :2] @ tilt
    origin = profile.frame.origin + columns[:, :2] @ shift
    return AxisFrame.along(origin, axis / np.linalg.norm(axis), seam)


_FINE_GRID = (512, 149)  # slices, and rays in each; odd for the same reason
_FINE_PACKINGS = 6  # packings made anew on fine profiles
_LAST_TRIES = 12  # sheets that are tried where no packing is within the tolerance on fine profiles
_MAX_COMPLETIONS = 3  # further sheets that are tried on fine profiles, where a plan has fewer than it may have


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


@dataclass(frozen=True, slots=True, eq=False)
class FineStage:
    """Where packings are made anew on fine profiles; what is known about an axis without others is kept.

    Attributes:
        link: the link.
        surveys: of its axes, as ``survey_axes`` returns them.
        requirements: on the sheets.
        alone: coarse plans about each axis by itself, of one sheet, two sheets ... (``plan_sheets``).
    """

    link: SampledLink
    surveys: list[AxisSurvey]
    requirements: SheetRequirements
    alone: list[list[AxisPlan]] = field(init=False, repr=False)
    _first: dict[tuple[int, tuple[int, int]], AxisPlan | None] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        most = self.requirements.max_sheets
        alone = [plan_sheets(one.profile, one.lines, self.loose, most) for one in self.surveys]
        object.__setattr__(self, "alone", alone)

    @property
    def loose(self) -> SheetRequirements:
        """Requirements for coarse profiles, on which a sheet may seem a little worse than it is."""
        wanted = self.requirements
        return replace(wanted, tolerance=1.1 * wanted.tolerance, min_length=0.75 * wanted.min_length)

    def best_plan(self) -> SheetPlan | None:
        """Return the plan that covers most; None where nothing fits."""
        wanted = self.requirements
        best: SheetPlan | None = None
        for packing in packings(self.surveys, self.alone, self.loose)[:_FINE_PACKINGS]:
            plan = self.made(packing)
            if plan is not None and (best is None or plan.score(wanted) > 1.002 * best.score(wanted)):
                best = plan
        return self.completed(best)

    def made(self, packing: list[Choice]) -> SheetPlan | None:
        """Return a packing made anew on fine profiles; None where nothing of it is within the tolerance."""
        done: list[AxisPlan] = []
        for choice in sorted(packing, key=lambda choice: -choice.plan.area):
            plan = self._first_of(choice) if not done else self._beside(choice, done)
            if plan is not None and (not done or plan.score(self.requirements) > 0.0):
                done.append(plan)
        return SheetPlan(tuple(sorted(done, key=lambda plan: -plan.area))) if done else None

    def completed(self, plan: SheetPlan | None) -> SheetPlan | None:
        """Return a plan, None for one without sheets, with further sheets as long as they are allowed and worth it."""
        axes = () if plan is None else plan.axes
        while sum(len(about.sides) for about in axes) < self.requirements.max_sheets:
            further = self.further(axes)
            if further is None:
                break
            axes = (*axes, further)
        return SheetPlan(axes) if axes else None

    def further(self, axes: tuple[AxisPlan, ...]) -> AxisPlan | None:
        """Return the largest sheet that can be added to plans, made on a fine profile; None where none is worth it.

        Args:
            axes: plans about axes, made on fine profiles; none for the largest sheet by itself.
        """
        least = self.requirements.least_gain if axes else 0.0
        single = ((plans[0].area, n) for n, plans in enumerate(self.alone) if plans)
        hopes = sorted((hope for hope in single if hope[0] > least), reverse=True)
        tries = _MAX_COMPLETIONS if axes else _LAST_TRIES
        found: list[Choice] = []
        for hope, number in hopes:
            if len(found) >= tries and hope <= found[tries - 1].plan.area:  # what is there can only take from it
                break
            survey = self.surveys[number]
            clear = kept_clear(survey.profile, list(axes), self.requirements)
            about = plan_sheets(clear, survey.lines, self.loose, 1)
            found += [Choice(number, one) for one in about if one.area > least]
            found.sort(key=lambda choice: -choice.plan.area)
        best: AxisPlan | None = None
        for choice in found[:tries]:
            made = self._beside(choice, list(axes))
            if made is None or (axes and made.score(self.requirements) <= 0.0):
                continue
            if best is None or made.area > best.area:
                best = made
        return best

    def _first_of(self, choice: Choice) -> AxisPlan | None:
        key = (choice.axis, choice.kinds)
        if key not in self._first:
            self._first[key] = self._beside(choice, [])
        return self._first[key]

    def _beside(self, choice: Choice, done: list[AxisPlan]) -> AxisPlan | None:
        """Return the sheets about one axis on a fine profile, clear of those that are there."""
        wanted = self.requirements
        lines = [(side.radius, side.slope) for side in choice.plan.sides]
        profile = self.link.profile(choice.plan.profile.frame, _FINE_GRID, wanted.max_bridge)
        plan = _fullest(kept_clear(profile, done, wanted), lines, wanted, choice.kinds)
        return plan and _refined(self.link, plan, wanted, done, choice.kinds)


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


def _refined(
    link: SampledLink,
    plan: AxisPlan,
    requirements: SheetRequirements,
    others: list[AxisPlan],
    kinds: tuple[int, int],
) -> AxisPlan:
    """Refit the axis to the region that the sheets cover, and raise the sides from the facets to the corners."""
    frame, grid, hull = plan.profile.frame, (len(plan.profile.z), len(plan.profile.phi)), link.hull
    full = [side for side in plan.sides if side.columns == grid[1]]
    lines = [(side.radius, side.slope) for side in plan.sides]
    if full:
        frame = refine_axis(plan.profile, full, requirements.tolerance, requirements.seam_direction)
    else:
        side = max(plan.sides, key=lambda side: side.area(plan.profile))
        cone = InfiniteCone(frame.origin, frame.axis, side.radius, math.atan(side.slope))
        below = hull.subset(side.covers(plan.profile, hull, requirements.tolerance))
        fitted = fit_cone(below, cone, (requirements.tolerance,))
        if fitted is not None:
            frame = AxisFrame.along(fitted.origin, fitted.axis, requirements.seam_direction)
            moved = float((fitted.origin - plan.profile.frame.origin) @ fitted.axis)
            slope = math.tan(fitted.half_angle)
            lines = [(fitted.radius, slope), *((r + s * moved, s) for r, s in lines)]
    rises, areas = [], []
    for side in plan.sides:
        below = hull.subset(side.covers(plan.profile, hull, requirements.tolerance))
        near = InfiniteCone(frame.origin, frame.axis, side.radius, math.atan(side.slope))
        if not full:
            away = float((frame.origin - plan.profile.frame.origin) @ frame.axis)
            near = replace(near, radius=side.radius + side.slope * away)
        rises.append(facet_offset(link.mesh, below, near, requirements.tolerance))
        areas.append(side.area(plan.profile))
    profile = kept_clear(link.profile(frame, grid, requirements.max_bridge), others, requirements)
    again = _fullest(profile, lines, requirements, kinds, float(np.average(rises, weights=areas)))
    return again if again is not None and again.area > 0.99 * plan.area else plan
