"""One developable sheet: its region on a profile, its side fitted to the hull there, and what the fit is worth.

The region is the largest one whose columns run straight along rulings, whatever its section is.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from coneskin.core.arrays import Bools, Floats, Ints
from coneskin.core.errors import GeometryError
from coneskin.geometry.developable import Developable
from coneskin.geometry.displacement_map import bridge_holes
from coneskin.geometry.fit.candidates import SampledLink
from coneskin.geometry.fit.fit_options import FitOptions
from coneskin.geometry.fit.fitted_sheet import FittedSheet
from coneskin.geometry.fit.profile import AxisFrame, RadialProfile, measure_profile
from coneskin.geometry.fit.side import longest_run
from coneskin.geometry.fit.surface_samples import SurfaceSamples
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.placed_frustum import PlacedFrustum

from .ruling_candidates import RulingCandidate
from .side_fit import fit_developable


@dataclass(frozen=True, slots=True)
class RuledRegion:
    """Cells of a profile: rows from ``first`` to before ``end``, and ``columns`` columns from ``column`` on."""

    first: int
    end: int
    column: int
    columns: int


def columns_of(region: RuledRegion, around: int) -> Ints:
    """Return the columns of a region on a profile of so many columns, in order."""
    return np.arange(region.column, region.column + region.columns) % around


def _ruled_region(
    profile: RadialProfile,
    apex: float | None,
    tolerance: float,
    rows: int,
    least: Floats,
    least_columns: int,
    full_only: bool = False,
) -> RuledRegion | None:
    """Return the region of largest area in which every column is straight within a tolerance.

    Args:
        profile: the hull about a line.
        apex: height at which the rulings meet, in the frame of the profile [m]; None where they are parallel to it.
        tolerance: largest distance from the ruling, across it [m].
        rows: least number of rows.
        least: smallest radius a sheet may have in each row [m], shape (k,).
        least_columns: least number of columns.
        full_only: True for full wraps only.
    """
    scale = np.ones(len(profile.z)) if apex is None else 1.0 - profile.z / apex
    usable = scale > 0.05
    scale = np.where(usable, scale, 1.0)[:, None]
    around = len(profile.phi)
    top, low = profile.radius / scale, profile.floor(tolerance) / scale
    good = profile.free() & usable[:, None] & (low > 0.0) & (profile.floor(tolerance) >= least[:, None])
    oblique = _obliquity(top, good)
    limit = 2.0 * tolerance * oblique / scale  # shape (k, p)
    best: RuledRegion | None = None
    worth = 0.0
    count = len(profile.z)
    for first in range(count - rows + 1):
        if (count - first) * around <= worth:
            break
        if not good[first].any():
            continue
        high, floor, tight = top[first].copy(), low[first].copy(), limit[first].copy()
        alive = good[first].copy()
        for end in range(first + 1, count + 1):
            if end - first > 1:
                row = end - 1
                np.maximum(high, top[row], out=high)
                np.minimum(floor, low[row], out=floor)
                np.minimum(tight, limit[row], out=tight)
                alive &= good[row] & (high - floor <= tight)
            kept = int(alive.sum())
            if kept < least_columns or kept * (count - first) <= worth:
                break
            if end - first < rows or kept * (end - first) <= worth:
                continue
            if kept == around:
                best, worth = RuledRegion(first, end, 0, around), float(around * (end - first))
                continue
            if full_only:
                break
            column, run = _longest_run(alive)
            if run >= least_columns and run * (end - first) > worth:
                best, worth = RuledRegion(first, end, column, run), float(run * (end - first))
    return best


def _obliquity(radius: Floats, good: Bools) -> Floats:
    """Return by how much a distance along a ray exceeds that square to the surface, for each column, shape (p,)."""
    shown = np.where(good & (radius > 0.0), radius, np.nan)  # a hole that is spanned may have no surface
    around = radius.shape[1]
    section = np.ones(around)
    for column in range(around):
        values = shown[:, column][np.isfinite(shown[:, column])]
        section[column] = float(np.median(values)) if len(values) else np.nan
    if not np.isfinite(section).any():
        return np.ones(around)
    section = np.where(np.isfinite(section), section, np.nanmedian(section))
    slope = (np.roll(section, -1) - np.roll(section, 1)) / (4.0 * np.pi / around * section)
    return np.asarray(np.minimum(np.hypot(1.0, slope), 2.0))


def _longest_run(alive: Bools) -> tuple[int, int]:
    """Return the first column and the length of the longest run of a ring."""
    gaps = np.flatnonzero(~alive)
    if len(gaps) == 0:
        return 0, len(alive)
    lengths = np.diff(np.concatenate([gaps, [gaps[0] + len(alive)]])) - 1
    longest = int(lengths.argmax())
    return int((gaps[longest] + 1) % len(alive)), int(lengths[longest])


_FIT_ROWS = 12  # slices whose points are fitted
_LEAST_POINTS = 100  # of a region, to fit a side to it
_CHECK_ROWS = 60  # slices by which a fit is judged
_MIN_NORMAL_COSINE = 0.9  # cosine between the normals of the hull and of a sheet on it


class FoundSheet(NamedTuple):
    """A fitted side with what is left of its region after the fit was checked."""

    sheet: FittedSheet
    covers: Bools  #: samples of the hull that it covers, shape (n,)


def ruled_profile(
    link: SampledLink, candidate: RulingCandidate, grid: tuple[int, int], options: FitOptions
) -> RadialProfile:
    """Measure a profile about a line, of about so many slices and rays, with holes filled up to its section."""
    frame = AxisFrame.along(candidate.origin, candidate.axis, options.seam)
    step = max(float(np.ptp(link.mesh.outermost @ frame.axis)) / grid[0], 0.0005)
    profile = measure_profile(link.mesh, link.rays, frame, step, grid[1], options.max_bridge)
    return _bridged_anew(profile, _apex_height(profile, candidate), options.max_bridge)


def _bridged_anew(profile: RadialProfile, apex: float | None, width: float) -> RadialProfile:
    """Return a profile whose holes are filled up to its section: the short radii of an oval are no hole."""
    scale = np.ones(len(profile.z)) if apex is None else np.maximum(1.0 - profile.z / apex, 0.05)
    shown = np.where(profile.radius > 0.0, profile.radius / scale[:, None], np.nan)
    present = np.isfinite(shown).any(axis=0)
    if not present.any():
        return profile
    section = np.where(present, np.nanmedian(np.where(present, shown, 1.0), axis=0), 0.0) * scale[:, None]
    lift = float(section.max())
    depth = np.where(profile.radius > 0.0, np.maximum(profile.radius - section + lift, 1e-6), 0.0)
    arc = math.tau / len(profile.phi) * float(np.median(section[:, present]))
    filled = bridge_holes(depth, profile.step, arc, width) - lift + section
    return replace(profile, bridged=np.maximum(filled, profile.radius))


def _apex_height(profile: RadialProfile, candidate: RulingCandidate) -> float | None:
    if candidate.apex is None:
        return None
    return float((candidate.apex - profile.frame.origin) @ profile.frame.axis)


def widest_region(profile: RadialProfile, candidate: RulingCandidate, options: FitOptions) -> RuledRegion | None:
    """Return the region of a profile that one sheet can cover."""
    columns = math.ceil(options.min_wrap / math.tau * len(profile.phi))
    rows = max(3, math.ceil(options.min_length / profile.step))
    least = np.full(len(profile.z), 0.25 * options.min_radius)
    apex = _apex_height(profile, candidate)
    return _ruled_region(profile, apex, options.tolerance, rows, least, columns, options.wrap == math.tau)


def hull_points(profile: RadialProfile, rows: slice = slice(None), columns: Ints | None = None) -> Floats:
    """Return the points of the hull below the cells of a profile, floors of holes filled, shape (n, 3) [m]."""
    chosen = np.arange(len(profile.phi)) if columns is None else columns
    out = np.stack([np.cos(profile.phi[chosen]), np.sin(profile.phi[chosen])], axis=1) @ profile.frame.columns[:, :2].T
    radius = profile.bridged[rows][:, chosen]
    points = profile.frame.origin + profile.z[rows][:, None, None] * profile.frame.axis + radius[..., None] * out
    return np.asarray(points.reshape(-1, 3))


def fit_sheet(
    link: SampledLink,
    profile: RadialProfile,
    worth: Floats,
    candidate: RulingCandidate,
    options: FitOptions,
    number: int,
) -> FoundSheet | None:
    """Return the sheet of a candidate, fitted on a fine profile and checked there."""
    region = widest_region(profile, candidate, options)
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
    profile: RadialProfile, region: RuledRegion, candidate: RulingCandidate, options: FitOptions
) -> Developable | None:
    """Fit a side to a region."""
    columns = columns_of(region, len(profile.phi))
    full = region.columns == len(profile.phi)
    apex = _apex_height(profile, candidate)
    scale = np.ones(len(profile.z)) if apex is None else 1.0 - profile.z / apex
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
        assert apex is not None
        reach = abs(apex - middle) / float(np.median(np.abs(away @ profile.frame.axis)))
        at = candidate.apex + reach * away
        ways = away if apex < middle else -away
    step = max(1, (region.end - region.first) // _FIT_ROWS)
    points = hull_points(profile, slice(region.first, region.end, step), columns)
    hit = profile.radius[region.first : region.end : step][:, columns]
    sound = (profile.bridged[region.first : region.end : step][:, columns] - hit <= options.tolerance).ravel()
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


def _covered_samples(placed: PlacedFrustum, hull: SurfaceSamples, distance: float) -> Bools:
    """Return whether a sheet lies on each sample of the hull, shape (n,)."""
    side = placed.frustum
    u, phi, off = placed.locate_all(hull.points)
    inside = (np.abs(off) <= distance) & (u >= 0.0) & (u <= side.slant) & (phi >= 0.0) & (phi <= side.wrap)
    if side.wrap >= math.tau - 1e-9:
        inside = (np.abs(off) <= distance) & (u >= 0.0) & (u <= side.slant)
    normals = placed.place(np.zeros(len(phi)), phi)[1]
    return np.asarray(inside & (np.einsum("ij,ij->i", normals, hull.normals) > _MIN_NORMAL_COSINE))


def covered_by(sheets: Iterable[FittedSheet], hull: SurfaceSamples, distance: float) -> Bools:
    """Return whether any of the sheets lies on each sample of the hull, shape (n,)."""
    covered = np.zeros(len(hull), bool)
    for sheet in sheets:
        covered |= _covered_samples(sheet.placed, hull, distance)
    return covered


def _checked(
    profile: RadialProfile,
    region: RuledRegion,
    placed: Developable,
    hull: SurfaceSamples,
    worth: Floats,
    options: FitOptions,
    rise: float,
    number: int,
) -> FoundSheet | None:
    """Return a side cut to the slices in which it is within the tolerance, as a sheet; None where too few are left."""
    columns = columns_of(region, len(profile.phi))
    step = max(1, (region.end - region.first) // _CHECK_ROWS)
    rows = np.arange(region.first, region.end, step)
    rows = rows if rows[-1] == region.end - 1 else np.append(rows, region.end - 1)
    shape = (len(rows), len(columns))
    floor = profile.bridged[rows][:, columns]
    hole = floor - profile.radius[rows][:, columns] > options.tolerance
    out = np.stack([np.cos(profile.phi[columns]), np.sin(profile.phi[columns])], axis=1)
    base = profile.frame.origin + profile.z[rows][:, None, None] * profile.frame.axis
    across = (out @ profile.frame.columns[:, :2].T)[None]
    points = base + profile.radius[rows][:, columns][..., None] * across
    rims = base + floor[..., None] * across
    off = placed.locate_all(points.reshape(-1, 3))[2].reshape(shape)
    rim = placed.locate_all(rims.reshape(-1, 3))[2].reshape(shape) if hole.any() else off
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
    seen = off[kept][~hole[kept]]
    covers = _covered_samples(placed, hull, 1.5 * options.tolerance)
    sheet = FittedSheet(
        placed=placed,
        max_deviation=float(np.abs(seen).max()) if seen.size else math.inf,
        rms_deviation=math.sqrt(float((seen**2).mean())) if seen.size else math.inf,
        bridged_share=float(hole[kept].mean()),
        bridged_depth=float(-off[kept][hole[kept]].min()) if hole[kept].any() else 0.0,
        length_share=placed.frustum.slant / (profile.step * len(profile.z)),
        area_share=float(covers.mean()),
        facet_rise=rise,
        axis=number,
        touch_share=float(worth[covers].sum() / worth.sum()),
    )
    return FoundSheet(sheet, covers)


def _span(placed: Developable, profile: RadialProfile, low: float, high: float) -> tuple[float, float]:
    """Return the arcs between which all rulings lie between two heights of a profile [m]."""
    phi = np.linspace(0.0, placed.frustum.wrap, 241)
    base, way, _ = placed.rulings(phi * (1.0 - 1e-12))
    pose = placed.link_frustum
    z = profile.frame.local(pose.apply_all(base))[:, 2]
    climb = (way @ np.array(pose.rotation).T) @ profile.frame.axis
    return float(((low - z) / climb).max()), float(((high - z) / climb).min())
