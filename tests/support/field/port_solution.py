"""Solutions of the field problems: what every peer returns, and what the electronics see of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .problems import Array


@dataclass(frozen=True, slots=True, eq=False)
class PortSolution:
    """The potentials and currents at the electrodes, in the order A, B, C, D.

    `admittance` [S] has shape (4, 4). `voltages` [V] and `currents` [A, into the sensor] have shape (2, 4): row 0 is
    the radial phase (B at 1 V, A at 0, guides C and D), row 1 the angular one (C at 1 V, D at 0, guides A and B).
    """

    admittance: Array
    voltages: Array
    currents: Array


@dataclass(frozen=True, slots=True, eq=False)
class PeerSolution:
    """A peer's solution: energies of the three modes [S], seconds spent in each step, number of unknowns.

    `potentials` (u, v) at the points asked for have shape (3, points, 2): mode, point, sheet; None where none were.
    """

    energies: Array
    seconds: dict[str, float]
    unknowns: int
    potentials: Array | None = None


def port_solution(energies: Array, load: float) -> PortSolution:
    """Return the four-port and the two phases from the energies of the three modes (see `problems`).

    The guides are solved for their common and their difference voltage, because with a weak contact their
    own admittance is nearly singular: its small part is the contact, which is row 2 of `energies`.
    """
    # Columns: the modes that make up A, B, C, D at 1 V alone; A is "everything" (no energy) less B less C and D.
    unit = np.array([[-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0], [-1.0, 0.0, 0.0, 1.0]])
    admittance = unit.T @ energies @ unit
    leak = 0.0 if math.isinf(load) else 1.0 / load
    # Guide voltages (c + d, c): leak of both as a quadratic form in (c, d).
    leaks = leak * np.array([[2.0, 1.0], [1.0, 1.0]])
    voltages = np.zeros((2, 4))
    # Radial: drive mode 0, common mode 2 (C and D), difference mode 1 (C).
    guide = energies[np.ix_([2, 1], [2, 1])] + leaks
    common, difference = np.linalg.solve(guide, -energies[[2, 1], 0])
    voltages[0] = [0.0, 1.0, common + difference, common]
    radial = energies @ [1.0, difference, common]
    # Angular: drive mode 1, common mode A and B = "everything" less mode 2, difference mode 0 (B).
    flip = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    guide = flip @ energies @ flip.T + leaks
    common, difference = np.linalg.solve(guide, -flip @ energies[:, 1])
    voltages[1] = [common, common + difference, 1.0, 0.0]
    angular = energies @ [difference, 1.0, -common]
    return PortSolution(admittance, voltages, np.array([_currents(radial), _currents(angular)]))


def _currents(flux: Array) -> Array:
    """Return the electrode currents A, B, C, D [A] from the currents of the three modes."""
    return np.array([-flux[0] - flux[2], flux[0], flux[1], flux[2] - flux[1]])
