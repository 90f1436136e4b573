"""Tables of bench `decode`."""

from __future__ import annotations

import math

from bench.report import show

from .cells import Cell
from .disturbances import Errors
from .several import PRESS_FRAMES, Power, Several

ELLIPSE_BAND = (0.93, 0.97)  # of the truths that an ellipse of 95 % may hold
MAX_FRAME_TIME = 25.0  # us, bytes to event
#: the largest rms over the bound that is asked for, by sensor and electronics
RATIO_LIMITS = {
    ("UR5e", "12 bit, matched"): 1.3,
    ("UR5e", "16 bit, matched"): 1.3,
    ("UR5e", "12 bit, 20 mA"): 1.8,
    ("paper", "12 bit, matched"): 1.5,
    ("paper", "12 bit, 20 mA"): 1.8,
}


def show_several(electric: str, kinds: list[Several]) -> list[str]:
    """Show presses by several contacts; return the row of their goal."""
    rows, total = [], _sum(kinds)
    for k in [total, *kinds]:
        worst = " ".join(map(str, k.worst[:5]))
        rows.append([k.kind, *map(str, (k.cases, k.touched, k.valid, k.any_off, k.all_off)), worst])
    title = f"several contacts, {electric}: with a valid frame of {PRESS_FRAMES} whose normal is more than 20 deg off"
    show(title, ["press", "cases", "touches", "ever valid", "off any", "off all", "cases"], rows)
    goal = f"no certain place beyond 20 deg of every contact, {electric}"
    measured = f"{total.all_off} of {total.cases}; {total.any_off} beyond it of one"
    return _goal(goal, measured, total.all_off == 0)


def show_power(found: list[Power]) -> None:
    rows = [[p.what, p.electronics, p.frames, f"{p.share:.3f}", f"{p.valid:.3f}", p.of] for p in found]
    columns = ["contacts", "electronics", "frames", "not one disc", "certain", "of"]
    show("not one disc: share of the touches, after so many frames", columns, rows)


def show_disturbances(found: list[Errors]) -> None:
    rows = [[e.what, f"{1e3 * e.median:.3f} / {1e3 * e.most:.3f}", f"{e.valid:.2f}", e.of] for e in found]
    title = "disturbances and outlines, UR5e, 16 bit: error, median / 95 %, to the centroid"
    show(title, ["", "mm", "certain", "touches"], rows)


def show_run_time(times: tuple[float, ...]) -> list[str]:
    """Show the run time of a frame; return the row of its goal."""
    micro = [f"{1e6 * time:.1f}" for time in times]
    show("run time, bytes to event, median [us]", ["all but the first", "first", "second"], [micro])
    return _goal(f"frame, bytes to event, {MAX_FRAME_TIME:g} us", f"{micro[0]} us", 1e6 * times[0] <= MAX_FRAME_TIME)


def show_cells(cells: list[Cell]) -> list[list[str]]:
    """Show single discs, all together and cell by cell; return the rows of their goals."""
    rows = []
    for key in dict.fromkeys((c.sheet, c.electronics, c.baseline) for c in cells):
        some = [c for c in cells if (c.sheet, c.electronics, c.baseline) == key]
        inside = [c.inside for c in some]
        held = f"{100 * min(inside):.0f} to {100 * max(inside):.0f}"
        row = [key[0], key[1], f"{100 * key[2]:g} %", f"{1e3 * _rms([c.bound for c in some]):.4f}"]
        rows.append([*row, f"{_ratio(some):.2f}", held])
    columns = ["sensor", "electronics", "baseline off", "bound [mm]", "rms / bound", "in the 95 % ellipse [%]"]
    show("one disc: rms of the second frame over the Cramer-Rao bound, all radii and ka", columns, rows)
    rows = []
    for c in cells:
        low, high = (100 * part for part in c.interval)
        place = [c.sheet, c.electronics, f"{1e3 * c.radius:g}", f"{c.ka:g}", f"{100 * c.baseline:g} %"]
        held = f"{100 * c.inside:.0f} ({low:.0f} to {high:.0f})"
        rows.append([*place, f"{1e3 * c.bound:.4f}", f"{c.rms / c.bound:.2f}", held, f"{c.frames}/{c.of}"])
    columns = ["sensor", "electronics", "a [mm]", "ka", "baseline off", "bound [mm]", "rms / bound"]
    show("every cell", [*columns, "in the ellipse [%], 95 % interval", "frames"], rows)
    return _goals_of(cells)


def show_goals(rows: list[list[str]]) -> None:
    show("goals", ["goal", "measured", "met"], rows)


def _goals_of(cells: list[Cell]) -> list[list[str]]:
    rows = []
    for (sheet, electric), most in RATIO_LIMITS.items():
        some = [c for c in cells if (c.sheet, c.electronics, c.baseline) == (sheet, electric, 0.0)]
        if some:
            ratio = _ratio(some)
            rows.append(_goal(f"rms over the bound, {sheet}, {electric}: {most:g}", f"{ratio:.2f}", ratio <= most))
    few = sum(c.interval[1] < ELLIPSE_BAND[0] for c in cells)
    many = sum(c.interval[0] > ELLIPSE_BAND[1] for c in cells)
    found = f"fewer in {few}, more in {many} of {len(cells)} cells, beyond what chance explains"
    return [*rows, _goal("95 % ellipse holds 93 to 97 % of the truths", found, not few and not many)]


def _goal(what: str, measured: str, met: bool) -> list[str]:
    return [what, measured, "yes" if met else "no"]


def _rms(values: list[float]) -> float:
    return math.sqrt(sum(v * v for v in values) / len(values))


def _ratio(cells: list[Cell]) -> float:
    return _rms([c.rms for c in cells]) / _rms([c.bound for c in cells])


def _sum(kinds: list[Several]) -> Several:
    total = Several("all", 0, 0, 0, 0, 0, [])
    for k in kinds:
        for field in ("cases", "touched", "any_off", "all_off", "valid"):
            setattr(total, field, getattr(total, field) + getattr(k, field))
    return total
