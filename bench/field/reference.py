"""Reference solutions of the field problems by NGSolve, written once and committed with their provenance.

    python -m bench field-reference --write      # makes tests/support/field/reference.json, about four minutes
    python -m bench field-reference              # compares the committed file with this machine's NGSolve

Every sensor is solved twice, at degree 12 on one mesh and at degree 10 on a finer one; the file keeps the first and the
largest difference between the two, which is an honest estimate of the error of the worse of them.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.support.field.ngsolve_peer import solve
from tests.support.field.port_solution import port_solution
from tests.support.field.problems import (
    Array,
    Problem,
    general_problems,
    hard_problems,
    random_problems,
    standard_problems,
)
from tests.support.field.reference import PATH, Reference, encode_reference, load_references


def phases(problem: Problem, energies: Array, modes: Array) -> Array:
    """Potentials of the two phases from those of the three modes, shape (2, points, 2)."""
    seen = port_solution(energies, problem.load).voltages
    radial = modes[0] + (seen[0, 2] - seen[0, 3]) * modes[1] + seen[0, 3] * modes[2]
    angular = modes[1] + (seen[1, 1] - seen[1, 0]) * modes[0] + seen[1, 0] * (1.0 - modes[2])
    return np.array([radial, angular])


def sample_points(problem: Problem) -> Array:
    """Two points of the sheet inside the first disc and one outside every disc: (r, theta), shape (3, 2)."""
    disc = problem.contacts[0][1]

    def clear(r: float, theta: float) -> float:
        """Distance to the nearest rim in units of its radius, negative inside a disc."""
        z = r * np.exp(1j * theta)
        return min(float(abs(z - c.r * np.exp(1j * c.theta))) / c.radius - 1 for _, c in problem.contacts)

    inside = []
    for rho in (0.0, 0.3, 0.6):
        for step in range(8):
            z = disc.r + rho * disc.radius * np.exp(1j * (0.7 + step * math.pi / 4))
            r, theta = float(abs(z)), disc.theta + float(np.angle(z))
            margin = 0.05 * disc.radius
            radial = problem.inner + margin < r < problem.outer - margin
            if radial and margin < r * theta < r * problem.theta0 - margin:
                inside.append((r, theta))
    width = problem.outer - problem.inner
    grid = [
        (problem.inner + f * width, g * problem.theta0)
        for f in np.linspace(0.25, 0.75, 5).tolist()
        for g in np.linspace(0.2, 0.8, 5).tolist()
    ]
    outside = next((point for point in grid if clear(*point) > 0.3), max(grid, key=lambda point: clear(*point)))
    return np.array([inside[0], inside[-1], outside])


def reference(problem: Problem) -> Reference:
    """Solve twice and keep the difference."""
    points = sample_points(problem)
    widths = [c.radius * math.sqrt(c.conductance * (problem.upper + problem.lower)) for _, c in problem.contacts]
    # Resolve the layer of width 1/k along the rims: the potentials there converge less fast than the ports.
    finer = min(1.0, *(3 / w for w in widths if math.isfinite(w) and w > 0), 1.0)
    found = []
    for order, size, inside in ((12, 0.5, 0.7), (10, 0.4, 0.5)):
        solved = solve(problem, order, size, inside * finer, points=points)
        assert solved.potentials is not None
        found.append((solved.energies, phases(problem, solved.energies, solved.potentials)))
    (first, fields), (second, other_fields) = found
    a, b = port_solution(first, problem.load), port_solution(second, problem.load)
    scale = np.abs(a.currents).max(axis=1, keepdims=True)
    estimate = max(
        np.abs(a.voltages - b.voltages).max(),
        np.abs((a.currents - b.currents) / scale).max(),
    )
    field_estimate = np.abs(fields - other_fields).max()
    return Reference(problem, (first + first.T) / 2, points, fields, float(estimate), float(field_estimate))


def write(path: Path = PATH, progress: Callable[[str], None] = print) -> None:
    """Make the file: the standard problems, the hard ones and the random sensors."""
    import ngsolve

    ngsolve.SetNumThreads(1)
    start = time.perf_counter()
    references = []
    for problem in [*standard_problems(), *hard_problems(), *general_problems(), *random_problems()]:
        references.append(reference(problem))
        last = references[-1]
        progress(f"{problem.name}: ports agree to {last.estimate:.1e}, potentials to {last.field_estimate:.1e}")
    content = {
        "provenance": {
            "what": "hp-FEM in the physical plane, discs meshed with curved elements; tests.support.field",
            "command": "python -m bench field-reference --write",
            "versions": {"ngsolve": ngsolve.__version__, "numpy": np.__version__, "python": sys.version.split()[0]},
            "order": "degree 12, edges 0.5 width / 0.7 radius; checked by degree 10, 0.4 width / 0.5 radius",
            "date": time.strftime("%Y-%m-%d"),
            "worst_estimate": max(r.estimate for r in references),
            "worst_field_estimate": max(r.field_estimate for r in references),
            "units": "m, rad, ohm per square, S/m^2 (null: perfect bond), ohm (null: open), S, V at 1 V of drive",
        },
        "sensors": [encode_reference(r) for r in references],
    }
    lines = json.dumps(content["provenance"], indent=1)
    sensors = ",\n".join(json.dumps(s, separators=(",", ":")) for s in content["sensors"])
    path.parent.mkdir(exist_ok=True)
    path.write_text(f'{{"provenance": {lines},\n"sensors": [\n{sensors}\n]}}\n')
    progress(f"{len(references)} sensors in {time.perf_counter() - start:.0f} s -> {path}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="make the committed file anew")
    arguments = parser.parse_args()
    if arguments.write:
        write()
        return 0
    worst = 0.0
    for committed in load_references():
        fresh = reference(committed.problem)
        worst = max(worst, float(np.abs(fresh.ports.voltages - committed.ports.voltages).max()))
    print(f"largest difference between {PATH.name} and this machine's NGSolve: {worst:.1e} V at 1 V of drive")
    return 0 if worst < 1e-11 else 1
