"""Committed solutions of the field problems by NGSolve, with their provenance; bench `field-reference` writes them."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .port_solution import PortSolution, port_solution
from .problems import Array, CircularPatch, EllipticPatch, Problem

PATH = Path(__file__).with_name("reference.json")


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """One problem and its reference solution.

    `energies` as in `problems`; `potentials` [V] at `points` (r [m], theta [rad]) for both phases, shape
    (2, points, 2 sheets); `estimate`: largest difference between two meshes and orders of the electrodes' voltages (at
    1 V of drive) and currents (in units of the drive current); `field_estimate`: that of the potentials [V].
    """

    problem: Problem
    energies: Array
    points: Array
    potentials: Array
    estimate: float
    field_estimate: float

    @property
    def ports(self) -> PortSolution:
        """Potentials and currents at the electrodes."""
        return port_solution(self.energies, self.problem.load)


def load_references(path: Path = PATH) -> list[Reference]:
    """Return the committed references."""
    return [_decode(entry) for entry in json.loads(path.read_text())["sensors"]]


def provenance(path: Path = PATH) -> dict[str, Any]:
    """Return versions, orders, date and command of the committed file."""
    found: dict[str, Any] = json.loads(path.read_text())["provenance"]
    return found


def encode_reference(r: Reference) -> dict[str, Any]:
    """Return a reference as the file holds it."""
    problem = asdict(r.problem)
    problem["load"] = None if math.isinf(r.problem.load) else r.problem.load
    problem["discs"] = [
        [d.r, d.theta, d.radius, None if math.isinf(d.conductance) else d.conductance] for d in r.problem.discs
    ]
    problem["patches"] = [list(asdict(p).values()) for p in r.problem.patches]
    return {
        "problem": problem,
        "energies": r.energies[np.triu_indices(3)].tolist(),
        "points": r.points.tolist(),
        "potentials": np.round(r.potentials, 15).tolist(),
        "estimate": float(f"{r.estimate:.2e}"),
        "field_estimate": float(f"{r.field_estimate:.2e}"),
    }


def _decode(entry: dict[str, Any]) -> Reference:
    raw = dict(entry["problem"])
    raw["discs"] = tuple(CircularPatch(d[0], d[1], d[2], math.inf if d[3] is None else d[3]) for d in raw["discs"])
    raw["patches"] = tuple(EllipticPatch(*p) for p in raw["patches"])
    raw["load"] = math.inf if raw["load"] is None else raw["load"]
    energies = np.zeros((3, 3))
    energies[np.triu_indices(3)] = entry["energies"]
    energies += np.triu(energies, 1).T
    return Reference(
        Problem(**raw),
        energies,
        np.array(entry["points"]),
        np.array(entry["potentials"]),
        entry["estimate"],
        entry["field_estimate"],
    )
