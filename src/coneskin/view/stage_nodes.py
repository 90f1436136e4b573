"""Nodes of a stage in a page's scene: made once, then moved and coloured for each moment."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from coneskin.geometry.pose import Pose, Vector

from .stage.level_scale import SHEET_COLOURS, level_colour
from .stage.solids import Solid, joined, revolve
from .stage.stage import Stage, floor_lines

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from coneskin.core.arrays import Floats, Ints
    from coneskin.geometry.placed_frustum import PlacedFrustum

    from .page_server import PageServer
    from .run_course import ContactMark, Moment, RunCourse

_MARKS_PER_LINK = 6  # nodes for contacts on each link with a sheet, used again and again
LOCATED = (214, 70, 224)  #: colour of a mark whose place is certain
_UNCERTAIN, _PAST = (249, 115, 22), (150, 143, 138)
_FLOOR, _RIM = (175, 175, 180), (150, 180, 205)
_ARROW_LENGTH = 0.14  # m; length of the arrow along the normal
_MIN_HALF_AXIS = 0.004  # m; half axes of an ellipse that can still be seen
_RING_RADII = 0.021, 0.026  # m; of the ring about it, which is seen from across a room
_MARK_HEIGHT = 0.003  # m above the place
_FADE_STEPS = 8  # steps in which a mark fades
_SEGMENT_COUNT = 32


def light_plainly(scene: Any) -> None:
    """Set two plain lights in the place of viser's own.

    Reflections of its surroundings and shadows of three cascades cost two thirds of a picture where a processor draws
    it (measured at 13b7922).

    Args:
        scene: viser's ``SceneApi``.
    """
    scene.configure_environment_map(hdri=None)
    scene.configure_default_lights(enabled=False, cast_shadow=False)
    scene.add_light_hemisphere("/sky", sky_color=(255, 255, 255), ground_color=(150, 150, 160), intensity=2.0)
    scene.add_light_directional("/sun", intensity=2.2, position=(1.5, -2.0, 3.0), cast_shadow=False)


def look_at_stages(server: PageServer, reach: float, count: int = 1) -> None:
    """Draw the floor, set the lights, and set from where a new viewer looks.

    Args:
        reach: how far anything can be from its base [m].
        count: stages side by side.
    """
    away = 0.6 * reach
    if count == 1:
        server.look_from((-away, -away, 0.7 * reach), (-0.1 * reach, 0.0, 0.3 * reach))  # most arms work to that side
    else:  # from in front, so that none stands before another
        server.look_from((-away * (0.7 + count), 0.0, 0.7 * reach), (0.0, 0.0, 0.28 * reach))
    light_plainly(server.scene)
    lines, faces = floor_lines(reach)
    _add_mesh(server.scene, "/floor", _single(lines), faces, _FLOOR)


class StageNodes:
    """Nodes of one stage.

    Args:
        scene: viser's ``SceneApi``, of a server or of one viewer.
        root: name of the node above them, such as "/run".
        offset: where the base stands on the floor [m].
    """

    def __init__(self, scene: Any, stage: Stage, root: str = "/run", offset: Vector = (0.0, 0.0, 0.0)) -> None:
        self._stage = stage
        scene.add_frame(root, show_axes=False, position=offset)
        self._frames = {link: scene.add_frame(f"{root}/link {link}", show_axes=False) for link in stage.links}
        for solid in joined(stage.solids):
            _add_solid(scene, f"{root}/link {solid.link}/{_node(solid.name)}", solid)
        self._poses: dict[int, Pose] = {}
        self._bodies = []
        for number, body in enumerate(stage.bodies):
            self._bodies.append(scene.add_frame(f"{root}/body {number}", show_axes=False))
            _add_solid(scene, f"{root}/body {number}/{_node(body.name)}", body)
        self._sheets = {}
        self._colours: dict[str, tuple[int, int, int]] = {}
        for number, sheet in enumerate(stage.sheets):
            name = f"{root}/link {sheet.link}/sheet {number} {_node(sheet.name)}"
            self._colours[sheet.name] = _RIM
            _add_mesh(scene, name, *_both_sides(sheet.vertices, sheet.faces), SHEET_COLOURS[0])
            rim = _both_sides(sheet.rim_vertices, sheet.rim_faces)  # it tells the level: the sheet's face has the place
            self._sheets[sheet.name] = _add_mesh(scene, f"{name}/active area", *rim, _RIM)
        links = sorted({sheet.link for sheet in stage.sheets})
        self._marks = {
            link: [_MarkNodes(scene, f"{root}/link {link}/contact {k}") for k in range(_MARKS_PER_LINK)]
            for link in links
        }
        self._sheet_of = {sheet.name: sheet for sheet in stage.sheets}

    def show(self, moment: Moment) -> None:
        """Move and colour the nodes; what has not changed is not sent."""
        for link, frame in self._frames.items():
            if (pose := moment.poses[link]) != self._poses.get(link):
                self._poses[link] = pose
                frame.wxyz, frame.position = pose.quaternion, pose.translation
        for frame, moved in zip(self._bodies, moment.bodies, strict=True):
            frame.position = moved
        for sheet in self._stage.sheets:
            level = moment.levels[sheet.name]
            colour = level_colour(level, sheet.touch_level) if level >= sheet.touch_level else _RIM
            if colour != self._colours[sheet.name]:
                self._colours[sheet.name] = self._sheets[sheet.name].color = colour
        left = {link: list(nodes) for link, nodes in self._marks.items()}
        for mark in moment.marks:
            touched = self._sheet_of.get(mark.sensor)
            if touched is not None and (nodes := left[touched.link]):
                nodes.pop(0).show(mark, touched.item.frustum)
        for nodes in left.values():
            for node in nodes:
                node.hide()


def nodes_of_runs(scene: Any, courses: Sequence[RunCourse]) -> list[StageNodes]:
    """Return the nodes of runs, each below a node of its number: "/run 1", "/run 2" ..."""
    return [StageNodes(scene, item.stage, f"/run {number}", item.offset) for number, item in enumerate(courses, 1)]


class _MarkNodes:
    """Nodes of one contact: the arrow along its normal, and on the sheet a ring and the ellipse of its uncertainty."""

    def __init__(self, scene: Any, name: str) -> None:
        self._scene, self._name = scene, name
        self._frame = scene.add_frame(name, show_axes=False, visible=False)
        self._drawn: ContactMark | None = None

    def show(self, mark: ContactMark, side: PlacedFrustum) -> None:
        fading = math.ceil(mark.strength * _FADE_STEPS)
        drawn = mark._replace(strength=fading)
        if drawn != self._drawn:
            self._drawn = drawn
            self._draw(mark, side, fading / _FADE_STEPS)
        self._frame.visible = True

    def hide(self) -> None:
        self._frame.visible = False

    def _draw(self, mark: ContactMark, side: PlacedFrustum, strength: float) -> None:
        colour = _PAST if strength < 1.0 else LOCATED if mark.located else _UNCERTAIN
        shade = None if strength >= 1.0 else 0.15 + 0.7 * strength
        arrow, faces = _arrow()
        there = Pose.along(mark.normal, mark.point)
        _add_mesh(
            self._scene, f"{self._name}/normal", _single(there.apply_all(arrow.astype(float))), faces, colour, shade
        )
        turn = np.linspace(0.0, 2.0 * math.pi, _SEGMENT_COUNT + 1)
        circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        ring = np.stack([radius * circle for radius in _RING_RADII])
        _add_mesh(self._scene, f"{self._name}/ring", *_on_sheet(side, mark.point, ring), colour, shade)
        disc = circle @ _half_axes(mark, side)
        uncertainty = _on_sheet(side, mark.point, np.stack([1e-3 * disc, disc]))
        _add_mesh(self._scene, f"{self._name}/uncertainty", *uncertainty, colour, shade)


def _add_mesh(
    scene: Any,
    name: str,
    vertices: NDArray[np.float32],
    faces: Ints,
    colour: tuple[int, int, int],
    opacity: float | None = None,
    side: str = "front",
) -> Any:
    look = {"color": colour, "opacity": opacity, "side": side, "cast_shadow": False, "receive_shadow": False}
    return scene.add_mesh_simple(name, vertices, faces, **look)


def _add_solid(scene: Any, name: str, solid: Solid) -> None:
    opacity = None if solid.opacity >= 1.0 else solid.opacity
    side = "front" if solid.closed else "double"
    _add_mesh(scene, name, _single(solid.vertices), solid.faces, solid.colour, opacity, side)


def _arrow() -> tuple[NDArray[np.float32], Ints]:
    head, shaft, width = 0.035, 0.0035, 0.010
    neck = _ARROW_LENGTH - head
    profile = [(0.0, 0.0), (shaft, 0.0), (shaft, neck), (width, neck), (0.0, _ARROW_LENGTH)]
    vertices, faces = revolve(profile, 16)
    return _single(vertices), faces


def _on_sheet(side: PlacedFrustum, point: Vector, rows: Floats) -> tuple[NDArray[np.float32], Ints]:
    """Return a band that lies on a sheet about a point.

    Args:
        point: in the same frame [m].
        rows: where the band's two edges are from there, along u and around [m], shape (2, n, 2).
    """
    u, phi, height = side.locate(point)
    around = phi + rows[..., 1] / max(side.frustum.radius_at(u), _MIN_HALF_AXIS)
    points, normals = side.place(u + rows[..., 0], around)
    k, count = np.arange(rows.shape[1] - 1), rows.shape[1]
    faces = np.concatenate([np.stack([k, k + 1, k + 1 + count], 1), np.stack([k, k + 1 + count, k + count], 1)])
    return _both_sides((points + (height + _MARK_HEIGHT) * normals).reshape(-1, 3), faces)


def _half_axes(mark: ContactMark, side: PlacedFrustum) -> Floats:
    """Return the half axes of a mark along u and around [m], shape (2, 2): long enough to be seen, or next to none."""
    if mark.ellipse is None or not mark.located:
        return 1e-3 * _MIN_HALF_AXIS * np.eye(2)
    u, phi, _ = side.locate(mark.point)
    points, _ = side.place(np.array([u, u + 1e-4, u]), np.array([phi, phi, phi + 1e-4]))
    ways = (points[1:] - points[0]) / np.linalg.norm(points[1:] - points[0], axis=1)[:, None]
    units, sizes, _ = np.linalg.svd((np.array(mark.ellipse) @ ways.T).T)
    return np.asarray((units * np.maximum(sizes, _MIN_HALF_AXIS)).T)


def _both_sides(vertices: Floats, faces: Ints) -> tuple[NDArray[np.float32], Ints]:
    """Return a surface that is seen from either side, as one of twice the faces.

    "side" of viser does the same by another program of the drawing process, whose making takes longer than drawing.
    """
    return np.concatenate([_single(vertices)] * 2), np.concatenate([faces, len(vertices) + faces[:, ::-1]])


def _single(values: Floats) -> NDArray[np.float32]:
    return values.astype("float32")


def _node(name: str) -> str:
    """Return a name as a node of the page's tree has it: a slash would begin a child."""
    return "".join("-" if letter in "/\\" else letter for letter in name)[:60]
