"""Search for the developable sheets of a link: general cylinders and cones, where those of round section cover less."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from coneskin.geometry.mesh import Mesh
from coneskin.geometry.placed_developable import PlacedDevelopable
from coneskin.geometry.ray_casting import RayCaster

from .candidates import find_axis_candidates
from .cones import LEAST_GAIN, SEARCH_SAMPLES, LinkFit, find_cones
from .coverage_notes import hull_note
from .developable_sheet import (
    FoundSheet,
    RulingNeeds,
    covered_samples,
    fit_sheet,
    hull_points,
    ruled_profile,
    widest_region,
)
from .fitted_sheet import FittedSheet
from .profile import RadialProfile
from .ruled_region import RuledRegion, columns_of
from .ruling_candidates import RulingCandidate, find_ruling_candidates
from .surface_samples import SurfaceSamples, sample_surface
from .touch_weights import TouchWeights, exposure_weights

__all__ = ["find_developables", "find_sheets"]

Floats = NDArray[np.float64]

TURN = 2.0 * math.pi
_COARSE = (100, 53)  # slices, and rays in each
_FINE = (300, 149)
_CONVEX_SHARE = 0.5  # of the hull that the sheets on a convex mesh must cover
_SAME = 0.9  # share of the points of a region on a known side: it is no other one
_REFINED = 3  # regions of which the best is looked for on fine profiles


def find_sheets(
    mesh: Mesh, *, round_only: bool = False, progress: Callable[[str], None] | None = None, **search: Any
) -> LinkFit:
    """Find the sheets that cover most of a link: cones, or developables of another section where they cover more.

    Args:
        mesh: the link.
        round_only: True for cones only.
        progress: called with the name of each step.
        search: further keyword arguments of ``find_cones``.

    Raises:
        GeometryError: an argument is out of range.
        MeshError: no face of the mesh is visible from outside.
    """
    cones = find_cones(mesh, progress=progress, **search)
    return cones if round_only else find_developables(mesh, cones, progress=progress, **search)


def find_developables(
    mesh: Mesh,
    cones: LinkFit,
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
    """Find general cylinders and cones where they cover more of a link than the cones that were found on it.

    Args:
        mesh: the link.
        cones: what ``find_cones`` found with the same arguments.
        tolerance: as of ``find_cones``, and so are all further arguments.
        max_sheets: sheets at most.
        wrap: angle that a sheet must cover [rad]; with one, developables of another section are not looked for.
        min_length: smallest length of a sheet along its rulings [m].
        min_wrap: smallest angle by which the normal turns on a partial wrap [rad].
        max_bridge: width of the widest hole or groove that a sheet spans [m].
        seam_direction: direction in the link's frame in which the seam of a full wrap faces.
        samples: number of points on the mesh by which coverage is measured.
        progress: called with the name of each step.
        max_wires: wires at most, four for each sheet.
        min_radius: smallest mean radius of a sheet [m].
        thickness: of a sheet [m].
        gap: smallest distance between sheets [m].
        weights: what areas count; None for all the same.
        exposure: True to weigh areas by how much of the space above them is free.

    Returns:
        ``cones`` where they cover as much, or all but a twentieth of the hull as much; else a fit with developables.

    Raises:
        GeometryError: an argument is out of range.
    """
    if wrap is not None and wrap != TURN:
        return cones
    most = max_sheets if max_wires is None else min(max_sheets, max_wires // 4)
    seam = np.asarray(seam_direction, float)
    needs = RulingNeeds(
        tolerance,
        wrap,
        min_length,
        min_wrap,
        max_bridge,
        seam / np.linalg.norm(seam),
        min_radius,
        thickness + gap,
    )
    say = progress or (lambda _: None)
    say("looking for rulings")
    rays = RayCaster(mesh)
    hull = sample_surface(mesh, rays, samples)
    search = hull if samples == SEARCH_SAMPLES else sample_surface(mesh, rays, SEARCH_SAMPLES)
    if exposure:
        weights = exposure_weights(search, rays)
    worth = np.ones(len(hull)) if weights is None else weights.at(hull.points)
    taken = np.zeros(len(hull), bool)
    for sheet in cones.sheets:
        taken |= covered_samples(sheet.placed, hull, 1.5 * tolerance)
    least = LEAST_GAIN
    if float(worth[~taken].sum()) < least * float(worth.sum()):
        return cones
    candidates = find_ruling_candidates(search, find_axis_candidates(search))
    coarse = [(one, ruled_profile(mesh, rays, one, _COARSE, needs)) for one in candidates]
    say("measuring rulings")
    alone = _pack(mesh, rays, hull, worth, coarse, needs, [], most, least)
    spare = most - len(cones.sheets) if cones.sheets else 0
    beside = _pack(mesh, rays, hull, worth, coarse, needs, list(cones.sheets), spare, least)
    before = sum(sheet.touch_share - least for sheet in cones.sheets)
    packings = [alone, [*cones.sheets, *beside]] if beside else [alone]
    best = max(packings, key=lambda sheets: sum(sheet.touch_share - least for sheet in sheets))
    gain = sum(sheet.touch_share - least for sheet in best) - before
    if not best or gain < (least if best is alone else 0.0):
        return cones
    # a bare convex hull has rulings of its own that the link has not
    if sum(sheet.area_share for sheet in best) < _CONVEX_SHARE and hull_note(mesh, search):
        return cones
    shares = [f"{sum(sheet.area_share for sheet in sheets):.0%}" for sheets in (cones.sheets, best)]
    kinds = " and ".join(sorted({f"a {sheet.placed.kind}" for sheet in best if sheet.placed.bends}))
    note = f"the link is not round: cones cover {shares[0]} of its hull, with {kinds} it is {shares[1]}"
    return replace(
        cones,
        notes=(*cones.notes, note),
        sheets=tuple(best),
        nearest=None,
        bare=(),
        reason="",
        needed_tolerance=tolerance,
        bare_areas=() if best is alone else cones.bare_areas,
        candidates=cones.candidates + len(candidates),
    )


def _pack(
    mesh: Mesh,
    rays: RayCaster,
    hull: SurfaceSamples,
    worth: Floats,
    coarse: list[tuple[RulingCandidate, RadialProfile]],
    needs: RulingNeeds,
    others: list[FittedSheet],
    most: int,
    least: float,
) -> list[FittedSheet]:
    """Return the sheets that add most, one after another, each clear of the others and of those that are there."""
    done: list[FittedSheet] = []
    while len(done) < most:
        there = [*others, *done]
        regions = []
        for number, (candidate, profile) in enumerate(coarse):
            free = _kept_clear(profile, there, needs)
            region = widest_region(free, candidate, needs)
            if region is not None:
                regions.append((_area(free, region), number, region))
        regions.sort(key=lambda item: -item[0])
        taken = np.zeros(len(hull), bool)
        for sheet in there:
            taken |= covered_samples(sheet.placed, hull, 1.5 * needs.tolerance)
        best: FoundSheet | None = None
        tried = 0
        for area, number, region in regions:
            if tried == _REFINED or area < least * len(hull) * hull.area:
                break
            if best is not None and _lies_on(best.placed, coarse[number][1], region, needs.tolerance):
                continue
            tried += 1
            candidate = coarse[number][0]
            fine = _kept_clear(ruled_profile(mesh, rays, candidate, _FINE, needs), there, needs)
            found = fit_sheet(mesh, fine, hull, worth, candidate, needs, len(there))
            if found is None or float(worth[found.covers & ~taken].sum()) < least * float(worth.sum()):
                continue
            if best is None or found.sheet.touch_share > 1.02 * best.sheet.touch_share:
                best = found
        if best is None:
            break
        done.append(best.sheet)
    return done


def _area(profile: RadialProfile, region: RuledRegion) -> float:
    """Return the area of a region [m2], but for the slope of its section."""
    cells = profile.radius[region.first : region.end][:, columns_of(region, len(profile.phi))]
    return float(cells.sum()) * profile.step * TURN / len(profile.phi)


def _lies_on(placed: PlacedDevelopable, profile: RadialProfile, region: RuledRegion, tolerance: float) -> bool:
    """Tell whether a region is that of a side which is known already."""
    step = max(1, (region.end - region.first) // 4)
    rows = slice(region.first, region.end, step)
    points = hull_points(profile, rows, columns_of(region, len(profile.phi)))
    u, phi, off = placed.locate_all(points)
    slack = 2.0 * profile.step
    on = (np.abs(off) < 1.5 * tolerance) & (u > -slack) & (u < placed.frustum.slant + slack)
    return float((on & (phi >= 0.0) & (phi <= placed.frustum.wrap)).mean()) > _SAME


def _kept_clear(profile: RadialProfile, sheets: list[FittedSheet], needs: RulingNeeds) -> RadialProfile:
    """Return a profile on which no sheet may lie where it would run into another."""
    if not sheets:
        return profile
    points = hull_points(profile)
    half = 0.5 * profile.step
    for sheet in sheets:
        side = sheet.placed.frustum
        u, phi, off = sheet.placed.locate_all(points)
        margin = (needs.clear + half) / max(min(side.radius1, side.radius2), 1e-3)
        inside = (off > -needs.clear) & (off < needs.clear) & (u > -needs.clear - half)
        inside &= (u < side.slant + needs.clear + half) & (phi > -margin) & (phi < side.wrap + margin)
        profile = profile.blocked(inside.reshape(profile.radius.shape) & (profile.radius > 0.0))
    return profile
