"""The axis and the sides about it that cover most of a link: candidates on coarse profiles, the best on a fine one."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .fit_candidates import Candidate
from .fit_centre import centred
from .fit_cone import Cone, fit_cone
from .fit_intervals import choose_intervals
from .fit_profile import AxisFrame, Profile, outer_profile
from .fit_samples import Samples
from .fit_side import Side, facet_offset, fit_side, under
from .fit_wraps import largest_region
from .mesh import Mesh
from .rays import Rays

__all__ = ["Coarse", "Plan", "Rules", "best_plan", "coarse_profiles"]

Floats = NDArray[np.float64]
Coarse = tuple[Profile, Cone | None]  #: a quick profile, and the cone that its axis belongs to

TURN = 2.0 * math.pi
PARTIAL_GAIN = 1.25  #: a partial wrap must cover that much more than full wraps to be preferred
SHEET_GAIN = 0.08  #: of the link's length, that a further sheet must add: fillets are not worth one
_COARSE, _FINE = (120, 53), (512, 149)  #: slices and rays in each; odd numbers, so that facets are not hit in step


@dataclass(frozen=True, slots=True)
class Rules:
    """What is asked of the sheets; the arguments of ``find_cones``."""

    tolerance: float
    max_sheets: int
    wrap: float | None
    shortest: float
    narrowest: float
    bridge: float
    seam: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """Sides about one axis.

    Attributes:
        profile: the hull about the axis.
        sides: the sheets to be, in order along the axis; empty where none is within the tolerance.
    """

    profile: Profile
    sides: list[Side]

    @property
    def area(self) -> float:
        """Area of all sheets [m2]."""
        return sum(side.area(self.profile) for side in self.sides)


def coarse_profiles(mesh: Mesh, rays: Rays, candidates: list[Candidate], rules: Rules) -> list[Coarse]:
    """A quick profile about every candidate, by which ``best_plan`` ranks them for any tolerance."""
    frames = [AxisFrame.along(candidate.origin, candidate.axis, rules.seam) for candidate in candidates]
    return [
        (_profile(mesh, rays, frame, _COARSE, rules), candidate.cone)
        for frame, candidate in zip(frames, candidates, strict=True)
    ]


def best_plan(mesh: Mesh, rays: Rays, hull: Samples, coarse: list[Coarse], rules: Rules) -> Plan | None:
    """The axis whose sheets cover most: ranked on coarse profiles, refined on a fine one; None where nothing fits."""
    loose = replace(rules, tolerance=1.1 * rules.tolerance, shortest=0.75 * rules.shortest)
    areas = [_plan(profile, cone, loose).area for profile, cone in coarse]
    best: Plan | None = None
    for number in sorted(range(len(coarse)), key=lambda n: -areas[n])[:2]:
        if areas[number] == 0.0:
            break
        profile, cone = coarse[number]
        fine = _plan(_profile(mesh, rays, profile.frame, _FINE, rules), cone, rules)
        plan = _refined(mesh, rays, hull, fine, rules) if fine.sides else fine
        if plan.sides and (best is None or plan.area > 1.002 * best.area):
            best = plan
    return best


def _profile(mesh: Mesh, rays: Rays, frame: AxisFrame, grid: tuple[int, int], rules: Rules) -> Profile:
    slices, around = grid
    length = float(np.ptp(frame.local(mesh.vertices)[:, 2]))
    return outer_profile(mesh, rays, frame, max(length / slices, 0.0005), around, rules.bridge)


def _plan(profile: Profile, cone: Cone | None, rules: Rules, rise: float = 0.0) -> Plan:
    """The sides about one axis that cover most."""
    rows = max(2, math.ceil(rules.shortest / profile.step))
    full, partial = Plan(profile, []), Plan(profile, [])
    if rules.wrap is None or rules.wrap == TURN:
        gain = max(1, round(SHEET_GAIN * len(profile.z)))
        chosen = choose_intervals(profile.z, *profile.bounds(), rules.tolerance, rules.max_sheets, rows, gain)
        sides = [fit_side(profile, a, b, 0, len(profile.phi), rules.tolerance, rise) for a, b in chosen]
        full = Plan(profile, [side for side in sides if side.end - side.first >= rows])
    if cone is not None and rules.wrap != TURN:
        partial = Plan(profile, _partial(profile, cone, rows, rules, rise))
    return partial if partial.area > PARTIAL_GAIN * full.area else full


def _partial(profile: Profile, cone: Cone, rows: int, rules: Rules, rise: float) -> list[Side]:
    """The largest region, in length and angle, that lies near a cone about the frame's axis from the frame's origin."""
    slope = math.tan(cone.half_angle)
    line = cone.radius + slope * profile.z + rise
    limit = rules.tolerance * math.hypot(1.0, slope)
    above = profile.radius <= (line + limit)[:, None]
    good = above & (profile.bridged >= (line - limit)[:, None])
    around = len(profile.phi)
    exact = rules.wrap is not None
    columns = math.ceil((rules.wrap or rules.narrowest) / TURN * around)
    region = largest_region(good, rows, min(columns, around), exact)
    if region is None:
        return []
    side = fit_side(profile, *region, rules.tolerance, rise)
    return [side] if side.end - side.first >= rows else []


def _refined(mesh: Mesh, rays: Rays, hull: Samples, plan: Plan, rules: Rules) -> Plan:
    """Fit the axis once more to the very region that the sheets cover, and raise the sides to the corners."""
    frame, grid = plan.profile.frame, (len(plan.profile.z), len(plan.profile.phi))
    cone = None
    if all(side.columns == grid[1] for side in plan.sides):
        frame = centred(plan.profile, plan.sides, rules.tolerance, rules.seam)
    else:
        side = plan.sides[0]
        cone = Cone(frame.origin, frame.axis, side.radius, math.atan(side.slope))
        below = hull.only(under(plan.profile, side, hull, rules.tolerance))
        cone = fit_cone(below, cone, (rules.tolerance,)) or cone
        frame = AxisFrame.along(cone.origin, cone.axis, rules.seam)
    rises, areas = [], []
    for side in plan.sides:
        below = hull.only(under(plan.profile, side, hull, rules.tolerance))
        near = cone or Cone(frame.origin, frame.axis, side.radius, math.atan(side.slope))
        rises.append(facet_offset(mesh, below, near, rules.tolerance))
        areas.append(side.area(plan.profile))
    profile = _profile(mesh, rays, frame, grid, rules)
    again = _plan(profile, cone, rules, float(np.average(rises, weights=areas)))
    return again if again.area > 0.99 * plan.area else plan
