"""How many multipoles and points a contact needs for a tolerance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .field_disc import Discs, centre_distance
from .field_sheet import SectorSheet

__all__ = ["LADDER", "Resolution", "resolution"]

Complex = NDArray[np.complex128]

#: Orders to choose from, so that a batch falls into few groups.
LADDER = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 64, 80, 96, 128)


@dataclass(frozen=True, slots=True, eq=False)
class Resolution:
    """What each scene needs.

    Attributes:
        order: M, shape (n,).
        points: N on each circle, shape (n,).
    """

    order: NDArray[np.int64]
    points: NDArray[np.int64]


def resolution(
    sheet: SectorSheet, discs: Discs, contrast: float, tolerance: float, order: int | None = None
) -> Resolution:
    """Order and points that leave about `tolerance` of the supply, for each scene.

    A multipole falls like exp(-2 rate m). The rate is acosh(distance/radius) for the images that act: in the
    corners, in the edges unless the sheets are equal, across the shorter side; half the bispherical distance for a
    second disc; and ln(r/radius) for the apex. The constant 0.52 covers all but 1 of 240 random sensors, 0.75 those
    next to an edge (measured against M = 128, N = 512).

    Args:
        sheet: the sheet.
        discs: the scenes.
        contrast: |Ru - Rl| / (Ru + Rl), the strength of the images in edges.
        tolerance: of the supply, above 0.
        order: M, if it is given.
    """
    a = discs.radius
    stretch = sheet.stretch(discs.u)
    corners = [np.abs(_flat_to(sheet, discs, u, phi)) for u in (0.0, sheet.width) for phi in (0.0, sheet.wrap)]
    rate = np.arccosh(np.maximum(np.minimum.reduce(corners) / a, 1.0))
    rate = np.minimum(rate, np.arccosh(np.maximum(min(sheet.length, sheet.breadth) * stretch / a, 1.0)))
    if sheet.curvature != 0.0:
        rate = np.minimum(rate, np.log(np.maximum(stretch / (abs(sheet.curvature) * a), 1.0)))
    if contrast > 0.0:
        room = sheet.edge_distances(discs.u, discs.phi).min(axis=-1)
        rate = np.minimum(rate, np.arccosh(np.maximum(room / a, 1.0)))
    slowest = rate.min(axis=1)
    near = (slowest < 1.0) & (contrast > 0.0)
    k = a.shape[1]
    for i in range(k):
        for j in range(i):
            d = centre_distance(sheet, discs.u[:, i], discs.phi[:, i], discs.u[:, j], discs.phi[:, j])
            cosh = (d * d - a[:, i] ** 2 - a[:, j] ** 2) / (2.0 * a[:, i] * a[:, j])
            pair = 0.5 * np.arccosh(np.maximum(cosh, 1.0))
            near |= pair < 1.0
            slowest = np.minimum(slowest, pair)
    if order is None:
        wanted = np.where(slowest < 0.45, 0.75, 0.56) * math.log(1.0 / tolerance) / np.maximum(slowest, 1e-3)
        ladder = np.array(LADDER)
        orders = ladder[np.searchsorted(ladder, np.minimum(1.0 + np.ceil(wanted), LADDER[-1]))]
    else:
        orders = np.full(slowest.shape, order)
    return Resolution(orders, np.where(near, 4, 2) * orders + 2)


def _flat_to(sheet: SectorSheet, discs: Discs, u: float, phi: float) -> Complex:
    """Flat coordinates of a point of the sheet from each centre [m]; beyond half a turn they only are large."""
    x0, _ = sheet.along(discs.u)
    y0, _ = sheet.across(discs.phi)
    x, _ = sheet.along(u)
    y, _ = sheet.across(phi)
    w = (x - x0) + 1j * (y - y0)
    kappa = sheet.curvature
    return np.asarray(w if kappa == 0.0 else sheet.stretch(discs.u) * np.expm1(kappa * w) / kappa, dtype=np.complex128)
