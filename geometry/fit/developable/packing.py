"""Packing of developable sheets on a link: general cylinders and cones, where those of round section cover less."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from coneskin.core.arrays import Bools, Floats
from coneskin.geometry.fit.bare_areas import BareArea, BareTally, flat_samples, hull_note, sheet_more
from coneskin.geometry.fit.candidates import SampledLink, sample_link
from coneskin.geometry.fit.cones import LEAST_GAIN, LinkFit, fit_cones
from coneskin.geometry.fit.fit_options import FitOptions, check_names
from coneskin.geometry.fit.fitted_sheet import FittedSheet
from coneskin.geometry.fit.profile import RadialProfile
from coneskin.geometry.fit.surface_samples import SurfaceSamples
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.placed_frustum import PlacedFrustum

from .found_sheet import (
    FoundSheet,
    RuledRegion,
    columns_of,
    covered_by,
    fit_sheet,
    hull_points,
    ruled_profile,
    widest_region,
)
from .ruling_candidates import RulingCandidate, find_ruling_candidates


def _bare_beside(
    sheets: Sequence[FittedSheet],
    more: Sequence[FittedSheet],
    earlier: Sequence[BareArea],
    hull: SurfaceSamples,
    options: FitOptions,
) -> tuple[BareArea, ...]:
    """Return what sheets leave bare, by reason, the largest area first.

    ``more`` could be added if one more were allowed; the reasons of ``earlier``, found before the last sheets, hold.
    """
    tally = BareTally(hull, covered_by(sheets, hull, options.tolerance))
    take = tally.take
    if more:
        take(sheet_more(len(sheets)), covered_by(more, hull, options.tolerance))
    for area in earlier:
        take(area.reason, _among(hull, area))
    take("flat", flat_samples(hull))
    least = f"{options.min_length * 1e3:g} mm long and {math.degrees(options.min_wrap):g} deg wide"
    take(f"curved in two ways, in a corner, or without room for a sheet {least}", np.ones(len(hull), bool))
    return tuple(tally.areas)


def _among(hull: SurfaceSamples, area: BareArea) -> Bools:
    """Return whether each sample is one of an area, shape (n,)."""
    inside = set(map(tuple, area.points.tolist()))
    return np.fromiter((tuple(point) in inside for point in hull.points.tolist()), bool, len(hull))


_COARSE_GRID = (100, 53)  # slices, and rays in each
_FINE_GRID = (300, 149)
_CONVEX_SHARE = 0.5  # of the hull that the sheets on a convex mesh must cover
_SAME_SHARE = 0.9  # share of the points of a region on a known side: it is no other one
_REFINED_REGIONS = 3  # regions of which the best is looked for on fine profiles


def with_developables(
    link: SampledLink, cones: LinkFit, options: FitOptions, say: Callable[[str], None] = lambda _: None
) -> LinkFit:
    """Find general cylinders and cones where they cover more of a link than the cones that were found on it.

    Args:
        link: the link.
        cones: what ``fit_cones`` found on it with the same options.
        options: of the search.
        say: called with the name of each step.

    Returns:
        ``cones`` where they cover as much, or all but ``LEAST_GAIN`` of the hull as much; else a fit with developables.
    """
    if options.wrap is not None and options.wrap != math.tau:
        return cones
    most, tolerance = options.most_sheets, options.tolerance
    say("looking for rulings")
    worth = np.ones(len(link.counted)) if link.worth is None else link.worth
    taken = covered_by(cones.sheets, link.counted, 1.5 * tolerance)
    if float(worth[~taken].sum()) < LEAST_GAIN * float(worth.sum()):
        return cones
    candidates = find_ruling_candidates(link.hull, link.axes)
    ruled = _RuledLink(link, options, worth, [(c, ruled_profile(link, c, _COARSE_GRID, options)) for c in candidates])
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
            taken = covered_by(there, hull, 1.5 * options.tolerance)
            best: FoundSheet | None = None
            tried = 0
            for area, number, region in self.regions(there):
                if tried == _REFINED_REGIONS or area < LEAST_GAIN * len(hull) * hull.area:
                    break
                candidate, profile = self.coarse[number]
                if best is not None and _lies_on(best.sheet.placed, profile, region, options.tolerance):
                    continue
                tried += 1
                fine = _kept_clear(ruled_profile(self.link, candidate, _FINE_GRID, options), there, options)
                found = fit_sheet(self.link, fine, worth, candidate, options, len(there))
                if found is None or float(worth[found.covers & ~taken].sum()) < LEAST_GAIN * float(worth.sum()):
                    continue
                if best is None or found.sheet.touch_share > 1.02 * best.sheet.touch_share:
                    best = found
            if best is None:
                break
            done.append(best.sheet)
        return done

    def regions(self, there: Sequence[FittedSheet]) -> list[tuple[float, int, RuledRegion]]:
        """Return the widest region of each profile clear of sheets: area [m2], number, region; the largest first."""
        regions = []
        for number, (candidate, profile) in enumerate(self.coarse):
            free = _kept_clear(profile, there, self.options)
            region = widest_region(free, candidate, self.options)
            if region is not None:
                regions.append((_area(free, region), number, region))
        return sorted(regions, key=lambda item: -item[0])


def _area(profile: RadialProfile, region: RuledRegion) -> float:
    """Return the area of a region [m2], but for the slope of its section."""
    cells = profile.radius[region.first : region.end][:, columns_of(region, len(profile.phi))]
    return float(cells.sum()) * profile.step * math.tau / len(profile.phi)


def _lies_on(placed: PlacedFrustum, profile: RadialProfile, region: RuledRegion, tolerance: float) -> bool:
    """Tell whether a region is that of a side which is known already."""
    step = max(1, (region.end - region.first) // 4)
    rows = slice(region.first, region.end, step)
    points = hull_points(profile, rows, columns_of(region, len(profile.phi)))
    u, phi, off = placed.locate_all(points)
    slack = 2.0 * profile.step
    on = (np.abs(off) < 1.5 * tolerance) & (u > -slack) & (u < placed.frustum.slant + slack)
    return float((on & (phi >= 0.0) & (phi <= placed.frustum.wrap)).mean()) > _SAME_SHARE


def _kept_clear(profile: RadialProfile, sheets: Sequence[FittedSheet], options: FitOptions) -> RadialProfile:
    """Return a profile on which no sheet may lie where it would run into another."""
    if not sheets:
        return profile
    points = hull_points(profile)
    clear = options.thickness + options.gap
    half = 0.5 * profile.step
    for sheet in sheets:
        side = sheet.placed.frustum
        u, phi, off = sheet.placed.locate_all(points)
        margin = (clear + half) / max(min(side.radius1, side.radius2), 1e-3)
        inside = (off > -clear) & (off < clear) & (u > -clear - half)
        inside &= (u < side.slant + clear + half) & (phi > -margin) & (phi < side.wrap + margin)
        profile = profile.blocked(inside.reshape(profile.radius.shape) & (profile.radius > 0.0))
    return profile


def find_sheets(
    mesh: Mesh,
    options: FitOptions | None = None,
    *,
    round_only: bool = False,
    progress: Callable[[str], None] | None = None,
    **named: Any,
) -> LinkFit:
    """Find the sheets that cover most of a link: cones, or developables of another section where they cover more.

    Args:
        mesh: the link.
        options: what is asked of the sheets; None for the values that ``FitOptions`` has by itself.
        round_only: True for cones only.
        progress: called with the name of each step.
        named: options by their names, instead of those in ``options``.

    Raises:
        GeometryError: an option is out of range.
        MeshError: no face of the mesh is visible from outside.
    """
    check_names(named)
    options = replace(options or FitOptions(), **named)
    say = progress or (lambda _: None)
    link = sample_link(mesh, options, say)
    cones = fit_cones(link, options, say)
    return cones if round_only else with_developables(link, cones, options, say)
