"""How many multipoles a contact needs for a tolerance."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .field_disc import Discs, centre_distance
from .field_sheet import SectorSheet

__all__ = ["LADDER", "higher", "resolution"]

#: Orders to choose from, so that a batch falls into few groups.
LADDER = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 64, 80, 96, 128)


def resolution(
    sheet: SectorSheet, discs: Discs, contrast: float, tolerance: float, order: int | None = None
) -> NDArray[np.int64]:
    """Order to begin with for each scene, shape (n,); `FieldModel` raises it where the solution asks for it.

    A multipole falls like exp(-2 rate m). The rate is acosh(distance/radius) for the images that act: in the
    corners, in the edges unless the sheets are equal, across the shorter side; half the bispherical distance for a
    second disc; and ln(r/radius) for the apex. Near edges and other discs are exact (`field_image`), so what they cost
    depends on the contact too, and is left to the solution's own estimate.

    Args:
        sheet: the sheet.
        discs: the scenes.
        contrast: |Ru - Rl| / (Ru + Rl), the strength of the images in edges.
        tolerance: of the supply, above 0.
        order: M, if it is given.
    """
    a = discs.radius
    stretch = sheet.stretch(discs.u)
    # The four corners in one go; a flat distance beyond half a turn is none, but large.
    w = np.array([0.0, 0.0, sheet.length, sheet.length]) + 1j * np.array([0.0, sheet.breadth, 0.0, sheet.breadth])
    w = w - (sheet.along(discs.u)[0] + 1j * sheet.across(discs.phi)[0])[..., None]
    kappa = sheet.curvature
    corners = np.abs(w) if kappa == 0.0 else stretch[..., None] * np.abs(np.expm1(kappa * w) / kappa)
    reach = np.minimum(corners.min(axis=-1), min(sheet.length, sheet.breadth) * stretch) / a
    rate = np.arccosh(np.maximum(reach, 1.0))
    if kappa != 0.0:
        rate = np.minimum(rate, np.log(np.maximum(stretch / (abs(kappa) * a), 1.0)))
    if contrast > 0.0:
        room = sheet.edge_distances(discs.u, discs.phi).min(axis=-1)
        # Taken out exactly, an edge costs about half of the orders, and a touching one no more than a near one.
        rate = np.minimum(rate, 1.75 * np.arccosh(np.maximum(room / a, 1.15)))
    slowest = rate.min(axis=1)
    k = a.shape[1]
    for i in range(k):
        for j in range(i):
            d = centre_distance(sheet, discs.u[:, i], discs.phi[:, i], discs.u[:, j], discs.phi[:, j])
            cosh = (d * d - a[:, i] ** 2 - a[:, j] ** 2) / (2.0 * a[:, i] * a[:, j])
            slowest = np.minimum(slowest, 1.75 * 0.5 * np.arccosh(np.maximum(cosh, 1.65)))
    if order is None:
        wanted = 0.56 * math.log(1.0 / tolerance) / np.maximum(slowest, 1e-3)
        ladder = np.array(LADDER)
        orders = ladder[np.searchsorted(ladder, np.minimum(1.0 + np.ceil(wanted), LADDER[-1]))]
    else:
        orders = np.full(slowest.shape, order)
    return np.asarray(orders, dtype=np.int64)


def higher(order: int) -> int:
    """The order to try next, about half as much again."""
    return min((m for m in LADDER if m >= 1.45 * order), default=LADDER[-1])
