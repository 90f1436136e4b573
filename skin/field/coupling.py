"""Coupling of the sheets by the contacts: six numbers, all that the electrodes can ever learn of them.

The electrodes impose a difference of the sheets h0 + hx x/L + hy y/T with h0 = V_B - V_D, hx = V_A - V_B,
hy = -(V_C - V_D). The current through the contacts answers with its total and its two first moments, and by reciprocity
through one symmetric 3 x 3 matrix W = G v v^T + P, v = (1, X, Y). Hence the sensor is a reciprocal 4-port whose
rows sum to zero, with exactly these six numbers beside the two known sheets.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .sheet import SectorSheet

__all__ = ["ELECTRODES", "Coupling", "admittance"]

Floats = NDArray[np.float64]

#: Order of every axis over electrodes: A (end 2) and B (end 1) of the upper sheet, C (phi=wrap) and D (phi=0) below.
ELECTRODES = ("A", "B", "C", "D")

# h = (h0, hx, hy) of the potentials of (A, B, C, D); its transpose gives the currents into the sensor.
_H = np.array([[0.0, 1.0, 0.0, -1.0], [1.0, -1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 1.0]])


@dataclass(frozen=True, slots=True, eq=False)
class Coupling:
    """The effect of the contacts between the sheets, one entry for each scene.

    Attributes:
        conductance: G, total conductance between the sheets, spreading in both included [S], shape (n,).
        x: X, electrical centre along the slant as a fraction of L (of the potential in the upper sheet), shape (n,).
        y: Y, electrical centre around as a fraction of T, shape (n,).
        xx: what the contacts add along the slant by letting current change sheets [S], shape (n,).
        xy: the same, across: what moves the guide pair apart [S], shape (n,).
        yy: the same, around [S], shape (n,).
        error: estimate of the error: of X, Y and the guides' potentials relative to the supply, of the rest relative to
            the conductances beside it; NaN where the method has no estimate, shape (n,).
    """

    conductance: Floats
    x: Floats
    y: Floats
    xx: Floats
    xy: Floats
    yy: Floats
    error: Floats

    def __len__(self) -> int:
        return int(self.conductance.shape[0])

    @classmethod
    def of_matrix(cls, w: Floats, fallback: Floats, error: Floats | None = None) -> Coupling:
        """Make it from W, shape (n, 3, 3); fallback: (X, Y) where nothing touches, shape (n, 2)."""
        g = w[:, 0, 0]
        divisor = np.where(g > 0.0, g, 1.0)
        centre = np.where(g[:, None] > 0.0, w[:, 0, 1:] / divisor[:, None], fallback)
        x, y = centre[:, 0], centre[:, 1]
        error = np.full(g.shape, np.nan) if error is None else error
        return cls(g, x, y, w[:, 1, 1] - g * x * x, w[:, 1, 2] - g * x * y, w[:, 2, 2] - g * y * y, error)

    def matrix(self) -> Floats:
        """Return W [S], shape (n, 3, 3), symmetric."""
        g, x, y = self.conductance, self.x, self.y
        w = np.empty((len(self), 3, 3))
        w[:, 0, 0] = g
        w[:, 0, 1] = w[:, 1, 0] = g * x
        w[:, 0, 2] = w[:, 2, 0] = g * y
        w[:, 1, 1] = g * x * x + self.xx
        w[:, 1, 2] = w[:, 2, 1] = g * x * y + self.xy
        w[:, 2, 2] = g * y * y + self.yy
        return w


def admittance(coupling: Coupling, sheet: SectorSheet, upper_resistance: float, lower_resistance: float) -> Floats:
    """Compute Y of the 4-port, I = Y V, currents into the sensor at (A, B, C, D) [S], shape (n, 4, 4).

    Symmetric exactly; rows sum to zero to rounding of their entries. Where contacts are so weak that they vanish
    beside the sheets, `fourport.solve_phase` is more accurate than this matrix, because it never adds the two.
    """
    y = _H.T @ coupling.matrix() @ _H
    y = 0.5 * (y + y.transpose(0, 2, 1))
    upper = sheet.breadth / (upper_resistance * sheet.length)
    lower = sheet.length / (lower_resistance * sheet.breadth)
    y[:, :2, :2] += upper * np.array([[1.0, -1.0], [-1.0, 1.0]])
    y[:, 2:, 2:] += lower * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return np.asarray(y, dtype=np.float64)
