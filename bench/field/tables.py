"""Tables and curves of bench `field`."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.report import show
from tests.support.field.port_solution import PortSolution
from tests.support.field.problems import Problem
from tests.support.field.reference import Reference

TARGET_ERRORS = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)


@dataclass(frozen=True, slots=True)
class Run:
    """One configuration of one solver on one problem; times in seconds for each contact."""

    problem: str
    solver: str
    configuration: str
    error: float
    seconds: float
    without_mesh: float

    @property
    def ours(self) -> bool:
        return self.solver.startswith("coneskin")


def cheapest(runs: list[Run], solver: str, target: float, mesh: bool = True) -> float:
    """Seconds of the cheapest configuration that reaches the error, inf if none does."""
    times = (r.seconds if mesh else r.without_mesh for r in runs if r.solver == solver and r.error <= target)
    return min(times, default=math.inf)


def print_work(runs: list[Run]) -> None:
    """Time to an error for each problem, and the ratio of the fastest peer's to ours."""
    for problem in dict.fromkeys(r.problem for r in runs):
        mine = [r for r in runs if r.problem == problem]
        ours = list(dict.fromkeys(r.solver for r in mine if r.ours))
        if ours == ["coneskin single"]:
            continue  # a table of its own
        peers = list(dict.fromkeys(r.solver for r in mine if not r.ours))
        short = [name.removeprefix("coneskin ") for name in ours]
        head = ["error", *short, *peers, *(f"ratio {name}" for name in short)]
        rows = []
        for target in TARGET_ERRORS:
            own = [cheapest(mine, name, target) for name in ours]
            theirs = [(cheapest(mine, p, target), cheapest(mine, p, target, mesh=False)) for p in peers]
            best = [min((pair[i] for pair in theirs), default=math.inf) for i in (0, 1)]
            rows.append(
                [f"{target:.0e}", *map(show_time, own), *(f"{show_time(a)} / {show_time(b)}" for a, b in theirs)]
                + [f"{_ratio(best[0], t)} / {_ratio(best[1], t)}" for t in own]
            )
        title = f"'{problem}': time to an error, mesh included / given"
        show(title, head, rows)


def show_time(seconds: float) -> str:
    if math.isinf(seconds):
        return "-"
    if seconds < 1e-3:
        return f"{seconds * 1e6:.3g} us"
    return f"{seconds * 1e3:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


def _ratio(theirs: float, ours: float) -> str:
    return "-" if math.isinf(ours) or math.isinf(theirs) else f"{float(f'{theirs / ours:.2g}'):g}"


def family(problem: Problem) -> str:
    """What a reference sensor tests."""
    if problem.name.startswith("random"):
        kind = "perfect bond" if problem.perfect else f"{'one disc' if len(problem.discs) == 1 else '2-3 discs'}"
        return f"random, {kind}, guides {'open' if math.isinf(problem.load) else 'loaded'}"
    if problem.patches or problem.name.startswith("clipped"):
        return "shapes and clipped discs (general method)"
    if "apart" in problem.name or "gap" in problem.name:
        gap = "0.01" if "0.01 a" in problem.name else "0.1"
        return f"hard: gap of {gap} radius"
    return "hard: extreme values, and the standard problems"


def print_agreement(references: list[Reference], solve: Callable[[Problem], PortSolution], title: str) -> float:
    """Agreement with the committed references, family by family; the worst |dV|."""
    groups: dict[str, list[tuple[float, float, float, float]]] = {}
    for reference in references:
        ours, theirs = solve(reference.problem), reference.ports
        scale = np.abs(theirs.currents).max(axis=1, keepdims=True)
        groups.setdefault(family(reference.problem), []).append(
            (
                float(np.abs(ours.voltages - theirs.voltages).max()),
                float(np.abs((ours.currents - theirs.currents) / scale).max()),
                float(np.abs(ours.admittance - theirs.admittance).max() / np.abs(theirs.admittance).max()),
                reference.estimate,
            )
        )
    head = ["family", "sensors", "worst |dV|/U0", "median", "worst |dI|/I", "worst |dY|/Y", "reference's own estimate"]
    rows = []
    for name in sorted(groups, reverse=True):
        volts, currents, admittances, estimates = (np.array(column) for column in zip(*groups[name], strict=True))
        rows.append(
            [name, str(len(volts)), f"{volts.max():.1e}", f"{np.median(volts):.1e}", f"{currents.max():.1e}"]
            + [f"{admittances.max():.1e}", f"{estimates.max():.1e}"]
        )
    show(f"Agreement with NGSolve, {title}", head, rows)
    return max(row[0] for group in groups.values() for row in group)


def draw(runs: list[Run], path: Path) -> None:
    """Work-precision curves, one panel a problem: every configuration, and the best of each solver joined."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    problems = list(dict.fromkeys(r.problem for r in runs))
    columns = min(3, len(problems))
    lines = math.ceil(len(problems) / columns)
    figure, axes = plt.subplots(
        lines, columns, figsize=(4.8 * columns, 4.0 * lines), sharey=True, sharex=True, squeeze=False
    )
    colours = {
        "coneskin batched": "#08306b",
        "coneskin single": "#4292c6",
        "coneskin general": "#6a51a3",
        "NGSolve": "#d1495b",
        "scikit-fem": "#e69f00",
        "pyEIT": "#4d9221",
    }
    for panel in axes.flat[len(problems) :]:
        panel.set_visible(False)
    for panel, problem in zip(axes.flat, problems, strict=False):
        for solver, colour in colours.items():
            mine = [r for r in runs if r.problem == problem and r.solver == solver]
            if not mine:
                continue
            panel.loglog([r.seconds for r in mine], [r.error for r in mine], ".", color=colour, alpha=0.3, ms=4)
            panel.loglog(*_front([(r.seconds, r.error) for r in mine]), "o-", color=colour, label=solver, ms=4)
            if not solver.startswith("coneskin"):
                panel.loglog(*_front([(r.without_mesh, r.error) for r in mine]), "--", color=colour, lw=1.0)
        panel.set_title(problem, fontsize=10)
        panel.grid(True, which="major", alpha=0.3)
        panel.tick_params(labelbottom=True)
    for panel in axes[:, 0]:
        panel.set_ylabel("largest error of a potential [V at 1 V]")
    for panel in axes[-1]:
        panel.set_xlabel("time for one contact [s]")
    axes[0, 0].set_ylim(1e-15, 1e-1)
    handles: dict[str, object] = {}
    for panel in axes.flat:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(list(handles.values()), list(handles), loc="lower center", ncols=6, fontsize=9, frameon=False)
    figure.suptitle("Error against run time on one thread, all in one run (dashed: the peer's mesh is given)")
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    figure.savefig(path, dpi=100)
    plt.close(figure)


def _front(points: list[tuple[float, float]]) -> tuple[list[float], list[float]]:
    """Times and errors of the points that no other beats in both."""
    front: list[tuple[float, float]] = []
    for seconds, error in sorted(points):
        if not front or error < front[-1][1]:
            front.append((seconds, max(error, 1e-16)))
    return [t for t, _ in front], [e for _, e in front]
