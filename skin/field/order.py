"""Number of multipoles that a contact needs for a tolerance."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .disc import Discs, centre_distance
from .sheet import SectorSheet

__all__ = ["FIRST", "LADDER", "higher", "resolution", "truncation"]

Floats = NDArray[np.float64]

#: Orders to choose from, so that a batch falls into few groups.
LADDER = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 64, 80, 96, 128, 192, 288, 432)

_FEWEST = 4  # orders, or nothing tells how they die away

#: Order up to which the first choice goes; a scene that needs more may do better on points of its rims.
FIRST = 128


def resolution(
    sheet: SectorSheet, discs: Discs, contrast: float, tolerance: float, order: int | None = None
) -> NDArray[np.int64]:
    """Return the order to begin with for each scene, shape (n,); `FieldModel` raises it where the solution asks for it.

    A multipole falls like exp(-2 rate m). The rate is acosh(distance/radius) for the images that act: in the
    corners, in the edges unless the sheets are equal, across the shorter side; half the bispherical distance for a
    second disc; and ln(r/radius) for the apex. Near edges and other discs are exact (`near_images`), so what they cost
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
        orders = ladder[np.searchsorted(ladder, np.clip(1.0 + np.ceil(wanted), _FEWEST, FIRST))]
    else:
        orders = np.full(slowest.shape, order)
    return np.asarray(orders, dtype=np.int64)


def higher(order: int, error: float = math.inf, tolerance: float = 0.0) -> int:
    """Return the order to try next: what a geometric decay to that error needs, 1.1 to 1.6 times this one."""
    known = 0.0 < error < 0.1 and tolerance > 0.0
    more = math.log(0.3 * tolerance) / math.log(error) if known else 1.45
    return min((m for m in LADDER if m >= min(max(more, 1.1), 1.6) * order), default=LADDER[-1])


def truncation(order: int, from_half: Floats, from_last: Floats) -> Floats:
    """Estimate the error of order M from what its last multipoles still changed, shape (n,).

    Args:
        order: M.
        from_half: change by the upper half of the orders, of numbers of order 1 that the electrodes see, shape (n,).
        from_last: change by the upper quarter, shape (n,).

    Returns:
        ten times the rest of a geometric series (Aitken). Where the decay is only algebraic, as beside an edge that all
        but touches, that rest is a third to a half of the true one.
    """
    if order < 4:  # too few for a rate
        return from_last
    before = np.maximum(from_half - from_last, 0.0)
    ratio = np.minimum(from_last / np.maximum(before, 1e-300), 0.9)
    return np.asarray(np.maximum(10.0 * from_last * ratio / (1.0 - ratio), 1e-3 * from_last))
