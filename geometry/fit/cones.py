"""Search for the sheets of a link: the frusta that cover most of it within a tolerance.

A sampled link is what the search sees: its rays, samples of its hull, what areas count, and the axes about which sheets
may lie. The cones and the other developables of a link are looked for on the same samples and from the same axes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from coneskin.geometry.mesh import Mesh
from coneskin.geometry.ray_casting import RayCaster

from .axis_plan import AxisPlan, SheetRequirements
from .bare_areas import BareArea, bare_areas, bare_lengths, hull_note
from .candidates import AxisCandidate, find_axis_candidates
from .coarse_packing import AxisSurvey, better_surveys, survey_axes
from .fit_options import MOST_TOLERANCE, FitOptions
from .fitted_sheet import FittedSheet, fitted_sheet
from .plan import FineStage, SheetPlan, best_plan
from .surface_samples import SurfaceSamples, sample_surface
from .touch_weights import TouchWeights, exposure_weights

__all__ = ["LEAST_GAIN", "BareLength", "LinkFit", "SampledLink", "find_cones", "fit_cones", "sample_link"]

_SEARCH_SAMPLES = 6000  #: points on the mesh from which the axes are found, whatever is asked


@dataclass(frozen=True, slots=True, eq=False)
class SampledLink:
    """A link with all that every search on it needs.

    Attributes:
        mesh: the link.
        rays: a ray caster of the mesh.
        hull: samples by which sheets are looked for.
        counted: samples by which coverage is measured.
        weights: what areas count; None where all count the same.
        axes: about which sheets may lie.
    """

    mesh: Mesh
    rays: RayCaster
    hull: SurfaceSamples
    counted: SurfaceSamples
    weights: TouchWeights | None
    axes: list[AxisCandidate]

    @property
    def hull_area(self) -> float:
        """Area visible from outside [m2]."""
        return len(self.hull) * self.hull.area

    @property
    def weighed_area(self) -> float:
        """Area visible from outside, by the weights [m2]."""
        if self.weights is None:
            return self.hull_area
        return float(self.weights.at(self.hull.points).sum()) * self.hull.area

    @property
    def worth(self) -> NDArray[np.float64] | None:
        """What each counted sample counts, shape (n,); None where all count the same."""
        return None if self.weights is None else self.weights.at(self.counted.points)


def sample_link(mesh: Mesh, options: FitOptions, progress: Callable[[str], None]) -> SampledLink:
    """Sample a link and find its axes; nothing is drawn by chance.

    Args:
        mesh: the link.
        options: of the search.
        progress: called with the name of each step.

    Raises:
        GeometryError: the weights are not about this link.
        MeshError: no face of the mesh is visible from outside.
    """
    progress("sampling the hull")
    rays = RayCaster(mesh)
    hull = sample_surface(mesh, rays, _SEARCH_SAMPLES)
    counted = hull if options.samples == _SEARCH_SAMPLES else sample_surface(mesh, rays, options.samples)
    weights = options.weights
    if options.exposure:
        progress("casting rays to the outside")
        weights = exposure_weights(hull, rays)
    if weights is not None:
        weights.check_place(hull.points)
    progress("looking for axes")
    return SampledLink(mesh, rays, hull, counted, weights, find_axis_candidates(hull))


Floats = NDArray[np.float64]

HULL_SHARE = 0.15  #: share of the area; a convex mesh of which less can be covered is taken for a collision hull
LEAST_GAIN = 0.04  #: share of the hull that a further sheet must add; a fillet adds less
_HINT_STEP = 1e-5  # m; a tolerance is advised in hundredths of a millimetre


@dataclass(frozen=True, slots=True)
class BareLength:
    """A length of the link without a sheet.

    Attributes:
        start: distance along the axis from end 1 of the first sheet [m].
        end: the same of its far end [m].
        reason: why no sheet lies there, in words.
    """

    start: float
    end: float
    reason: str


@dataclass(frozen=True, slots=True)
class LinkFit:
    """Sheets found on a link, and the lengths that they leave bare.

    Attributes:
        sheets: those about the axis that covers most first, in order along their axis; empty where nothing fits within
            the tolerance.
        nearest: where nothing fits, the sheet that comes nearest; None where a sheet fits.
        bare: lengths without a sheet along the axis of the first sheet, in order.
        tolerance: largest distance allowed between sheet and hull [m].
        link_length: length of the link along the axis of the first sheet [m].
        hull_area: area visible from outside [m2].
        notes: notes on the mesh, one sentence each.
        reason: why nothing fits; empty where a sheet does.
        candidates: number of axes tried.
        ray_engine: the engine that cast the rays, "embree" or "grid".
        needed_tolerance: where nothing fits, a tolerance with which something does, tried [m]; infinite without one.
        bare_areas: what no sheet covers, by reason, the largest first; empty where no sheet fits.
        weights: name of the map by which areas were weighed; empty where all count the same.
        touch_weights: that map; None where all count the same.
    """

    sheets: tuple[FittedSheet, ...]
    nearest: FittedSheet | None
    bare: tuple[BareLength, ...]
    tolerance: float
    link_length: float
    hull_area: float
    notes: tuple[str, ...]
    reason: str
    candidates: int
    ray_engine: str
    needed_tolerance: float = math.inf
    bare_areas: tuple[BareArea, ...] = ()
    weights: str = ""
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
    options = replace(options or FitOptions(), **named)
    say = progress or (lambda _: None)
    return fit_cones(sample_link(mesh, options, say), options, say)


def fit_cones(link: SampledLink, options: FitOptions, say: Callable[[str], None]) -> LinkFit:
    """Find the frusta that cover most of a sampled link; ``say`` is called with the name of each step."""
    requirements = SheetRequirements(
        options.tolerance,
        options.most_sheets,
        options.wrap,
        options.min_length,
        options.min_wrap,
        options.max_bridge,
        options.seam,
        options.min_radius,
        options.thickness,
        options.gap,
        LEAST_GAIN * link.weighed_area,
        link.weights,
        options.min_arc,
    )
    mesh, rays, hull, counted, worth = link.mesh, link.rays, link.hull, link.counted, link.worth
    tolerance, min_length = options.tolerance, options.min_length
    hull_area, weighed, candidates = link.hull_area, link.weighed_area, link.axes
    say("measuring profiles")
    surveys = survey_axes(mesh, rays, candidates, requirements)
    surveys += better_surveys(mesh, rays, surveys, requirements)
    search = _Search(mesh, rays, hull, weighed, surveys, requirements, options.allow_hull)
    plan, refusal = search.plan(tolerance)
    name = "" if link.weights is None else link.weights.name
    nearest, needed, length = None, math.inf, _longest(hull)
    if plan is None:
        reason = refusal or f"no cone fits within {tolerance * 1e3:g} mm over a length of {min_length * 1e3:g} mm"
        if length < min_length:
            reason = f"the link is {length * 1e3:.1f} mm long, but a sheet needs at least {min_length * 1e3:g} mm"
        say("looking for the nearest sheet")
        looser, needed = search.nearest()
        if looser is not None:
            first = looser.axes[0]
            widest = max(first.sides, key=lambda side: side.area(first.profile))
            nearest = fitted_sheet(first, widest, 0, counted, needed, worth)
        return LinkFit(
            sheets=(),
            nearest=nearest,
            needed_tolerance=needed,
            bare=(BareLength(0.0, length, reason),),
            tolerance=tolerance,
            link_length=length,
            hull_area=hull_area,
            notes=mesh.notes,
            reason=reason,
            candidates=len(candidates),
            ray_engine=rays.engine,
            weights=name,
            touch_weights=link.weights,
        )
    first = plan.axes[0]
    further: AxisPlan | None = None
    if plan.count >= requirements.max_sheets:
        further = search.stage(tolerance).further(plan.axes, surveys)
    return LinkFit(
        sheets=tuple(
            fitted_sheet(about, side, number, counted, tolerance, worth)
            for number, about in enumerate(plan.axes)
            for side in about.sides
        ),
        nearest=None,
        needed_tolerance=tolerance,
        bare_areas=tuple(bare_areas(plan, further, surveys, hull, requirements)),
        bare=tuple(
            BareLength(*item)
            for item in bare_lengths(
                first.profile,
                first.sides,
                tolerance,
                min_length,
                further,
            )
        ),
        tolerance=tolerance,
        link_length=first.profile.step * len(first.profile.z),
        hull_area=hull_area,
        notes=mesh.notes,
        reason="",
        candidates=len(candidates),
        ray_engine=rays.engine,
        weights=name,
        touch_weights=link.weights,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """What is known of a link when sheets are looked for, with one tolerance or another."""

    mesh: Mesh
    rays: RayCaster
    hull: SurfaceSamples
    weighed: float  # area of the hull, by the weights [m2]
    surveys: list[AxisSurvey]
    requirements: SheetRequirements
    allow_hull: bool
    _stages: dict[float, FineStage] = field(default_factory=dict, repr=False)

    def stage(self, tolerance: float) -> FineStage:
        """Return where packings are made anew within a tolerance [m]."""
        if tolerance not in self._stages:
            wanted = replace(self.requirements, tolerance=tolerance)
            self._stages[tolerance] = FineStage(self.mesh, self.rays, self.hull, wanted)
        return self._stages[tolerance]

    def plan(self, tolerance: float) -> tuple[SheetPlan | None, str]:
        """Return the best plan within a tolerance [m]; or None and, for a mesh that is a bare hull, the reason."""
        stage = self.stage(tolerance)
        plan, wanted = best_plan(stage, self.surveys), stage.requirements
        area, whole = plan.area if plan else 0.0, self.weighed
        # a requested wrap implies that the shape is known; otherwise sheets should cover some of a convex body
        if self.allow_hull or area >= HULL_SHARE * whole or (plan and wanted.wrap):
            return plan, ""
        hulled = hull_note(self.mesh, self.hull)
        if hulled:
            share = f"{100.0 * area / whole:.0f} %"
            return None, f"{hulled} (a sheet within {tolerance * 1e3:g} mm would cover {share} of it)"
        return plan, ""

    def nearest(self) -> tuple[SheetPlan | None, float]:
        """Return a plan within the least of some tolerances that gives one, and that tolerance [m]."""
        for factor in (1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0):
            tolerance = math.ceil(factor * self.requirements.tolerance / _HINT_STEP - 1e-6) * _HINT_STEP
            if tolerance > MOST_TOLERANCE:
                break
            plan, _ = self.plan(tolerance)
            if plan is not None:
                return plan, tolerance
        return None, math.inf


def _longest(hull: SurfaceSamples) -> float:
    """Return the length of the hull along its longest direction [m]."""
    off = hull.points - hull.points.mean(axis=0)
    return float(np.ptp(off @ np.linalg.eigh(off.T @ off)[1][:, 2]))
