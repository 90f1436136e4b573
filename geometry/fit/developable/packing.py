"""Packing of developable sheets on a link: general cylinders and cones, where those of round section cover less.

A sheet lies on the largest region of a profile whose columns run straight along rulings, whatever its section is. Its
side is fitted to the hull there, and cut to what is within the tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from coneskin.core.arrays import Bools, Floats
from coneskin.core.errors import GeometryError
from coneskin.geometry.developable import Developable
from coneskin.geometry.fit.axis_plan import FittedSheet, deviations
from coneskin.geometry.fit.bare_areas import BareArea, BareTally, hull_note
from coneskin.geometry.fit.candidates import SampledLink, sample_link
from coneskin.geometry.fit.cones import LEAST_GAIN, LinkFit, fit_cones
from coneskin.geometry.fit.fit_options import FitOptions, check_names
from coneskin.geometry.fit.profile import RadialProfile, Region
from coneskin.geometry.fit.side import longest_run
from coneskin.geometry.fit.surface_samples import SurfaceSamples
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.placed_frustum import PlacedFrustum

from .ruling_candidates import RulingCandidate, find_ruling_candidates
from .side_fit import fit_developable


def _bare_beside(
    sheets: Sequence[FittedSheet],
    more: Sequence[FittedSheet],
    earlier: Sequence[BareArea],
    hull: SurfaceSamples,
    options: FitOptions,
) -> tuple[BareArea, ...]:
    """Return what sheets leave bare, by reason, the largest area first.

    ``more`` could be added; the reasons of ``earlier``, found before the last sheets, hold.
    """
    from scipy.spatial import cKDTree

    tally = BareTally(hull, _covered(sheets, hull, options.tolerance))
    take = tally.take
    if more:
        tally.take_more(len(sheets), _covered(more, hull, options.tolerance))
    for area in earlier:
        take(area.reason, cKDTree(area.points).query(hull.points)[0] == 0.0)
    take("flat", hull.flat())
    least = f"{options.min_length * 1e3:g} mm long and {math.degrees(options.min_wrap):g} deg wide"
    take(f"curved in two ways, in a corner, or without room for a sheet {least}", np.ones(len(hull), bool))
    return tuple(tally.areas)


def _covered(sheets: Iterable[FittedSheet], hull: SurfaceSamples, distance: float) -> Bools:
    """Return whether any of the sheets lies on each sample of the hull, shape (n,)."""
    covered = np.zeros(len(hull), bool)
    for sheet in sheets:
        covered |= hull.below(sheet.placed, distance)
    return covered


_COARSE_GRID = (100, 53)  # slices, and rays in each
_FINE_GRID = (300, 149)
_CONVEX_SHARE = 0.5  # of the hull that the sheets on a convex mesh must cover
_SAME_SHARE = 0.9  # share of the points of a region on a known side: it is no other one
_REFINED_REGIONS = 3  # regions of which the best is looked for on fine profiles


def _with_developables(
    link: SampledLink, cones: LinkFit, options: FitOptions, say: Callable[[str], None] = lambda _: None
) -> LinkFit:
    """Find general cylinders and cones where they cover more of a link than the cones that were found on it.

    Args:
        cones: what ``fit_cones`` found on it with the same options.
        say: called with the name of each step.

    Returns:
        ``cones`` where they cover as much, or all but ``LEAST_GAIN`` of the hull as much; else a fit with developables.
    """
    if options.wrap is not None and options.wrap != math.tau:
        return cones
    options = link.eased(options)[0]
    most, tolerance = options.most_sheets, options.tolerance
    say("looking for rulings")
    worth = np.ones(len(link.counted)) if link.worth is None else link.worth
    taken = _covered(cones.sheets, link.counted, 1.5 * tolerance)
    if float(worth[~taken].sum()) < LEAST_GAIN * float(worth.sum()):
        return cones
    candidates = find_ruling_candidates(link.hull, link.axes)
    ruled = _RuledLink(link, options, worth, [(c, c.profile(link, _COARSE_GRID, options)) for c in candidates])
    say("measuring rulings")
    # where the widest region is that of a cone which is there already, other sheets only go beside the cones
    regions = ruled.regions([])
    known = bool(regions) and any(
        _lies_on(sheet.placed, ruled.coarse[regions[0][1]][1], regions[0][2], tolerance) for sheet in cones.sheets
    )
    alone = [] if known else ruled.packed([], most)
    beside = ruled.packed(cones.sheets, most - len(cones.sheets) if cones.sheets else 0)
    packings = [alone, [*cones.sheets, *beside]] if beside else [alone]
    best = max(packings, key=_score)
    if not best or _score(best) - _score(cones.sheets) < (LEAST_GAIN if best is alone else 0.0):
        return cones
    # a bare convex hull has rulings of its own that the link has not
    scarce = sum(sheet.area_share for sheet in best) < _CONVEX_SHARE
    if scarce and not options.allow_hull and hull_note(link.mesh, link.hull):
        return cones
    shares = [f"{sum(sheet.area_share for sheet in sheets):.0%}" for sheets in (cones.sheets, best)]
    kinds = " and ".join(sorted({f"a {sheet.placed.kind}" for sheet in best if sheet.placed.bends}))
    say("looking at what stays bare")
    more = ruled.packed(best, 1) if len(best) == most else []
    bare = _bare_beside(best, more, () if best is alone else cones.bare_areas, link.hull, options)
    note = f"the link is not round: cones cover {shares[0]} of its hull, with {kinds} it is {shares[1]}"
    return replace(
        cones,
        notes=(*cones.notes, note),
        sheets=tuple(best),
        nearest=None,
        reason="",
        needed_tolerance=tolerance,
        bare_areas=bare,
        candidates=cones.candidates + len(candidates),
    )


def _score(sheets: Sequence[FittedSheet]) -> float:
    """Return the share of the hull that sheets cover, by the weights, less what each has to add."""
    return sum(sheet.touch_share - LEAST_GAIN for sheet in sheets)


@dataclass(frozen=True, slots=True, eq=False)
class _RuledLink:
    """A link with the lines about which its rulings may lie, and what each counted sample is worth."""

    link: SampledLink
    options: FitOptions
    worth: Floats
    coarse: list[tuple[RulingCandidate, RadialProfile]]

    def packed(self, others: Sequence[FittedSheet], most: int) -> list[FittedSheet]:
        """Return the sheets that add most, one after another, each clear of the others and of those that are there."""
        options, hull, worth = self.options, self.link.counted, self.worth
        done: list[FittedSheet] = []
        while len(done) < most:
            there = [*others, *done]
            taken = _covered(there, hull, 1.5 * options.tolerance)
            best: _FoundSheet | None = None
            tried = 0
            for area, number, region in self.regions(there):
                if tried == _REFINED_REGIONS or area < LEAST_GAIN * len(hull) * hull.area:
                    break
                candidate, profile = self.coarse[number]
                if best is not None and _lies_on(best.sheet.placed, profile, region, options.tolerance):
                    continue
                tried += 1
                fine = _kept_clear(candidate.profile(self.link, _FINE_GRID, options), there, options)
                found = _fit_sheet(self.link, fine, worth, candidate, options, len(there))
                if found is None or float(worth[found.covers & ~taken].sum()) < LEAST_GAIN * float(worth.sum()):
                    continue
                if best is None or found.sheet.touch_share > 1.02 * best.sheet.touch_share:
                    best = found
            if best is None:
                break
            done.append(best.sheet)
        return done

    def regions(self, there: Sequence[FittedSheet]) -> list[tuple[float, int, Region]]:
        """Return the widest region of each profile clear of sheets: area [m2], number, region; the largest first."""
        regions = []
        for number, (candidate, profile) in enumerate(self.coarse):
            free = _kept_clear(profile, there, self.options)
            region = candidate.widest_region(free, self.options)
            if region is not None:
                regions.append((_area(free, region), number, region))
        return sorted(regions, key=lambda item: -item[0])


def _area(profile: RadialProfile, region: Region) -> float:
    """Return the area of a region [m2], but for the slope of its section."""
    cells = profile.radius[region.first : region.end][:, profile.azimuths(region.column, region.columns)]
    return float(cells.sum()) * profile.step * math.tau / len(profile.phi)


def _lies_on(placed: PlacedFrustum, profile: RadialProfile, region: Region, tolerance: float) -> bool:
    """Tell whether a region is that of a side which is known already."""
    step = max(1, (region.end - region.first) // 4)
    rows = slice(region.first, region.end, step)
    points = profile.points(True, rows, profile.azimuths(region.column, region.columns))
    u, phi, off = placed.locate_all(points)
    slack = 2.0 * profile.step
    on = (np.abs(off) < 1.5 * tolerance) & (u > -slack) & (u < placed.frustum.slant + slack)
    return float((on & (phi >= 0.0) & (phi <= placed.frustum.wrap)).mean()) > _SAME_SHARE


def _kept_clear(profile: RadialProfile, sheets: Sequence[FittedSheet], options: FitOptions) -> RadialProfile:
    """Return a profile on which no sheet may lie where it would run into another."""
    if not sheets:
        return profile
    points = profile.points(True)
    clear = options.thickness + options.gap
    half = 0.5 * profile.step
    for sheet in sheets:
        side = sheet.placed.frustum
        u, phi, off = sheet.placed.locate_all(points)
        margin = (clear + half) / max(min(side.radius1, side.radius2), 1e-3)
        inside = (off > -clear) & (off < clear) & (u > -clear - half)
        inside &= (u < side.slant + clear + half) & (phi > -margin) & (phi < side.wrap + margin)
        profile = profile.blocked(inside & (profile.radius > 0.0))
    return profile


_FIT_ROWS = 12  # slices whose points are fitted
_LEAST_POINTS = 100  # of a region, to fit a side to it
_CHECK_ROWS = 60  # slices by which a fit is judged


class _FoundSheet(NamedTuple):
    """A fitted side with what is left of its region after the fit was checked."""

    sheet: FittedSheet
    covers: Bools  #: samples of the hull that it covers, shape (n,)


def _fit_sheet(
    link: SampledLink,
    profile: RadialProfile,
    worth: Floats,
    candidate: RulingCandidate,
    options: FitOptions,
    number: int,
) -> _FoundSheet | None:
    """Return the sheet of a candidate, fitted on a fine profile and checked there."""
    region = candidate.widest_region(profile, options)
    if region is None:
        return None
    placed = _side(profile, region, candidate, options)
    if placed is None:
        return None
    rise = _rise(link.mesh, placed, options.tolerance)
    if rise:
        placed = placed.parallel(rise)
    return _checked(profile, region, placed, link.counted, worth, options, rise, number)


def _side(
    profile: RadialProfile, region: Region, candidate: RulingCandidate, options: FitOptions
) -> Developable | None:
    """Fit a side to a region."""
    columns = profile.azimuths(region.column, region.columns)
    full = region.columns == len(profile.phi)
    apex, scale = candidate.apex_height(profile), candidate.scale(profile)
    rows = slice(region.first, region.end)
    section = np.median(profile.bridged[rows][:, columns] / scale[rows, None], axis=0)
    turned = profile.phi[columns]
    out = np.stack([np.cos(turned), np.sin(turned)], axis=1) @ profile.frame.columns[:, :2].T
    middle = float(profile.z[rows].mean())
    at = profile.frame.origin + section[:, None] * out
    if candidate.apex is None:
        at = at + middle * profile.frame.axis
        ways = np.broadcast_to(profile.frame.axis, at.shape)
    else:
        away = at - candidate.apex
        away /= np.linalg.norm(away, axis=1)[:, None]
        reach = abs(apex - middle) / float(np.median(np.abs(away @ profile.frame.axis)))
        at = candidate.apex + reach * away
        ways = away if apex < middle else -away
    step = max(1, (region.end - region.first) // _FIT_ROWS)
    fitted = slice(region.first, region.end, step)
    sound = (profile.bridged - profile.radius)[fitted][:, columns] <= options.tolerance
    points = profile.points(True, fitted, columns)
    if sound.sum() < _LEAST_POINTS:
        return None
    try:
        return fit_developable(at, ways, points[sound], full, candidate.apex is not None, options.tolerance)
    except (GeometryError, np.linalg.LinAlgError):
        return None


def _rise(mesh: Mesh, placed: Developable, tolerance: float) -> float:
    """Return by how much the corners of the facets lie outside the side, which was fitted to the facets [m]."""
    corners = mesh.vertices if len(mesh.vertices) <= 20_000 else mesh.vertices[:: len(mesh.vertices) // 20_000 + 1]
    u, phi, off = placed.locate_all(corners)
    side = placed.frustum
    near = (np.abs(off) < tolerance) & (u > -tolerance) & (u < side.slant + tolerance)
    near &= (phi >= 0.0) & (phi <= side.wrap)
    if near.sum() < 24:
        return 0.0
    mean = float(np.median(off[near]))
    spread = 1.4826 * float(np.median(np.abs(off[near] - mean)))
    return mean if mean > 0.0 and spread <= 0.3 * mean else 0.0


def _checked(
    profile: RadialProfile,
    region: Region,
    placed: Developable,
    hull: SurfaceSamples,
    worth: Floats,
    options: FitOptions,
    rise: float,
    number: int,
) -> _FoundSheet | None:
    """Return a side cut to the slices in which it is within the tolerance, as a sheet; None where too few are left."""
    columns = profile.azimuths(region.column, region.columns)
    step = max(1, (region.end - region.first) // _CHECK_ROWS)
    rows = np.arange(region.first, region.end, step)
    rows = rows if rows[-1] == region.end - 1 else np.append(rows, region.end - 1)
    hole = (profile.bridged - profile.radius)[rows][:, columns] > options.tolerance
    off = placed.locate_all(profile.points(False, rows, columns))[2]
    rim = placed.locate_all(profile.points(True, rows, columns))[2] if hole.any() else off
    within = np.where(hole, rim, off)
    good = np.asarray((np.abs(within) <= options.tolerance).all(axis=1))
    run = longest_run(good)
    if run[1] - run[0] < 2:
        return None
    ends = _span(placed, profile, float(profile.z[rows[run[0]]]), float(profile.z[rows[run[1] - 1]]))
    if ends[1] - ends[0] < options.min_length:
        return None
    placed = placed.part(ends[0], ends[1], 0.0, placed.frustum.wrap)
    narrow = min(placed.frustum.radius1, placed.frustum.radius2)
    if narrow < options.min_radius * max(1.0, placed.sharpest_bend) or narrow * placed.frustum.wrap < options.min_arc:
        return None
    kept = slice(run[0], run[1])
    covers = hull.below(placed, 1.5 * options.tolerance)
    sheet = FittedSheet(
        placed=placed,
        **deviations(off[kept], hole[kept]),
        length_share=placed.frustum.slant / (profile.step * len(profile.z)),
        area_share=float(covers.mean()),
        facet_rise=rise,
        axis=number,
        touch_share=float(worth[covers].sum() / worth.sum()),
    )
    return _FoundSheet(sheet, covers)


def _span(placed: Developable, profile: RadialProfile, low: float, high: float) -> tuple[float, float]:
    """Return the arcs between which all rulings lie between two heights of a profile [m]."""
    phi = np.linspace(0.0, placed.frustum.wrap, 241)
    base, way, _ = placed.rulings(phi * (1.0 - 1e-12))
    pose = placed.link_frustum
    z = profile.frame.local(pose.apply_all(base))[:, 2]
    climb = (way @ np.array(pose.rotation).T) @ profile.frame.axis
    return float(((low - z) / climb).max()), float(((high - z) / climb).min())


def find_sheets(
    mesh: Mesh,
    options: FitOptions | None = None,
    *,
    round_only: bool = False,
    progress: Callable[[str], None] | None = None,
    **named: Any,
) -> LinkFit:
    """Find the sheets that cover most of a link: cones, or developables of another section where they cover more.

    Arguments and errors are those of ``find_cones``; with ``round_only`` there are cones only.
    """
    check_names(named)
    options = replace(options or FitOptions(), **named)
    say = progress or (lambda _: None)
    link = sample_link(mesh, options, say)
    cones = fit_cones(link, options, say)
    return cones if round_only else _with_developables(link, cones, options, say)
