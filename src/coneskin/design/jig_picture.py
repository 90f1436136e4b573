"""Picture of a jig: the printed parts of each collar as they stand on the printer, a little apart."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from .workshop.jig import Collar

__all__ = ["draw_jig"]

_LIGHT = np.array([0.35, -0.55, 0.76])
_APART = 0.25  # of the radius of a part: how far the parts are drawn from each other
_LABEL = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1.0}
_COLOURS = ((0.42, 0.62, 0.78), (0.85, 0.62, 0.40), (0.55, 0.72, 0.50), (0.72, 0.58, 0.76))


def draw_jig(figure: Any, collars: Sequence[Collar]) -> None:
    """Draw the collars of a sheet.

    Args:
        figure: an empty figure of matplotlib.
        collars: at least one.
    """
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    grid = figure.subplots(1, len(collars), subplot_kw={"projection": "3d", "proj_type": "ortho"}, squeeze=False)
    for axes, collar in zip(grid.flat, collars, strict=True):
        shown, paint = [], []
        turned = -1.0 if collar.end == 1 else 1.0  # as it stands, end 1 is upside down
        for part in collar.parts:
            middle = 0.5 * (part.start + part.end)
            aside = 0.5 * _APART * max(part.surface.size[:2])
            off = np.array([aside * math.cos(middle), turned * aside * math.sin(middle), 0.0])
            triangles = 1e3 * (part.surface.vertices[part.surface.faces] + off)
            a, b, c = triangles.transpose(1, 0, 2)
            normal = np.cross(b - a, c - a)
            size = np.linalg.norm(normal, axis=1)
            bright = 0.55 + 0.45 * (normal @ _LIGHT) / np.where(size > 0.0, size, 1.0)
            shown.append(triangles)
            paint.append(np.clip(np.outer(bright, _COLOURS[(part.number - 1) % len(_COLOURS)]), 0.0, 1.0))
            at = 1e3 * (part.surface.vertices.mean(axis=0) + off)
            at[:2] += 0.35e3 * max(part.surface.size[:2]) * np.array([math.cos(middle), turned * math.sin(middle)])
            name = f"part {part.number}" + (", begins at edge 0" if part.number == 1 else "")
            axes.text(at[0], at[1], -8.0, name, fontsize=9, ha="center", zorder=10, bbox=_LABEL)
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
