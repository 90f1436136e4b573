"""Sheets for a link: the frusta that cover most of it within a tolerance, what they leave bare, and why."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from coneskin.errors import GeometryError

from .fit_candidates import find_candidates
from .fit_hull import bare_lengths, hull_note
from .fit_plan import Plan, Rules, best_plan, coarse_profiles
from .fit_profile import Profile
from .fit_samples import Samples, surface_samples
from .fit_side import Side, columns_of, under
from .frustum import Frustum
from .mesh import Mesh
from .placed import PlacedFrustum
from .pose import Pose
from .rays import Rays
from .sector import Sector, unroll

__all__ = ["Bare", "Fit", "Sheet", "find_cones"]

Floats = NDArray[np.float64]

TURN = 2.0 * math.pi
HULL_SHARE = 0.25  #: a convex mesh of which less can be covered is taken for a collision hull


@dataclass(frozen=True, slots=True)
class Bare:
    """A length of the link without a sheet.

    Attributes:
        start: where it begins, along the axis of the first sheet from its end 1 [m].
        end: where it ends [m].
        reason: why, in words.
    """

    start: float
    end: float
    reason: str


@dataclass(frozen=True, slots=True)
class Sheet:
    """One sheet and how it sits on the link.

    Attributes:
        placed: the frustum and its pose in the link's frame; phi = 0 is where the wrap begins.
        start_azimuth: angle from the seam direction asked for to where the wrap begins [rad], in [0, 2 pi).
        worst: largest distance between sheet and hull, without what is bridged [m].
        rms: the root of the mean square of the same [m].
        bridged: share of the sheet that spans holes and grooves deeper than the tolerance.
        deepest: depth of the deepest of them [m]; 0 where there are none.
        length_share: its length over the length of the link along its axis.
        area_share: share of the hull that it covers.
        facet_rise: by how much the corners of the mesh lie outside of its flats, on average [m]; in the radii already.
    """

    placed: PlacedFrustum
    start_azimuth: float
    worst: float
    rms: float
    bridged: float
    deepest: float
    length_share: float
    area_share: float
    facet_rise: float

    @property
    def frustum(self) -> Frustum:
        """The shape."""
        return self.placed.frustum

    @property
    def half_angle(self) -> float:
        """Signed half angle [rad]; positive where the sheet widens along its axis."""
        return self.placed.frustum.half_angle

    @property
    def sector(self) -> Sector:
        """Its flat pattern: r1, r2 and theta0."""
        return unroll(self.placed.frustum)


@dataclass(frozen=True, slots=True)
class Fit:
    """What was found on a link.

    Attributes:
        sheets: in order along their axis; empty where nothing fits within the tolerance.
        best: where nothing fits, the nearest thing; its ``worst`` is the tolerance that it needs. Else None.
        bare: lengths without a sheet, in order.
        tolerance: largest distance allowed between sheet and hull [m].
        link_length: length of the link along the axis [m].
        hull_area: area that sees the outside [m2].
        notes: what to know of the mesh, one sentence each.
        reason: why nothing fits; empty where something does.
        candidates: axes tried.
        rays: the engine that cast the rays.
    """

    sheets: tuple[Sheet, ...]
    best: Sheet | None
    bare: tuple[Bare, ...]
    tolerance: float
    link_length: float
    hull_area: float
    notes: tuple[str, ...]
    reason: str
    candidates: int
    rays: str


def find_cones(
    mesh: Mesh,
    tolerance: float = 0.001,
    max_sheets: int = 2,
    wrap: float | None = None,
    shortest: float = 0.025,
    narrowest: float = math.radians(150.0),
    bridge: float = 0.010,
    seam: tuple[float, float, float] = (1.0, 0.0, 0.0),
    samples: int = 6000,
    progress: Callable[[str], None] | None = None,
) -> Fit:
    """Find the frusta that cover most of a link.

    Args:
        mesh: the link.
        tolerance: largest distance between a sheet and the hull [m].
        max_sheets: sheets at most, on one axis.
        wrap: angle that a sheet must cover [rad]; None for full wraps where they fit, and the best partial wrap else.
        shortest: length along the axis below which a sheet is not worth while [m].
        narrowest: smallest partial wrap [rad].
        bridge: width of the widest hole or groove that a sheet spans [m].
        seam: direction in the link's frame that the seam of a full wrap looks to.
        samples: points on the mesh that the axis is found from.
        progress: called with the name of each step.

    Returns:
        the fit; without sheets where nothing fits within the tolerance.

    Raises:
        GeometryError: a rule out of range.
        MeshError: no face of the mesh sees the outside.
    """
    for name, value in (("tolerance", tolerance), ("shortest", shortest), ("bridge", bridge)):
        if not (math.isfinite(value) and value > 0.0):
            raise GeometryError(f"{name} must be above 0 m, got {value!r}")
    if max_sheets < 1:
        raise GeometryError(f"max_sheets must be at least 1, got {max_sheets!r}")
    for name, angle in (("wrap", TURN if wrap is None else wrap), ("narrowest", narrowest)):
        if not 0.0 < angle <= TURN:
            raise GeometryError(f"{name} must be above 0 and at most a full turn (2 pi rad), got {angle!r} rad")
    say = progress or (lambda _: None)
    rules = Rules(tolerance, max_sheets, wrap, shortest, narrowest, bridge, np.asarray(seam, float))
    say("sampling the hull")
    rays = Rays(mesh)
    hull = surface_samples(mesh, rays, samples)
    say("looking for axes")
    candidates = find_candidates(hull, tolerance)
    say("measuring profiles")
    coarse = coarse_profiles(mesh, rays, candidates, rules)
    plan = best_plan(mesh, rays, hull, coarse, rules)
    area = plan.area if plan else 0.0
    hull_area = len(hull) * hull.area
    # who asks for a wrap knows the shape; otherwise a convex body should be covered for the most part
    hulled = "" if (plan and wrap) or area >= HULL_SHARE * hull_area else hull_note(mesh, hull)
    best, reason = None, ""
    length = _longest(hull)
    if hulled or plan is None:
        plan = None
        reason = f"no cone holds within {tolerance * 1e3:g} mm over {shortest * 1e3:g} mm of length"
        if length < shortest:
            reason = f"the link is {length * 1e3:.1f} mm long, a sheet must have {shortest * 1e3:g} mm at least"
        elif hulled:
            share = f"{100.0 * area / hull_area:.0f} %"
            reason = f"{hulled} (a sheet within {tolerance * 1e3:g} mm would cover {share} of it)"
        say("looking for the nearest thing")
        for factor in (2.0, 4.0, 8.0, 16.0):
            looser = best_plan(mesh, rays, hull, coarse, replace(rules, tolerance=factor * tolerance))
            if looser is not None:
                widest = max(looser.sides, key=partial(Side.area, profile=looser.profile))
                best = _sheet(looser, widest, hull, factor * tolerance)
                if not hulled or looser.area >= HULL_SHARE * hull_area:
                    break
    sheets: tuple[Sheet, ...] = ()
    bare: tuple[Bare, ...] = (Bare(0.0, length, reason),)
    if plan is not None:
        length = plan.profile.step * len(plan.profile.z)
        sheets = tuple(_sheet(plan, side, hull, tolerance) for side in plan.sides)
        bare = tuple(Bare(*item) for item in bare_lengths(plan.profile, plan.sides, tolerance, shortest))
    return Fit(
        sheets=sheets,
        best=best,
        bare=bare,
        tolerance=tolerance,
        link_length=length,
        hull_area=hull_area,
        notes=mesh.notes,
        reason=reason,
        candidates=len(candidates),
        rays=rays.engine,
    )


def _longest(hull: Samples) -> float:
    """Length of the hull along its longest direction [m]."""
    off = hull.points - hull.points.mean(axis=0)
    return float(np.ptp(off @ np.linalg.eigh(off.T @ off)[1][:, 2]))


def _ends(profile: Profile, sides: list[Side]) -> list[tuple[float, float]]:
    """Heights where each side begins and ends [m]; neighbours that touch share the circle where they meet."""
    half = 0.5 * profile.step
    ends = [[float(profile.z[s.first]), float(profile.z[s.end - 1])] for s in sides]
    for n, (one, two) in enumerate(pairwise(sides)):
        gap = two.first - one.end
        if gap > 4 or one.slope == two.slope:
            continue
        meet = (two.radius - one.radius) / (one.slope - two.slope)
        low, high = ends[n][1] - 8 * half, ends[n + 1][0] + 8 * half
        if low <= meet <= high:
            ends[n][1] = ends[n + 1][0] = meet
    return [(a, b) for a, b in ends]


def _sheet(plan: Plan, side: Side, hull: Samples, tolerance: float) -> Sheet:
    """What is to be said of one side."""
    profile, frame = plan.profile, plan.profile.frame
    start, end = _ends(profile, plan.sides)[plan.sides.index(side)]
    radii = side.radius + side.slope * start, side.radius + side.slope * end
    width = TURN / len(profile.phi)
    full = side.columns == len(profile.phi)
    wrap = TURN if full else (side.columns - 1) * width
    turn = 0.0 if full else side.column * width
    spin = np.array([[math.cos(turn), -math.sin(turn), 0.0], [math.sin(turn), math.cos(turn), 0.0], [0, 0, 1]])
    base = frame.origin + start * frame.axis
    rows = [(float(a), float(b), float(c)) for a, b, c in frame.columns @ spin]
    pose = Pose((rows[0], rows[1], rows[2]), (float(base[0]), float(base[1]), float(base[2])))
    cells = columns_of(profile, side.column, side.columns)
    cosine = 1.0 / math.hypot(1.0, side.slope)
    line = side.radii(profile.z[side.first : side.end])[:, None]
    miss = (profile.radius[side.first : side.end][:, cells] - line) * cosine
    hole = miss < -tolerance
    seen = miss[~hole]
    return Sheet(
        placed=PlacedFrustum(Frustum(max(radii[0], 0.0), max(radii[1], 0.0), end - start, wrap), pose),
        start_azimuth=turn,
        worst=float(np.abs(seen).max()) if seen.size else math.inf,
        rms=math.sqrt(float((seen**2).mean())) if seen.size else math.inf,
        bridged=float(hole.mean()),
        deepest=float(-miss[hole].min()) if hole.any() else 0.0,
        length_share=(end - start) / (profile.step * len(profile.z)),
        area_share=float(under(profile, side, hull, tolerance).mean()),
        facet_rise=side.rise,
    )
