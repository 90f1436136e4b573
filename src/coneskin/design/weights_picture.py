"""Picture of what counts on a link: its areas coloured by their weights, with the outlines of the sheets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from .sheets.sheet_design import SheetDesign

if TYPE_CHECKING:
    from coneskin.geometry.fit.touch_weights import TouchWeights

__all__ = ["draw_weights"]

_OUTLINE = "#d1495b"
_LIFT = 1e-3  # m; by which outlines stand off the outer face, so that they are not hidden


def draw_weights(figure: Any, triangles: Any, designs: Sequence[SheetDesign], weights: TouchWeights) -> None:
    """Draw the link from two sides, each area in the colour of its weight as a share of the largest.

    Args:
        figure: an empty figure of matplotlib.
        triangles: of the link [m], shape (n, 3, 3).
        designs: the sheets, of which the outlines are drawn.
        weights: what an area counts.
    """
    import numpy as np
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

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
                axes.plot(*line.T, color=_OUTLINE, lw=1.5)
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
    import numpy as np

    side, height = design.place.frustum, design.options.stack.thickness + _LIFT
    along, around = np.linspace(0.0, side.slant, 40), np.linspace(0.0, side.wrap, 180)
    found = []
    for u, phi in ((0.0, around), (side.slant, around), (along, 0.0), (along, side.wrap)):
        points, normals = design.place.place(u, phi)
        found.append((1e3 * (points + height * normals), normals))
    return found
