"""Run times of coneskin's field model on the problems that the peers solve too."""

from __future__ import annotations

from typing import Any

import numpy as np

from coneskin.skin.field.fourport import Readings, angular_phase, radial_phase
from coneskin.skin.field.patch import solve_patch
from tests.support.field.port_solution import PortSolution
from tests.support.field.problems import Problem
from tests.support.field.solution import contact_patch, disc_arrays, field_model

PHASES = (radial_phase(), angular_phase())


class Single:
    """One disc at a time, both phases: what a user's loop pays for each. `order` None: the solver's choice."""

    def __init__(self, problem: Problem, order: int | None, tolerance: float = 1e-12) -> None:
        self.sensor, self.order, self.count = field_model(problem, tolerance), order, 1
        self.contact: tuple[Any, ...] = tuple(float(row[0, 0]) for row in disc_arrays(problem))

    def __call__(self) -> list[Readings]:
        u, phi, radius, conductance = self.contact
        coupling = self.sensor.contacts(u, phi, radius, conductance, order=self.order)
        return [self.sensor.read(coupling, phase) for phase in PHASES]


class Batch(Single):
    """Many different discs in one call, the problem's own the first of them.

    The others lie within a twentieth of a radius of it, where the same order leaves the same error.
    """

    def __init__(self, problem: Problem, order: int | None, tolerance: float = 1e-12, count: int = 2000) -> None:
        super().__init__(problem, order, tolerance)
        u, phi, radius, conductance = self.contact
        draw = np.random.default_rng(1)
        us, phis = np.full(count, u), np.full(count, phi)
        us[1:] += radius * draw.uniform(-0.05, 0.05, count - 1)
        phis[1:] += radius / problem.discs[0].r * draw.uniform(-0.05, 0.05, count - 1)
        self.contact, self.count = (us, phis, radius, conductance), count


class General:
    """One contact of any shape by the general method, both phases."""

    def __init__(self, problem: Problem, directions: int, rings: int) -> None:
        self.sensor, self.patch = field_model(problem), contact_patch(problem)
        self.cells, self.count = (directions, rings), 1

    def __call__(self) -> list[Readings]:
        coupling = solve_patch(self.sensor, self.patch, *self.cells)
        return [self.sensor.read(coupling, phase) for phase in PHASES]


class Map:
    """10 000 discs all over the sheet, both phases: an error map."""

    def __init__(self, problem: Problem, tolerance: float = 1e-9, side: int = 100) -> None:
        self.sensor, self.count = field_model(problem, tolerance), side * side
        radius, conductance = problem.discs[0].radius, problem.discs[0].conductance
        inner, outer = problem.inner + 1.1 * radius, problem.outer - 1.1 * radius
        r, share = np.meshgrid(np.linspace(inner, outer, side), np.linspace(0.0, 1.0, side))
        margin = np.arcsin(1.1 * radius / r)
        phi = margin + share * (problem.theta0 - 2 * margin)
        self.contact = (np.abs(r - problem.r1).ravel(), phi.ravel(), radius, conductance)

    def __call__(self) -> list[Readings]:
        u, phi, radius, conductance = self.contact
        coupling = self.sensor.contacts(u, phi, radius, conductance)
        return [self.sensor.read(coupling, phase) for phase in PHASES]


def error(readings: list[Readings], reference: PortSolution) -> float:
    """Largest error of an electrode's potential over both phases [V at 1 V of drive]."""
    pairs = zip(readings, reference.voltages, strict=True)
    return max(float(np.abs(r.electrodes[0] - volts).max()) for r, volts in pairs)
