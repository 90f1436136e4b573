"""Error against run time of the field model, beside NGSolve, scikit-fem and pyEIT, all in one run on one thread.

    python -m bench field                      # about five minutes
    python -m bench field --quick              # half a minute, fewer configurations
    python -m bench field --plot field.png     # the curves as a picture too

An error is the largest error of an electrode's potential in the radial and the angular phase, at 1 V of drive,
against the committed reference (degree 12, bench `field-reference`). A time is the least processor time of repeated
solutions of both phases, which on one thread is the run time of an idle machine; the peers' is given with and without
the making of the mesh. The ratio compares the cheapest configuration of each solver that reaches an error. Without a
peer installed the rest is still printed.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from bench.report import head, show
from coneskin.skin.field.disc import Disc
from coneskin.skin.field.fourport import Readings, angular_phase, radial_phase
from tests.support.field.contact_patch import solve_patch
from tests.support.field.port_solution import PortSolution, port_solution
from tests.support.field.problems import Problem
from tests.support.field.reference import Reference, load_references, provenance
from tests.support.field.solution import contact_patch, disc_arrays, field_model, solve_discs, solve_general

from .tables import TARGET_ERRORS, Run, cheapest, draw, print_agreement, print_work, show_time

PHASES = (radial_phase(), angular_phase())
TURNS = 3  # of each solver at each problem: for a second or so a computer may be slower


class Single:
    """One scene at a time at an asked tolerance, both phases: what a user's loop pays for each."""

    def __init__(self, problem: Problem, tolerance: float) -> None:
        self.sensor, self.count = field_model(problem, tolerance), 1
        self.discs = [Disc(*row) for row in np.concatenate(disc_arrays(problem)).T.tolist()]
        self.told = float(self.sensor.discs(self.discs).error[0])

    def __call__(self) -> list[Readings]:
        coupling = self.sensor.discs(self.discs)
        return [self.sensor.read(coupling, phase) for phase in PHASES]


class Batch:
    """Many different discs in one call, the problem's own the first of them; `order` None: the solver's choice.

    The others lie within a twentieth of a radius of it, where the same order leaves the same error.
    """

    def __init__(self, problem: Problem, order: int | None, tolerance: float = 1e-12, count: int = 2000) -> None:
        self.sensor, self.order, self.count = field_model(problem, tolerance), order, count
        u, phi, radius, conductance = (float(row[0, 0]) for row in disc_arrays(problem))
        draw = np.random.default_rng(1)
        us, phis = np.full(count, u), np.full(count, phi)
        us[1:] += radius * draw.uniform(-0.05, 0.05, count - 1)
        phis[1:] += radius / problem.discs[0].r * draw.uniform(-0.05, 0.05, count - 1)
        self.contact = us, phis, radius, conductance

    def __call__(self) -> list[Readings]:
        coupling = self.sensor.contacts(*self.contact, order=self.order)
        return [self.sensor.read(coupling, phase) for phase in PHASES]


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


def largest_error(readings: list[Readings], reference: PortSolution) -> float:
    """Largest error of an electrode's potential over both phases [V at 1 V of drive]."""
    pairs = zip(readings, reference.voltages, strict=True)
    return max(float(np.abs(r.electrodes[0] - volts).max()) for r, volts in pairs)


# isort: split


ORDER_LIST = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24)
CELL_COUNTS = ((8, 2), (12, 3), (16, 4), (24, 5), (32, 7), (48, 9), (64, 11))


def installed() -> list[Any]:
    """The peers that are there; all of them need Netgen's meshes."""
    found: list[Any] = []
    if find_spec("ngsolve") is None:
        return found
    from tests.support.field import ngsolve_peer

    found.append(ngsolve_peer)
    if find_spec("skfem") is not None:
        from tests.support.field import skfem_peer

        found.append(skfem_peer)
        if find_spec("pyeit") is not None:
            from tests.support.field import pyeit_peer

            found.append(pyeit_peer)
    return found


def repeat(solve: Callable[[], Any], budget: float, least: int = 3) -> tuple[float, Any]:
    """Least seconds of a call, after one that is not counted: what else the computer does only adds to it."""
    result = solve()
    spent: list[float] = []
    while len(spent) < least or sum(spent) < budget:
        start = time.process_time()
        result = solve()
        spent.append(time.process_time() - start)
    return min(spent), result


def our_runs(reference: Reference, quick: bool) -> Iterator[Run]:
    """The disc solver at every order, single and batched, and the general method on ever smaller cells."""
    problem = reference.problem
    calls: list[tuple[str, str, Any]] = []
    if problem.discs and not problem.name.startswith("clipped"):
        if len(problem.discs) == 1:
            for order in ORDER_LIST[:9] if quick else ORDER_LIST:
                batch = Batch(problem, order, count=400 if quick else 2000)
                calls.append(("coneskin batched", f"M={order}", batch))
        for tolerance in TARGET_ERRORS:
            calls.append(("coneskin single", f"asked {tolerance:.0e}", Single(problem, tolerance)))
    if len(problem.discs) > 1:
        general = []
    else:
        general = [General(problem, *cells) for cells in (CELL_COUNTS[:5:2] if quick else CELL_COUNTS)]
    for one in general:
        calls.append(("coneskin general", "{}x{}".format(*one.cells), one))
    for solver, configuration, call in calls:
        seconds, readings = repeat(call, 0.05 if quick else 0.1)
        error = largest_error(readings, reference.ports)
        yield Run(problem.name, solver, configuration, error, seconds / call.count, seconds / call.count)


def peer_runs(reference: Reference, peers: list[Any], quick: bool) -> Iterator[Run]:
    """Every installed peer over its degrees and meshes."""
    problem = reference.problem
    for module in peers:
        for label, call in configurations(module, problem, quick):
            solved = call()
            first = sum(solved.seconds.values())
            runs = (
                [call() for _ in range(max(2, math.ceil((0.05 if quick else 0.1) / first)))]
                if first < 1.0
                else [solved]
            )
            totals = [(sum(r.seconds.values()), r.seconds["mesh"]) for r in runs]
            voltages = port_solution(solved.energies, problem.load).voltages
            error = float(np.abs(voltages - reference.ports.voltages).max())
            whole = min(total for total, _ in totals)
            yield Run(
                problem.name,
                module.NAME,
                label,
                error,
                whole,
                min(total - mesh for total, mesh in totals),
            )


def configurations(module: Any, problem: Problem, quick: bool) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Degrees and mesh sizes of a peer; scikit-fem and pyEIT have no meshes of cut shapes here."""
    if module.NAME == "NGSolve":
        for size in (0.5,) if quick else (1.0, 0.5, 0.35, 0.25, 0.15):
            for order in (1, 2, 3, 4, 6, 8) if quick else range(1, 11 if size > 0.3 else 7):
                yield f"p={order} h={size}", partial(module.solve, problem, order, size, 2 * size)
    elif problem.patches or problem.name.startswith("clipped"):
        return
    elif module.NAME == "scikit-fem":
        for degree in (1, 2, 3, 4):
            for size in (0.3, 0.1) if quick else (0.5, 0.3, 0.2, 0.14, 0.1, 0.07, 0.05, 0.035):
                yield f"p={degree} h={size}", partial(module.solve, problem, degree, size, 2 * size)
    else:
        for size in (0.2, 0.1) if quick else (0.4, 0.2, 0.1, 0.05, 0.025, 0.0125):
            yield f"p=1 h={size}", partial(module.solve, problem, size, 2 * size)


def print_goals(runs: list[Run], references: list[Reference], quick: bool) -> None:
    """What is asked, told and reached one scene at a time, in what part of NGSolve's time; and maps of the sheet."""
    maps = []
    for reference in references:
        problem = reference.problem
        if not problem.discs or problem.name.startswith("clipped"):
            continue
        mine, rows = [r for r in runs if r.problem == problem.name], []
        for tolerance in TARGET_ERRORS:
            asked = (r for r in mine if r.configuration == f"asked {tolerance:.0e}")
            run = min(asked, key=lambda one: one.seconds)
            theirs = cheapest(mine, "NGSolve", tolerance)
            ratio = "-" if math.isinf(theirs) else f"{theirs / run.seconds:.0f}"
            told = f"{Single(problem, tolerance).told:.1e}"
            times = show_time(run.seconds), show_time(theirs)
            rows.append([f"{tolerance:.0e}", told, f"{run.error:.1e}", *times, ratio])
        show(
            f"'{problem.name}', one at a time: error asked, told, true",
            ["asked", "told", "true", "coneskin", "NGSolve", "ratio"],
            rows,
        )
        if len(problem.discs) == 1:
            sheet = Map(problem)
            seconds, _ = repeat(sheet, 0.0, least=1)
            batch = Batch(problem, None, 1e-9, 400 if quick else 2000)
            each, readings = repeat(batch, 0.1 if quick else 0.5, least=1 if quick else 3)
            error = f"{largest_error(readings, reference.ports):.1e}"
            maps.append([problem.name, show_time(each / batch.count), error, f"{show_time(seconds)} for {sheet.count}"])
    show(
        "at tolerance 1e-9: batched, and a map of discs all over the sheet",
        ["problem", "batched", "error", "map"],
        maps,
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer configurations, about half a minute")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="draw the curves (needs matplotlib)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write every run")
    arguments = parser.parse_args()
    peers = installed()
    if peers:
        import ngsolve

        ngsolve.SetNumThreads(1)
    print(head("numpy", "scipy", "ngsolve", "scikit-fem", "pyeit") + "; one thread used")
    made = provenance()
    print(f"reference: {made['command']}, NGSolve {made['versions']['ngsolve']}, {made['date']}; {made['order']}")
    references = load_references()
    general = [r for r in references if r.problem.patches or r.problem.name.startswith("clipped")]
    discs = [r for r in references if r not in general]
    print_agreement(discs, solve_discs, "discs at the order that the solver chooses")
    print_agreement(general, solve_general, "general method with its default cells")
    if not peers:
        print("\nno peer is installed, so no ratio is printed: pip install 'coneskin[bench]'")
    pairs = [r for r in discs if r.problem.name.startswith("two discs 0.1")]
    measured = [*discs[:3], *pairs]
    runs: list[Run] = []
    for reference in measured:
        print(f"measuring '{reference.problem.name}' ...", file=sys.stderr)
        for _ in range(1 if arguments.quick else TURNS):
            runs += our_runs(reference, arguments.quick)
            runs += peer_runs(reference, peers, arguments.quick)
    print_work(runs)
    print_goals(runs, measured, arguments.quick)
    for module in peers:
        print(f"{module.NAME}: {module.LIMITS}")
    if arguments.plot:
        draw(runs, arguments.plot)
        print(f"curves: {arguments.plot}")
    if arguments.json:
        arguments.json.write_text(json.dumps([asdict(r) for r in runs], indent=1))
    return 0
