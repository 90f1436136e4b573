"""Pictures for the report. The only importer of matplotlib in the design."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .design import SheetDesign
from .errors import MissingExtra
from .geometry.stack import parallel
from .layout_picture import FOIL, INK, draw_layout

if TYPE_CHECKING:
    from .geometry.mesh import Mesh

__all__ = ["draw_pictures"]

_SHEET = ("#2a7fb8", "#d1495b", "#6a994e", "#8d5a97")
_MOST_FACES = 12000  # drawn by matplotlib in a second


def draw_pictures(
    folder: Path,
    designs: tuple[SheetDesign, ...],
    mesh: Mesh | None,
    tolerance: float,
    progress: Callable[[str], None],
) -> list[tuple[str, str]]:
    """Draw the flat layouts, the link with its sheets, and the map of deviations.

    Args:
        folder: where to put them; they go into pictures/.
        designs: the sheets.
        mesh: of the link, in the frame of the sheets; None where there is none.
        tolerance: of the fit [m], the range of the colours.
        progress: called with the name of each step.

    Returns:
        caption and path in the folder of each picture.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as exc:
        raise MissingExtra("matplotlib", "drawing pictures (or leave them out with --no-pictures)", "design") from exc
    (folder / "pictures").mkdir()
    done: list[tuple[str, str]] = []

    def save(figure: Any, name: str, caption: str) -> None:
        figure.savefig(folder / "pictures" / name, dpi=130, bbox_inches="tight", pad_inches=0.15)
        done.append((caption, f"pictures/{name}"))

    progress("drawing the link")
    figure = Figure(figsize=(8, 6.5), layout="constrained")
    _draw_link(figure, designs, mesh)
    save(
        figure,
        "link.png",
        "The link with its sheets: outer faces, the lines of the electrodes, and in black the edges.",
    )
    for design in designs:
        progress(f"{design.name}: drawing the layout")
        figure = Figure(figsize=(9, 7), layout="constrained")
        draw_layout(figure, design)
        name = design.name.replace(" ", "-")
        save(figure, f"{name}-layout.png", f"{design.name.capitalize()}, flat, seen from outside; dimensions in mm.")
        if mesh is not None:
            progress(f"{design.name}: measuring deviations")
            figure = Figure(figsize=(8, 4.2), layout="constrained")
            _draw_deviation(figure, design, mesh, tolerance)
            save(
                figure,
                f"{name}-deviation.png",
                f"{design.name.capitalize()}: height of the mesh above the cone. Grey: deeper than shown; the sheet "
                "bridges it.",
            )
    return done


def _draw_link(figure: Any, designs: Sequence[SheetDesign], mesh: Mesh | None) -> None:
    """The mesh in grey, the outer faces of the sheets in colour, the electrodes as lines on them."""
    import numpy as np
    from matplotlib.colors import to_rgb
    from matplotlib.ticker import MaxNLocator
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    axes = figure.add_subplot(projection="3d", computed_zorder=False, proj_type="ortho")
    first = designs[0].place.link_frustum
    # from where the seam is seen, a little from the side and from above
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
        add(_coarser(mesh) * 1e3, "#c4c8ce")
    for index, design in enumerate(designs):
        grid = _outer_face(design, np.linspace(0.0, 1.0, 41), np.linspace(0.0, 1.0, 121))
        corners = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
        p, q, r, s = (corner.reshape(-1, 3) for corner in corners)
        add(np.concatenate([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)]), _SHEET[index % 4])
    triangles = np.concatenate(shown)
    order = np.argsort(triangles.mean(axis=1) @ view)
    paint = np.concatenate(colours)[order]
    axes.add_collection3d(Poly3DCollection(triangles[order], facecolors=paint, edgecolors=paint, linewidths=0.3))
    for design in designs:
        _draw_electrodes(axes, design, view)
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    middle, least = 0.5 * (low + high), 0.1 * float((high - low).max())  # a flat link still needs a box
    low, high = np.minimum(low, middle - 0.5 * least), np.maximum(high, middle + 0.5 * least)
    limits = dict(zip(("xlim", "ylim", "zlim"), zip(low, high, strict=True), strict=True))
    axes.set(**limits, xlabel="x mm", ylabel="y mm")
    axes.set_zlabel("z mm", labelpad=12)
    axes.tick_params("z", pad=6)
    for axis, span in zip((axes.xaxis, axes.yaxis, axes.zaxis), high - low, strict=True):
        axis.set_major_locator(MaxNLocator(max(2, round(8 * span / (high - low).max()))))
    axes.set_box_aspect(high - low, zoom=0.9)
    axes.view_init(math.degrees(math.asin(view[2])), math.degrees(math.atan2(view[1], view[0])))


def _outer_face(design: SheetDesign, u: Any, phi: Any) -> Any:
    """Points of the outer face [mm] at fractions of slant and wrap, shape (k, p, 3)."""
    import numpy as np

    thickness, place = design.choices.stack.thickness, design.place
    side = parallel(place.frustum, thickness)
    points = side.points(np.asarray(u)[:, None] * side.slant, np.asarray(phi)[None, :] * side.wrap)
    points[..., 2] -= thickness * side.sin_half_angle
    pose = place.link_frustum
    return 1e3 * (points @ np.array(pose.rotation).T + np.array(pose.translation))


def _draw_electrodes(axes: Any, design: SheetDesign, view: Any) -> None:
    """Middle lines of the electrodes and the two edges, as far as they face the viewer."""
    import numpy as np

    side, box, plan = design.place.frustum, design.layout.field, design.layout.plan
    half = 0.5 * plan.electrode
    turn = half / min(side.radius1, side.radius2)
    along, around = np.linspace(0.0, 1.0, 2), np.linspace(0.0, 1.0, 121)
    rotation = np.array(design.place.link_frustum.rotation)
    for name, u, phi, colour in (
        ("B", [(box.u1 - half) / side.slant], around, FOIL),
        ("A", [(box.u2 + half) / side.slant], around, FOIL),
        ("D", along, [(box.phi1 - turn) / side.wrap], FOIL),
        ("C", along, [(box.phi2 + turn) / side.wrap], FOIL),
        ("", along, [0.0], INK),
        ("", along, [1.0], INK),
    ):
        points = _outer_face(design, u, phi).reshape(-1, 3)
        facing = side.normals(np.broadcast_to(phi, points.shape[:1]) * side.wrap) @ rotation.T @ view > 0.02
        points[~facing] = np.nan
        axes.plot(*points.T, color=colour, lw=2.0 if name else 1.0)
        if facing.any() and name:
            middle = points[facing][facing.sum() // 3] if len(points) > 2 else points.mean(axis=0)
            axes.text(*middle, name, color="white", fontweight="bold", ha="center", va="center")


def _coarser(mesh: Mesh) -> Any:
    """Triangles of a mesh [m], merged in cells where there are too many to draw."""
    import numpy as np

    faces, vertices = mesh.faces, mesh.vertices
    size = float(np.ptp(vertices, axis=0).max())
    cell = size / 120.0
    while len(faces) > _MOST_FACES:
        keys = np.round(vertices / cell).astype(np.int64)
        _, first, place = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        vertices, faces = vertices[first], place.reshape(-1)[faces]
        faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
        faces = faces[np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1]]
        cell *= 1.3
    triangles = vertices[faces]
    for _ in range(8):  # halve long triangles: painted from back to front, they would cover what is before them
        edges = np.linalg.norm(triangles - np.roll(triangles, -1, axis=1), axis=2)
        long = edges.max(axis=1) > size / 20.0
        if not long.any() or len(triangles) > 4 * _MOST_FACES:
            break
        turned = np.stack([np.roll(t, -k, axis=0) for t, k in zip(triangles[long], edges[long].argmax(1), strict=True)])
        a, b, c = turned.transpose(1, 0, 2)
        middle = 0.5 * (a + b)
        halves = np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)
        triangles = np.concatenate([triangles[~long], *halves])
    return triangles


def _draw_deviation(figure: Any, design: SheetDesign, mesh: Mesh, tolerance: float) -> None:
    """Height of the mesh above the cone, over azimuth and slant distance."""
    import numpy as np
    from matplotlib import colormaps

    from .geometry.displacement import heights_by_ray
    from .geometry.rays import Rays

    side = design.place.frustum
    u = np.asarray(side.slant * (np.arange(180) + 0.5) / 180.0, np.float64)
    phi = np.asarray(side.wrap * (np.arange(360) + 0.5) / 360.0, np.float64)
    heights = heights_by_ray(Rays(mesh), design.place, u, phi, tolerance) * 1e3
    limit = tolerance * 1e3
    axes = figure.add_subplot()
    shown = np.ma.masked_where(heights < -limit, heights)
    axes.set_facecolor("#999999")
    extent = (0.0, math.degrees(side.wrap), 0.0, side.slant * 1e3)
    image = axes.imshow(
        shown, origin="lower", aspect="auto", extent=extent, cmap=colormaps["RdBu_r"], vmin=-limit, vmax=limit
    )
    figure.colorbar(image, label="mm above the cone")
    axes.set(xlabel="azimuth deg", ylabel="slant distance from end 1, mm", title=f"{design.name}: mesh against cone")
