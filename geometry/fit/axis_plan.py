"""Sheets about one axis: full wraps, partial wraps, and both together, that cover most with a number of sheets.

A partial wrap is the largest region in length and angle, on shoulders and wrists that no full wrap fits. Sheets about
other axes take cells of the profile away: those on which a sheet would run into theirs. Each side of a plan becomes a
fitted sheet: a frustum on the link, and how well it fits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from coneskin.core.arrays import Bools, Floats
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose

from .fit_options import FitOptions
from .profile import RadialProfile, Region
from .side import StraightSide, balance_borders, choose_intervals, fit_side, longest_intervals
from .surface_samples import SurfaceSamples


def _largest_region(
    good: Bools, rows: int = 1, columns: int = 1, exact: bool = False, worth: Floats | None = None
) -> Region | None:
    """Return the largest rectangle of good cells on a grid whose columns go round, or the one that is worth most.

    It has ``rows`` and ``columns`` at least, or exactly so many columns; its first column is in [0, p).
    """
    count, around = good.shape
    if columns > around or rows > count:
        return None
    filled = good.sum(axis=1)
    wide_enough = np.flatnonzero(filled >= columns)
    if len(wide_enough) < rows:
        return None
    lowest, end = int(wide_enough[0]), int(wide_enough[-1]) + 1
    good, count = good[lowest:end], end - lowest
    whole = np.cumsum(np.concatenate([good, good], axis=1), axis=1, dtype=np.int32)
    whole = np.concatenate([np.zeros((count, 1), np.int32), whole], axis=1)
    row = np.arange(1, count + 1, dtype=np.int32)[:, None]

    def runs(wide: int) -> NDArray[np.int32]:
        """Return how many rows of a block of so many columns end in each row, by its first column, shape (k, p)."""
        block = whole[:, wide : wide + around] - whole[:, :around] == wide
        return np.asarray(row - np.maximum.accumulate(np.where(block, 0, row), axis=0))

    most = columns if exact else int(filled.max())
    if worth is None:
        found = _largest(runs, rows, columns, most)
    else:
        found = _worthiest(runs, rows, columns, most, worth[lowest:end])
    return found and found._replace(first=found.first + lowest, end=found.end + lowest)


def _largest(runs: Callable[[int], NDArray[np.int32]], rows: int, columns: int, most: int) -> Region | None:
    """Return the region of most cells. A wider block is not taller, so only the widest of each height is looked for."""
    tallest: dict[int, tuple[int, int, int]] = {}

    def look(wide: int) -> int:
        if wide not in tallest:
            run = runs(wide)
            at = int(run.argmax())
            tallest[wide] = (int(run.flat[at]), *divmod(at, run.shape[1]))
        return tallest[wide][0]

    best: Region | None = None
    area, wide = 0, columns
    while wide <= most:
        tall = look(wide)
        if tall < rows or tall * most <= area:
            break
        beyond, step = most + 1, 1
        while beyond - wide > 1:
            middle = min(wide + step, (wide + beyond) // 2)
            if look(middle) == tall:
                wide, step = middle, 2 * step
            else:
                beyond, step = middle, most
        if tall * wide > area:
            _, end, first = tallest[wide]
            area, best = tall * wide, Region(end + 1 - tall, end + 1, first, wide)
        wide = max(wide, area // max(tall - 1, 1)) + 1
    return best


def _worthiest(
    runs: Callable[[int], NDArray[np.int32]], rows: int, columns: int, most: int, worth: Floats
) -> Region | None:
    """Return the region of the cells that count most, each of them as much as ``worth`` says."""
    count, around = worth.shape
    row = np.arange(1, count + 1, dtype=np.int32)[:, None]
    sums = np.zeros((count + 1, 2 * around + 1))
    sums[1:, 1:] = np.concatenate([worth, worth], axis=1).cumsum(axis=0).cumsum(axis=1)
    best: Region | None = None
    area = 0.0
    for wide in range(columns, most + 1):
        run = runs(wide)
        if int(run.max()) < rows:
            break
        across = sums[:, wide : wide + around] - sums[:, :around]
        values = np.where(run >= rows, across[1:] - np.take_along_axis(across, row - run, axis=0), 0.0)
        at = int(values.argmax())
        if values.flat[at] > area:
            end, first = divmod(at, around)
            area, best = float(values.flat[at]), Region(end + 1 - int(run.flat[at]), end + 1, first, wide)
    return best


SideLine = tuple[float, float]  #: radius at z = 0 of the profile's frame [m], and dr/dz

_MIN_CELL_SHARE = 0.97  # of the largest side so far: fewer cells near a line hold no larger one


@dataclass(frozen=True, slots=True)
class SheetRequirements(FitOptions):
    """Options of a search that are checked already, or made of such; its weights are those of the link."""

    least_gain: float = 0.0  #: what a further sheet must add, by the weights [m2]

    def __post_init__(self) -> None:
        """Check nothing: a search looks beyond the limits too."""

    @property
    def loose(self) -> SheetRequirements:
        """Requirements for coarse profiles, on which a sheet may seem a little worse than it is."""
        length, wrap = 0.75 * self.min_length, 0.92 * self.min_wrap
        return replace(self, tolerance=1.1 * self.tolerance, min_length=length, min_wrap=wrap)

    def least_radius(self, wrap: float) -> float:
        """Return the smallest radius [m] of a side at least so wide [rad]; its fit may lie a tolerance inside."""
        return max(self.min_radius, self.min_arc / wrap + self.tolerance) if self.min_arc else self.min_radius


@dataclass(frozen=True, slots=True, eq=False)
class AxisPlan:
    """Straight sides about one axis that are to become sheets."""

    profile: RadialProfile  #: the hull about the axis; cells on which no sheet may lie have the weight 0
    sides: list[StraightSide]  #: the sides, in order along the axis; empty where none is within the tolerance

    @property
    def area(self) -> float:
        """Area of all sheets, by the weights of the profile [m2]."""
        return sum(side.area(self.profile) for side in self.sides)

    @property
    def kinds(self) -> tuple[int, int]:
        """Numbers of full and of partial wraps."""
        full = sum(side.columns == len(self.profile.phi) for side in self.sides)
        return full, len(self.sides) - full

    def score(self, requirements: SheetRequirements) -> float:
        """Return the area, less what each sheet has to add to be worth its wires [m2]."""
        return self.area - requirements.least_gain * len(self.sides)


def plan_sheets(
    profile: RadialProfile,
    lines: list[SideLine],
    requirements: SheetRequirements,
    count: int,
    rise: float = 0.0,
    exactly: tuple[int, int] | None = None,
) -> list[AxisPlan]:
    """Return the plan that covers most for each number of sheets from 1 on; shorter where more add nothing.

    Args:
        lines: straight sides near which partial wraps are looked for.
        count: number of sheets at most.
        rise: added to the radii, because facets lie inside the true surface [m].
        exactly: numbers of full and of partial wraps, to plan no others.
    """
    rows = max(2, math.ceil(requirements.min_length / profile.step))
    best: dict[int, AxisPlan] = {}
    for full in _full_wraps(profile, requirements, rows, count, rise):
        if exactly is not None and len(full) != exactly[0]:
            continue
        sides = list(full)
        while True:
            plan = AxisPlan(profile, sorted(sides, key=lambda side: (side.first, side.column)))
            known = best.get(len(sides))
            if sides and (known is None or plan.area > known.area):
                best[len(sides)] = plan
            wanted = count if exactly is None else sum(exactly)
            if len(sides) == wanted or requirements.wrap == math.tau:
                break
            held = profile
            for side in sides:
                held = held.blocked(_neighbourhood(profile, side, requirements.gap))
            part = largest_partial_wrap(held, lines, requirements, rows, rise)
            if part is None:
                break
            sides = [*sides, part]
    return [best[number] for number in range(1, count + 1) if number in best]


def _full_wraps(
    profile: RadialProfile, requirements: SheetRequirements, rows: int, count: int, rise: float
) -> list[list[StraightSide]]:
    """Return the sides of none, one, two ... full wraps that cover most, each list longer than the one before."""
    found: list[list[StraightSide]] = [[]]
    if requirements.wrap is not None and requirements.wrap != math.tau:
        return found
    high, low = profile.bounds(requirements.tolerance)
    low = np.where(low >= requirements.least_radius(math.tau), low, 0.0)
    ends = longest_intervals(profile.z, high, low, requirements.tolerance, rows)
    worth = profile.radius.mean(axis=1) if profile.weight is None else (profile.radius * profile.weight).mean(axis=1)
    for number in range(1, count + 1):
        chosen = choose_intervals(ends, number, rows, worth)
        chosen = balance_borders(profile.z, high, low, chosen, rows)
        sides = [fit_side(profile, a, b, 0, len(profile.phi), requirements.tolerance, rise) for a, b in chosen]
        sides = [side for side in sides if side.end - side.first >= rows]
        if len(sides) <= len(found[-1]):
            break
        found.append(sides)
    return found


def largest_partial_wrap(
    profile: RadialProfile, lines: list[SideLine], requirements: SheetRequirements, rows: int, rise: float
) -> StraightSide | None:
    """Return the largest side near one of the lines; None where none is large enough."""
    around = len(profile.phi)
    exact = requirements.wrap is not None
    columns = min(math.ceil((requirements.wrap or requirements.min_wrap) / math.tau * around), around)
    free, floor = profile.free(), profile.floor(requirements.tolerance)
    least = requirements.least_radius(columns * math.tau / around)
    best: StraightSide | None = None
    area = 0.0
    for radius, slope in lines:
        line = radius + slope * profile.z + rise
        limit = requirements.tolerance * math.hypot(1.0, slope)
        good = free & (profile.radius <= (line + limit)[:, None]) & (floor >= (line - limit)[:, None])
        good &= (line >= least)[:, None]
        filled = good.sum(axis=1)
        if int(filled.sum()) < rows * columns:
            continue
        most = float(filled @ line) * profile.step * math.tau / around * math.hypot(1.0, slope)
        if requirements.weights is None and most < _MIN_CELL_SHARE * area:
            continue
        worth = None if requirements.weights is None else profile.weight
        region = _largest_region(good, rows, columns, exact, worth)
        if region is None:
            continue
        cells = region.columns * float(line[region.first : region.end].sum())
        if worth is None and cells * profile.step * math.tau / around * math.hypot(1.0, slope) < _MIN_CELL_SHARE * area:
            continue
        side = fit_side(profile, *region, requirements.tolerance, rise)
        if side.end - side.first >= rows and side.area(profile) > area:
            best, area = side, side.area(profile)
    return best


def _neighbourhood(profile: RadialProfile, side: StraightSide, gap: float) -> Bools:
    """Return the cells of a side and those nearer to it than a gap [m], shape (k, p)."""
    cells = np.zeros(profile.radius.shape, bool)
    rows = math.ceil(gap / profile.step)
    around = len(profile.phi)
    least = float(side.radii(profile.z[side.first : side.end]).min())
    wide = min(math.ceil(gap / (math.tau / around * max(least, 1e-3))), around)
    columns = profile.azimuths(side.column - wide, min(side.columns + 2 * wide, around))
    cells[np.ix_(np.arange(max(0, side.first - rows), min(len(profile.z), side.end + rows)), columns)] = True
    return cells


_TESTED_HEIGHTS = 4  # heights at which the space above a cell is tested


def _clashing_cells(
    profile: RadialProfile, other: RadialProfile, side: StraightSide, thickness: float, gap: float
) -> Bools:
    """Return the cells above which the space of a sheet to come meets that of a side which is there, shape (k, p).

    The side lies on the profile ``other``; thickness of both sheets and least gap between them [m].
    """
    turned = profile.frame.columns.T @ other.frame.columns
    out = np.stack([np.cos(profile.phi), np.sin(profile.phi)], axis=1) @ turned[:2]
    foot = (profile.frame.origin - other.frame.origin) @ other.frame.columns
    # a coordinate at a time: numpy is slow with arrays of three columns
    x, y, z = (foot[i] + profile.z[:, None] * turned[2, i] + profile.radius * out[:, i] for i in range(3))
    ca = 1.0 / math.hypot(1.0, side.slope)
    sa = side.slope * ca
    low = float(other.z[side.first]) - 0.5 * other.step
    high = float(other.z[side.end - 1]) + 0.5 * other.step
    width = 2.0 * math.pi / len(other.phi)
    full = side.columns == len(other.phi)
    # cells lie up to a step apart: a sheet that slips between two of them is caught by the wider border
    slack = gap + 0.5 * max(profile.step, other.step)
    reach = 2.0 * (thickness + slack)  # beyond which no layer above a cell comes near
    above = np.abs((np.sqrt(x * x + y * y) - side.radius - side.slope * z) * ca)
    near = np.flatnonzero((above < reach) & (z > low - reach) & (z < high + reach))
    base = np.stack([x.flat[near], y.flat[near], z.flat[near]], axis=1)
    way = out[near % len(profile.phi)]
    met = np.zeros(len(near), bool)
    for layer in np.linspace(0.0, thickness, _TESTED_HEIGHTS):
        x, y, z = (base + layer * way).T
        rho = np.sqrt(x * x + y * y)
        height = (rho - side.radius - side.slope * z) * ca
        foot = z + height * sa  # along the normal of the side
        inside = (height > -slack) & (height < thickness + slack) & (foot > low - slack) & (foot < high + slack)
        if not full:
            margin = slack / np.maximum(rho, 1e-3)
            azimuth = (np.arctan2(y, x) - side.column * width + margin) % (2.0 * math.pi)
            inside &= azimuth < (side.columns - 1) * width + 2.0 * margin
        met |= inside
    clash = np.zeros(profile.radius.shape, bool)
    clash.flat[near[met]] = True
    return clash


def kept_clear(profile: RadialProfile, plans: Sequence[AxisPlan], requirements: SheetRequirements) -> RadialProfile:
    """Return a profile on which no sheet may lie where it would run into those of plans about other axes."""
    for plan in plans:
        for side in plan.sides:
            cells = _clashing_cells(profile, plan.profile, side, requirements.thickness, requirements.gap)
            if cells.any():
                profile = profile.blocked(cells)
    return profile


@dataclass(frozen=True, slots=True)
class FittedSheet:
    """One sheet, its place on the link and how well it fits.

    Attributes:
        placed: the frustum and its pose in the link's frame; the wrap begins at phi = 0.
        max_deviation: largest distance between sheet and hull, bridged holes left out [m].
        rms_deviation: root mean square of that distance [m].
        bridged_share: share of the sheet that spans holes and grooves, deeper below their rims than the tolerance.
        bridged_depth: depth of the deepest bridged hole [m]; 0 without one.
        length_share: length of the sheet over the length of the link along the axis.
        area_share: share of the hull that the sheet covers.
        facet_rise: mean distance by which the corners of the mesh lie outside its facets [m]; the radii include it.
        axis: number of its axis; sheets with the same number lie about the same axis.
        touch_share: share of the hull that the sheet covers, weighed by what touches count there; without weights the
            same as ``area_share``.
    """

    placed: PlacedFrustum
    max_deviation: float
    rms_deviation: float
    bridged_share: float
    bridged_depth: float
    length_share: float
    area_share: float
    facet_rise: float
    axis: int = 0
    touch_share: float = 0.0

    @property
    def facet_height(self) -> float:
        """Largest distance by which the facets of the mesh lie inside the surface of their corners [m].

        A facet of a tube lies two thirds of that inside on average, which is ``facet_rise``.
        """
        return 1.5 * self.facet_rise

    @property
    def frustum(self) -> Frustum:
        """Side of the sheet."""
        return self.placed.frustum

    def covering(self, part: PlacedFrustum) -> FittedSheet:
        """Return the sheet on a part of its side; its deviation stays that of the whole."""
        length, area = part.frustum.height / self.frustum.height, part.frustum.area / self.frustum.area
        return replace(
            self,
            placed=part,
            length_share=length * self.length_share,
            area_share=area * self.area_share,
            touch_share=area * self.touch_share,
        )


def deviations(miss: Floats, hole: Bools) -> dict[str, float]:
    """Return the deviations of a sheet from its distances to cells of the hull [m], and which of these are in holes."""
    seen = miss[~hole]
    return {
        "max_deviation": float(np.abs(seen).max()) if seen.size else math.inf,
        "rms_deviation": math.sqrt(float((seen**2).mean())) if seen.size else math.inf,
        "bridged_share": float(hole.mean()),
        "bridged_depth": float(-miss[hole].min()) if hole.any() else 0.0,
    }


def fitted_sheet(
    plan: AxisPlan,
    side: StraightSide,
    axis: int,
    hull: SurfaceSamples,
    tolerance: float,
    seam: Floats,
    worth: Floats | None = None,
) -> FittedSheet:
    """Return one side of a plan as a sheet on the link.

    Args:
        tolerance: largest distance between sheet and hull [m].
        seam: direction in which the seam of a full wrap faces, shape (3,).
        worth: what each sample counts, shape (n,); the same for all by default.
    """
    profile, frame = plan.profile, plan.profile.frame
    start, end = _ends(plan)[plan.sides.index(side)]
    radii = side.radius + side.slope * start, side.radius + side.slope * end
    width = math.tau / len(profile.phi)
    full = side.columns == len(profile.phi)
    wrap = math.tau if full else (side.columns - 1) * width
    turn = frame.azimuth(seam) if full else side.column * width
    spin = np.array([[math.cos(turn), -math.sin(turn), 0.0], [math.sin(turn), math.cos(turn), 0.0], [0, 0, 1]])
    base = frame.origin + start * frame.axis
    rows = [(float(a), float(b), float(c)) for a, b, c in frame.columns @ spin]
    pose = Pose((rows[0], rows[1], rows[2]), (float(base[0]), float(base[1]), float(base[2])))
    cells = profile.azimuths(side.column, side.columns)
    cosine = 1.0 / math.hypot(1.0, side.slope)
    line = side.radii(profile.z[side.first : side.end])[:, None]
    radius = profile.radius[side.first : side.end][:, cells]
    hole = profile.bridged[side.first : side.end][:, cells] - radius > tolerance
    miss = (radius - line) * cosine
    below = side.covers(profile, hull, tolerance)
    return FittedSheet(
        placed=PlacedFrustum(Frustum(max(radii[0], 0.0), max(radii[1], 0.0), end - start, wrap), pose),
        **deviations(miss, hole),
        length_share=(end - start) / (profile.step * len(profile.z)),
        area_share=float(below.mean()),
        facet_rise=side.rise,
        axis=axis,
        touch_share=float(below.mean() if worth is None else worth[below].sum() / worth.sum()),
    )


def _ends(plan: AxisPlan) -> list[tuple[float, float]]:
    """Return the heights of both ends of each side [m]; full wraps that touch share the circle where they meet."""
    profile, sides = plan.profile, plan.sides
    half = 0.5 * profile.step
    ends = [[float(profile.z[s.first]), float(profile.z[s.end - 1])] for s in sides]
    for n, (one, two) in enumerate(pairwise(sides)):
        gap = two.first - one.end
        if not 0 <= gap <= 4 or one.slope == two.slope or one.columns != two.columns != len(profile.phi):
            continue
        meet = (two.radius - one.radius) / (one.slope - two.slope)
        low, high = ends[n][1] - 8 * half, ends[n + 1][0] + 8 * half
        if low <= meet <= high:
            ends[n][1] = ends[n + 1][0] = meet
    return [(a, b) for a, b in ends]
