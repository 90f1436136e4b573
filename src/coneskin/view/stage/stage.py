"""Stage: what is drawn once and then only moved: the arm's solids, and the sheets as they lie on its links.

The solids of an arm are made from its tables (``solids``): their axes are exact, how thick they are is not. Where a
sheet truly lies, its scene says. So a solid that hides one is at fault: that part is drawn so that you see through it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from coneskin.core.arrays import Floats, Ints
from coneskin.geometry.pose import Pose, Vector
from coneskin.robot.arm.kinematics import MESHED_ARMS, dh_mesh, link_index, link_poses
from coneskin.robot.arm.model import ArmModel
from coneskin.scene.build import SensorOnArm
from coneskin.scene.values.scene import Scene
from coneskin.skin.sensor import Sensor

from .solids import Solid, arm_solids, body_solids, put_together

_SHEET_HEIGHT = 0.0015  # m above the sensed surface: sheets are that thick, and no link is to shine through
_MAX_SAGITTA = 0.0005  # m by which a flat piece may lie below the round side, so that the link does not shine through
_VERTEX_DISTANCE = 0.008  # m between two vertices along a side that is not straight, about
_MAX_VERTICES = 96  # vertices along or around
_RIM_WIDTH, _RIM_ABOVE = 0.005, 0.0006  # m; of the band that shows where the active area ends, above the sheet


class SheetSurface(NamedTuple):
    """Active area of a sensor."""

    name: str  #: of the sensor
    link: int  #: index of the DH frame that it moves with
    vertices: Floats  #: in that frame [m], shape (n, 3)
    faces: Ints  #: indices of vertices, shape (m, 3)
    rim_vertices: Floats  #: of a narrow band inside of the active area's edges, in that frame [m], shape (k, 3)
    rim_faces: Ints  #: indices of those vertices, shape (l, 3)
    touch_level: float  #: from which the sensor is touched
    slimmest: float  #: the least radius of its link there [m]
    sensor: Sensor  #: with its electronics, and what force its level stands for
    item: SensorOnArm  #: its place on the arm

    @classmethod
    def of(cls, item: SensorOnArm, sensor: Sensor) -> SheetSurface:
        """Return the active area of a sensor at its place on the arm, in the DH frame of its link."""
        cone = item.frustum.frustum
        largest = max(cone.radius1, cone.radius2)
        straight = item.surface is None  # a mesh lies below another sheet, and is not quite a cone
        u = np.linspace(0.0, cone.slant, 2 if straight else _count(cone.slant / _VERTEX_DISTANCE, 8))
        step = 2.0 * math.acos(1.0 - min(_MAX_SAGITTA / largest, 1.0)) if straight else _VERTEX_DISTANCE / largest
        phi = np.linspace(0.0, cone.wrap, _count(cone.wrap / step, 24))
        vertices, faces = _strip(item, u, phi, _SHEET_HEIGHT)
        width, turn = min(_RIM_WIDTH, cone.slant), min(_RIM_WIDTH / largest, cone.wrap)
        bands = [(u[[0]] + (0.0, width), phi), (u[[-1]] - (width, 0.0), phi)]
        bands += [(u, phi[[0]] + (0.0, turn)), (u, phi[[-1]] - (turn, 0.0))]
        rim = put_together([_strip(item, along, around, _SHEET_HEIGHT + _RIM_ABOVE) for along, around in bands])
        level, slimmest = sensor.thresholds.touch_level, 0.97 * min(cone.radius1, cone.radius2)
        return cls(item.name, item.link, vertices, faces, *rim, level, slimmest, sensor, item)


def _strip(item: SensorOnArm, u: Floats, phi: Floats, above: float) -> tuple[Floats, Ints]:
    """Return vertices and faces of the part of a side between places, so far above what is sensed [m]."""
    rows, columns = np.meshgrid(u, phi, indexing="ij")
    points, normals = item.frustum.place(rows, columns)
    if item.surface is not None:
        flat = zip(rows.ravel().tolist(), columns.ravel().tolist(), strict=True)
        points = np.array([item.surface.point(a, b) for a, b in flat]).reshape(points.shape)
    index = np.arange(rows.size).reshape(rows.shape)
    a, b, c, d = index[:-1, :-1].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return (points + above * normals).reshape(-1, 3), faces


def _count(pieces: float, least: int) -> int:
    return min(max(math.ceil(pieces) + 1, least), _MAX_VERTICES)


CLEAR = 0.3  #: opacity of a solid in which part of a sheet is buried
_MIN_HIDDEN_SHARE = 0.005  # share of a sheet from which on it counts
_ROWS, _COLUMNS = 16, 48  # places of a sheet that are looked at


def _clear_where_buried(
    solids: Sequence[Solid], sheets: Sequence[SheetSurface], poses: Mapping[int, Pose]
) -> tuple[Solid, ...]:
    """Return solids, those clear in which a sheet on their link or a neighbour is buried.

    Neighbours turn about the axis of their joint, and so does each solid about it: one pose of the arm stands for all.
    """
    found = []
    for solid in solids:
        near = [sheet for sheet in sheets if solid.closed and abs(sheet.link - solid.link) <= 1]
        hides = any(_share_inside(solid, _places(sheet, poses, solid.link)) > _MIN_HIDDEN_SHARE for sheet in near)
        found.append(solid._replace(opacity=CLEAR) if hides else solid)
    return tuple(found)


def _places(sheet: SheetSurface, poses: Mapping[int, Pose], link: int) -> Floats:
    """Return places all over a sheet, in the frame of a link [m], shape (n, 3)."""
    cone = sheet.item.frustum.frustum
    u, phi = np.meshgrid(np.linspace(0.0, cone.slant, _ROWS), np.linspace(0.0, cone.wrap, _COLUMNS), indexing="ij")
    points, _ = sheet.item.frustum.place(u, phi)
    here = poses[sheet.link].apply_all(points.reshape(-1, 3))
    return np.asarray(poses[link].inverse().apply_all(here))


def _share_inside(solid: Solid, points: Floats) -> float:
    """Return which share of points is inside of a solid, which is convex as all that is closed here."""
    a, b, c = (solid.vertices[solid.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    behind = points @ normals.T < np.einsum("ij,ij->i", a, normals)
    return float(behind.all(axis=1).mean())


SPACING = 0.25  #: m between two lines
_LINE_WIDTH = 0.006  # m; from 2 m off still more than a pixel


def floor_lines(reach: float) -> tuple[Floats, Ints]:
    """Return vertices [m] and faces, seen from above, of lines as far as twice an arm's reach [m] each way."""
    count = max(1, math.ceil(2.0 * reach / SPACING))
    at, end, half = SPACING * np.arange(-count, count + 1), SPACING * count, 0.5 * _LINE_WIDTH
    corners = [np.stack([at + side, np.full_like(at, far)], axis=1) for far in (-end, end) for side in (-half, half)]
    across = np.stack(corners, axis=1)  # lines along y: near left, near right, far left, far right
    along = across[..., ::-1][:, [0, 2, 1, 3]]  # the same along x
    flat = np.concatenate([across, along]).reshape(-1, 2)
    first = 4 * np.arange(2 * len(at))[:, None, None]
    faces = (first + np.array([(0, 1, 3), (0, 3, 2)])).reshape(-1, 3)
    return np.column_stack([flat, np.zeros(len(flat))]), faces


#: joint positions of an arm of which nothing has been measured [rad]: it stands upright, its elbow bent
REST = (0.0, -1.5708, 1.2, -1.2, -1.5708, 0.0)
_SHELL_COLOUR = (201, 205, 210)


@dataclass(frozen=True, slots=True)
class Stage:
    """What is drawn once."""

    title: str  #: for people
    model: ArmModel | None  #: of the arm; None where the scene has none
    solids: tuple[Solid, ...]  #: of the arm
    sheets: tuple[SheetSurface, ...]  #: on it
    bodies: tuple[Solid, ...] = ()  #: around it, part by part, in the base frame where the scene puts them
    starts: tuple[Vector, ...] = ()  #: the places of those parts there [m]

    @property
    def links(self) -> tuple[int, ...]:
        """Indices of the frames that something moves with."""
        return tuple(sorted({0, *(solid.link for solid in self.solids), *(sheet.link for sheet in self.sheets)}))

    @property
    def reach(self) -> float:
        """How far anything can be from the base [m]."""
        if self.model is not None:
            return sum(map(abs, self.model.a)) + sum(map(abs, self.model.d))
        return max((float(abs(sheet.vertices).max()) for sheet in self.sheets), default=1.0)

    def poses(self, q: Sequence[float] | None) -> dict[int, Pose]:
        """Return the pose in the base frame of each link's frame at joint positions q [rad]; None: at rest."""
        if self.model is None:
            return {link: Pose() for link in self.links}
        found = link_poses(self.model, REST if q is None else q)
        return {link: found[link] for link in self.links}

    def moved(self, places: Sequence[Vector]) -> tuple[Vector, ...]:
        """Return how far each part of a body is from where the scene puts it [m]: nowhere, unless all are told."""
        if len(places) != len(self.starts):
            return ((0.0, 0.0, 0.0),) * len(self.starts)
        return tuple((x - x0, y - y0, z - z0) for (x, y, z), (x0, y0, z0) in zip(places, self.starts, strict=True))


def set_stage(scene: Scene, placed: Sequence[SensorOnArm], title: str, meshes: bool = False) -> Stage:
    """Return the stage for a scene.

    Args:
        placed: its sensors, as of ``place_on_arm``.
        meshes: open the mesh files that the scene names, instead of making the link's solids from the arm's tables.

    Raises:
        KinematicsError: nobody knows where the tubes of the arm are.
        MeshError: a mesh cannot be read.
    """
    sheets = tuple(SheetSurface.of(*pair) for pair in zip(placed, (one.sensor for one in scene.sensors), strict=True))
    bodies, starts = tuple(body_solids(scene.bodies)), tuple(place for body in scene.bodies for place in body.parts)
    if scene.arm is None:
        return Stage(title, None, (), sheets, bodies, starts)
    model = scene.arm.arm_model
    slimmest: dict[int, float] = {}
    for sheet in sheets:
        slimmest[sheet.link] = min(sheet.slimmest, slimmest.get(sheet.link, sheet.slimmest))
    solids = arm_solids(model, slimmest) if model.name in MESHED_ARMS else ()
    if meshes:
        own = _link_meshes(scene, model)
        solids = (*(solid for solid in solids if solid.link not in {mesh.link for mesh in own}), *own)
    stage = Stage(title, model, tuple(solids), sheets, bodies, starts)
    return replace(stage, solids=_clear_where_buried(solids, sheets, stage.poses(None)))


def _link_meshes(scene: Scene, model: ArmModel) -> list[Solid]:
    """Return the meshes of the links that name one, in the DH frames."""
    found = []
    for link in scene.links:
        if link.mesh is not None:
            from coneskin.geometry.mesh import load_mesh

            mesh = load_mesh(link.mesh).moved(dh_mesh(model, link.name))
            faces = np.asarray(mesh.faces)
            found.append(
                Solid(f"{link.name}, mesh", link_index(link.name), np.asarray(mesh.vertices), faces, _SHELL_COLOUR)
            )
    return found
