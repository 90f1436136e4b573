"""Pictures in space: a link with its sheets from two sides, what counts on it, and the printed parts of a jig.

Each is cast ray by ray, so that what is nearer hides what is behind it, and needs no fewer faces than there are. The
link shows where the sheets are, their ends, and the faces to measure from.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from coneskin.geometry.fit.bare_areas import BareArea
from coneskin.geometry.fit.touch_weights import TouchWeights
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.ray_casting import RayCaster

from .sheet_pictures import FOIL_COLOUR, INK_COLOUR
from .sheets.sheet_design import SheetDesign
from .workshop.jig import Collar
from .workshop.placement import DatumFace

_SHEET_COLOURS = ("#2a7fb8", "#d1495b", "#6a994e", "#8d5a97")
#: one for each reason why a part of a link is bare
_BARE_COLOURS = ("#c3c8d0", "#ecd28b", "#a9d6ad", "#dbb0d6", "#a8cbee", "#f2b79b", "#b5e0dd", "#d8d3a6")
_LINK_COLOUR = _BARE_COLOURS[0]
_REASON_VOTES = 15  # samples of the hull nearest to a place, of which most have its reason
_LABEL_BOX = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1.0}
_VIEW_PIXELS = 900  # of a view's longer side
_GRAZING_SHADE = 0.45  # of the brightness, in a face that the light grazes
_EDGE_DEPTH = 0.015  # of the size: a step in depth that is drawn as an edge
_CABLE_STEP = 2e-3  # m; between places of a cable that are drawn
_OUTLINE_LIFT = 2e-3  # m by which lines stand off a surface, which lies up to the tolerance above a sheet's side


class _View:
    """A body from far away, which hides what is behind it, drawn on a plane: x to the right, y up [mm]."""

    def __init__(self, body: Mesh, way: Any) -> None:
        self.way = np.asarray(way) / np.linalg.norm(way)
        right = np.cross((0.0, 0.0, 1.0) if abs(self.way[2]) < 0.99 else (0.0, 1.0, 0.0), self.way)
        right /= np.linalg.norm(right)
        self._screen = np.stack([right, np.cross(self.way, right)])
        self._body, self._rays = body, RayCaster(body)
        corners = self.flat(body.vertices)
        self.low, self.high = corners.min(axis=0), corners.max(axis=0)
        self.size = float((self.high - self.low).max())

    def flat(self, points: Any) -> Any:
        """Return where points [m] of shape (n, 3) are drawn [mm], shape (n, 2)."""
        return 1e3 * np.asarray(points) @ self._screen.T

    def sees(self, points: Any, normals: Any) -> Any:
        """Return which points [m] of surfaces face the viewer with nothing before them, shape (n,)."""
        seen = normals @ self.way > 0.02
        ways = np.broadcast_to(self.way, points.shape).copy()
        return seen & ~np.isfinite(self._rays.cast(points + _OUTLINE_LIFT * normals, ways)[0])

    def draw_line(self, axes: Any, points: Any, normals: Any, **style: Any) -> Any:
        """Draw a line on a surface where it is seen, and return where that is, shape (n,)."""
        seen = self.sees(points, normals)
        line = self.flat(points)
        line[~seen] = np.nan
        axes.plot(*line.T, **style)
        return seen

    def draw(self, axes: Any, colours: Callable[[Any, Any], Any], light: Any = None) -> None:
        """Draw the body, its edges, and a scale.

        Args:
            axes: of matplotlib.
            colours: from faces, shape (n,), and points on them [m], shape (n, 3), to red, green, blue, shape (n, 3).
            light: direction to the light; None for colours that mean something.
        """
        step = self.size / (_VIEW_PIXELS if self._rays.engine == "embree" else _VIEW_PIXELS // 3)
        x, y = (np.arange(low - step, high + 2.0 * step, step) for low, high in zip(self.low, self.high, strict=True))
        across, along = (part.reshape(-1, 1) for part in np.meshgrid(1e-3 * x, 1e-3 * y))
        far = 2.0 * float(np.abs(self._body.vertices).max())
        origins = across * self._screen[0] + along * self._screen[1] + far * self.way
        depth, face = self._rays.cast(origins, np.broadcast_to(-self.way, origins.shape).copy())
        hit = face >= 0
        picture = np.zeros((len(hit), 4))
        picture[hit, :3], picture[hit, 3] = colours(face[hit], origins[hit] - depth[hit, None] * self.way), 1.0
        if light is not None:
            bright = np.abs(self._body.normals_and_areas[0][face[hit]] @ (light / np.linalg.norm(light)))
            picture[hit, :3] *= (1.0 - _GRAZING_SHADE + _GRAZING_SHADE * bright)[:, None]
        shape = len(y), len(x)
        deep = np.where(hit, depth, 3.0 * far).reshape(shape)
        steps = [np.abs(np.diff(deep, axis=axis)) > 1e-3 * _EDGE_DEPTH * self.size for axis in (0, 1)]
        edge = np.pad(steps[0], ((0, 1), (0, 0))) | np.pad(steps[1], ((0, 0), (0, 1)))
        picture = picture.reshape((*shape, 4))
        picture[edge] = (0.25, 0.25, 0.25, 1.0)
        axes.imshow(
            picture, origin="lower", extent=(x[0], x[-1] + step, y[0], y[-1] + step), interpolation="antialiased"
        )
        axes.axis("off")
        corner = self.low - 0.12 * self.size
        length = max(n for n in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000) if n == 1 or n <= 0.3 * self.size)
        end = np.array([max(self.high[0], corner[0] + 0.25 * self.size + length), corner[1]])  # beside the frame
        axes.plot([end[0] - length, end[0]], [end[1]] * 2, color=INK_COLOUR, lw=2.0, solid_capstyle="butt")
        axes.text(end[0] - 0.5 * length, end[1] + 0.015 * self.size, f"{length} mm", ha="center", fontsize=9)
        axes.set(xlim=(corner[0] - 0.12 * self.size, end[0] + 0.05 * self.size))
        axes.set(ylim=(corner[1] - 0.12 * self.size, self.high[1] + 0.05 * self.size))

    def draw_frame(self, axes: Any) -> None:
        """Draw the directions of the frame."""
        corner = self.low - 0.12 * self.size
        for name, way in zip("xyz", 1e-3 * np.eye(3), strict=True):
            tip = corner + 0.1 * self.size * self.flat(way)
            axes.annotate("", tip, corner, arrowprops={"arrowstyle": "->", "shrinkA": 0, "shrinkB": 0})
            axes.text(*(corner + 0.13 * self.size * self.flat(way)), name, ha="center", va="center", fontsize=9)


def _body(parts: Iterable[Any]) -> tuple[Mesh, Any]:
    """Return triangles [m] of parts, each of shape (n, 3, 3), as one mesh, and the number of the part of each face."""
    shown, owner = [], []
    for number, triangles in enumerate(parts):
        a, b, c = np.asarray(triangles).transpose(1, 0, 2)
        flat = np.linalg.norm(np.cross(b - a, c - a), axis=1) <= 0.0  # at the tip of a cone
        shown.append(triangles[~flat])
        owner.append(np.full(np.count_nonzero(~flat), number))
    corners = np.concatenate(shown).reshape(-1, 3)
    return Mesh(corners, np.arange(len(corners)).reshape(-1, 3)), np.concatenate(owner)


def _palette(names: Sequence[str]) -> Any:
    from matplotlib.colors import to_rgb

    return np.array([to_rgb(name) for name in names])


def draw_link(
    figure: Any,
    designs: Sequence[SheetDesign],
    mesh: Mesh | None,
    areas: Sequence[BareArea] = (),
    faces: Sequence[DatumFace] = (),
) -> None:
    """Draw the link from two opposite sides, the first of which shows the seam of sheet 1.

    Args:
        figure: an empty figure of matplotlib, without a layout engine.
        designs: the sheets: outer faces in colour, electrodes as lines on them.
        mesh: of the link, drawn in grey; None where there is none.
        areas: what no sheet covers, by reason; each has a colour of its own.
        faces: flat faces of the link, drawn as outlines with their names.
    """
    first = designs[0].place.link_frustum
    body, owner = _body(
        [*(design.outer_triangles() for design in designs), *([] if mesh is None else [mesh.triangles])]
    )
    paints = _palette([_SHEET_COLOURS[index % 4] for index in range(len(designs))] + [_LINK_COLOUR])

    def colours(hit: Any, points: Any) -> Any:
        found = paints[owner[hit]]
        if areas:
            bare = owner[hit] == len(designs)
            found[bare] = _palette(_BARE_COLOURS)[_reasons(points[bare], areas) % len(_BARE_COLOURS)]
        return found

    for side, (x, y, z) in enumerate(((0.80, 0.45, 0.35), (-0.80, -0.45, -0.35))):
        # slightly from the side; once from above and once from below, so that both ends are seen
        axes = figure.add_axes((0.57 * side, 0.14, 0.45, 0.84))
        view = _View(body, first.rotate((x, y, z)))
        view.draw(axes, colours, np.array(first.rotate((x, -0.3 * y, 1.3 * z))))
        view.draw_frame(axes)
        for design in designs:
            _draw_electrodes(axes, design, view)
        for face in faces:
            _draw_face(axes, face, view)
        _name_ends(axes, designs, view)
    for number, area in enumerate(areas):
        label = f"bare, {area.share:.0%}: {area.reason}"
        axes.plot([], [], "s", color=_BARE_COLOURS[number % len(_BARE_COLOURS)], label=label)
    if areas:
        figure.legend(loc="lower center", fontsize="small", frameon=False)


def _reasons(points: Any, areas: Sequence[BareArea]) -> Any:
    """Return the numbers of the areas that places [m] of shape (n, 3) belong to: those of most samples near them."""
    from scipy.spatial import cKDTree

    owner = np.repeat(np.arange(len(areas)), [len(area.points) for area in areas])
    near = cKDTree(np.concatenate([area.points for area in areas])).query(points, min(_REASON_VOTES, len(owner)))[1]
    votes = owner[near.reshape(len(points), -1)]
    return np.stack([(votes == number).sum(axis=1) for number in range(len(areas))]).argmax(axis=0)


def _draw_face(axes: Any, face: DatumFace, view: _View) -> None:
    """Draw the outline of a flat face of the link, with its name."""
    outline, middle = np.concatenate([face.outline, face.outline[:1]]), face.outline.mean(axis=0, keepdims=True)
    normals = np.broadcast_to(np.array(face.normal), outline.shape)
    if view.draw_line(axes, outline, normals, ls="--", color=INK_COLOUR, lw=1.2).any():
        at = view.flat(middle)[0]
        axes.text(*at, face.name, fontweight="bold", ha="center", va="center", bbox=_LABEL_BOX)


def _name_ends(axes: Any, designs: Sequence[SheetDesign], view: _View) -> None:
    """Write the names of the sheets and of their ends beside the picture, with lines to where the viewer sees them.

    Each is on that side of the picture to which its end lies from the middle of the sheet, so that no line crosses the
    sheet to its other end.
    """
    names: list[tuple[Any, bool, str, str]] = []
    for index, design in enumerate(designs):
        side = design.place.frustum
        phi = side.wrap * np.linspace(0.1, 0.9, 121)  # at a corner a name could be that of the edge
        middle = view.flat(design.outer_face(np.full(len(phi), 0.5 * side.slant), phi)[0])[:, 0].mean()
        for end, u in ((1, 0.0), (2, side.slant)):
            points, normals = design.outer_face(np.full(len(phi), u), phi)
            seen, flat = view.sees(points, normals), view.flat(points)
            if seen.mean() >= 0.2:  # else the other side shows it better
                right = bool(flat[:, 0].mean() >= middle)
                at = flat[seen][(flat[seen, 0] if right else -flat[seen, 0]).argmax()]
                joints = "".join(f", joint {joint}" for joint in design.joints.get(f"end {end}", ()))
                names.append((at, right, f"{design.name}, end {end}{joints}", _SHEET_COLOURS[index % 4]))
    _write_beside(axes, view, names)


def _write_beside(axes: Any, view: _View, names: Iterable[tuple[Any, bool, str, str]]) -> None:
    """Write names with colours to the left or, where told, to the right of a picture, with lines to their places."""
    from matplotlib.patheffects import withStroke

    below = [-math.inf, -math.inf]
    halo = [withStroke(linewidth=3.0, foreground="white")]
    for at, right, name, colour in sorted(names, key=lambda item: float(item[0][1])):
        below[right] = max(below[right] + 0.06 * view.size, float(at[1]))
        edge = view.high[0] + 0.04 * view.size if right else view.low[0] - 0.04 * view.size
        text = {"color": colour, "fontsize": 9, "va": "center", "ha": "left" if right else "right"}
        arrow = {"arrowstyle": "-", "color": INK_COLOUR, "lw": 0.8, "shrinkA": 0, "shrinkB": 0, "path_effects": halo}
        axes.annotate(name, at, (edge, below[right]), arrowprops=arrow, annotation_clip=False, **text)
        axes.plot(*at, "o", color=INK_COLOUR, markersize=3, path_effects=halo)


def _draw_electrodes(axes: Any, design: SheetDesign, view: _View) -> None:
    """Draw the middle lines of the electrodes, and the ends and edges, where the viewer sees them."""
    along, around, border = _border(design)
    for u, phi in border:
        view.draw_line(axes, *design.outer_face(u, phi), color=INK_COLOUR, lw=1.0)
    for name in "BADC":
        u, phi = design.layout.electrode_middle(name, 0.0, 0.0)
        line = (np.full(len(around), u), around) if name in "AB" else (along, np.full(len(along), phi))
        points, normals = design.outer_face(*line)
        seen = view.draw_line(axes, points, normals, color=FOIL_COLOUR, lw=2.0)
        if seen.sum() >= 0.1 * len(seen):
            at = view.flat(points[seen])[seen.sum() // 3 if name in "AB" else seen.sum() // 2]
            box = {"boxstyle": "circle,pad=0.15", "facecolor": FOIL_COLOUR, "edgecolor": "none"}
            axes.text(*at, name, color="white", fontsize=8, fontweight="bold", ha="center", va="center", bbox=box)


def _border(design: SheetDesign) -> tuple[Any, Any, list[tuple[Any, Any]]]:
    """Return places along and around a sheet, and those of its ends and edges."""
    side = design.place.frustum
    along, around = np.linspace(0.0, side.slant, 41), np.linspace(0.0, side.wrap, 181)
    ends = [(np.full(len(around), u), around) for u in (0.0, side.slant)]
    return along, around, [*ends, *((along, np.full(len(along), phi)) for phi in (0.0, side.wrap))]


def draw_robot(figure: Any, links: Sequence[Mesh], sheets: Sequence[SheetDesign], cables: Sequence[Any] = ()) -> None:
    """Draw a robot from two opposite sides with the names of its sheets and its cables.

    Args:
        figure: an empty figure of matplotlib, without a layout engine.
        links: in one pose, in the frame of the robot.
        sheets: in that frame.
        cables: lines through points in that frame [m], each of shape (n, 3).
    """
    body, owner = _body([*(sheet.outer_triangles() for sheet in sheets), *(mesh.triangles for mesh in links)])
    hues = [_SHEET_COLOURS[index % 4] for index in range(len(sheets))]
    paints = _palette([*hues, *[_LINK_COLOUR] * len(links)])
    for side, way in enumerate((np.array([0.5, -1.0, 0.45]), np.array([-0.5, 1.0, 0.45]))):
        axes = figure.add_axes((0.0, 0.52 - 0.52 * side, 1.0, 0.48))
        view = _View(body, way)
        view.draw(axes, lambda hit, _: paints[owner[hit]], way + (0.4, 0.3, 0.5))
        view.draw_frame(axes)
        for line in cables:
            gone = np.concatenate([[0.0], np.linalg.norm(np.diff(line, axis=0), axis=1).cumsum()])
            at = np.arange(0.0, gone[-1], _CABLE_STEP)
            points = np.stack([np.interp(at, gone, column) for column in line.T], axis=1)
            view.draw_line(axes, points, np.broadcast_to(view.way, points.shape), color="black", lw=1.2)
        names = []
        for sheet, colour in zip(sheets, hues, strict=True):
            along, around, _ = _border(sheet)
            points, normals = (part.reshape(-1, 3) for part in sheet.outer_face(*np.meshgrid(along, around)))
            seen = view.sees(points, normals)
            if seen.mean() >= 0.1:  # else the other side shows it better
                flat = view.flat(points[seen])
                at = flat[np.linalg.norm(flat - flat.mean(axis=0), axis=1).argmin()]
                names.append((at, bool(at[0] > 0.5 * (view.low[0] + view.high[0])), sheet.name, colour))
        _write_beside(axes, view, names)


def draw_weights(figure: Any, mesh: Mesh, designs: Sequence[SheetDesign], weights: TouchWeights) -> None:
    """Draw the link from two sides, each place in the colour of its weight as a share of the largest.

    Args:
        figure: an empty figure of matplotlib.
        mesh: of the link.
        designs: the sheets, of which the outlines are drawn.
        weights: what an area counts.
    """
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    colours = colormaps["viridis"]
    first = designs[0].place.link_frustum
    for number, way in enumerate(((0.80, 0.45, 0.35), (-0.80, -0.45, 0.35)), 1):
        axes = figure.add_subplot(1, 2, number)
        view = _View(mesh, first.rotate(way))
        view.draw(axes, lambda _, points: colours(weights.at(points))[:, :3])
        view.draw_frame(axes)
        for design in designs:
            for u, phi in _border(design)[2]:
                view.draw_line(axes, *design.outer_face(u, phi), color="#d1495b", lw=1.5)
    bar = figure.colorbar(ScalarMappable(Normalize(0.0, 1.0), colours), ax=figure.axes, location="bottom", shrink=0.6)
    bar.set_label(f"what an area counts by {weights.name}, as a share of the largest; red: the sheets")


_LIGHT_DIRECTION = np.array([0.35, -0.55, 0.76])
_PART_DISTANCE = 0.25  # of the radius of a part: how far the parts are drawn from each other
_PART_COLOURS = ("#6b9ec7", "#d99e66", "#8cb880", "#b894c2")


def draw_jig(figure: Any, collars: Sequence[Collar]) -> None:
    """Draw the collars of a sheet.

    Args:
        figure: an empty figure of matplotlib.
        collars: at least one.
    """
    grid = figure.subplots(1, len(collars), squeeze=False)
    paints = _palette(_PART_COLOURS)
    for axes, collar in zip(grid.flat, collars, strict=True):
        turned = -1.0 if collar.end == 1 else 1.0  # as it stands, end 1 is upside down
        middles = [0.5 * (part.start + part.end) for part in collar.parts]
        ways = [np.array([math.cos(middle), turned * math.sin(middle), 0.0]) for middle in middles]
        body, owner = _body(
            part.surface.vertices[part.surface.faces] + 0.5 * _PART_DISTANCE * max(part.surface.extents[:2]) * way
            for part, way in zip(collar.parts, ways, strict=True)
        )
        turn = _clear_azimuth(turned * angle for part in collar.parts for angle in (part.start, part.end))
        high = math.radians(38.0)
        view = _View(body, (math.cos(high) * math.cos(turn), math.cos(high) * math.sin(turn), math.sin(high)))
        numbers = np.array([part.number - 1 for part in collar.parts])[owner] % len(paints)

        def painted(hit: Any, _: Any, own: Any = paints[numbers]) -> Any:
            return own[hit]

        view.draw(axes, painted, _LIGHT_DIRECTION)
        for part, way in zip(collar.parts, ways, strict=True):
            out = view.flat(way) / np.linalg.norm(view.flat(way))
            own = view.flat(body.vertices)
            reach = float((own @ out).max()) + 0.06 * view.size  # beyond all of it
            middle = own.mean(axis=0)
            at = middle + (reach - float(middle @ out)) * out
            name = f"part {part.number}" + (",\nbegins at edge 0" if part.number == 1 else "")
            aside = "center" if abs(out[0]) < 0.3 else "left" if out[0] > 0.0 else "right"
            axes.text(*at, name, fontsize=9, ha=aside, va="center", bbox=_LABEL_BOX)
        axes.set_title(f"end {collar.end}", fontsize=10, loc="left")


def _clear_azimuth(cuts: Iterable[float]) -> float:
    """Return the azimuth of a view [rad] in which no cut plane is seen edge-on: the picture would look cropped."""
    at = np.radians(np.arange(-175.0, 185.0, 5.0))
    slant = np.abs(np.sin(at[:, None] - np.array(list(cuts)))).min(axis=1)
    return float(at[int((slant + 0.05 * np.cos(at + math.radians(150.0))).argmax())])
