"""Assembly of the sheets of a link: where each ends, how it is laid out, and where its wires leave.

Link, sheets, tabs, ties, connectors and cables are bodies, none of which may meet another. Each sheet has variants: a
side for its wires, and an end drawn back to make room for them. One sheet after another takes the one that leaves most
active beside all other bodies, or is left out with the reason; of the orders, the one that leaves most active counts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import permutations
from typing import get_args

import numpy as np

from coneskin.core.errors import GeometryError
from coneskin.geometry.drawing.electrode_layout import LEAST_ACTIVE_SHARE, ElectrodePlan, SheetLayout, best_layout
from coneskin.geometry.drawing.surface_shape import SheetSide
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.ray_casting import RayCaster

from .cable_way import BODY_CLEARANCE, Body, CableWay, LinkSurface, SheetBody, TabApron

_DRAWN_BACK = (0.0, 0.014, 0.026)  # m; of an end, for tabs; and for a cable that runs around beside them
_SHELL_COUNT = (41, 121, 3)  # places of a sheet along, around and across, by which it is held against another
_TAB_SLOPES = (0.0, 0.3, 0.6, 1.0)  # rise over length; tabs bend up to half a right angle where the link stands out
_HANGING_WORTH = 0.9  # of a sheet whose cable hangs beyond the link, beside one whose cable lies on it
_TRIM_ERROR = 1e-6  # m
_MAX_PERMUTED = 3  # sheets; of more, two orders are tried
_SIDE_NAMES = {"end1": "end 1", "end2": "end 2", "edge0": "edge 0", "edge1": "the edge of C"}


def sheet_gap(one: SheetBody, two: SheetBody, rows: int = _SHELL_COUNT[0]) -> tuple[float, float]:
    """Return the least distance from one sheet to another, 0 where they meet, and u of that place of the first [m].

    Args:
        one: a sheet.
        two: another one.
        rows: places of the first along its slant; 2 for its ends alone.
    """
    side = one.place.frustum
    u, phi = np.linspace(0.0, side.slant, rows), np.linspace(0.0, side.wrap, _SHELL_COUNT[1])
    points, normals = one.place.place(*np.meshgrid(u, phi, indexing="ij"))
    layers = np.linspace(0.0, one.thickness, _SHELL_COUNT[2])[:, None, None, None]
    gaps = two.distances((points + layers * normals).reshape(-1, 3)).reshape(_SHELL_COUNT[2], rows, -1).min(axis=(0, 2))
    least = np.flatnonzero(gaps <= gaps.min())  # where they meet: all of it
    return float(gaps.min()), float(u[least].mean())


def _cut_back(place: PlacedFrustum, start: float, end: float) -> PlacedFrustum:
    """Return a place, shortened along the slant at end 1 and end 2 [m]; refused where nothing would be left."""
    side = place.frustum
    if start + end >= side.slant:
        raise GeometryError(
            f"the gap to its neighbors takes {1e3 * (start + end):.4g} mm of a sheet {1e3 * side.slant:.4g} mm long: "
            "reduce the sheet gap"
        )
    return place.part(start, side.slant - end, 0.0, side.wrap) if start or end else place


def _clear_of_each_other(places: Sequence[PlacedFrustum], thickness: float, gap: float) -> list[PlacedFrustum]:
    """Return places whose sheets keep a gap [m]: ends that are nearer are drawn back, both by as much.

    Raises:
        GeometryError: a sheet would have nothing left.
    """
    kept = list(places)
    for i in range(len(kept)):
        for j in range(i):
            pair = kept[j], kept[i]
            bodies = [SheetBody(place, thickness) for place in pair]
            gaps = sheet_gap(bodies[0], bodies[1]), sheet_gap(bodies[1], bodies[0])
            if min(gaps)[0] >= gap - _TRIM_ERROR:
                continue
            first = [u < 0.5 * place.frustum.slant for (_, u), place in zip(gaps, pair, strict=True)]
            low, high, rows = 0.0, max(gap, 1e-3), 2 if max(gaps)[0] > 0.0 else _SHELL_COUNT[0]

            def cut(by: float, pair: Sequence[PlacedFrustum] = pair, first: Sequence[bool] = first) -> list[SheetBody]:
                ends = [(by, 0.0) if at_first else (0.0, by) for at_first in first]
                return [SheetBody(_cut_back(p, *by_end), thickness) for p, by_end in zip(pair, ends, strict=True)]

            def apart(by: float, rows: int = rows) -> bool:
                one, two = cut(by)
                return min(sheet_gap(one, two, rows)[0], sheet_gap(two, one, rows)[0]) >= gap

            while not apart(high):
                low, high = high, 2.0 * high
            while high - low > _TRIM_ERROR:
                middle = 0.5 * (low + high)
                low, high = (low, middle) if apart(middle) else (middle, high)
            kept[j], kept[i] = (body.place for body in cut(high))
    return kept


@dataclass(frozen=True, slots=True)
class PlacedSheet:
    """One sheet of an assembly.

    Attributes:
        index: of its place among those given.
        place: the side that it covers, with ends drawn back where there was need.
        layout: of its electrodes.
        apron: of its tabs.
        way: of its cable.
        sheet: the space that it takes.
    """

    index: int
    place: PlacedFrustum
    layout: SheetLayout
    apron: TabApron
    way: CableWay
    sheet: SheetBody

    @property
    def bodies(self) -> tuple[Body, ...]:
        """Sheet, tabs, and cable with tie and connector."""
        return self.sheet, self.apron.body(), self.way.body()


@dataclass(frozen=True, eq=False)
class _Variant:
    """A way to make one sheet: a side for its wires, and what it covers then."""

    place: PlacedFrustum
    layout: SheetLayout
    thickness: float
    height: float
    rays: RayCaster | None
    wished: float
    asked: bool

    @property
    def active(self) -> float:
        """Active area [m2]."""
        return self.layout.active.area(self.layout.sheet)

    @cached_property
    def sheet(self) -> SheetBody:
        return SheetBody(self.place, self.thickness)

    @cached_property
    def apron(self) -> TabApron:
        for slope in _TAB_SLOPES:
            apron = TabApron.of(self.place, self.layout, self.height, slope)
            if not apron.stands_in(self.rays):
                break
        if self.asked and self.layout.plan.wires.startswith("edge") and self.sheet.near(apron.feet, 0.0).any():
            return TabApron.of(self.place, self.layout, self.height, math.inf)  # between edges that meet: up
        return apron

    @cached_property
    def surface(self) -> LinkSurface:
        return LinkSurface(self.place, self.rays, self.wished + 0.03)

    def wired(self, others: Sequence[Body]) -> CableWay | str:
        """Return the way of its cable beside other bodies, or why there is none."""
        standing = math.isinf(self.apron.slope)
        if not standing and self.sheet.near(self.apron.feet, 0.0).any():
            return "the tabs would lie on the sheet itself"
        if self.apron.stands_in(self.rays):
            return "the link stands out where the tabs leave"
        if any(body.near(self.apron.feet, BODY_CLEARANCE).any() for body in others):
            return "the tabs would meet another sheet or its wires"
        side = self.layout.plan.wires
        if standing:
            way = CableWay.over_seam(self.apron, side, self.sheet, self.wished)
        else:
            way = self.surface.find_way(self.apron, side, self.sheet, others, self.wished)
        return way or f"there is no free way of {1e3 * self.wished:.0f} mm for the cable with its tie and its connector"


def assemble(
    places: Sequence[PlacedFrustum],
    plan: ElectrodePlan | None,
    wires: SheetSide | None,
    thickness: float,
    tab_height: float,
    gap: float,
    connector: float,
    rays: RayCaster | None = None,
    found: bool = False,
    beside: Sequence[Body] = (),
) -> tuple[tuple[PlacedSheet, ...], dict[int, str]]:
    """Place all sheets of a link.

    Args:
        places: sides that sheets are to cover.
        plan: widths of the electrodes; None to choose them for each sheet.
        wires: side at which all wires leave; None to choose it for each sheet.
        thickness: of the sheets [m].
        tab_height: of the tabs above the link [m].
        gap: least distance between sheets [m].
        connector: wished length of each cable from the rim to the connector [m].
        rays: a ray caster of the link; None where it is known by its dimensions, and goes on as its sides do.
        found: True where the places were found on a mesh: those that are not worth their wires are left out.
        beside: further bodies that none may meet.

    Returns:
        the sheets that can be built; and why not, by the index of each other place.

    Raises:
        GeometryError: the sheets cannot keep the gap.
    """
    cleared = _clear_of_each_other(places, thickness, gap)
    sides: tuple[SheetSide, ...] = get_args(SheetSide) if wires is None else (wires,)

    def variants(place: PlacedFrustum) -> Iterator[_Variant]:
        for side in sides:
            for back in _DRAWN_BACK if side.startswith("end") else (0.0,):
                try:
                    cut = _cut_back(place, *((back, 0.0) if side == "end1" else (0.0, back)))
                    layout = best_layout(cut.frustum, plan, side)
                except GeometryError as error:
                    problems.setdefault(str(error))
                    continue
                if found and plan is None and layout.active_share < LEAST_ACTIVE_SHARE:
                    why = f"rims and electrodes would leave less than {LEAST_ACTIVE_SHARE:.0%} of it active"
                    problems.setdefault(f"{why}; give widths (electrodes) to design it all the same")
                    continue
                yield _Variant(cut, layout, thickness, tab_height, rays, connector, wires is not None)

    left_out: dict[int, str] = {}
    choices: dict[int, list[_Variant]] = {}
    for index, place in enumerate(cleared):
        problems: dict[str, None] = {}
        choices[index] = sorted(variants(place), key=lambda one: -one.active)
        if not choices[index]:
            left_out[index] = next(iter(problems))
            del choices[index]
    most, placed, refused = _most_active(choices, cleared, thickness, beside)
    for index in sorted(choices) if refused and found else ():
        # a sheet may bar the way of the wires of a larger one, which is built in its place
        others = {other: options for other, options in choices.items() if other != index}
        active, rest, reasons = _most_active(others, cleared, thickness, beside)
        if active > most:
            most, placed, refused = (
                active,
                rest,
                reasons | {index: "other sheets, with more active area, take its room"},
            )
    return tuple(placed[index] for index in sorted(placed)), left_out | refused


def _most_active(
    choices: dict[int, list[_Variant]], cleared: Sequence[PlacedFrustum], thickness: float, beside: Sequence[Body]
) -> tuple[float, dict[int, PlacedSheet], dict[int, str]]:
    """Return the active area [m2] of the sheets placed in the best order, these by their index, and why not others."""
    orders = list(permutations(choices)) if len(choices) <= _MAX_PERMUTED else [tuple(choices), tuple(choices)[::-1]]
    most, placed, refused = -1.0, dict[int, PlacedSheet](), dict[int, str]()
    for order in orders:
        done: dict[int, PlacedSheet] = {}
        reasons: dict[int, str] = {}
        for k, index in enumerate(order):
            bodies = [*beside, *(body for sheet in done.values() for body in sheet.bodies)]
            bodies += [SheetBody(cleared[later], thickness) for later in order[k + 1 :]]
            best = _best(index, choices[index], bodies)
            if isinstance(best, str):
                reasons[index] = best
            else:
                done[index] = best
        active = sum(sheet.layout.active.area(sheet.layout.sheet) for sheet in done.values())
        if active > most:
            most, placed, refused = active, done, reasons
    return most, placed, refused


def _best(index: int, variants: Sequence[_Variant], bodies: Sequence[Body]) -> PlacedSheet | str:
    """Return the sheet that is worth most beside other bodies, or why there is none."""
    best, most, reasons = None, 0.0, dict[str, None]()
    for variant in variants:
        if variant.active <= most:
            break
        way = variant.wired(bodies)
        if isinstance(way, str):
            reasons.setdefault(f"at {_SIDE_NAMES[variant.layout.plan.wires]} {way}")
            continue
        worth = variant.active * (_HANGING_WORTH if way.hangs else 1.0)
        if worth > most:
            most, best = worth, PlacedSheet(index, variant.place, variant.layout, variant.apron, way, variant.sheet)
    return best or "; ".join(reasons)
