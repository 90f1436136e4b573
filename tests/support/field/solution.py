"""Solution of the field problems by coneskin's own model, in the vocabulary of the peers."""

from __future__ import annotations

import numpy as np

from coneskin.skin.field.fourport import Coupling, angular_phase, radial_phase
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.sheet import SectorSheet

from . import contact_patch as field_shape
from .contact_patch import ContactPatch, solve_patch
from .port_solution import PortSolution
from .problems import Array, CircularPatch, Problem


def field_model(problem: Problem, tolerance: float = 1e-12) -> FieldModel:
    """Return the sensor of a problem without contacts: a negative curvature where end 2 is the narrow one."""
    towards = 1.0 if problem.r2 > problem.r1 else -1.0
    sheet = SectorSheet(
        width=problem.outer - problem.inner,
        curvature=towards / problem.r1,
        arc=problem.r1 * problem.theta0,
        wrap=problem.theta0,
    )
    return FieldModel(sheet, problem.upper, problem.lower, tolerance)


def disc_arrays(problem: Problem) -> tuple[Array, Array, Array, Array]:
    """Return u, phi, radius and conductance of the discs, each of shape (1, discs)."""
    rows = [(abs(d.r - problem.r1), d.theta, d.radius, d.conductance) for d in problem.discs]
    u, phi, radius, conductance = np.array(rows).T[:, None, :]
    return u, phi, radius, conductance


def solve_discs(problem: Problem, order: int | None = None, coupling: Coupling | None = None) -> PortSolution:
    """Solve four-port and both phases of one scene of discs, at an order, or from a known coupling."""
    sensor = field_model(problem)
    return _ports(problem, sensor, coupling or sensor.contacts(*disc_arrays(problem), order=order))


def solve_general(problem: Problem, directions: int = 32, rings: int = 7) -> PortSolution:
    """Solve one contact of any shape by the general method."""
    sensor = field_model(problem)
    return _ports(problem, sensor, solve_patch(sensor, contact_patch(problem), directions, rings))


def _ports(problem: Problem, sensor: FieldModel, coupling: Coupling) -> PortSolution:
    phases = (radial_phase(adc=problem.load), angular_phase(adc=problem.load))
    readings = [sensor.read(coupling, phase) for phase in phases]
    return PortSolution(
        sensor.admittance(coupling)[0],
        np.array([r.electrodes[0] for r in readings]),
        np.array([r.currents[0] for r in readings]),
    )


def contact_patch(problem: Problem) -> ContactPatch:
    """Return the only contact of a sensor that widens, where e_u is e_r."""
    ((_, contact),) = problem.contacts
    if isinstance(contact, CircularPatch):
        outline = field_shape.disc(contact.radius)
    else:
        make = {"rectangle": field_shape.rectangle, "ellipse": field_shape.ellipse}[contact.shape]
        outline = make(contact.along, contact.across, contact.turn)
    return ContactPatch(contact.r - problem.r1, contact.theta, outline, contact.conductance)
