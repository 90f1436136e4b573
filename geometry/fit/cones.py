"""Search for the sheets of a link: the frusta that cover most of it within a tolerance."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from coneskin.geometry.mesh import Mesh

from .axis_plan import AxisPlan, SheetRequirements
from .bare_areas import BareArea, bare_areas, hull_note
from .candidates import SampledLink, sample_link
from .coarse_packing import better_surveys, survey_axes
from .fit_options import MOST_TOLERANCE, FitOptions, check_names
from .fitted_sheet import FittedSheet, fitted_sheet
from .plan import FineStage, SheetPlan
from .surface_samples import SurfaceSamples
from .touch_weights import TouchWeights

HULL_SHARE = 0.15  #: share of the area; a convex mesh of which less can be covered is taken for a collision hull
LEAST_GAIN = 0.04  #: share of the hull that a further sheet must add; a fillet adds less
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

    @property
    def weights(self) -> str:
        """Name of the map by which areas were weighed; empty where all count the same."""
        return "" if self.touch_weights is None else self.touch_weights.name


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
    say("measuring profiles")
    surveys = survey_axes(link, requirements)
    surveys += better_surveys(link, surveys, requirements)
    stage = FineStage(link, surveys, requirements)
    tolerance, worth = options.tolerance, link.worth
    plan, refusal = _plan(stage, options.allow_hull)
    fit = LinkFit(
        sheets=(),
        nearest=None,
        tolerance=tolerance,
        link_length=_longest(link.hull),
        hull_area=link.hull_area,
        notes=link.mesh.notes,
        reason="",
        candidates=len(link.axes),
        needed_tolerance=tolerance,
        touch_weights=link.weights,
    )
    if plan is None:
        length, least = fit.link_length, options.min_length
        reason = refusal or f"no cone fits within {tolerance * 1e3:g} mm over a length of {least * 1e3:g} mm"
        if length < least:
            reason = f"the link is {length * 1e3:.1f} mm long, but a sheet needs at least {least * 1e3:g} mm"
        say("looking for the nearest sheet")
        looser, needed = _nearest(stage, options.allow_hull)
        nearest = None
        if looser is not None:
            first = looser.axes[0]
            widest = max(first.sides, key=lambda side: side.area(first.profile))
            nearest = fitted_sheet(first, widest, 0, link.counted, needed, worth)
        return replace(fit, nearest=nearest, needed_tolerance=needed, reason=reason)
    first = plan.axes[0]
    further: AxisPlan | None = None
    if plan.count >= requirements.max_sheets:
        further = stage.further(plan.axes)
    return replace(
        fit,
        sheets=tuple(
            fitted_sheet(about, side, number, link.counted, tolerance, worth)
            for number, about in enumerate(plan.axes)
            for side in about.sides
        ),
        bare_areas=tuple(bare_areas(plan, further, surveys, link.hull, requirements)),
        link_length=first.profile.step * len(first.profile.z),
    )


def _plan(stage: FineStage, allow_hull: bool) -> tuple[SheetPlan | None, str]:
    """Return the best plan; or None and, for a mesh that is a bare hull, the reason."""
    plan, wanted = stage.best_plan(), stage.requirements
    area, whole = plan.area if plan else 0.0, stage.link.weighed_area
    # a requested wrap implies that the shape is known; otherwise sheets should cover some of a convex body
    if allow_hull or area >= HULL_SHARE * whole or (plan and wanted.wrap):
        return plan, ""
    hulled = hull_note(stage.link.mesh, stage.link.hull)
    if hulled:
        share = f"{100.0 * area / whole:.0f} %"
        return None, f"{hulled} (a sheet within {wanted.tolerance * 1e3:g} mm would cover {share} of it)"
    return plan, ""


def _nearest(stage: FineStage, allow_hull: bool) -> tuple[SheetPlan | None, float]:
    """Return a plan within the least of some tolerances that gives one, and that tolerance [m]."""
    wanted = stage.requirements
    for factor in (1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0):
        tolerance = math.ceil(factor * wanted.tolerance / _HINT_STEP - 1e-6) * _HINT_STEP
        if tolerance > MOST_TOLERANCE:
            break
        looser = FineStage(stage.link, stage.surveys, replace(wanted, tolerance=tolerance))
        plan, _ = _plan(looser, allow_hull)
        if plan is not None:
            return plan, tolerance
    return None, math.inf


def _longest(hull: SurfaceSamples) -> float:
    """Return the length of the hull along its longest direction [m]."""
    off = hull.points - hull.points.mean(axis=0)
    return float(np.ptp(off @ np.linalg.eigh(off.T @ off)[1][:, 2]))
