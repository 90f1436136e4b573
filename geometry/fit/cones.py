"""Search for the sheets of a link: the frusta that cover most of it within a tolerance.

The best coarse packings are made again on fine profiles, and completed there. An axis is refined by the centers of its
slices, which do not depend on the normals of the mesh.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.geometry.mesh import Mesh

from .axis_plan import AxisPlan, FittedSheet, SheetRequirements, SideLine, fitted_sheet, kept_clear, plan_sheets
from .bare_areas import BareArea, bare_areas, hull_note
from .candidates import SampledLink, find_axis_candidates, sample_link
from .coarse_packing import (
    AxisSurvey,
    Choice,
    better_surveys,
    packings,
    search_axis,
    survey_about,
    survey_axes,
    widest_side,
)
from .cone_fit import InfiniteCone, fit_cone
from .fit_options import MOST_TOLERANCE, FitOptions, check_names
from .profile import AxisFrame, RadialProfile, axes_apart
from .side import StraightSide, facet_offset
from .touch_weights import TouchWeights


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
_FINE_PACKINGS = 3  # packings made anew on fine profiles
_LAST_TRIES = 12  # sheets that are tried where no packing is within the tolerance on fine profiles
_LEAST_RISE = 1.002  # times what plans are worth, below which others are no better
_MAX_EXCHANGES = 4  # of a plan for others
_PROMISING_SHARE = 0.9  # of what plans cover; others that cover less at once are given up
_LEAST_BARE = 100  # samples, from which axes are looked for
_KNOWN_AXIS = (0.0005, 5e-5)  # rad, m
_MAX_COMPLETIONS = 3  # further sheets that are tried on fine profiles, where a plan has fewer than it may have


@dataclass(frozen=True, slots=True, eq=False)
class FineStage:
    """Where packings are made anew on fine profiles; what is known about an axis without others is kept.

    Attributes:
        link: the link.
        surveys: of its axes, as ``survey_axes`` returns them; the search adds those that it meets.
        requirements: on the sheets.
        alone: coarse plans about each axis by itself, of one sheet, two sheets ... (``plan_sheets``).
    """

    link: SampledLink
    surveys: list[AxisSurvey]
    requirements: SheetRequirements
    alone: list[list[AxisPlan]] = field(init=False, repr=False)
    _first: dict[tuple[int, tuple[int, int]], AxisPlan | None] = field(default_factory=dict, repr=False)
    _best_near: set[AxisPlan] = field(default_factory=set, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "alone", [self._plans_about(one) for one in self.surveys])

    def _plans_about(self, survey: AxisSurvey) -> list[AxisPlan]:
        """Return the coarse plans about an axis by itself."""
        return plan_sheets(survey.profile, survey.lines, self.requirements.loose, self.requirements.max_sheets)

    def best_plans(self) -> tuple[AxisPlan, ...]:
        """Return the plans that together cover most, the one that covers most first; none where nothing fits."""
        best: tuple[AxisPlan, ...] = ()
        most = 0.0
        for packing in packings(self.surveys, self.alone, self.requirements.loose)[:_FINE_PACKINGS]:
            plans = self.made(packing)
            if plans and (not best or self.worth(plans) > _LEAST_RISE * most):
                best, most = plans, self.worth(plans)
        return self.improved(self.completed(best))

    def improved(self, axes: tuple[AxisPlan, ...]) -> tuple[AxisPlan, ...]:
        """Return plans of which one after another gave way to others, as long as these cover more."""
        if not axes:
            return axes
        self._look_beside(axes)
        axes = self._polished(self.completed(axes))
        for _ in range(_MAX_EXCHANGES):
            for one in sorted(axes, key=lambda plan: -plan.area):
                others = self.completed(tuple(other for other in axes if other is not one))
                if self.worth(others) > _PROMISING_SHARE * self.worth(axes):
                    others = self._polished(others)
                if self.worth(others) > _LEAST_RISE * self.worth(axes):
                    axes = others
                    break
            else:
                break
        return tuple(sorted(axes, key=lambda plan: -plan.area))

    def worth(self, axes: Sequence[AxisPlan]) -> float:
        """Return what plans cover, less what their sheets have to add [m2]."""
        return sum(plan.score(self.requirements) for plan in axes)

    def _look_beside(self, axes: tuple[AxisPlan, ...]) -> None:
        """Learn axes of what plans leave bare, and better ones near those that are known."""
        hull, wanted = self.link.hull, self.requirements
        bare = np.ones(len(hull), bool)
        for plan in axes:
            for side in plan.sides:
                bare &= ~side.covers(plan.profile, hull, wanted.tolerance)
        if bare.sum() < _LEAST_BARE:
            return
        left = replace(self.link, axes=find_axis_candidates(hull.subset(bare)))
        for survey in survey_axes(left, wanted):
            self._learn(survey)
        clear = [replace(one, profile=kept_clear(one.profile, axes, wanted)) for one in self.surveys]
        for survey in better_surveys(self.link, clear, wanted):
            self._learn(survey)

    def _learn(self, survey: AxisSurvey) -> None:
        """Keep an axis with its plans, unless it is known."""
        own = survey.profile.frame
        for known in self.surveys:
            frame = known.profile.frame
            tilt, shift = axes_apart((own.origin, own.axis), (frame.origin, frame.axis))
            if tilt < _KNOWN_AXIS[0] and shift < _KNOWN_AXIS[1]:
                return
        self.surveys.append(survey)
        self.alone.append(self._plans_about(survey))

    def _polished(self, axes: tuple[AxisPlan, ...]) -> tuple[AxisPlan, ...]:
        """Return plans with better axes near theirs, where there are any."""
        for one in axes:
            if one in self._best_near:
                continue
            kept, better = one, self._near(one, [other for other in axes if other is not one])
            if better is not None and better.score(self.requirements) > _LEAST_RISE * one.score(self.requirements):
                kept = better
            axes = tuple(kept if other is one else other for other in axes)
            self._best_near.add(kept)
        return axes

    def _near(self, plan: AxisPlan, others: Sequence[AxisPlan]) -> AxisPlan | None:
        """Return the plan about a better axis near that of one, clear of others; None without such an axis."""
        wanted = self.requirements
        profile = kept_clear(survey_about(self.link, plan, wanted).profile, others, wanted)
        lines = [(side.radius, side.slope) for side in plan.sides]
        frame = search_axis(profile, widest_side(plan, profile), lines, wanted)
        return None if frame is None else self._fine(frame, lines, plan.kinds, others)

    def made(self, packing: list[Choice]) -> tuple[AxisPlan, ...]:
        """Return a packing made anew on fine profiles; nothing where none of it is within the tolerance."""
        done: list[AxisPlan] = []
        for choice in sorted(packing, key=lambda choice: -choice.plan.area):
            plan = self._first_of(choice) if not done else self._beside(choice, done)
            if plan is not None and (not done or plan.score(self.requirements) > 0.0):
                done.append(plan)
        return tuple(sorted(done, key=lambda plan: -plan.area))

    def completed(self, axes: tuple[AxisPlan, ...]) -> tuple[AxisPlan, ...]:
        """Return plans with further sheets as long as they are allowed and worth it."""
        while sum(len(about.sides) for about in axes) < self.requirements.max_sheets:
            further = self.further(axes)
            if further is None:
                break
            axes = (*axes, further)
        return axes

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
            clear = kept_clear(survey.profile, axes, self.requirements)
            about = plan_sheets(clear, survey.lines, self.requirements.loose, 1)
            found += [Choice(number, one) for one in about if one.area > least]
            found.sort(key=lambda choice: -choice.plan.area)
        best: AxisPlan | None = None
        for choice in found[:tries]:
            made = self._beside(choice, axes)
            if made is None or (axes and made.score(self.requirements) <= 0.0):
                continue
            if best is None or made.area > best.area:
                best = made
        return best

    def _first_of(self, choice: Choice) -> AxisPlan | None:
        key = (choice.axis, choice.plan.kinds)
        if key not in self._first:
            self._first[key] = self._beside(choice, [])
        return self._first[key]

    def _beside(self, choice: Choice, done: Sequence[AxisPlan]) -> AxisPlan | None:
        """Return the sheets about one axis on a fine profile, clear of those that are there."""
        lines = [(side.radius, side.slope) for side in choice.plan.sides]
        return self._fine(choice.plan.profile.frame, lines, choice.plan.kinds, done)

    def _fine(
        self, frame: AxisFrame, lines: list[SideLine], kinds: tuple[int, int], done: Sequence[AxisPlan]
    ) -> AxisPlan | None:
        """Return the sheets about an axis near some lines, on a fine profile and about the axis that fits them best."""
        wanted = self.requirements
        profile = self.link.profile(frame, _FINE_GRID, wanted.max_bridge)
        plan = _fullest(kept_clear(profile, done, wanted), lines, wanted, kinds)
        if plan is None:
            return None
        plan = _refined(self.link, plan, wanted, done, kinds)
        self._learn(survey_about(self.link, plan, wanted))
        return plan


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
    others: Sequence[AxisPlan],
    kinds: tuple[int, int],
) -> AxisPlan:
    """Refit the axis to the region that the sheets cover, and raise the sides from the facets to the corners."""
    frame, grid, hull = plan.profile.frame, (len(plan.profile.z), len(plan.profile.phi)), link.hull
    full = [side for side in plan.sides if side.columns == grid[1]]
    lines = [(side.radius, side.slope) for side in plan.sides]
    if full:
        frame = refine_axis(plan.profile, full, requirements.tolerance, requirements.seam)
    else:
        side = max(plan.sides, key=lambda side: side.area(plan.profile))
        cone = InfiniteCone(frame.origin, frame.axis, side.radius, math.atan(side.slope))
        below = hull.subset(side.covers(plan.profile, hull, requirements.tolerance))
        fitted = fit_cone(below, cone, (requirements.tolerance,))
        if fitted is not None:
            frame = AxisFrame.along(fitted.origin, fitted.axis, requirements.seam)
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


HULL_SHARE = 0.15  #: share of the area; a convex mesh of which less can be covered is taken for a collision hull
LEAST_GAIN = 0.04  #: share of the hull that a further sheet must add; a fillet adds less
_FIRST_RAY = (0.74, 0.57, 0.36)  # in the link's own frame; oblique, so that it lies along no axis
_HINT_STEP = 1e-5  # m; a tolerance is advised in hundredths of a millimetre


@dataclass(frozen=True, slots=True)
class LinkFit:
    """Sheets found on a link, and what they leave bare.

    Attributes:
        sheets: those about the axis that covers most first, in order along their axis; empty where nothing fits within
            the tolerance.
        nearest: where nothing fits, the sheet that comes nearest; None where a sheet fits.
        tolerance: largest distance allowed between sheet and hull [m].
        link_length: length of the link along the axis of the first sheet [m].
        hull_area: area visible from outside [m2].
        notes: notes on the mesh, one sentence each.
        reason: why nothing fits; empty where a sheet does.
        candidates: number of axes tried.
        needed_tolerance: where nothing fits, a tolerance with which something does, tried [m]; infinite without one.
        bare_areas: what no sheet covers, by reason, the largest first; empty where no sheet fits.
        touch_weights: map by which areas were weighed; None where all count the same.
    """

    sheets: tuple[FittedSheet, ...]
    nearest: FittedSheet | None
    tolerance: float
    link_length: float
    hull_area: float
    notes: tuple[str, ...]
    reason: str
    candidates: int
    needed_tolerance: float = math.inf
    bare_areas: tuple[BareArea, ...] = ()
    touch_weights: TouchWeights | None = None


def find_cones(
    mesh: Mesh,
    options: FitOptions | None = None,
    *,
    progress: Callable[[str], None] | None = None,
    **named: Any,
) -> LinkFit:
    """Find the frusta that cover most of a link, about one or several axes; with weights, most of what is touched.

    The search draws nothing by chance: the same mesh gives the same sheets.

    Args:
        mesh: the link.
        options: what is asked of the sheets; None for the values that ``FitOptions`` has by itself.
        progress: called with the name of each step.
        named: options by their names, instead of those in ``options``: ``find_cones(mesh, tolerance=0.002)``.

    Returns:
        the fit; without sheets where nothing fits within the tolerance.

    Raises:
        GeometryError: an option is out of range.
        MeshError: no face of the mesh is visible from outside.
    """
    check_names(named)
    options = replace(options or FitOptions(), **named)
    say = progress or (lambda _: None)
    return fit_cones(sample_link(mesh, options, say), options, say)


def fit_cones(link: SampledLink, options: FitOptions, say: Callable[[str], None]) -> LinkFit:
    """Find the frusta that cover most of a sampled link; ``say`` is called with the name of each step."""
    options, flaws = link.eased(options)
    asked = {item.name: getattr(options, item.name) for item in fields(FitOptions)}
    asked |= {"max_sheets": options.most_sheets, "weights": link.weights}
    # the rays about an axis begin at a direction of the link's own, so that the sheets do not depend on its frame
    asked["seam_direction"] = tuple(link.mesh.own_frame[1] @ _FIRST_RAY)
    requirements = SheetRequirements(**asked, least_gain=LEAST_GAIN * link.weighed_area)
    say("measuring profiles")
    surveys = survey_axes(link, requirements)
    surveys += better_surveys(link, surveys, requirements)
    stage = FineStage(link, surveys, requirements)
    tolerance, worth = options.tolerance, link.worth
    axes, refusal = _plans(stage, options.allow_hull)
    off = link.hull.points - link.hull.points.mean(axis=0)  # along its longest direction
    fit = LinkFit(
        sheets=(),
        nearest=None,
        tolerance=tolerance,
        link_length=float(np.ptp(off @ np.linalg.eigh(off.T @ off)[1][:, 2])),
        hull_area=link.hull_area,
        notes=(*link.mesh.notes, *flaws),
        reason="",
        candidates=len(link.axes),
        needed_tolerance=tolerance,
        touch_weights=link.weights,
    )
    if not axes:
        length, least = fit.link_length, options.min_length
        reason = refusal or f"no cone fits within {tolerance * 1e3:g} mm over a length of {least * 1e3:g} mm"
        if length < least:
            reason = f"the link is {length * 1e3:.1f} mm long, but a sheet needs at least {least * 1e3:g} mm"
        say("looking for the nearest sheet")
        looser, needed = _nearest(stage, options.allow_hull)
        nearest = None
        if looser:
            first = looser[0]
            widest = max(first.sides, key=lambda side: side.area(first.profile))
            nearest = fitted_sheet(first, widest, 0, link.counted, needed, options.seam, worth)
        return replace(fit, nearest=nearest, needed_tolerance=needed, reason=reason)
    first = axes[0]
    full = sum(len(about.sides) for about in axes) >= requirements.max_sheets
    further = stage.further(axes) if full else None
    return replace(
        fit,
        sheets=tuple(
            fitted_sheet(about, side, number, link.counted, tolerance, options.seam, worth)
            for number, about in enumerate(axes)
            for side in about.sides
        ),
        bare_areas=tuple(bare_areas(axes, further, surveys, link.hull, requirements)),
        link_length=first.profile.step * len(first.profile.z),
    )


def _plans(stage: FineStage, allow_hull: bool) -> tuple[tuple[AxisPlan, ...], str]:
    """Return the best plans; or none and, for a mesh that is a bare hull, the reason."""
    axes, wanted = stage.best_plans(), stage.requirements
    area, whole = sum(plan.area for plan in axes), stage.link.weighed_area
    # a requested wrap implies that the shape is known; otherwise sheets should cover some of a convex body
    if not (allow_hull or area >= HULL_SHARE * whole or (axes and wanted.wrap)):
        hulled = hull_note(stage.link.mesh, stage.link.hull)
        if hulled:
            share = f"{100.0 * area / whole:.0f} %"
            return (), f"{hulled} (a sheet within {wanted.tolerance * 1e3:g} mm would cover {share} of it)"
    return axes, ""


def _nearest(stage: FineStage, allow_hull: bool) -> tuple[tuple[AxisPlan, ...], float]:
    """Return plans within the least of some tolerances that gives one, and that tolerance [m]."""
    wanted = stage.requirements
    for factor in (1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0):
        tolerance = math.ceil(factor * wanted.tolerance / _HINT_STEP - 1e-6) * _HINT_STEP
        if tolerance > MOST_TOLERANCE:
            break
        axes, _ = _plans(FineStage(stage.link, stage.surveys, replace(wanted, tolerance=tolerance)), allow_hull)
        if axes:
            return axes, tolerance
    return (), math.inf
