"""Candidates for the rulings of a link: directions in which they are parallel, and points in which they meet.

A point p with the normal n lies on a developable with parallel rulings along a only if n a = 0, and on one whose
rulings meet in x only if n (p - x) = 0, whatever its section is. In homogeneous coordinates both are one linear law.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np

from coneskin.core.arrays import Bools, Floats, Ints
from coneskin.geometry.displacement_map import bridge_holes
from coneskin.geometry.fit.candidates import AxisCandidate, SampledLink, most_voted
from coneskin.geometry.fit.fit_options import FitOptions
from coneskin.geometry.fit.profile import AxisFrame, RadialProfile, Region
from coneskin.geometry.fit.side import longest_run
from coneskin.geometry.fit.surface_samples import SurfaceSamples

_DRAW_COUNT = 1600  # pairs, and triples, of samples
_VOTER_COUNT = 1200  # samples that vote
_RULING_GATE = 0.035  # rad; angle between a ruling and the tangent plane up to which a sample counts
_LEAST_SHARE = 0.08  # of the hull that must obey a candidate
_MAX_DIRECTIONS = 4  # tried at most
_MAX_APEXES = 2
_MAX_APEX_DISTANCE = 30.0  # sizes of the link; rulings that meet further away are parallel
_SAME_DIRECTION = 0.02  # rad; directions closer than this are one


@dataclass(frozen=True, slots=True, eq=False)
class RulingCandidate:
    """A line inside a link about which its rulings are looked for.

    Attributes:
        origin: a point of the line [m], shape (3,).
        axis: unit vector along it, shape (3,).
        apex: point of the line in which the rulings meet [m], shape (3,); None where they are parallel to it.
    """

    origin: Floats
    axis: Floats
    apex: Floats | None = None

    def apex_height(self, profile: RadialProfile) -> float:
        """Return the height of the apex in the frame of a profile [m]; infinite where the rulings are parallel."""
        return math.inf if self.apex is None else float((self.apex - profile.frame.origin) @ profile.frame.axis)

    def scale(self, profile: RadialProfile) -> Floats:
        """Return the size of the section in each slice of a profile, over that at its origin, shape (k,)."""
        return np.asarray(1.0 - profile.z / self.apex_height(profile))

    def profile(self, link: SampledLink, grid: tuple[int, int], options: FitOptions) -> RadialProfile:
        """Measure a profile about it, of about so many slices and rays, with holes filled up to its section."""
        frame = AxisFrame.along(self.origin, self.axis, options.seam)
        profile = link.profile(frame, grid, options.max_bridge, weighed=False)
        return _bridged_anew(profile, self.scale(profile), options.max_bridge)

    def widest_region(self, profile: RadialProfile, options: FitOptions) -> Region | None:
        """Return the region of a profile about it that one sheet can cover."""
        columns = math.ceil(options.min_wrap / math.tau * len(profile.phi))
        rows = max(3, math.ceil(options.min_length / profile.step))
        least = np.full(len(profile.z), 0.25 * options.min_radius)
        scale, full_only = self.scale(profile), options.wrap == math.tau
        return _ruled_region(profile, scale, options.tolerance, rows, least, columns, full_only)


def _bridged_anew(profile: RadialProfile, scale: Floats, width: float) -> RadialProfile:
    """Return a profile whose holes are filled up to its section: the short radii of an oval are no hole."""
    scale = np.maximum(scale, 0.05)
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


def _ruled_region(
    profile: RadialProfile,
    scale: Floats,
    tolerance: float,
    rows: int,
    least: Floats,
    least_columns: int,
    full_only: bool = False,
) -> Region | None:
    """Return the region of largest area in which every column is straight within a tolerance across its ruling [m].

    The scale is the size of the section in each row over that at the origin, ``least`` the smallest radius there [m],
    each of shape (k,).
    """
    usable = scale > 0.05
    scale = np.where(usable, scale, 1.0)[:, None]
    around = len(profile.phi)
    top, low = profile.radius / scale, profile.floor(tolerance) / scale
    good = profile.free() & usable[:, None] & (low > 0.0) & (profile.floor(tolerance) >= least[:, None])
    oblique = _obliquity(top, good)
    limit = 2.0 * tolerance * oblique / scale  # shape (k, p)
    best: Region | None = None
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
                best, worth = Region(first, end, 0, around), float(around * (end - first))
                continue
            if full_only:
                break
            column, after = longest_run(np.concatenate([alive, alive]))  # the columns go round
            run = after - column
            if run >= least_columns and run * (end - first) > worth:
                best, worth = Region(first, end, column, run), float(run * (end - first))
    return best


def _obliquity(radius: Floats, good: Bools) -> Floats:
    """Return by how much a distance along a ray exceeds that square to the surface, for each column, shape (p,)."""
    around = radius.shape[1]
    there = good & (radius > 0.0)  # a hole that is spanned may have no surface
    section = np.array(
        [np.median(column[seen]) if seen.any() else np.nan for column, seen in zip(radius.T, there.T, strict=True)]
    )
    if not there.any():
        return np.ones(around)
    section = np.where(np.isfinite(section), section, np.nanmedian(section))
    slope = (np.roll(section, -1) - np.roll(section, 1)) / (4.0 * np.pi / around * section)
    return np.asarray(np.minimum(np.hypot(1.0, slope), 2.0))


def find_ruling_candidates(samples: SurfaceSamples, axes: list[AxisCandidate]) -> list[RulingCandidate]:
    """Find lines about which a link may have rulings; the same samples give the same lines.

    Args:
        axes: known candidates for axes of cones, whose directions are tried too.
    """
    rng = np.random.default_rng(5)
    if len(samples) < 24:
        return []
    size = float(np.ptp(samples.points, axis=0).max())
    voters = samples.some(_VOTER_COUNT)
    found: list[RulingCandidate] = []
    for direction in _directions(samples, voters, rng, axes):
        obeys = np.abs(samples.normals @ direction) < 2.0 * _RULING_GATE
        middle = _middle(samples.points[obeys], direction)
        found.append(RulingCandidate(middle, direction))
        for axis in axes:  # a tube beside another one is not about the middle of both
            off = axis.origin - middle
            apart = float(np.linalg.norm(off - (off @ direction) * direction))
            if abs(axis.axis @ direction) > 1.0 - _SAME_DIRECTION**2 and apart > 0.03 * size and len(found) < 8:
                found.append(RulingCandidate(axis.origin, direction))
        loose = np.abs(samples.normals @ direction) < 0.3
        apex = _common_point(samples.points[loose], samples.normals[loose], size, direction)
        if apex is not None:
            found.append(_about(samples, apex))
    for apex in _apexes(samples, voters, rng, size):
        candidate = _about(samples, apex)
        known = [other.apex for other in found if other.apex is not None]
        if all(np.linalg.norm(apex - other) > 0.02 * np.linalg.norm(apex - candidate.origin) for other in known):
            found.append(candidate)
    return found


def _directions(
    samples: SurfaceSamples, voters: Ints, rng: np.random.Generator, axes: list[AxisCandidate]
) -> list[Floats]:
    """Return the directions to which most tangent planes are parallel, the best first, refined."""
    i, j = rng.integers(0, len(samples), (2, _DRAW_COUNT))
    drawn = np.cross(samples.normals[i], samples.normals[j])
    length = np.linalg.norm(drawn, axis=1)
    drawn = drawn[length > 0.3] / length[length > 0.3, None]
    trials = np.concatenate([drawn, *(axis.axis[None] for axis in axes)])
    votes = (np.abs(samples.normals[voters] @ trials.T) < _RULING_GATE).astype(float)
    chosen: list[Floats] = []
    for best in most_voted(votes, _LEAST_SHARE, 0.3):  # a flat of a box obeys several directions
        direction = trials[best]
        for gate in (2.0 * _RULING_GATE, _RULING_GATE, 0.5 * _RULING_GATE):
            near = samples.normals[np.abs(samples.normals @ direction) < gate]
            if len(near) < 12:
                break
            direction = np.linalg.eigh(near.T @ near)[1][:, 0]
        direction = direction * np.sign(direction[int(np.abs(direction).argmax())])
        if all(abs(direction @ other) < math.cos(_SAME_DIRECTION) for other in chosen):
            chosen.append(direction)
        if len(chosen) == _MAX_DIRECTIONS:
            break
        votes[:, best] = 0.0
    return chosen


def _middle(points: Floats, direction: Floats) -> Floats:
    """Return a point of the line along a direction through the middle of the shadow of some points."""
    first = np.linalg.eigh(np.eye(3) - np.outer(direction, direction))[1][:, 1:]
    shadow = points @ first
    middle = first @ (0.5 * (np.percentile(shadow, 1.0, axis=0) + np.percentile(shadow, 99.0, axis=0)))
    return np.asarray(middle + direction * float(np.median(points @ direction)))


def _common_point(points: Floats, normals: Floats, size: float, direction: Floats) -> Floats | None:
    """Return the point in which the tangent planes meet; None where that is nearly infinitely far away."""
    middle = points.mean(axis=0)
    rows = np.concatenate([normals, -np.einsum("ij,ij->i", normals, points - middle)[:, None] / size], axis=1)
    weights = (np.abs(normals @ direction) < 0.15).astype(float)
    solution = np.zeros(4)
    for _ in range(25):
        if weights.sum() < 12.0:
            return None
        solution = np.linalg.eigh((rows * weights[:, None]).T @ rows)[1][:, 0]
        miss = np.abs(rows @ solution) / max(float(np.linalg.norm(solution[:3])), 1e-9)
        scale = max(4.0 * float(np.median(miss[weights > 0.0])), 0.2 * _RULING_GATE)
        weights = np.where(miss < scale, (1.0 - (miss / scale) ** 2) ** 2, 0.0)
    if abs(solution[3]) * _MAX_APEX_DISTANCE < np.linalg.norm(solution[:3]):
        return None
    return np.asarray(middle + size * solution[:3] / solution[3])


def _apexes(samples: SurfaceSamples, voters: Ints, rng: np.random.Generator, size: float) -> list[Floats]:
    """Return the points in which most tangent planes meet, the best first, refined."""
    index = rng.integers(0, len(samples), (_DRAW_COUNT, 3))
    p, n = samples.points[index], samples.normals[index]
    sound = np.abs(np.linalg.det(n)) > 0.01
    p, n = p[sound], n[sound]
    trials = np.linalg.solve(n, np.einsum("hij,hij->hi", n, p)[..., None])[..., 0]
    middle = samples.points.mean(axis=0)
    trials = trials[np.linalg.norm(trials - middle, axis=1) < _MAX_APEX_DISTANCE * size]
    if len(trials) == 0:
        return []
    chosen: list[Floats] = []
    for best in itertools.islice(most_voted(_votes(samples, voters, trials).astype(float), _LEAST_SHARE), _MAX_APEXES):
        apex = trials[best]
        for gate in (2.0 * _RULING_GATE, _RULING_GATE, 0.5 * _RULING_GATE):
            way = samples.points - apex
            near = np.abs(np.einsum("ij,ij->i", samples.normals, way)) < gate * np.linalg.norm(way, axis=1)
            if near.sum() < 12:
                break
            rows = samples.normals[near]
            apex = np.linalg.lstsq(rows, np.einsum("ij,ij->i", rows, samples.points[near]), rcond=1e-6)[0]
        chosen.append(np.asarray(apex))
    return chosen


def _votes(samples: SurfaceSamples, voters: Ints, trials: Floats) -> Bools:
    p, n = samples.points[voters], samples.normals[voters]
    off = np.einsum("ij,ij->i", n, p)[:, None] - n @ trials.T
    square = (p**2).sum(axis=1)[:, None] - 2.0 * p @ trials.T + (trials**2).sum(axis=1)
    return np.asarray(np.abs(off) < _RULING_GATE * np.sqrt(np.maximum(square, 1e-12)))


def _about(samples: SurfaceSamples, apex: Floats) -> RulingCandidate:
    """Return the line from an apex through the middle of the samples that see it along their tangent planes."""
    way = samples.points - apex
    length = np.linalg.norm(way, axis=1)
    ways = way / np.maximum(length, 1e-9)[:, None]
    near = np.abs(np.einsum("ij,ij->i", samples.normals, ways)) < 2.0 * _RULING_GATE
    if near.sum() < 12:
        near[:] = True
    mean = ways[near].mean(axis=0)
    axis = mean / max(float(np.linalg.norm(mean)), 1e-9)
    # the middle of the bundle, not its densest part
    first = np.linalg.eigh(np.eye(3) - np.outer(axis, axis))[1][:, 1:]
    shadow = (ways[near] / np.maximum(ways[near] @ axis, 0.1)[:, None]) @ first
    axis = axis + first @ (0.5 * (np.percentile(shadow, 1.0, axis=0) + np.percentile(shadow, 99.0, axis=0)))
    axis /= np.linalg.norm(axis)
    origin = apex + axis * float(np.median((way @ axis)[near]))
    return RulingCandidate(origin, axis, apex)
