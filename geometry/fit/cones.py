"""Search for the sheets of a link: the frusta that cover most of it within a tolerance."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from coneskin.errors import GeometryError
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.ray_casting import RayCaster

from .axis_plan import SheetRequirements
from .bare_areas import BareArea, bare_areas
from .candidates import find_axis_candidates
from .coverage_notes import bare_lengths, hull_note
from .fitted_sheet import FittedSheet, fitted_sheet
from .plan import AxisSurvey, SheetPlan, best_plan, better_surveys, survey_axes
from .surface_samples import SurfaceSamples, sample_surface
from .touch_weights import TouchWeights, exposure_weights

__all__ = ["BareLength", "LinkFit", "find_cones"]

Floats = NDArray[np.float64]

TURN = 2.0 * math.pi
HULL_SHARE = 0.15  #: share of the area; a convex mesh of which less can be covered is taken for a collision hull
LEAST_GAIN = 0.05  #: share of the hull that a further sheet must add; a fillet adds less
SEARCH_SAMPLES = 6000  #: points on the mesh from which the axes are found, whatever ``samples`` is
_MOST_TOLERANCE = 0.020  # m; a sheet that stands off further does not follow the link
_MOST_BRIDGE = 0.100  # m; over a wider hole a sheet sags
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


def find_cones(
    mesh: Mesh,
    tolerance: float = 0.001,
    max_sheets: int = 2,
    wrap: float | None = None,
    min_length: float = 0.025,
    min_wrap: float = math.radians(150.0),
    max_bridge: float = 0.010,
    seam_direction: tuple[float, float, float] = (1.0, 0.0, 0.0),
    samples: int = 6000,
    progress: Callable[[str], None] | None = None,
    *,
    max_wires: int | None = None,
    min_radius: float = 0.004,
    thickness: float = 0.0062,
    gap: float = 0.001,
    weights: TouchWeights | None = None,
    exposure: bool = False,
) -> LinkFit:
    """Find the frusta that cover most of a link, about one or several axes; with weights, most of what is touched.

    The search draws nothing by chance: the same mesh gives the same sheets.

    Args:
        mesh: the link.
        tolerance: largest distance between a sheet and the hull [m].
        max_sheets: sheets at most.
        wrap: angle that a sheet must cover [rad]; None for what covers most, full wraps or partial ones.
        min_length: smallest length of a sheet along the axis [m].
        min_wrap: smallest partial wrap [rad].
        max_bridge: width of the widest hole or groove that a sheet spans [m].
        seam_direction: direction in the link's frame in which the seam of a full wrap faces.
        samples: number of points on the mesh by which coverage is measured; the sheets do not depend on it.
        progress: called with the name of each step.
        max_wires: wires at most, four for each sheet; None for as many as the sheets need.
        min_radius: smallest radius of a sheet [m]; a cone is covered up to there, not up to its apex.
        thickness: of a sheet [m]; sheets about different axes do not run into each other.
        gap: smallest distance between sheets about different axes, and between partial wraps [m].
        weights: what areas count, where touches are likelier on some than on others; None for all the same.
        exposure: True to weigh areas by how much of the space above them is free (``exposure_weights``).

    Returns:
        the fit; without sheets where nothing fits within the tolerance.

    Raises:
        GeometryError: an argument is out of range.
        MeshError: no face of the mesh is visible from outside.
    """
    lengths = {"tolerance": tolerance, "min_length": min_length, "max_bridge": max_bridge, "min_radius": min_radius}
    for name, value in lengths.items():
        if not (math.isfinite(value) and value > 0.0):
            raise GeometryError(f"{name} must be above 0 mm, got {value * 1e3:g} mm")
    for name, value, most in (("tolerance", tolerance, _MOST_TOLERANCE), ("max_bridge", max_bridge, _MOST_BRIDGE)):
        if value > most:
            raise GeometryError(f"{name} must be at most {most * 1e3:g} mm, got {value * 1e3:g} mm")
    for name, value in {"thickness": thickness, "gap": gap}.items():
        if not (math.isfinite(value) and value >= 0.0):
            raise GeometryError(f"{name} must be finite and not negative, got {value * 1e3:g} mm")
    if max_sheets < 1:
        raise GeometryError(f"max_sheets must be at least 1, got {max_sheets!r}")
    if max_wires is not None and max_wires < 4:
        raise GeometryError(f"max_wires must be at least 4, the wires of one sheet, got {max_wires!r}")
    for name, angle in (("wrap", TURN if wrap is None else wrap), ("min_wrap", min_wrap)):
        if not 0.0 < angle <= TURN:
            raise GeometryError(
                f"{name} must be above 0 and at most a full turn of 360 deg, got {math.degrees(angle):g} deg"
            )
    seam = np.asarray(seam_direction, float)
    size = float(np.linalg.norm(seam))
    if not (math.isfinite(size) and size > 0.0):
        raise GeometryError(f"the direction of the seam must be finite and not zero, got {tuple(seam_direction)}")
    if weights is not None and exposure:
        raise GeometryError("weights of touches come from a map or from the exposure, not from both")
    say = progress or (lambda _: None)
    say("sampling the hull")
    rays = RayCaster(mesh)
    hull = sample_surface(mesh, rays, SEARCH_SAMPLES)
    counted = hull if samples == SEARCH_SAMPLES else sample_surface(mesh, rays, samples)
    hull_area = len(hull) * hull.area
    if exposure:
        say("casting rays to the outside")
        weights = exposure_weights(hull, rays)
    if weights is not None:
        weights.check_place(hull.points)
    worth = None if weights is None else weights.at(counted.points)
    weighed = hull_area if weights is None else float(weights.at(hull.points).sum()) * hull.area
    requirements = SheetRequirements(
        tolerance,
        max_sheets if max_wires is None else min(max_sheets, max_wires // 4),
        wrap,
        min_length,
        min_wrap,
        max_bridge,
        seam / size,
        min_radius,
        thickness,
        gap,
        LEAST_GAIN * weighed,
        weights,
    )
    say("looking for axes")
    candidates = find_axis_candidates(hull)
    say("measuring profiles")
    surveys = survey_axes(mesh, rays, candidates, requirements)
    surveys += better_surveys(mesh, rays, surveys, requirements)
    search = _Search(mesh, rays, hull, weighed, surveys, requirements)
    plan, refusal = search.plan(tolerance)
    name = "" if weights is None else weights.name
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
        )
    first = plan.axes[0]
    return LinkFit(
        sheets=tuple(
            fitted_sheet(about, side, number, counted, tolerance, worth)
            for number, about in enumerate(plan.axes)
            for side in about.sides
        ),
        nearest=None,
        needed_tolerance=tolerance,
        bare_areas=tuple(bare_areas(plan, surveys, hull, requirements)),
        bare=tuple(
            BareLength(*item)
            for item in bare_lengths(
                first.profile,
                first.sides,
                tolerance,
                min_length,
                spare=sum(len(about.sides) for about in plan.axes) < requirements.max_sheets,
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

    def plan(self, tolerance: float) -> tuple[SheetPlan | None, str]:
        """Return the best plan within a tolerance [m]; or None and, for a mesh that is a bare hull, the reason."""
        wanted = replace(self.requirements, tolerance=tolerance)
        plan = best_plan(self.mesh, self.rays, self.hull, self.surveys, wanted)
        area, whole = plan.area if plan else 0.0, self.weighed
        # a requested wrap implies that the shape is known; otherwise sheets should cover some of a convex body
        if area >= HULL_SHARE * whole or (plan and wanted.wrap):
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
            if tolerance > _MOST_TOLERANCE:
                break
            plan, _ = self.plan(tolerance)
            if plan is not None:
                return plan, tolerance
        return None, math.inf


def _longest(hull: SurfaceSamples) -> float:
    """Return the length of the hull along its longest direction [m]."""
    off = hull.points - hull.points.mean(axis=0)
    return float(np.ptp(off @ np.linalg.eigh(off.T @ off)[1][:, 2]))
