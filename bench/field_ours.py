"""coneskin's field model on the problems of field_problems, with the peers' vocabulary."""

from __future__ import annotations

from typing import Any

import numpy as np
from field_problems import Array, Disc, Ports, Problem

from coneskin.skin import field_shape
from coneskin.skin.field_coupling import Coupling
from coneskin.skin.field_fourport import Readings, angular_phase, radial_phase
from coneskin.skin.field_model import FieldModel
from coneskin.skin.field_patch import Patch, solve_patch
from coneskin.skin.field_sheet import SectorSheet

PHASES = (radial_phase(), angular_phase())


def model(problem: Problem, tolerance: float = 1e-12) -> FieldModel:
    """The sensor of a problem without its contacts: a negative curvature where end 2 is the narrow one."""
    towards = 1.0 if problem.r2 > problem.r1 else -1.0
    sheet = SectorSheet(
        width=problem.outer - problem.inner,
        curvature=towards / problem.r1,
        arc=problem.r1 * problem.theta0,
        wrap=problem.theta0,
    )
    return FieldModel(sheet, problem.upper, problem.lower, tolerance)


def discs(problem: Problem) -> tuple[Array, Array, Array, Array]:
    """u, phi, radius and conductance of the discs, each of shape (1, discs)."""
    rows = [(abs(d.r - problem.r1), d.theta, d.radius, d.conductance) for d in problem.discs]
    u, phi, radius, conductance = np.array(rows).T[:, None, :]
    return u, phi, radius, conductance


def solve(problem: Problem, order: int | None = None) -> Ports:
    """Four-port and both phases of one scene of discs; `order` None lets the solver choose."""
    sensor = model(problem)
    u, phi, radius, conductance = discs(problem)
    return _ports(problem, sensor, sensor.contacts(u, phi, radius, conductance, order=order))


def solve_general(problem: Problem, directions: int = 32, rings: int = 7) -> Ports:
    """The same of one contact of any shape, by the general method."""
    sensor = model(problem)
    return _ports(problem, sensor, solve_patch(sensor, _patch(problem), directions, rings))


def _ports(problem: Problem, sensor: FieldModel, coupling: Coupling) -> Ports:
    phases = (radial_phase(adc=problem.load), angular_phase(adc=problem.load))
    readings = [sensor.read(coupling, phase) for phase in phases]
    return Ports(
        sensor.admittance(coupling)[0],
        np.array([r.electrodes[0] for r in readings]),
        np.array([r.currents[0] for r in readings]),
    )


def _patch(problem: Problem) -> Patch:
    """The only contact of a sensor that widens, where e_u is e_r."""
    ((_, contact),) = problem.contacts
    if isinstance(contact, Disc):
        outline = field_shape.disc(contact.radius)
    else:
        make = {"rectangle": field_shape.rectangle, "ellipse": field_shape.ellipse}[contact.shape]
        outline = make(contact.along, contact.across, contact.turn)
    return Patch(contact.r - problem.r1, contact.theta, outline, contact.conductance)


class Single:
    """One disc at a time, both phases: what a user's loop pays for each. `order` None: the solver's choice."""

    def __init__(self, problem: Problem, order: int | None, tolerance: float = 1e-12) -> None:
        self.sensor, self.order, self.count = model(problem, tolerance), order, 1
        self.contact: tuple[Any, ...] = tuple(float(row[0, 0]) for row in discs(problem))

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
        self.sensor, self.patch, self.cells, self.count = model(problem), _patch(problem), (directions, rings), 1

    def __call__(self) -> list[Readings]:
        coupling = solve_patch(self.sensor, self.patch, *self.cells)
        return [self.sensor.read(coupling, phase) for phase in PHASES]


class Map:
    """10 000 discs all over the sheet, both phases: an error map."""

    def __init__(self, problem: Problem, tolerance: float = 1e-9, side: int = 100) -> None:
        self.sensor, self.count = model(problem, tolerance), side * side
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


def error(readings: list[Readings], reference: Ports) -> float:
    """Largest error of an electrode's potential over both phases [V at 1 V of drive]."""
    pairs = zip(readings, reference.voltages, strict=True)
    return max(float(np.abs(r.electrodes[0] - volts).max()) for r, volts in pairs)
