"""Printed jig of a sheet: collars that hold its ends at their places on the link while the adhesive sets.

A collar has two zones. Its lip lies on the bare link beyond the end of the sheet: the negative of the mesh, or of the
cone where there is no mesh. Then a step as high as the sheet, against which the end of the sheet is pushed; then a
sleeve over the sheet. Towards the joint of the link the lip ends flush with the outermost face of the link if that is
near, otherwise at its own length; where a part of the link stands out, its edge keeps clear of that part, which fixes
its azimuth as well. A collar is split into parts that are put on from the side, so none of them has an undercut.

The height of the link above the cone is found by rays at the nodes of a grid. Between them an edge of the mesh may
stand out further: over a facet the distance from an axis has no maximum but on its border, so the edges are followed as
well, and what stands out in a cell counts for its four nodes. A surface through the nodes is then nowhere below the
link, but for the sag of its own chords.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from coneskin.core.arrays import Bools, Floats
from coneskin.design.sheets.cable_way import SheetBody
from coneskin.design.sheets.sheet_design import SheetDesign
from coneskin.geometry.drawing.surface_shape import ShapeTab
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.pose import Pose
from coneskin.geometry.ray_casting import RayCaster
from coneskin.geometry.solid import shell_surface, widest_nearby, without_undercut

if TYPE_CHECKING:
    from trimesh import Trimesh


def with_sheets(mesh: Mesh, others: Sequence[SheetDesign]) -> Mesh:
    """Return the mesh of the link with the outer faces of the sheets that it bears already."""
    if not others:
        return mesh
    corners = np.concatenate([mesh.triangles, *(other.outer_triangles() for other in others)]).reshape(-1, 3)
    return Mesh(corners, np.arange(len(corners)).reshape(-1, 3), mesh.source, mesh.unit)


def _blocked(design: SheetDesign, neighbors: Sequence[SheetDesign], end: int) -> str:
    """Say what of other sheets lies where the lip of a collar would begin; empty where nothing does."""
    side, thickness = design.place.frustum, design.options.stack.thickness
    phi = np.linspace(0.0, side.wrap, 181)
    for other in neighbors:
        if other.above or other.name == design.name:
            continue
        sheet = SheetBody(other.place, thickness)
        bodies = (
            (sheet, "it meets the sheet beside it: take its pencil line"),
            (other.apron.body(), _WIRES_MET),
            (other.way.body(), _WIRES_MET),
        )
        for body, why in bodies:
            for away in (0.25 * _MIN_LIP, 0.75 * _MIN_LIP):
                u = -away if end == 1 else side.slant + away
                points, normals = design.place.place(np.full(len(phi), u), phi)
                met = [body.near(points + lift * normals, 0.0) for lift in (0.5 * thickness, thickness)]
                if np.any(met):
                    return why.format(other.name)
    return ""


_EDGE_STEP = 0.4e-3  # m; between the points at which an edge is looked at
_GRID_MARGIN = 1e-3  # m; before the end of the sheet, and beyond the reach, that is looked at too


class _EdgePoints(NamedTuple):
    excess: Floats  # above the cone [m]
    outwards: Floats  # along the axis from the sheet's end [m]
    phi: Floats  # azimuth [rad]


class _LinkExcess:
    """What is outermost beside one end of a sheet, in the frame of the sheet.

    Args:
        side: cone of the link under the sheet; it is extended beyond the end.
        step: height of the end of the sheet on the axis [m].
        sign: of the direction away from the sheet along the axis.
        reach: how far from the end is looked [m].
        body: the link, in a frame of its own; None where it is the cone itself.
        pose: of the frame of the link, seen from that of the sheet.
    """

    def __init__(self, side: Frustum, step: float, sign: float, reach: float, body: Mesh | None, pose: Pose) -> None:
        self._side, self._step, self._sign = side, step, sign
        beside = None if body is None else _beside(body, pose, step, sign, reach)
        self._far = 0.0 if beside is None else float(np.sqrt((beside.vertices[:, :2] ** 2).sum(axis=1).max())) + 0.01
        self._rays = None if beside is None else RayCaster(beside)
        self._edges = None if beside is None else self._follow_edges(beside, reach)

    def cone(self, z: float | Floats) -> Floats:
        """Return the radius of the extended cone at heights on the axis [m]."""
        slope = (self._side.radius2 - self._side.radius1) / self._side.height
        return np.asarray(np.maximum(_LEAST_RADIUS, self._side.radius1 + slope * np.asarray(z, float)))

    def height(self, outwards: float | Floats) -> Floats:
        """Return the height on the axis at a distance from the sheet's end [m]."""
        return np.asarray(self._step + self._sign * np.asarray(outwards, float))

    def over(self, share: Floats, lengths: Floats, phi: Floats, margin: float) -> Floats:
        """Return the height of the link above the cone at the nodes of a grid [m], 0 where there is no link.

        Args:
            share: of the length of a column at which its nodes lie, from 0 at the sheet's end, evenly up to 1.
            lengths: of the columns, away from the sheet [m], shape (n,).
            phi: azimuths of the columns, evenly [rad], shape (n,).
            margin: an edge outside the grid that is nearer to it than this counts too [m].
        """
        result = np.zeros((len(share), len(phi)))
        if self._rays is None or self._edges is None:
            return result
        z = self.height(share[:, None] * lengths)
        cone, radial = self.cone(z), np.stack([np.cos(phi), np.sin(phi), np.zeros_like(phi)], axis=-1)
        origins = np.broadcast_to(self._far * radial, (*z.shape, 3)).copy()
        origins[..., 2] = z
        ways = np.broadcast_to(-radial, origins.shape)
        depth, _ = self._rays.cast(origins.reshape(-1, 3), np.ascontiguousarray(ways).reshape(-1, 3))
        radius = (self._far - depth).reshape(z.shape)
        # beyond the link, or through an open end of the mesh, there is nothing to lie on
        found = np.isfinite(radius) & (radius > 0.5 * cone)
        result[found] = (radius - cone)[found]
        self._add_edges(result, lengths, phi, margin)
        return result

    def _add_edges(self, result: Floats, lengths: Floats, phi: Floats, margin: float) -> None:
        """Raise the nodes around each point of an edge to its height."""
        assert self._edges is not None
        excess, outwards, azimuth = self._edges
        rows, columns = result.shape
        width = float(phi[1] - phi[0])
        beside = margin / float(self.cone(self._step))
        x = ((azimuth - phi[0] + beside) % math.tau - beside) / width
        near = (x <= columns - 1 + beside / width) & (outwards >= -margin)
        x = np.clip(x[near], 0.0, columns - 1)
        excess, outwards = excess[near], outwards[near]
        length = np.interp(x, np.arange(columns), lengths)
        reached = outwards <= length + margin
        x, excess = x[reached], excess[reached]
        y = np.clip(outwards[reached] / np.maximum(length[reached], 1e-9), 0.0, 1.0) * (rows - 1)
        for row in (np.floor(y), np.ceil(y)):
            for column in (np.floor(x), np.ceil(x)):
                np.maximum.at(result, (row.astype(int), column.astype(int)), excess)

    def _follow_edges(self, body: Mesh, reach: float) -> _EdgePoints:
        """Return points along the edges of the link that are beside the sheet's end."""
        pairs = np.sort(body.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        lower, upper = np.divmod(np.unique(pairs[:, 0] * len(body.vertices) + pairs[:, 1]), len(body.vertices))
        first, last = body.vertices[lower], body.vertices[upper]
        a, b = (self._sign * (ends[:, 2] - self._step) for ends in (first, last))
        low, high = -_GRID_MARGIN, reach + _GRID_MARGIN
        beside = (np.maximum(a, b) >= low) & (np.minimum(a, b) <= high)
        first, last, a, b = first[beside], last[beside], a[beside], b[beside]
        with np.errstate(divide="ignore", invalid="ignore"):  # the part of each edge that is beside the sheet's end
            to_low, to_high = (low - a) / (b - a), (high - a) / (b - a)
        level = a == b
        start = np.where(level, 0.0, np.clip(np.minimum(to_low, to_high), 0.0, 1.0))
        stop = np.where(level, 1.0, np.clip(np.maximum(to_low, to_high), 0.0, 1.0))
        first, last = first + start[:, None] * (last - first), first + stop[:, None] * (last - first)
        counts = np.ceil(np.linalg.norm(last - first, axis=1) / _EDGE_STEP).astype(np.int64) + 1
        edge = np.repeat(np.arange(len(counts)), counts)
        at = (np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)) / np.maximum(counts[edge] - 1, 1)
        x, y, z = (first[edge] + at[:, None] * (last - first)[edge]).T
        return _EdgePoints(np.hypot(x, y) - self.cone(z), self._sign * (z - self._step), np.arctan2(y, x))


def _beside(body: Mesh, pose: Pose, step: float, sign: float, reach: float) -> Mesh | None:
    """Return the faces that rays or edges beside a sheet's end can meet, in its frame; None where there is none."""
    away = sign * (body.vertices @ np.array(pose.rotation[2]) + (pose.translation[2] - step))
    beyond, before = ((away > reach + _GRID_MARGIN)[body.faces], (away < -_GRID_MARGIN)[body.faces])
    near = ~(beyond.all(axis=1) | before.all(axis=1))
    return body.part(near).moved(pose) if near.any() else None


_LIP_ROWS = 61  # along the lip
_MAX_PLAY = 12  # columns of a degree; a collar that can be turned further does not show its azimuth


def _lip_play(
    link: _LinkExcess,
    lips: Sequence[tuple[Floats, Floats, Bools]],
    wanted: float,
    clearance: float,
    facets: float = 0.0,
) -> float | None:
    """Return the angle between the two positions in which a collar meets its link [rad]; None where there are none.

    The collar stays about the axis of its sheet, but for a shift by the clearance. Facets are the mesh's, not the
    link's: a collar that is held by nothing else does not show its azimuth. Of each lip there are the azimuths of its
    columns, evenly, its lengths there, and where tabs leave.
    """
    share = np.linspace(0.0, 1.0, _LIP_ROWS)
    ways = [_MAX_PLAY + 1, _MAX_PLAY + 1]
    for phi, lengths, tabs in lips:
        excess = link.over(share, np.full(len(phi), wanted), phi, 0.0)
        cone = link.cone(link.height(share * wanted))[:, None]
        inside = without_undercut(cone + excess + clearance, phi) + max(clearance, facets)
        inside = np.where((share[:, None] * wanted <= lengths) & ~tabs, inside, np.inf)
        radius = cone + excess
        for way, (held, met) in enumerate(((inside, radius), (inside[:, ::-1], radius[:, ::-1]))):
            for columns in range(1, ways[way]):
                if (met[:, columns:] > held[:, :-columns]).any():
                    ways[way] = columns
                    break
    width = float(lips[0][0][1] - lips[0][0][0])
    return None if max(ways) > _MAX_PLAY else sum(ways) * width


_COLUMN_STEP = math.radians(1.0)  # step around the axis; an arc of 100 mm then lies 0.004 mm beside its chord
_ROW_STEP = 2e-3  # m; step along the axis where the lip follows a mesh
_STOP_ROW = 0.25e-3  # m; step by which the end of a lip before what stands out is found
_FLUSH_DISTANCE = 40e-3  # m; an outermost face nearer than this is the datum of the lip
_MAX_RISE = 8e-3  # m; what stands out further from the cone is not gripped: the lip ends before it
_MIN_LIP_PIECE = 1e-3  # m; a lip is left out where it would be shorter
_WIRES_MET = "the tabs or wires of {0} are in the way: mark the line of the rim, and push the sheet against that"
_FLUSH_RIM = 0.5e-3  # m; an end so near to the rim is flush with it
_MIN_LIP = 4e-3  # m; a lip that is shorter everywhere holds nothing
_SLOT_WIDTH = 4e-3  # m; between the parts, so that the seam is seen and a strap pulls them tight
_CHANNEL_HEIGHT = 8e-3  # m; height of the way out for tabs with their wires
_TAB_ROOM = 3e-3  # m; on both sides of the tabs
_SEAT_RIM_WIDTH, _SEAT_RIM_HEIGHT = 2e-3, 1.5e-3  # m; width of the rims that keep a strap on its seat, and their height
_NOTCH_DEPTH = 1e-3  # m; depth of the grooves that number a part
_LEAST_RADIUS = 4e-3  # m; a cone is not followed nearer to its apex
_MIN_CONE_COSINE = 0.5  # cosine of the half angle; a collar around a flatter cone has nothing to grip


@dataclass(frozen=True, slots=True, eq=False)
class _CollarPart:
    """One printed part of a collar, standing on its wide face; z is the axis of the sheet.

    Parts are numbered from 1, anticlockwise from edge 0 as seen from end 2, and have as many grooves on the outside.
    """

    number: int
    start: float
    end: float
    surface: Trimesh


@dataclass(frozen=True, slots=True, eq=False)
class Collar:
    """The collar at one end of a sheet.

    Attributes:
        end: 1 or 2.
        parts: to be printed.
        lip: greatest length of the lip on the link [m].
        flush: the lip ends flush with the outermost face of the link.
        stopped: the edge of the lip lies against a part of the link that stands out.
        play: angle by which it can be turned until its lip meets a part of the link on the other side [rad]; None
            where the link does not show its azimuth.
        before: from the outermost face of the link to the edge of the lip, along the axis [m]; None without a mesh.
        pose: of its parts, as they are printed, about the sheet.
    """

    end: int
    parts: tuple[_CollarPart, ...]
    lip: float
    flush: bool
    stopped: bool
    play: float | None
    before: float | None
    pose: Pose

    def slug(self, part: _CollarPart) -> str:
        """Return the name of the file of a part."""
        return f"end-{self.end}-part-{part.number}"


def jig_collars(
    design: SheetDesign,
    mesh: Mesh | None = None,
    others: Sequence[SheetDesign] = (),
    neighbors: Sequence[SheetDesign] = (),
) -> tuple[tuple[Collar, ...], tuple[str, ...]]:
    """Make the collars of a sheet.

    Args:
        design: the sheet.
        mesh: of the link, in the frame of the sheets; None where it is known by its dimensions only.
        others: sheets that are on the link already when this one is put on.
        neighbors: all sheets of the link.

    Returns:
        the collars, and a sentence for each end that has none.
    """
    plan = design.options.jig
    if plan.surface == "none":
        return (), ()
    if design.place.bends:
        return (), (f"{design.name} lies on a link that is not round, for which no jig is made: measure its place",)
    if design.above:
        return (), (f"{design.name} lies on {design.above}, whose ends and seam show its place",)
    if design.place.frustum.cos_half_angle < _MIN_CONE_COSINE:
        return (), (f"{design.name} is too flat for collars: weigh it down with a board of its shape",)
    collars: list[Collar] = []
    without: list[str] = []
    body = None if mesh is None or plan.surface == "cone" else with_sheets(mesh, others)
    for end in (1, 2):
        if why := _blocked(design, neighbors, end):
            without.append(f"at end {end} {why}")
            continue
        try:
            collars.append(_Builder(design, mesh, body, end).collar())
        except _NoRoomError as exc:
            without.append(str(exc))
    return tuple(collars), tuple(without)


class _NoRoomError(Exception):
    """There is no room for a lip."""


class _Builder:
    """One collar in the making, in the frame of the sheet; ``s`` runs outwards along the axis from the sheet's end."""

    def __init__(self, design: SheetDesign, mesh: Mesh | None, body: Mesh | None, end: int) -> None:
        self.design, self.plan, self.end = design, design.options.jig, end
        self.side = design.place.frustum
        thickness = design.options.stack.thickness
        self.outer = design.place.parallel(thickness).frustum
        lift = thickness * self.side.sin_half_angle  # the outer face is moved by it towards end 1
        self.sign = -1.0 if end == 1 else 1.0
        sheet_end = min(0.0, -lift) if end == 1 else self.side.height + max(0.0, -lift)
        self.step = sheet_end + self.sign * self.plan.clearance
        self.rim: float | None = None  # from the end of the sheet to the rim of the link [m]
        self.room: float | None = None  # the same from the step
        pose = design.place.link_frustum.inverse()
        if mesh is not None:
            z = self.sign * (mesh.vertices @ np.array(pose.rotation[2]) + pose.translation[2])
            self.rim = float(z.max()) - (0.0 if end == 1 else self.side.height)
            self.room = float(z.max()) - self.sign * self.step
        self.flush = self.room is not None and _MIN_LIP <= self.room <= _FLUSH_DISTANCE
        self.wanted = self.room if self.flush and self.room is not None else self.plan.grip
        self.link = _LinkExcess(self.side, self.step, self.sign, self.wanted + self.plan.clearance, body, pose)

    def collar(self) -> Collar:
        """Return the collar.

        Raises:
            _NoRoomError: the link stands out, or ends, where the lip would be.
        """
        wanted = self.wanted
        taper = self.sign * (self.side.radius2 - self.side.radius1) / self.side.height
        if taper < 0.0:  # the cone ends at its apex
            wanted = min(wanted, (float(self.link.cone(self.step)) - _LEAST_RADIUS) / -taper)
        if self.room is not None:
            wanted = min(wanted, self.room)
        if wanted < _MIN_LIP:
            if self.rim is None or self.rim < _FLUSH_RIM:
                raise _NoRoomError(f"end {self.end} lies where the link ends: keep the sheet flush with its rim")
            raise _NoRoomError(
                f"end {self.end} lies {1e3 * self.rim:.1f} mm before the outermost place of the link, too little for a "
                "lip: place it by the distances above"
            )
        spans = self._spans()
        free = [self._lip_lengths(np.linspace(*span), wanted) for span in spans]
        longest = max(float(lengths.max()) for lengths in free)
        if longest < _MIN_LIP:
            raise _NoRoomError(f"the link stands out right at end {self.end}: push the sheet against it there")
        shortest = min(float(lengths.min()) for lengths in free)
        stopped = shortest < wanted - 1e-9
        parts, lips = [], []
        for number, ((start, stop, _), lengths) in enumerate(zip(spans, free, strict=True), 1):
            phi = np.linspace(start, stop, len(lengths))
            parts.append(_CollarPart(number, start, stop, self._part(phi, lengths, number)))
            lips.append((phi, lengths, self._above_tabs(phi)))
        facets = 0.0 if self.design.fit is None else self.design.fit.facet_height
        play = _lip_play(self.link, lips, wanted, self.plan.clearance, facets)
        reached = self.flush and longest > wanted - 1e-9
        before = None if self.room is None else self.room - longest
        turned = Pose.from_xyz_rpy(
            (0.0, 0.0, self.step - self.sign * self.plan.reach), (math.pi * (self.end == 1), 0, 0)
        )
        return Collar(self.end, tuple(parts), longest, reached, stopped, play, before, turned)

    def _spans(self) -> list[tuple[float, float, int]]:
        """Return start, end and number of columns of each part."""
        wrap, radius = self.side.wrap, min(self.outer.radius1, self.outer.radius2)
        if wrap > math.tau - 0.5:
            middle, count, whole = 0.5 * (wrap - math.tau), self.plan.parts, math.tau  # of the seam
        else:
            middle, count, whole = 0.0, max(1, math.ceil(wrap / math.pi - 1e-9)), wrap
            count = max(count, self.plan.parts if wrap > math.pi else 1)
        half = 0.5 * _SLOT_WIDTH / radius
        spans = []
        for k in range(count):
            start, stop = middle + k * whole / count, middle + (k + 1) * whole / count
            start += half if k or whole == math.tau else 0.0
            stop -= half if k < count - 1 or whole == math.tau else 0.0
            spans.append((start, stop, max(4, math.ceil((stop - start) / _COLUMN_STEP)) + 1))
        return spans

    def _lip_lengths(self, phi: Floats, wanted: float) -> Floats:
        """Return the length of the lip at each azimuth [m]."""
        share = np.linspace(0.0, 1.0, max(2, math.ceil(wanted / _STOP_ROW)) + 1)
        standing = self.link.over(share, np.full(len(phi), wanted), phi, self.plan.clearance) > _MAX_RISE
        first = np.where(standing.any(axis=0), standing.argmax(axis=0), len(share))
        before = wanted * share[np.clip(first - 1, 0, len(share) - 1)] - self.plan.clearance
        free = np.where(first < len(share), before, wanted)
        free = -widest_nearby(-free[None], 0, 1)[0]
        return np.where(free < _MIN_LIP_PIECE, 0.0, free)

    def _part(self, phi: Floats, lengths: Floats, number: int) -> Trimesh:
        """Return the shell of one part."""
        plan = self.plan
        count = max(2, math.ceil(float(lengths.max()) / _ROW_STEP)) + 1
        share = np.linspace(1.0, 0.0, count)[:, None]
        # without a lip the part ends before the step: what stands out may begin at the sheet itself
        start = np.where(lengths > 0.0, 0.0, 2.0 * plan.clearance)
        lip_z = self.step + self.sign * (share * lengths - start)
        cone = self.link.cone(lip_z)
        excess = self.link.over(share[::-1, 0], lengths, phi, plan.clearance)[::-1]
        lip = cone + widest_nearby(excess, 1, 1) + plan.clearance
        lip = np.minimum(lip, cone + _MAX_RISE + plan.wall)  # where there is no lip, no wall either
        lip = np.where(self._above_tabs(phi), np.maximum(lip, cone + _CHANNEL_HEIGHT), lip)
        rim = _SEAT_RIM_WIDTH
        into = np.array([0.0, rim, rim, plan.reach - rim, plan.reach - rim, plan.reach])
        sleeve_z = self.step - self.sign * np.maximum(into[:, None], start)
        slope = (self.outer.radius2 - self.outer.radius1) / self.outer.height
        lifted = sleeve_z + self.design.options.stack.thickness * self.side.sin_half_angle
        sleeve = self.outer.radius1 + slope * lifted + plan.clearance
        z, inside = np.concatenate([lip_z, sleeve_z]), np.concatenate([lip, sleeve])
        inside = without_undercut(inside, phi)
        inside[:count] = np.where(lengths > 0.0, inside[:count], inside[count])  # no lip: the step is the end there
        near = np.abs(z[:, None] - z[None]) <= plan.wall
        outside = np.where(near, inside[None], 0.0).max(axis=1)
        beside = max(1, math.ceil(plan.wall / (float(inside.min()) * _COLUMN_STEP)))
        outside = widest_nearby(outside, 0, beside) + plan.wall
        seat = max(float(outside[-6:].max()), float((sleeve + plan.wall).max()))
        outside[-6:] = seat
        outside[[-6, -5, -2, -1]] += _SEAT_RIM_HEIGHT
        outside[:count] = np.where(lengths > 0.0, outside[:count], outside[count])
        notched = np.zeros(len(phi), bool)
        for k in range(number):
            notched[4 + 6 * k : 8 + 6 * k] = len(phi) > 12 + 6 * k
        outside = np.where(notched, outside - _NOTCH_DEPTH, outside)
        z = self.sign * (z - self.step)
        z = z - z.min()
        flip = self.sign  # end 1 is turned over, so that both kinds stand on their sleeve
        inner, outer = (
            np.stack([radius * np.cos(phi), flip * radius * np.sin(phi), z], axis=-1) for radius in (inside, outside)
        )
        return shell_surface(inner, outer)

    def _above_tabs(self, phi: Floats) -> Bools:
        """Tell at which azimuths tabs leave under the lip."""
        radius = self.side.radius1 if self.end == 1 else self.side.radius2
        tabs = [
            tab
            for foil in self.design.layout.foils.values()
            for tab in foil
            if isinstance(tab, ShapeTab) and tab.side == f"end{self.end}"
        ]
        near = np.zeros(len(phi), bool)
        for tab in tabs:
            away = np.abs((phi - tab.phi + math.pi) % math.tau - math.pi)
            near |= away < (0.5 * tab.width + _TAB_ROOM) / radius + _COLUMN_STEP
        return near
