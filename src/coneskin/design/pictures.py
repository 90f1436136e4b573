"""Pictures of the report: the link, the layouts and the deviations from the mesh."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.errors import MissingExtra

from .jig_picture import draw_jig
from .layout_picture import FOIL_COLOUR, INK_COLOUR, draw_layout
from .parts_picture import draw_parts
from .sheets import SheetDesign
from .stack_picture import draw_seam, draw_stack
from .weights_picture import draw_weights
from .workshop.build_figures import BuildFigures

if TYPE_CHECKING:
    from coneskin.geometry.fit.bare_areas import BareArea
    from coneskin.geometry.fit.touch_weights import TouchWeights
    from coneskin.geometry.mesh import Mesh

__all__ = ["draw_pictures"]

_SHEET_COLOURS = ("#2a7fb8", "#d1495b", "#6a994e", "#8d5a97")
_BARE_COLOURS = ("#c4c8ce", "#d8c9a3", "#b3c7b0", "#cdb4c9", "#a9b8c9", "#e0b9a8")
_MAX_FACES = 12000  # faces; matplotlib draws them in about a second


def draw_pictures(
    folder: Path,
    designs: tuple[SheetDesign, ...],
    figures: Sequence[BuildFigures],
    mesh: Mesh | None,
    tolerance: float,
    progress: Callable[[str], None],
    bare: Sequence[BareArea] = (),
    weights: TouchWeights | None = None,
) -> list[tuple[str, str]]:
    """Draw the link with its sheets, and of each sheet its layout, parts, stack and seam, and the map of deviations.

    Args:
        folder: output folder; the pictures go into its pictures/.
        designs: the sheets.
        figures: for building each of them.
        mesh: of the link, in the frame of the sheets; None for a link given by its dimensions.
        tolerance: of the fit [m].
        progress: called with the name of each step.
        bare: what no sheet covers, by reason; each has a colour of its own.
        weights: what areas count; None where all count the same.

    Returns:
        caption and path in the folder of each picture.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as exc:
        raise MissingExtra("matplotlib", "drawing pictures (--no-pictures leaves them out)", "design") from exc
    (folder / "pictures").mkdir()
    done: list[tuple[str, str]] = []

    def save(figure: Any, name: str, caption: str) -> None:
        figure.savefig(folder / "pictures" / name, dpi=130, bbox_inches="tight", pad_inches=0.15)
        done.append((caption, f"pictures/{name}"))

    progress("drawing the link")
    figure = Figure(figsize=(8, 6.5), layout="constrained")
    _draw_link(figure, designs, mesh, bare)
    save(
        figure,
        "link.png",
        "The link with its sheets: outer faces in colour, middle lines of the electrodes in orange, edges black."
        + (" What is bare is tinted by its reason." if bare else ""),
    )
    if weights is not None and mesh is not None:
        progress("drawing what counts")
        figure = Figure(figsize=(10, 6), layout="constrained")
        draw_weights(figure, _coarser(mesh), designs, weights)
        save(figure, "weights.png", f"What counts on the link, by {weights.name}, from two sides.")
    for design, item in zip(designs, figures, strict=True):
        progress(f"{design.name}: drawing the layout")
        figure = Figure(figsize=(9, 7), layout="constrained")
        draw_layout(figure, design, item.cable)
        name = design.name.replace(" ", "-")
        save(
            figure,
            f"{name}-layout.png",
            f"{design.name.capitalize()}, flat, seen from outside, and the way of its wires; dimensions in mm.",
        )
        title = design.name.capitalize()
        progress(f"{design.name}: drawing how it is built")
        figure = Figure(figsize=(9, 7), layout="constrained")
        draw_stack(figure, design)
        save(figure, f"{name}-stack.png", f"{title}: its seven parts in the order of assembly, each seen from outside.")
        figure = Figure(figsize=(9, 4.5), layout="constrained")
        draw_seam(figure, design, item)
        save(figure, f"{name}-seam.png", f"{title}: section across its seam.")
        figure = Figure(figsize=(9, 11), layout="constrained")
        draw_parts(figure, design)
        save(figure, f"{name}-parts.png", f"{title}: its parts as they are cut, dimensions in mm.")
        if item.collars:
            progress(f"{design.name}: drawing the jig")
            figure = Figure(figsize=(10, 4.5), layout="constrained")
            draw_jig(figure, item.collars)
            save(figure, f"{name}-jig.png", f"{title}: parts of its jig as they are printed, a little apart.")
        if mesh is not None and not design.above:
            progress(f"{design.name}: measuring deviations")
            figure = Figure(figsize=(8, 4.2), layout="constrained")
            _draw_deviation(figure, design, mesh, tolerance)
            save(
                figure,
                f"{name}-deviation.png",
                f"{design.name.capitalize()}: height of the mesh above the {design.place.kind}. Grey: holes and "
                "grooves deeper than the tolerance, which the sheet bridges.",
            )
    return done


def _draw_link(figure: Any, designs: Sequence[SheetDesign], mesh: Mesh | None, areas: Sequence[BareArea] = ()) -> None:
    """Draw the mesh in grey, the outer faces of the sheets in colour and the electrodes as lines on them."""
    import numpy as np
    from matplotlib.colors import to_rgb
    from matplotlib.ticker import MaxNLocator
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    axes = figure.add_subplot(projection="3d", computed_zorder=False, proj_type="ortho")
    first = designs[0].place.link_frustum
    # the view shows the seam, slightly from the side and from above
    view = np.array(first.rotate((0.80, 0.45, 0.35)))
    view /= np.linalg.norm(view)
    light = np.array(first.rotate((0.85, -0.3, 0.45)))
    shown, colours = [], []

    def add(triangles: Any, colour: str) -> None:
        a, b, c = triangles.transpose(1, 0, 2)
        normal = np.cross(b - a, c - a)
        size = np.linalg.norm(normal, axis=1)
        bright = 0.4 + 0.6 * np.abs(normal @ light) / np.where(size > 0.0, size, 1.0)
        shown.append(triangles)
        colours.append(np.outer(np.minimum(bright, 1.0), to_rgb(colour)))

    if mesh is not None:
        bare = _coarser(mesh)
        for design in designs:  # in the order of drawing, covered triangles would show through the sheets
            bare = bare[~_covered(design, bare)]
        for colour, part in _by_reason(bare, areas):
            add(part * 1e3, colour)
        for area, colour in zip(areas, _BARE_COLOURS, strict=False):
            axes.plot([], [], [], "s", color=colour, label=f"bare, {area.share:.0%}: {area.reason}")
        if areas:
            figure.legend(loc="outside lower center", fontsize="small", frameon=False)
    for index, design in enumerate(designs):
        grid = _outer_face(design, np.linspace(0.0, 1.0, 41), np.linspace(0.0, 1.0, 121))
        corners = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
        p, q, r, s = (corner.reshape(-1, 3) for corner in corners)
        add(np.concatenate([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)]), _SHEET_COLOURS[index % 4])
    triangles = np.concatenate(shown)
    order = np.argsort(triangles.mean(axis=1) @ view)
    paint = np.concatenate(colours)[order]
    axes.add_collection3d(Poly3DCollection(triangles[order], facecolors=paint, edgecolors=paint, linewidths=0.3))
    for design in designs:
        _draw_electrodes(axes, design, view)
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    middle, least = 0.5 * (low + high), 0.1 * float((high - low).max())  # a flat link needs a box with a volume
    low, high = np.minimum(low, middle - 0.5 * least), np.maximum(high, middle + 0.5 * least)
    limits = dict(zip(("xlim", "ylim", "zlim"), zip(low, high, strict=True), strict=True))
    axes.set(**limits)
    axes.set_xlabel("x [mm]", labelpad=10)
    axes.set_ylabel("y [mm]", labelpad=10)
    axes.set_zlabel("z [mm]", labelpad=24)
    axes.tick_params("z", pad=6)
    for axis, span in zip((axes.xaxis, axes.yaxis, axes.zaxis), high - low, strict=True):
        axis.set_major_locator(MaxNLocator(max(2, round(8 * span / (high - low).max()))))
    axes.set_box_aspect(high - low, zoom=0.9)
    axes.view_init(math.degrees(math.asin(view[2])), math.degrees(math.atan2(view[1], view[0])))


def _by_reason(triangles: Any, areas: Sequence[BareArea]) -> list[tuple[str, Any]]:
    """Return colours, each with the bare triangles [m] that have it: those nearest to the samples of one reason."""
    if not areas or len(triangles) == 0:
        return [("#c4c8ce", triangles)]
    import numpy as np
    from scipy.spatial import cKDTree

    points = np.concatenate([area.points for area in areas])
    owner = np.repeat(np.arange(len(areas)), [len(area.points) for area in areas])
    nearest = owner[cKDTree(points).query(triangles.mean(axis=1))[1]]
    return [(_BARE_COLOURS[n % len(_BARE_COLOURS)], triangles[nearest == n]) for n in np.unique(nearest)]


def _outer_face(design: SheetDesign, u: Any, phi: Any) -> Any:
    """Return points of the outer face [mm] at fractions of slant and wrap, shape (k, p, 3)."""
    import numpy as np

    thickness, place = design.options.stack.thickness, design.place
    side = place.frustum
    points, normals = place.place(np.asarray(u)[:, None] * side.slant, np.asarray(phi)[None, :] * side.wrap)
    return 1e3 * (points + thickness * normals)


def _draw_electrodes(axes: Any, design: SheetDesign, view: Any) -> None:
    """Draw the middle lines of the electrodes and the two edges where they face the viewer."""
    import numpy as np

    side, box, plan = design.place.frustum, design.layout.field, design.layout.plan
    half = 0.5 * plan.electrode
    turn = half / min(side.radius1, side.radius2)
    along, around = np.linspace(0.0, 1.0, 2), np.linspace(0.0, 1.0, 121)
    for name, u, phi, colour in (
        ("B", [(box.u1 - half) / side.slant], around, FOIL_COLOUR),
        ("A", [(box.u2 + half) / side.slant], around, FOIL_COLOUR),
        ("D", along, [(box.phi1 - turn) / side.wrap], FOIL_COLOUR),
        ("C", along, [(box.phi2 + turn) / side.wrap], FOIL_COLOUR),
        ("", along, [0.0], INK_COLOUR),
        ("", along, [1.0], INK_COLOUR),
    ):
        points = _outer_face(design, u, phi).reshape(-1, 3)
        azimuths = np.broadcast_to(phi, points.shape[:1]) * side.wrap
        facing = design.place.place(np.zeros(len(azimuths)), azimuths)[1] @ view > 0.02
        points[~facing] = np.nan
        axes.plot(*points.T, color=colour, lw=2.0 if name else 1.0)
        if facing.any() and name:
            middle = points[facing][facing.sum() // 3] if len(points) > 2 else points.mean(axis=0)
            axes.text(*middle, name, color="white", fontweight="bold", ha="center", va="center")


def _coarser(mesh: Mesh) -> Any:
    """Return the triangles of a mesh [m], merged in cells if there are too many to draw."""
    import numpy as np

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
    import numpy as np

    side = design.place.frustum
    u, phi, height = design.place.locate_all(triangles)
    covered = (u >= 0.0) & (u <= side.slant) & (np.abs(height) < design.options.stack.thickness)
    covered &= phi % (2.0 * math.pi) <= side.wrap
    return covered.all(axis=1)


def _draw_deviation(figure: Any, design: SheetDesign, mesh: Mesh, tolerance: float) -> None:
    """Draw the height of the mesh above the side of a sheet over azimuth and slant distance."""
    import numpy as np
    from matplotlib import colormaps

    from coneskin.geometry.displacement_map import heights_by_ray
    from coneskin.geometry.ray_casting import RayCaster

    side = design.place.frustum
    u = np.asarray(side.slant * (np.arange(180) + 0.5) / 180.0, np.float64)
    phi = np.asarray(side.wrap * (np.arange(360) + 0.5) / 360.0, np.float64)
    heights = heights_by_ray(RayCaster(mesh), design.place, u, phi, tolerance) * 1e3
    axes = figure.add_subplot()
    shown = np.ma.masked_where(heights < -1e3 * tolerance, heights)
    # the colours span the deviations, but at least a twentieth of the tolerance and at most all of it
    limit = 1e3 * min(max(1e-3 * float(np.ma.filled(np.abs(shown), 0.0).max()), 0.05 * tolerance), tolerance)
    axes.set_facecolor("#999999")
    extent = (0.0, math.degrees(side.wrap), 0.0, side.slant * 1e3)
    image = axes.imshow(
        shown, origin="lower", aspect="auto", extent=extent, cmap=colormaps["RdBu_r"], vmin=-limit, vmax=limit
    )
    figure.colorbar(image, label=f"height above the {design.place.kind} [mm]")
    axes.set(
        xlabel="azimuth phi [deg]",
        ylabel="slant distance u from end 1 [mm]",
        title=f"{design.name}: deviation of the mesh from the {design.place.kind}, tolerance {1e3 * tolerance:g} mm",
    )
