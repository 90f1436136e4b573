"""The cables of a robot's sheets, from each connector to one box with all boards at the foot of its base link.

So no USB cable crosses a joint. Link after link, from the base outwards, the shortest ways lead to one place at the
joint towards the base. There all cables go on in loops, which allow for the whole range of the joint.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, cast

import numpy as np

from coneskin.core.arrays import Floats, Ints
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.pose import Pose
from coneskin.geometry.urdf import UrdfJoint, joint_frame, joints_inwards, link_poses

from .cable_lattice import CableLattice, length_of
from .sheets.cable_way import CABLE_RADIUS, SphereBody
from .sheets.sheet_design import SheetDesign

_OHMS_PER_METRE = 1.06 / 58.0 / 0.14  # of 0.14 mm2: copper at 20 degC (IEC 60028), 6 % more for the lay of its strands
BEND_RADIUS = 15.0 * CABLE_RADIUS  #: m; 7.5 diameters of a cable that moves
BOX_LENGTH = 0.3  #: m; of each cable, from the foot of the robot to the box
_CONNECTOR_REACH = 0.04  # m; from a connector to the first free place
_CROSSING_PLACES = 500  # free places on either side of a joint from which those of its loop are chosen
_CROSSING_REACH = 0.04  # m; of them from what moves on the other side
_LOOP_REACH = 0.15  # m; from the axis: a wider loop sweeps past the arm
_LOOP_ANGLES, _LOOP_POINTS = 5, 33  # at which, and points at which, it is held against both links
_LOOPS_TRIED, _LOOPS_AT_ONCE = 40, 200  # from each place; the shortest one that meets neither link is taken
_LEAST_OFF = 5e-3  # m; of the next link from a base, each in its middle; nearer ones say nothing of its ends
_LEAST_PART = 100  # places of a lattice that are joined; fewer are a niche


def loop_length(child: Floats, parent: Floats, limits: tuple[float, float], travel: float = 0.0) -> Floats:
    """Return the length of a cable past a joint that nowhere in its range is too short [m].

    The cable goes from its end nearer to the axis outwards to the radius r of its other end, along the axis into the
    gap between the links, around the axis there, and along it to the other end: rise + r turn. The turn is largest at
    an end of the range, by half the range more than in its middle. A straight line between the ends is never longer, at
    any angle. Added are the travel of a joint that slides, and two quarter bends, as if they led nowhere.

    Args:
        child: ends on the outer link in the frame of the joint, whose axis is z, at its angle 0 [m], shape (..., 3).
        parent: the other ends in that frame [m], shape (..., 3).
        limits: of the joint [rad]; where they are infinite, half a turn each way is taken.
        travel: of a joint that slides [m].
    """
    middle, half = _turns(child, parent, limits)
    radius1, radius2 = (np.hypot(ends[..., 0], ends[..., 1]) for ends in (child, parent))
    turn = np.abs(middle) + half
    around = np.abs(radius1 - radius2) + np.abs(child[..., 2] - parent[..., 2]) + np.maximum(radius1, radius2) * turn
    return np.asarray(around + travel + math.pi * BEND_RADIUS)


def _turns(child: Floats, parent: Floats, limits: tuple[float, float]) -> tuple[Floats, float]:
    """Return the turn of loops in the middle of a joint's range, from the inner to the outer end, and half of it."""
    lower, upper = limits if math.isfinite(limits[1] - limits[0]) else (-math.pi, math.pi)
    turn1, turn2 = (np.arctan2(ends[..., 1], ends[..., 0]) for ends in (child, parent))
    middle = np.mod(turn1 - turn2 + 0.5 * (lower + upper) + math.pi, math.tau) - math.pi
    return np.asarray(middle), 0.5 * (upper - lower)


@dataclass(frozen=True, slots=True, eq=False)
class CableSection:
    """A stretch of a cable, on a link or past a joint.

    Attributes:
        place: name of the link or of the joint.
        points: on a link: the way in its frame, towards the base [m], shape (n, 3); past a joint: the end on the outer
            link and the other one in the frame of the joint, whose axis is z, at its angle 0 [m], shape (2, 3).
        length: [m].
        limits: of the joint [rad]; infinite where it has none; None on a link.
    """

    place: str
    points: Floats
    length: float
    limits: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class CableTree:
    """The cables.

    Attributes:
        cables: sections from the connector to the foot of the robot, by the number of the sensor; none where there is
            no way.
        reasons: why not, a sentence for each reason.
    """

    cables: tuple[tuple[CableSection, ...], ...]
    reasons: tuple[str, ...]

    def length(self, sensor: int) -> float:
        """Return the length of a cable from its connector to the box of the boards [m]; 0 where there is no way."""
        sections = self.cables[sensor]
        return math.fsum(section.length for section in sections) + BOX_LENGTH if sections else 0.0

    def ohms(self, sensor: int) -> float:
        """Return the resistance of each wire of a cable [ohm]; 0 where there is no way."""
        return _OHMS_PER_METRE * self.length(sensor)

    def as_data(self) -> dict[str, Any]:
        """Return the cables for design.json; a joint without limits has no range."""
        cables = []
        for sensor, sections in enumerate(self.cables):
            parts: list[dict[str, Any]] = []
            for section in sections:
                length = round(1e3 * section.length, 1)
                if section.limits is None:
                    points = np.round(1e3 * section.points, 2).tolist()
                    parts.append({"link": section.place, "length_mm": length, "points_mm": points})
                else:
                    degrees = [round(math.degrees(limit), 3) for limit in section.limits if math.isfinite(limit)]
                    parts.append({"joint": section.place, "length_mm": length, "range_deg": degrees or None})
            size = {"length_mm": round(1e3 * self.length(sensor), 1), "ohm": round(self.ohms(sensor), 4)}
            cables.append({"sensor": sensor, **size, "sections": parts})
        return {"box_mm": 1e3 * BOX_LENGTH, "cables": cables, "reasons": list(self.reasons)}

    def bundles(self) -> Iterator[tuple[CableSection, tuple[int, ...]]]:
        """Yield the longest section at each link and joint with all sensors whose cables are tied together there."""
        found: dict[tuple[str, bool], list[tuple[CableSection, int]]] = {}  # a joint may be named as a link is
        for sensor, sections in enumerate(self.cables):
            for section in reversed(sections):
                found.setdefault((section.place, section.limits is None), []).append((section, sensor))
        for tied in found.values():
            yield max((s for s, _ in tied), key=lambda s: s.length), tuple(sensor for _, sensor in tied)


def bundle_radius(count: int) -> float:
    """Return the radius of some cables that are tied together [m]: of the circle around as many equal ones.

    Up to seven as proven (R. L. Graham, 1968), beyond by a density of .68, below which no known packing is.
    """
    proven = (1.0, 2.0, 2.1547, 2.4142, 2.7013, 3.0, 3.0)
    return CABLE_RADIUS * (proven[count - 1] if count <= len(proven) else math.sqrt(count / 0.68))


_Exit = tuple[CableSection, int] | None  # past the joint, and the place beyond it; none at the foot of the robot


@dataclass(frozen=True, slots=True, eq=False)
class _RoutedLink:
    """Shortest ways on a link towards the base."""

    lattice: CableLattice
    parent: str
    exits: Mapping[int, _Exit]  #: by the number of the place
    away: Floats  #: of each place, from the foot of the robot [m]
    before: Ints  #: number of the next place towards the base
    laid: dict[int, int]  #: the places of cables that are laid, and the next one of each, its own where they leave

    @classmethod
    def of(cls, lattice: CableLattice, parent: str, exits: Mapping[int, _Exit], costs: Sequence[float]) -> _RoutedLink:
        away, before = lattice.ways(np.array(list(exits), int), np.array(costs))
        return cls(lattice, parent, exits, away, before, {exit_: exit_ for exit_ in exits})

    def way(self, place: int) -> list[int]:
        """Return the places, by their numbers, from one to where it meets a cable that is laid."""
        way = [place]
        while way[-1] not in self.laid:
            way.append(int(self.before[way[-1]]))
        return way

    def lay(self, place: int) -> list[int]:
        """Return the places of a cable, drawn straight, from one to where it leaves the link."""
        self.laid.update(pairwise(self.lattice.taut(self.way(place))))
        laid = [place]
        while (then := self.laid[laid[-1]]) != laid[-1]:
            laid.append(then)
        return laid


class CableRouter:
    """Search of the ways of all cables.

    Args:
        joints: of the robot.
        meshes: of its links.
        sheets: in the order of their sensors, each with the name of its link.
        beside: returns the spaces that the links next to one sweep, by their names.
    """

    def __init__(
        self,
        joints: Sequence[UrdfJoint],
        meshes: Mapping[str, Mesh],
        sheets: Sequence[tuple[str, SheetDesign]],
        beside: Callable[[str], Mapping[str, SphereBody]],
    ) -> None:
        self._meshes, self._sheets, self._beside = meshes, sheets, beside
        self._joints = joints
        self._poses = link_poses(joints, [0.0] * len(joints))
        self._routed: dict[str, _RoutedLink | str] = {}
        self._spaces: dict[str, Mapping[str, SphereBody]] = {}
        self._counts: dict[str, int] = {}
        for link, _ in sheets:
            while link:
                self._counts[link] = self._counts.get(link, 0) + 1
                link = self._towards_base(link)[0]

    def tree(self) -> CableTree:
        """Return the cables of all sheets; the outer ones are laid first, and those nearer to the base join them."""
        cables: list[tuple[CableSection, ...]] = []
        reasons: dict[str, list[int]] = {}
        left = dict(Counter(link for link, _ in self._sheets))
        for sensor, (link, _) in reversed(list(enumerate(self._sheets))):
            left[link] -= 1
            cable = self._cable(link, left[link])
            cables.append(() if isinstance(cable, str) else cable)
            if isinstance(cable, str):
                reasons.setdefault(cable, []).insert(0, sensor)
        said = [f"No cable is laid for sensor {', '.join(map(str, bare))}: {why}." for why, bare in reasons.items()]
        feet = sorted({sections[-1].place for sections in cables if sections})
        if len(feet) > 1:
            said.insert(0, f"The cables end at the feet of {' and '.join(feet)}: a box for each.")
        return CableTree(tuple(reversed(cables)), tuple(reversed(said)))

    def _towards_base(self, link: str) -> tuple[str, tuple[UrdfJoint, ...]]:
        """Return the next link with a mesh towards the base, and the joints between; no name at the base."""
        return joints_inwards(link, self._joints, self._meshes)

    def _up(self, base: str) -> Floats:
        """Return the unit vector from what a base is bolted to, in its frame: the next link is at its other end."""
        outer = next((link for link in self._meshes if self._towards_base(link)[0] == base), None)
        to_base = self._poses.get(base, Pose()).inverse()
        upright = np.array(to_base.rotate((0.0, 0.0, 1.0)))
        if outer is None:
            return upright
        joint = self._towards_base(outer)[1][-1]
        frame = to_base @ joint_frame(joint, self._poses)
        middle = (to_base @ self._poses[outer]).apply_all(self._meshes[outer].own_frame[0][None])[0]
        away, axis = middle - self._meshes[base].own_frame[0], np.array(frame.rotation)[:, 2]
        along = float(away @ axis) * axis  # of an upright joint; past one that lies is where the base ends
        up = along if float(np.linalg.norm(along)) > 0.5 * float(np.linalg.norm(away)) else away
        off = float(np.linalg.norm(up))
        return np.asarray(up / off) if off > _LEAST_OFF else upright

    def _cable(self, link: str, sheet: int) -> tuple[CableSection, ...] | str:
        """Return the sections of the cable of a sheet on a link, or why there is no way."""
        routed = self._route(link)
        if isinstance(routed, str):
            return routed
        lattice = routed.lattice
        start = lattice.connector(sheet)
        off = np.linalg.norm(lattice.places - start, axis=1)
        near = np.flatnonzero(off < _CONNECTOR_REACH)
        near = near[np.argsort(routed.away[near] + off[near], kind="stable")]
        near = near[np.isfinite(routed.away[near])]
        # where no place is clear of the link by a cable's radius, one is bent over an edge there
        tried = ((k, clearance) for clearance in (1.1 * CABLE_RADIUS, 0.0) for k in near)
        first = next((k for k, clearance in tried if lattice.led_from(sheet, lattice.places[k], clearance)), None)
        if first is None:
            return self._obstacle(link, routed, "its connector", lambda places: np.linalg.norm(places - start, axis=1))
        sections, points, place = [], start[None], int(first)
        while True:
            way = routed.lay(place)
            points = np.concatenate([points, routed.lattice.places[way]])
            sections.append(CableSection(link, points, length_of(points)))
            leaving = routed.exits[way[-1]]
            if leaving is None:
                if len(routed.exits) > 1:  # the first cable chooses where the box stands
                    self._routed[link] = _RoutedLink.of(routed.lattice, "", {way[-1]: None}, [0.0])
                return tuple(sections)
            sections.append(leaving[0])
            link, place, points = routed.parent, leaving[1], np.empty((0, 3))
            routed = cast("_RoutedLink", self._routed[link])

    def _route(self, link: str) -> _RoutedLink | str:
        """Return the ways on a link, or why there are none."""
        if link not in self._routed:
            parent, joints = self._towards_base(link)
            inner = self._route(parent) if parent else None
            self._routed[link] = inner if isinstance(inner, str) else self._route_on(link, parent, inner, joints)
        return self._routed[link]

    def _route_on(
        self, link: str, parent: str, inner: _RoutedLink | None, joints: Sequence[UrdfJoint]
    ) -> _RoutedLink | str:
        sheets = [sheet for name, sheet in self._sheets if name == link]
        spaces = self._spaces[link] = self._beside(link)
        up = None if inner else self._up(link)
        radius = bundle_radius(self._counts[link])
        lattice = CableLattice(self._meshes[link], sheets, list(spaces.values()), radius, up)
        if inner is None:
            sizes = np.bincount(lattice.parts)[lattice.parts[lattice.foot]]
            if not len(sizes):
                return f"no place at the foot of {link} is free"
            feet = {int(foot): None for foot in lattice.foot[sizes == sizes.max()]}  # not in a niche
            return _RoutedLink.of(lattice, "", feet, [0.0] * len(feet))
        moving = [joint for joint in joints if joint.limits != (0.0, 0.0) or joint.travel > 0.0]
        if len(moving) > 1:
            return f"between {link} and {parent} there is more than one joint"
        joint = (moving or joints)[0]
        parts = range(lattice.parts.max(initial=-1) + 1)
        ahead = self._ahead(link, lattice, len(sheets))
        found = [one for part in parts if (one := self._crossing(lattice, part, ahead, link, inner, parent, joint))]
        if found:
            exits = {at: leaving for at, leaving, _ in found}
            return _RoutedLink.of(lattice, parent, exits, [cost for _, _, cost in found])
        return self._obstacle(parent, inner, joint.name, self._moving(link, parent, lattice.places).distances)

    def _moving(self, other: str, link: str, places: Floats) -> SphereBody:
        """Return what moves on the other side of a joint, in the frame of a link; where that is unknown, as it stands.

        Args:
            other: name of the other link.
            link: name of the link.
            places: about the other one, in its frame [m], shape (n, 3).
        """
        space = self._spaces[link].get(other)
        if space is not None and len(space.points):
            return space
        return SphereBody((self._poses[link].inverse() @ self._poses[other]).apply_all(places), 0.0)

    def _ahead(self, link: str, lattice: CableLattice, sheets: int) -> Floats:
        """Return how far each place on a link is from its connectors and the joints beyond, by their cables [m]."""
        ends = [np.linalg.norm(lattice.places - lattice.connector(sheet), axis=1) for sheet in range(sheets)]
        goals = [(np.flatnonzero(off < _CONNECTOR_REACH), 1) for off in ends]
        for outer, space in self._spaces[link].items():
            if self._towards_base(outer)[0] == link:
                goals.append((_nearest(lattice.places, space), self._counts.get(outer, 0)))
        ahead = np.zeros(len(lattice.places))
        for goal, count in goals:
            away = lattice.ways(goal, np.zeros(len(goal)))[0]
            ahead += count / self._counts[link] * np.where(np.isfinite(away), away, 0.0)
        return ahead

    def _crossing(
        self,
        lattice: CableLattice,
        part: int,
        ahead: Floats,
        link: str,
        inner: _RoutedLink,
        parent: str,
        joint: UrdfJoint,
    ) -> tuple[int, _Exit, float] | None:
        """Return where cables on a part of a link pass the joint towards the base, and their length from there [m]."""
        ours = np.flatnonzero(lattice.parts == part)
        if len(ours) < _LEAST_PART:
            return None
        theirs = np.flatnonzero(np.isfinite(inner.away))
        ends, others = lattice.places[ours], inner.lattice.places[theirs]
        ours = ours[_nearest(ends, self._moving(parent, link, others))]
        theirs = theirs[_nearest(others, self._moving(link, parent, ends))]
        frame = joint_frame(joint, self._poses)
        turned = frame.inverse() @ self._poses[link], frame.inverse() @ self._poses[parent]
        ours, a = _within(ours, turned[0].apply_all(lattice.places[ours]))
        theirs, b = _within(theirs, turned[1].apply_all(inner.lattice.places[theirs]))
        loops = loop_length(a[:, None], b, joint.limits, joint.travel)
        costs = loops + inner.away[theirs]
        best = np.argsort(costs, axis=1)[:, :_LOOPS_TRIED]
        order = np.stack([np.repeat(np.arange(len(ours)), best.shape[1]), best.ravel()], axis=1)
        order = order[np.argsort((costs + ahead[ours][:, None])[tuple(order.T)], kind="stable")]
        for some in np.array_split(order, math.ceil(len(order) / _LOOPS_AT_ONCE) or 1):
            i, j = some.T
            middle, half = _turns(a[i], b[j], joint.limits)
            turns = middle[:, None] + half * np.linspace(-1.0, 1.0, _LOOP_ANGLES)
            clear = lattice.clear(turned[0].inverse().apply_all(_loops(a[i], b[j], -turns)))
            clear &= inner.lattice.clear(turned[1].inverse().apply_all(_loops(b[j], a[i], turns)))
            for k, m in some[clear]:
                past = CableSection(joint.name, np.stack([a[k], b[m]]), float(loops[k, m]), joint.limits)
                return int(ours[k]), (past, int(theirs[m])), float(costs[k, m])
        return None

    def _obstacle(self, link: str, routed: _RoutedLink, goal: str, away: Callable[[Floats], Floats]) -> str:
        """Return which sheets of a link bar the way to a goal, of which places are so far away [m]."""
        lattice = routed.lattice
        bare = CableLattice(lattice.mesh, (), list(self._spaces[link].values()), lattice.radius)
        width = f"a bundle of {2e3 * lattice.radius:.0f} mm"
        if len(bare.places):
            first = {int(np.linalg.norm(bare.places - lattice.places[k], axis=1).argmin()): None for k in routed.exits}
            found = _RoutedLink.of(bare, "", first, [0.0] * len(first))
            end = int(np.where(np.isfinite(found.away), away(bare.places), np.inf).argmin())
            if barred := [f"sheet {k + 1}" for k in lattice.met(bare.places[found.way(end)])]:
                return f"{width} finds no way past {' and '.join(barred)} on {link}"
        return f"{width} finds no free place at {goal} on {link}"


def _loops(ends: Floats, others: Floats, turns: Floats) -> Floats:
    """Return points of loops from ends on a link to the other ones, at some angles, in the frame of the joint [m].

    Args:
        ends: in the frame of the joint, as it is fixed to that link [m], shape (n, 3).
        others: on the other link, of which radius and height count [m], shape (n, 3).
        turns: from the ones to the others about the axis [rad], shape (n, k).
    """
    at = np.linspace(0.0, 4.0, _LOOP_POINTS)
    share, rise = np.interp(at, (0.5, 3.5), (0.0, 1.0)), np.interp(at, (0.0, 0.5, 3.5, 4.0), (0.0, 0.5, 0.5, 1.0))
    radius = np.maximum(np.hypot(ends[:, 0], ends[:, 1]), np.hypot(others[:, 0], others[:, 1]))[:, None, None]
    azimuth = np.arctan2(ends[:, 1], ends[:, 0])[:, None, None] + share * turns[:, :, None]
    height = ends[:, 2, None, None] + rise * (others[:, 2] - ends[:, 2])[:, None, None]
    return np.stack(np.broadcast_arrays(radius * np.cos(azimuth), radius * np.sin(azimuth), height), axis=-1)


def _within(numbers: Ints, ends: Floats) -> tuple[Ints, Floats]:
    """Return the places, and where they are in the frame of a joint, from which a loop may go around it."""
    near = np.hypot(ends[:, 0], ends[:, 1]) < _LOOP_REACH
    return numbers[near], ends[near]


def _nearest(places: Floats, space: SphereBody) -> Ints:
    """Return the numbers of the places nearest to what moves beside them."""
    away = space.distances(places)
    near = np.argsort(away, kind="stable")[:_CROSSING_PLACES]
    return near[away[near] < _CROSSING_REACH]
