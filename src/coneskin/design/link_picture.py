"""Pictures in space: a link with its sheets from two sides, what counts on it, and the printed parts of a jig.

The link shows where the sheets are, their ends, and the faces to measure from.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from coneskin.geometry.ray_casting import RayCaster

from .sheet_pictures import FOIL_COLOUR, INK_COLOUR
from .sheets.sheet_design import SheetDesign
from .workshop.jig import Collar

if TYPE_CHECKING:
    from coneskin.geometry.fit.bare_areas import BareArea
    from coneskin.geometry.fit.touch_weights import TouchWeights
    from coneskin.geometry.mesh import Mesh

    from .workshop.placement import DatumFace

__all__ = ["draw_jig", "draw_link", "draw_weights", "drawn_triangles"]

_SHEET_COLOURS = ("#2a7fb8", "#d1495b", "#6a994e", "#8d5a97")
_BARE_COLOURS = ("#c4c8ce", "#d8c9a3", "#b3c7b0", "#cdb4c9", "#a9b8c9", "#e0b9a8")
_LABEL_BOX = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1.0}
_MAX_FACES = 12000  # faces; matplotlib draws them in about a second


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
    triangles, owner = _triangles(designs, mesh, areas)
    rays = None if mesh is None else RayCaster(mesh)
    for side, (x, y, z) in enumerate(((0.80, 0.45, 0.35), (-0.80, -0.45, -0.35))):
        axes = figure.add_axes((0.5 * side, 0.14, 0.5, 0.84), projection="3d", computed_zorder=False, proj_type="ortho")
        # slightly from the side; once from above and once from below, so that both ends are seen
        view = np.array(first.rotate((x, y, z)))
        light = np.array(first.rotate((x, -0.3 * y, 1.3 * z)))
        _draw_side(axes, triangles, owner, view / np.linalg.norm(view), light / np.linalg.norm(light))
        for index, design in enumerate(designs):
            sight = _Sight(view / np.linalg.norm(view), rays, 1e-3 * float(np.ptp(triangles, axis=(0, 1)).max()))
            _draw_electrodes(axes, design, sight)
            _name_ends(axes, design, sight, _SHEET_COLOURS[index % 4])
        for face in faces:
            _draw_face(axes, face, sight)
    for area, colour in zip(areas, _BARE_COLOURS, strict=False):
        axes.plot([], [], [], "s", color=colour, label=f"bare, {area.share:.0%}: {area.reason}")
    if areas:
        figure.legend(loc="lower center", fontsize="small", frameon=False)


def _triangles(designs: Sequence[SheetDesign], mesh: Mesh | None, areas: Sequence[BareArea]) -> tuple[Any, list[str]]:
    """Return what is drawn: triangles [mm], shape (n, 3, 3), and the colour of each."""
    shown, colours = [], []

    def add(triangles: Any, colour: str) -> None:
        shown.append(triangles)
        colours.extend([colour] * len(triangles))

    if mesh is not None:
        bare = drawn_triangles(mesh)
        for design in designs:  # in the order of drawing, covered triangles would show through the sheets
            bare = bare[~_covered(design, bare)]
        for colour, part in _by_reason(bare, areas):
            add(part * 1e3, colour)
    for index, design in enumerate(designs):
        grid = _outer_face(design, np.linspace(0.0, 1.0, 41), np.linspace(0.0, 1.0, 121))
        corners = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
        p, q, r, s = (corner.reshape(-1, 3) for corner in corners)
        add(np.concatenate([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)]), _SHEET_COLOURS[index % 4])
    return np.concatenate(shown), colours


def _draw_side(axes: Any, triangles: Any, colours: Sequence[str], view: Any, light: Any) -> None:
    """Draw triangles [mm] as they are seen from a direction, with the axes of their frame."""
    from matplotlib.colors import to_rgb
    from matplotlib.ticker import MaxNLocator
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    a, b, c = triangles.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1)
    bright = np.minimum(0.4 + 0.6 * np.abs(normal @ light) / np.where(size > 0.0, size, 1.0), 1.0)
    known = {colour: to_rgb(colour) for colour in dict.fromkeys(colours)}
    order = np.argsort(triangles.mean(axis=1) @ view)
    paint = (bright[:, None] * np.array([known[colour] for colour in colours]))[order]
    axes.add_collection3d(Poly3DCollection(triangles[order], facecolors=paint, edgecolors=paint, linewidths=0.3))
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    middle, least = 0.5 * (low + high), 0.1 * float((high - low).max())  # a flat link needs a box with a volume
    low, high = np.minimum(low, middle - 0.5 * least), np.maximum(high, middle + 0.5 * least)
    axes.set(**dict(zip(("xlim", "ylim", "zlim"), zip(low, high, strict=True), strict=True)))
    axes.set_xlabel("x [mm]", labelpad=10)
    axes.set_ylabel("y [mm]", labelpad=10)
    axes.set_zlabel("z [mm]", labelpad=18)
    axes.tick_params("z", pad=6)
    for axis, span in zip((axes.xaxis, axes.yaxis, axes.zaxis), high - low, strict=True):
        axis.set_major_locator(MaxNLocator(max(2, round(8 * span / (high - low).max()))))
    axes.set_box_aspect(high - low, zoom=0.82)
    axes.view_init(math.degrees(math.asin(view[2])), math.degrees(math.atan2(view[1], view[0])))


class _Sight(NamedTuple):
    """A viewer, to whom the link hides what is behind it."""

    view: Any  #: direction to the viewer, a unit vector
    rays: RayCaster | None  #: of the link
    size: float  #: of the link [m]

    def sees(self, points: Any, normals: Any) -> Any:
        """Return which points [mm] face the viewer with nothing of the link before them, shape (n,)."""
        seen = normals @ self.view > 0.02
        if self.rays is not None and seen.any():
            # off the mesh, which lies up to the tolerance above a sheet's side
            depth, _ = self.rays.cast(1e-3 * points + 2e-3 * normals, np.broadcast_to(self.view, points.shape).copy())
            seen &= ~np.isfinite(depth)
        return seen


def _draw_face(axes: Any, face: DatumFace, sight: _Sight) -> None:
    """Draw the outline of a flat face of the link, with its name."""
    if np.dot(face.normal, sight.view) < 0.05:
        return
    outline = 1e3 * (face.outline + 5e-4 * np.array(face.normal))
    axes.plot(*np.concatenate([outline, outline[:1]]).T, "--", color=INK_COLOUR, lw=1.2)
    axes.text(*outline.mean(axis=0), face.name, fontweight="bold", ha="center", va="center", bbox=_LABEL_BOX)


def _name_ends(axes: Any, design: SheetDesign, sight: _Sight, colour: str) -> None:
    """Write the name of the sheet and of its end beside each end, where the viewer sees it best."""
    phi = np.linspace(0.0, 1.0, 121)
    axis = np.array(design.place.link_frustum.rotate((0.0, 0.0, 1.0)))
    for end, u in ((1, 0.0), (2, 1.0)):
        points = _outer_face(design, [u], phi).reshape(-1, 3)
        normals = design.place.place(np.zeros(len(phi)), phi * design.place.frustum.wrap)[1]
        seen = sight.sees(points, normals)
        if seen.mean() < 0.2:  # the other side shows it better
            continue
        best = int(np.where(seen, normals @ sight.view, -1.0).argmax())
        aside = 40.0 * sight.size * (1.0 if end == 2 else -1.0) * axis
        name = f"{design.name}, end {end}"
        axes.text(*(points[best] + aside), name, color=colour, fontsize=8, ha="center", va="center", bbox=_LABEL_BOX)


def _by_reason(triangles: Any, areas: Sequence[BareArea]) -> list[tuple[str, Any]]:
    """Return colours, each with the bare triangles [m] that have it: those nearest to the samples of one reason."""
    if not areas or len(triangles) == 0:
        return [("#c4c8ce", triangles)]
    from scipy.spatial import cKDTree

    points = np.concatenate([area.points for area in areas])
    owner = np.repeat(np.arange(len(areas)), [len(area.points) for area in areas])
    nearest = owner[cKDTree(points).query(triangles.mean(axis=1))[1]]
    return [(_BARE_COLOURS[n % len(_BARE_COLOURS)], triangles[nearest == n]) for n in np.unique(nearest)]


def _outer_face(design: SheetDesign, u: Any, phi: Any) -> Any:
    """Return points of the outer face [mm] at fractions of slant and wrap, shape (k, p, 3)."""
    thickness, place = design.options.stack.thickness, design.place
    side = place.frustum
    points, normals = place.place(np.asarray(u)[:, None] * side.slant, np.asarray(phi)[None, :] * side.wrap)
    return 1e3 * (points + thickness * normals)


def _draw_electrodes(axes: Any, design: SheetDesign, sight: _Sight) -> None:
    """Draw the middle lines of the electrodes and the two edges where the viewer sees them."""
    side = design.place.frustum
    along, around = np.linspace(0.0, 1.0, 21), np.linspace(0.0, 1.0, 121)
    lines: list[tuple[str, Any, Any]] = []
    for name in "BADC":
        u, phi = design.layout.electrode_middle(name, 0.0, 0.0)
        lines.append((name, [u / side.slant], around) if name in "AB" else (name, along, [phi / side.wrap]))
    for name, share, turn in (*lines, ("", along, [0.0]), ("", along, [1.0])):
        points = _outer_face(design, share, turn).reshape(-1, 3)
        azimuths = np.broadcast_to(turn, points.shape[:1]) * side.wrap
        seen = sight.sees(points, design.place.place(np.zeros(len(azimuths)), azimuths)[1])
        points[~seen] = np.nan
        axes.plot(*points.T, color=FOIL_COLOUR if name else INK_COLOUR, lw=2.0 if name else 1.0)
        if name and seen.sum() >= 0.1 * len(seen):
            middle = points[seen][seen.sum() // 3 if name in "AB" else seen.sum() // 2]
            axes.text(*middle, name, color="white", fontweight="bold", ha="center", va="center")


def drawn_triangles(mesh: Mesh) -> Any:
    """Return the triangles of a mesh [m], merged in cells if there are too many to draw."""
    faces, vertices = mesh.faces, mesh.vertices
    size = float(np.ptp(vertices, axis=0).max())
    cell = size / 120.0
    while len(faces) > _MAX_FACES:
        keys = np.round(vertices / cell).astype(np.int64)
        _, first, place = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        vertices, faces = vertices[first], place.reshape(-1)[faces]
        faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
        faces = faces[np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1]]
        cell *= 1.3
    triangles = vertices[faces]
    for _ in range(8):  # halve long triangles: in the order of drawing they would cover nearer ones
        edges = np.linalg.norm(triangles - np.roll(triangles, -1, axis=1), axis=2)
        long = edges.max(axis=1) > size / 20.0
        if not long.any() or len(triangles) > 4 * _MAX_FACES:
            break
        turned = np.stack([np.roll(t, -k, axis=0) for t, k in zip(triangles[long], edges[long].argmax(1), strict=True)])
        a, b, c = turned.transpose(1, 0, 2)
        middle = 0.5 * (a + b)
        halves = np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)
        triangles = np.concatenate([triangles[~long], *halves])
    return triangles


def _covered(design: SheetDesign, triangles: Any) -> Any:
    """Return whether a sheet covers each triangle [m], shape (n,)."""
    side = design.place.frustum
    u, phi, height = design.place.locate_all(triangles)
    covered = (u >= 0.0) & (u <= side.slant) & (np.abs(height) < design.options.stack.thickness)
    covered &= phi % (2.0 * math.pi) <= side.wrap
    return covered.all(axis=1)


_OUTLINE_COLOR = "#d1495b"
_OUTLINE_LIFT = 1e-3  # m; by which outlines stand off the outer face, so that they are not hidden


def draw_weights(figure: Any, triangles: Any, designs: Sequence[SheetDesign], weights: TouchWeights) -> None:
    """Draw the link from two sides, each area in the colour of its weight as a share of the largest.

    Args:
        figure: an empty figure of matplotlib.
        triangles: of the link [m], shape (n, 3, 3).
        designs: the sheets, of which the outlines are drawn.
        weights: what an area counts.
    """
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    colours, scale = colormaps["viridis"], Normalize(0.0, 1.0)
    paint = colours(weights.at(triangles.mean(axis=1)))
    first = designs[0].place.link_frustum
    low, high = 1e3 * triangles.min(axis=(0, 1)), 1e3 * triangles.max(axis=(0, 1))
    panels = []
    for number, way in enumerate(((0.80, 0.45, 0.35), (-0.80, -0.45, 0.35)), 1):
        axes = figure.add_subplot(1, 2, number, projection="3d", computed_zorder=False, proj_type="ortho")
        view = np.array(first.rotate(way))
        view /= np.linalg.norm(view)
        order = np.argsort(triangles.mean(axis=1) @ view)
        axes.add_collection3d(
            Poly3DCollection(1e3 * triangles[order], facecolors=paint[order], edgecolors=paint[order], linewidths=0.3)
        )
        for design in designs:
            for line, normals in _outlines(design):
                line[normals @ view < 0.0] = np.nan
                axes.plot(*line.T, color=_OUTLINE_COLOR, lw=1.5)
        axes.set(
            xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]), xlabel="x [mm]", ylabel="y [mm]"
        )
        axes.set_zlabel("z [mm]")
        axes.set_box_aspect(np.maximum(high - low, 0.1 * float((high - low).max())), zoom=0.9)
        axes.view_init(math.degrees(math.asin(view[2])), math.degrees(math.atan2(view[1], view[0])))
        axes.tick_params(labelsize=7)
        panels.append(axes)
    bar = figure.colorbar(ScalarMappable(scale, colours), ax=panels, location="bottom", shrink=0.6)
    bar.set_label(f"what an area counts by {weights.name}, as a share of the largest; red: the sheets")


def _outlines(design: SheetDesign) -> list[tuple[Any, Any]]:
    """Return points [mm] and normals of the ends and edges of a sheet's outer face."""
    side, height = design.place.frustum, design.options.stack.thickness + _OUTLINE_LIFT
    along, around = np.linspace(0.0, side.slant, 40), np.linspace(0.0, side.wrap, 180)
    found = []
    for u, phi in ((0.0, around), (side.slant, around), (along, 0.0), (along, side.wrap)):
        points, normals = design.place.place(u, phi)
        found.append((1e3 * (points + height * normals), normals))
    return found


_LIGHT_DIRECTION = np.array([0.35, -0.55, 0.76])
_PART_DISTANCE = 0.25  # of the radius of a part: how far the parts are drawn from each other
_PART_COLORS = ((0.42, 0.62, 0.78), (0.85, 0.62, 0.40), (0.55, 0.72, 0.50), (0.72, 0.58, 0.76))


def draw_jig(figure: Any, collars: Sequence[Collar]) -> None:
    """Draw the collars of a sheet.

    Args:
        figure: an empty figure of matplotlib.
        collars: at least one.
    """
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    grid = figure.subplots(1, len(collars), subplot_kw={"projection": "3d", "proj_type": "ortho"}, squeeze=False)
    for axes, collar in zip(grid.flat, collars, strict=True):
        shown, paint = [], []
        turned = -1.0 if collar.end == 1 else 1.0  # as it stands, end 1 is upside down
        for part in collar.parts:
            middle = 0.5 * (part.start + part.end)
            aside = 0.5 * _PART_DISTANCE * max(part.surface.size[:2])
            off = np.array([aside * math.cos(middle), turned * aside * math.sin(middle), 0.0])
            triangles = 1e3 * (part.surface.vertices[part.surface.faces] + off)
            a, b, c = triangles.transpose(1, 0, 2)
            normal = np.cross(b - a, c - a)
            size = np.linalg.norm(normal, axis=1)
            bright = 0.55 + 0.45 * (normal @ _LIGHT_DIRECTION) / np.where(size > 0.0, size, 1.0)
            shown.append(triangles)
            paint.append(np.clip(np.outer(bright, _PART_COLORS[(part.number - 1) % len(_PART_COLORS)]), 0.0, 1.0))
            at = 1e3 * (part.surface.vertices.mean(axis=0) + off)
            at[:2] += 0.35e3 * max(part.surface.size[:2]) * np.array([math.cos(middle), turned * math.sin(middle)])
            name = f"part {part.number}" + (", begins at edge 0" if part.number == 1 else "")
            axes.text(at[0], at[1], -8.0, name, fontsize=9, ha="center", zorder=10, bbox=_LABEL_BOX)
        triangles = np.concatenate(shown)
        drawn = Poly3DCollection(triangles, facecolors=np.concatenate(paint), edgecolors="none", clip_on=False)
        axes.add_collection3d(drawn)
        low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        axes.set_box_aspect(high - low, zoom=0.85)  # the box is turned: its corners reach beyond the axes
        axes.view_init(38.0, math.degrees(_view(turned * angle for p in collar.parts for angle in (p.start, p.end))))
        axes.set_title(f"end {collar.end}", fontsize=10)
        axes.axis("off")


def _view(cuts: Iterable[float]) -> float:
    """Return the azimuth of a view [rad] in which no cut plane is seen edge-on: the picture would look cropped."""
    at = np.radians(np.arange(-175.0, 185.0, 5.0))
    slant = np.abs(np.sin(at[:, None] - np.array(list(cuts)))).min(axis=1)
    return float(at[int((slant + 0.05 * np.cos(at + math.radians(150.0))).argmax())])
