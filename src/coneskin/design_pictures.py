"""Pictures for the report. The only importer of matplotlib in the design."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .design import SheetDesign
from .errors import MissingExtra
from .geometry.outline import Outline
from .geometry.pen import Corner, draw, draw_circle, flat_point
from .geometry.sector import unroll
from .geometry.stack import parallel

if TYPE_CHECKING:
    from .geometry.mesh import Mesh

__all__ = ["draw_pictures"]

_INK, _FOIL, _ACTIVE, _SHEET = "#222222", "#c27c0e", "#9fd3c7", ("#2a7fb8", "#d1495b", "#6a994e", "#8d5a97")
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
        _draw_layout(figure, design)
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


def _xy(outline: Outline) -> tuple[list[float], list[float]]:
    """Points of an outline [mm], closed."""
    flat = outline.flattened(5e-5)
    points = [(x * 1e3, y * 1e3) for x, y, _ in flat.vertices]
    points += points[:1] if outline.closed else []
    return [x for x, _ in points], [y for _, y in points]


def _draw_layout(figure: Any, design: SheetDesign) -> None:
    """All that is on a sheet, on the cone of its upper conductive layer, with dimensions."""
    axes = figure.add_subplot()
    layout = design.layout
    cone = design.cuts[4].surface
    box = layout.active
    active = tuple(
        Corner(u, p) for u, p in ((box.u1, box.phi1), (box.u1, box.phi2), (box.u2, box.phi2), (box.u2, box.phi1))
    )
    axes.fill(*_xy(draw(cone, active)), color=_ACTIVE, alpha=0.6, lw=0)
    axes.plot(*_xy(draw(cone, layout.rim)), color=_INK, lw=1.4)
    axes.plot(*_xy(draw(cone, layout.upper)), color=_INK, lw=0.5, ls="--")
    axes.plot(*_xy(draw(cone, layout.lower)), color=_INK, lw=0.5, ls=":")
    for name, foil in layout.foils.items():
        axes.fill(*_xy(draw(cone, foil)), facecolor=_FOIL, alpha=0.45 if name in "AB" else 0.8, edgecolor=_INK, lw=0.4)
    for u, phi in layout.holes:
        axes.fill(*_xy(draw_circle(cone, u, phi, layout.plan.hole)), facecolor="white", edgecolor=_INK, lw=0.8)
    _dimensions(axes, design, cone)
    axes.margins(0.08)
    axes.set_aspect("equal")
    axes.axis("off")


def _dimensions(axes: Any, design: SheetDesign, cone: Any) -> None:
    """Arc lengths at both ends, the slant, the sector, and the names of the electrodes."""
    wrap, slant, layout = cone.wrap, cone.slant, design.layout
    lift = 0.06 * max(slant, 0.3 * wrap * max(cone.radius1, cone.radius2))
    style = {"ha": "center", "va": "center", "fontsize": 9, "color": _INK}

    def at(u: float, phi: float) -> tuple[float, float]:
        x, y = flat_point(cone, u, phi)
        return x * 1e3, y * 1e3

    x0, y0, x1, y1 = draw(cone, layout.rim).bounds
    far = 1.5e3 * lift
    bottom, right = y0 * 1e3 - far - 12.0 * bool(layout.plan.wires == "end1"), x1 * 1e3 + far
    arrow = {"arrowstyle": "<->", "color": _INK, "lw": 0.7, "shrinkA": 0, "shrinkB": 0}
    axes.plot([x0 * 1e3, x1 * 1e3, right], [bottom - 0.6e3 * lift, bottom, bottom], lw=0.0)  # arrows make no room
    axes.annotate("", (x0 * 1e3, bottom), (x1 * 1e3, bottom), arrowprops=arrow)
    axes.text(500.0 * (x0 + x1), bottom, f"{(x1 - x0) * 1e3:.2f}", **style, backgroundcolor="white")
    axes.annotate("", (right, y0 * 1e3), (right, y1 * 1e3), arrowprops=arrow)
    axes.text(right, 500.0 * (y0 + y1), f"{(y1 - y0) * 1e3:.2f}", rotation=90, **style, backgroundcolor="white")
    flat = unroll(cone)
    lines = [
        f"{design.name}, upper conductive layer",
        f"slant {slant * 1e3:.3f}",
        f"arcs {flat.arc1 * 1e3:.3f} (end 1), {flat.arc2 * 1e3:.3f} (end 2)",
    ]
    if math.isfinite(flat.r1):
        lines.append(f"r1 {flat.r1 * 1e3:.3f}, r2 {flat.r2 * 1e3:.3f}, theta0 {math.degrees(flat.theta0):.4f} deg")
    lines.append(f"active {1e4 * layout.active.area(layout.sheet):.1f} cm2 ({layout.active_share:.0%})")
    axes.text(*at(0.5 * slant, 0.5 * wrap), "\n".join(lines), **style)
    half = 0.5 * layout.plan.electrode
    narrow = min(layout.sheet.radius1, layout.sheet.radius2)
    field = layout.field
    for name, u, phi in (
        ("A", field.u2 + half, 0.42 * wrap),
        ("B", field.u1 - half, 0.42 * wrap),
        ("C", 0.5 * slant, field.phi2 + half / narrow),
        ("D", 0.5 * slant, field.phi1 - half / narrow),
    ):
        axes.text(*at(u, phi), name, **{**style, "fontweight": "bold"})


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
        ("B", [(box.u1 - half) / side.slant], around, _FOIL),
        ("A", [(box.u2 + half) / side.slant], around, _FOIL),
        ("D", along, [(box.phi1 - turn) / side.wrap], _FOIL),
        ("C", along, [(box.phi2 + turn) / side.wrap], _FOIL),
        ("", along, [0.0], _INK),
        ("", along, [1.0], _INK),
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
