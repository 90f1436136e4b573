"""Nodes of a stage in a page's scene: made once, then moved and coloured for each moment."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from coneskin.geometry.pose import Vector

from .stage.level_scale import level_colour
from .stage.solids import along, joined, quaternion, revolve
from .stage.stage import floor_lines

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from coneskin.core.arrays import Floats, Ints

    from .contact_mark import ContactMark
    from .page_server import PageServer
    from .run_course import Moment
    from .stage.solids import Solid
    from .stage.stage import Stage

__all__ = ["StageNodes", "light_plainly", "look_at_stages"]

_MARKS_PER_LINK = 6  # nodes for contacts on each link with a sheet, used again and again
_LOCATED, _UNCERTAIN, _PAST = (192, 38, 211), (249, 115, 22), (120, 113, 108)
_FLOOR, _RIM = (175, 175, 180), (30, 33, 36)
_ARROW_LENGTH = 0.14  # m; length of the arrow along the normal
_MIN_HALF_AXIS = 0.004  # m; half axes of an ellipse that can still be seen
_FADE_STEPS = 8  # steps in which a mark fades
_SEGMENT_COUNT = 32


def light_plainly(scene: Any) -> None:
    """Set two plain lights in the place of viser's own.

    Reflections of its surroundings and shadows of three cascades cost two thirds of a picture where a processor draws
    it (bench/RESULTS.md).

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
        server: of the page.
        reach: how far anything can be from its base [m].
        count: stages side by side.
    """
    away = 0.5 * reach
    if count == 1:
        server.look_from((-away, -away, 0.6 * reach), (-0.1 * reach, 0.0, 0.3 * reach))  # most arms work to that side
    else:  # from in front, so that none stands before another
        server.look_from((-away * (0.7 + count), 0.0, 0.7 * reach), (0.0, 0.0, 0.28 * reach))
    light_plainly(server.scene)
    lines, faces = floor_lines(reach)
    _add_mesh(server.scene, "/floor", _single(lines), faces, _FLOOR)


class StageNodes:
    """Nodes of one stage.

    Args:
        scene: viser's ``SceneApi``, of a server or of one viewer.
        stage: what is drawn.
        root: name of the node above them, such as "/run".
        offset: where the base stands on the floor [m].
    """

    def __init__(self, scene: Any, stage: Stage, root: str = "/run", offset: Vector = (0.0, 0.0, 0.0)) -> None:
        self._stage = stage
        scene.add_frame(root, show_axes=False, position=offset)
        self._frames = {link: scene.add_frame(f"{root}/link {link}", show_axes=False) for link in stage.links}
        for solid in joined(stage.solids):
            _add_solid(scene, f"{root}/link {solid.link}/{_node(solid.name)}", solid)
        self._bodies = []
        for number, body in enumerate(stage.bodies):
            self._bodies.append(scene.add_frame(f"{root}/body {number}", show_axes=False))
            _add_solid(scene, f"{root}/body {number}/{_node(body.name)}", body)
        self._sheets = {}
        self._colours: dict[str, tuple[int, int, int]] = {}
        for number, sheet in enumerate(stage.sheets):
            name = f"{root}/link {sheet.link}/sheet {number} {_node(sheet.name)}"
            colour = self._colours[sheet.name] = level_colour(0.0, sheet.touch_level)
            self._sheets[sheet.name] = _add_mesh(scene, name, *_both_sides(sheet.vertices, sheet.faces), colour)
            _add_mesh(scene, f"{name}/active area", *_both_sides(sheet.rim_vertices, sheet.rim_faces), _RIM)
        links = sorted({sheet.link for sheet in stage.sheets})
        self._marks = {
            link: [_MarkNodes(scene, f"{root}/link {link}/contact {k}") for k in range(_MARKS_PER_LINK)]
            for link in links
        }
        self._link_of = {sheet.name: sheet.link for sheet in stage.sheets}

    def show(self, moment: Moment) -> None:
        """Move and colour the nodes; what has not changed is not sent."""
        for link, frame in self._frames.items():
            pose = moment.poses[link]
            frame.wxyz, frame.position = quaternion(pose), pose.translation
        for frame, moved in zip(self._bodies, moment.bodies, strict=True):
            frame.position = moved
        for sheet in self._stage.sheets:
            colour = level_colour(moment.levels[sheet.name], sheet.touch_level)
            if colour != self._colours[sheet.name]:
                self._colours[sheet.name] = self._sheets[sheet.name].color = colour
        left = {link: list(nodes) for link, nodes in self._marks.items()}
        for mark in moment.marks:
            nodes = left.get(self._link_of.get(mark.sensor, -1))
            if nodes:
                nodes.pop(0).show(mark)
        for nodes in left.values():
            for node in nodes:
                node.hide()


class _MarkNodes:
    """Nodes of one contact: its ball, the arrow along its normal, and the ellipse of its uncertainty."""

    def __init__(self, scene: Any, name: str) -> None:
        self._scene, self._name = scene, name
        self._frame = scene.add_frame(name, show_axes=False, visible=False)
        self._drawn: tuple[Any, ...] | None = None
        self._parts: list[Any] = []

    def show(self, mark: ContactMark) -> None:
        fading = math.ceil(mark.strength * _FADE_STEPS)
        drawn = (mark._replace(strength=fading, level=0.0),)
        if drawn != self._drawn:
            self._drawn = drawn
            self._draw(mark, fading / _FADE_STEPS)
        self._frame.visible = True

    def hide(self) -> None:
        self._frame.visible = False

    def _draw(self, mark: ContactMark, strength: float) -> None:
        colour = _PAST if strength < 1.0 else _LOCATED if mark.located else _UNCERTAIN
        shade = None if strength >= 1.0 else 0.15 + 0.7 * strength
        self._frame.position, self._frame.wxyz = mark.point, quaternion(along(mark.normal))
        arrow, faces = _arrow()
        _add_mesh(self._scene, f"{self._name}/normal", arrow, faces, colour, shade)
        _add_mesh(
            self._scene, f"{self._name}/uncertainty", *_both_sides(*_ellipse(mark)), colour, 0.55 * (shade or 1.0)
        )


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
    profile = [
        (0.0, 0.0),
        (shaft, 0.0),
        (shaft, _ARROW_LENGTH - head),
        (width, _ARROW_LENGTH - head),
        (0.0, _ARROW_LENGTH),
    ]
    vertices, faces = revolve(profile, 16)
    return _single(vertices), faces


def _ellipse(mark: ContactMark) -> tuple[Floats, Ints]:
    """Return the ellipse of a mark in its own frame; a small disc where nothing is known of its size."""
    import numpy as np

    back = along(mark.normal).inverse()
    axes = mark.ellipse or ((_MIN_HALF_AXIS, 0.0, 0.0), (0.0, _MIN_HALF_AXIS, 0.0))
    first, second = (np.array(back.rotate(axis) if mark.ellipse else axis) for axis in axes)
    first, second = _visible(first), _visible(second)
    turn = np.linspace(0.0, 2.0 * math.pi, _SEGMENT_COUNT, endpoint=False)[:, None]
    rim = np.cos(turn) * first + np.sin(turn) * second + (0.0, 0.0, 0.004)
    vertices = np.concatenate([[[0.0, 0.0, 0.004]], rim])
    k = np.arange(_SEGMENT_COUNT)
    return vertices, np.column_stack([np.zeros_like(k), 1 + k, 1 + (k + 1) % _SEGMENT_COUNT])


def _both_sides(vertices: Floats, faces: Ints) -> tuple[NDArray[np.float32], Ints]:
    """Return a surface that is seen from either side, as one of twice the faces.

    "side" of viser does the same by another program of the drawing process, whose making takes longer than drawing.
    """
    import numpy as np

    return np.concatenate([_single(vertices)] * 2), np.concatenate([faces, len(vertices) + faces[:, ::-1]])


def _visible(axis: Floats) -> Floats:
    import numpy as np

    length = float(np.linalg.norm(axis))
    return axis * max(1.0, _MIN_HALF_AXIS / length) if length > 0.0 else np.array((_MIN_HALF_AXIS, 0.0, 0.0))


def _single(values: Floats) -> NDArray[np.float32]:
    return values.astype("float32")


def _node(name: str) -> str:
    """Return a name as a node of the page's tree has it: a slash would begin a child."""
    return "".join("-" if letter in "/\\" else letter for letter in name)[:60]
