"""Disturbances in bench `decode`: wrong leads, a leak, a supply that sags; contacts of other outlines; run time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bench.report import quantile
from tests.support.field.converter_plant import leak_admittance

from .cells import electronics
from .plants import RADII, SHEETS, Case, SolvedPlants, disc_cases, radius_at, shape_cases
from .runs import LEARNED_FRAMES, Sitting, decode

ELECTRONICS_NAME = "16 bit, matched"  # so that noise hides nothing


@dataclass
class Errors:
    """Errors of touches under one disturbance.

    Attributes:
        what: the disturbance, or the outline.
        median, most: of the errors, and what 95 % stay below [m].
        valid: part of the touches whose place is certain within the frames.
        of: touches.
    """

    what: str
    median: float
    most: float
    valid: float
    of: int


def measure(plants: SolvedPlants, places: int) -> list[Errors]:
    """Measure each disturbance on discs all over the forearm, then contacts that are no whole discs."""
    circuit = electronics("UR5e")[ELECTRONICS_NAME]
    discs = [case for radius in RADII[1:3] for ka in (1.0, 3.0) for case in disc_cases("UR5e", radius, ka, places)]
    rng = np.random.default_rng(8)
    unequal = [replace(circuit, leads=tuple(rng.uniform(3.0, 12.0, 4).tolist())) for _ in range(4)]
    found = [
        _errors("none", plants, discs, [circuit], 0.0),
        _errors("leak of 100 kohm between the layers", plants, discs, [circuit], 1e-5),
        _errors("leads of 3 to 12 ohm, told as 1 ohm, not calibrated", plants, discs, unequal, 0.0),
        _errors(
            "supply 1 % lower in the radial phase, one supply sent",
            plants,
            discs,
            [replace(circuit, phase_supply=(1.0, 0.99, 1.0))],
            0.0,
        ),
    ]
    shapes = shape_cases("UR5e", 4 * places)
    for kind in dict.fromkeys(case.kind for case in shapes):
        found.append(_errors(kind, plants, [case for case in shapes if case.kind == kind], [circuit], 0.0))
    return found


def centroid(case: Case) -> tuple[float, float]:
    """Return the centroid of what lies on the sheet (u [m], phi [rad])."""
    (patch,), plant = case.patches, SHEETS[case.sheet]
    t = (np.arange(200) + 0.5) / 100.0 - 1.0
    x, y = (grid.ravel() for grid in np.meshgrid(t, t))
    inside = x * x + y * y < 1.0
    x, y = patch.along * x[inside], patch.across * y[inside]
    u = patch.u + np.cos(patch.turn) * x - np.sin(patch.turn) * y
    phi = patch.phi + (np.sin(patch.turn) * x + np.cos(patch.turn) * y) / radius_at(plant, patch.u)
    on = (u > 0.0) & (u < plant.slant) & (phi > 0.0) & (phi < plant.wrap)
    return float(u[on].mean()), float(phi[on].mean())


def _errors(what: str, plants: SolvedPlants, cases: list[Case], circuits: list, leak: float) -> Errors:
    plant, rng = SHEETS["UR5e"], np.random.default_rng(9)
    y = np.array([plants.of(case) for case in cases]) + leak_admittance(leak)
    still = plants.admittance(plant, ()) + leak_admittance(leak)
    places = np.array([centroid(case) for case in cases])
    errors, certain = [], []
    for c in circuits:
        untouched, touches = c.counts(c.exact(still), LEARNED_FRAMES, rng), c.counts(c.exact(y), 20, rng)
        answer = decode(Sitting(plant, c, untouched, touches))
        du = answer["u"] - places[:, :1]
        ds = plant.radius1 * (answer["phi"] - places[:, 1:])
        errors += np.hypot(du, ds)[:, 1].tolist()
        certain += answer["valid"].any(axis=1).tolist()
    valid = float(np.mean(certain))
    return Errors(what, quantile(errors, 0.5), quantile(errors, 0.95), valid, len(cases) * len(circuits))


def run_time(plants: SolvedPlants, rounds: int) -> tuple[float, ...]:
    """Return the median time of a frame of a touch, bytes to event, of the first and of the second one [s].

    Each frame counts with the quickest of the rounds: what else the computer does only adds to it.
    """
    plant, circuit = SHEETS["UR5e"], electronics("UR5e")["12 bit, matched"]
    rng = np.random.default_rng(10)
    exact = circuit.exact(np.array([plants.of(case) for case in disc_cases("UR5e", RADII[1], 1.0, 1)] * 20))
    sitting = Sitting(
        plant,
        circuit,
        circuit.counts(circuit.exact(plants.admittance(plant, ())), LEARNED_FRAMES, rng),
        circuit.counts(exact, 200, rng),
    )
    seconds = np.min([decode(sitting)["seconds"] for _ in range(rounds)], axis=0)
    return tuple(float(np.median(part)) for part in (seconds[:, 1:], seconds[:, 0], seconds[:, 1]))
