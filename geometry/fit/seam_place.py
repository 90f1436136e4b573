"""Place of the blind seam around an axis: where the link itself keeps touches away most.

A seam can face any way around a full wrap, and the cable leaves beside it. What stands out from the link beyond the
ends of the tube (a joint, a flange) shields one side of it; a hand comes from the other sides. So the seam, its
electrodes and the cable lie where the least of the half-space above them is free.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.ray_casting import RayCaster

from .cones import LinkFit
from .touch_weights import TouchWeights, free_shares

_AZIMUTH_COUNT = 36
_ROW_COUNT = 21  # along a sheet; most of what shields a tube stands beyond its ends
_NEAR_AZIMUTHS = 1  # azimuths on both sides that count too: a blind seam is 20 to 35 deg wide
_SEAM_MARGIN = math.radians(15.0)  # rad on both sides of a seam that its electrodes take
_MIN_SHIELDED_SHARE = 0.005  # of the half-space; a smaller difference between the sides is the error of the rays


def place_seams(fit: LinkFit, mesh: Mesh, weights: TouchWeights | None = None) -> tuple[LinkFit, tuple[str, ...]]:
    """Turn the full wraps of a fit until their seams lie where the link shields them most.

    Sheets about one axis are turned together, so that their cables run side by side. Partial wraps stay: they have no
    choice. Where nothing shields any side, the seams stay as well.

    Args:
        weights: where touches are likely; the free space of a place counts as much as its weight.

    Returns:
        the fit, and a sentence for each axis that says where its seam faces, and why.
    """
    rays = RayCaster(mesh)
    sheets = list(fit.sheets)
    reasons: list[str] = []
    for axis in dict.fromkeys(sheet.axis for sheet in sheets):
        full = [i for i, sheet in enumerate(sheets) if sheet.axis == axis and sheet.frustum.wrap == math.tau]
        if not full:
            continue
        parts = [_touches_around(sheets[i].placed, rays, weights) for i in full]
        area = np.array([sheets[i].frustum.area for i in full])
        exposed = np.average(parts, axis=0, weights=area)
        wide = np.mean([np.roll(exposed, k) for k in range(-_NEAR_AZIMUTHS, _NEAR_AZIMUTHS + 1)], axis=0)
        best = int(wide.argmin())
        shielded, least = 1.0 - float(wide[best]), 1.0 - float(wide.max())
        flat = _bends_around([sheets[i].placed for i in full])
        even = shielded - least < _MIN_SHIELDED_SHARE
        if even:
            best = 0 if flat is None else int(flat.argmin())
        elif flat is not None:  # among the places that are shielded as well, that with the least bend: it peels least
            best = int(np.where(wide <= wide.min() + _MIN_SHIELDED_SHARE, flat, np.inf).argmin())
            shielded = 1.0 - float(wide[best])
        turn = best * math.tau / _AZIMUTH_COUNT
        for i in full:
            sheets[i] = replace(sheets[i], placed=sheets[i].placed.turned(turn))
        direction = sheets[full[0]].placed.link_frustum.rotate((1.0, 0.0, 0.0))
        numbers = [str(i + 1) for i in full]
        names = f"{', '.join(numbers[:-1])} and {numbers[-1]}" if len(numbers) > 1 else numbers[0]
        reasons.append(_reason(names, direction, shielded, least, weights, even and flat is not None))
    return replace(fit, sheets=tuple(sheets)), tuple(reasons)


def _touches_around(placed: PlacedFrustum, rays: RayCaster, weights: TouchWeights | None) -> Floats:
    """Return the share of the half-space that is free, weighted, at evenly spaced azimuths, shape (azimuths,)."""
    side = placed.frustum
    u = (np.arange(_ROW_COUNT) + 0.5) * side.slant / _ROW_COUNT
    phi = np.arange(_AZIMUTH_COUNT) * math.tau / _AZIMUTH_COUNT
    points, normals = placed.place(u[:, None], phi[None, :])
    points, normals = points.reshape(-1, 3), normals.reshape(-1, 3)
    free = free_shares(points, normals, rays) * (1.0 if weights is None else weights.at(points))
    return np.asarray(free.reshape(_ROW_COUNT, _AZIMUTH_COUNT).mean(axis=0))


def _bends_around(places: list[PlacedFrustum]) -> Floats | None:
    """Return how sharply the sheets are bent around evenly spaced azimuths [rad]; None of cones."""
    if not any(placed.bends for placed in places):
        return None
    worst = np.zeros(_AZIMUTH_COUNT)
    reach = np.linspace(-1.0, 1.0, 9) * _SEAM_MARGIN
    for placed in places:
        phi = np.arange(_AZIMUTH_COUNT)[:, None] * math.tau / _AZIMUTH_COUNT + reach
        normals = placed.place(np.zeros(phi.shape), phi)[1]
        turns = np.linalg.norm(np.diff(normals, axis=1), axis=2).sum(axis=1)
        worst = np.maximum(worst, np.round(turns, 3))
    return worst


def _reason(
    names: str,
    direction: tuple[float, float, float],
    shielded: float,
    least: float,
    weights: TouchWeights | None,
    flattest: bool,
) -> str:
    x, y, z = (f"{value:z.2f}" for value in direction)
    several = " and " in names
    whose = f"the seams of sheets {names} face" if several else f"the seam of sheet {names} faces"
    where = f"{whose} ({x}, {y}, {z}) of the link's frame"
    other = "--seam puts it elsewhere"
    if flattest:
        return f"{where}, where the link is flattest, because a seam over a sharp bend peels; {other}"
    if shielded - least < _MIN_SHIELDED_SHARE:
        return f"{where}: the link shields no side more than another, so it is any side; {other}"
    if weights is not None:
        return f"{where}, where touches count least by {weights.name}; the cable leaves beside it; {other}"
    return (
        f"{where}, where the link itself shields {shielded:.1%} of the space above it, and {least:.1%} on the most "
        f"exposed side; the cable leaves beside it; {other}"
    )
