"""Tables and picture of bench `decode`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from bench.report import head

from .cells import Cell
from .disturbances import Errors
from .several import Power, Several

BAND = (0.93, 0.97)  # of the truths that an ellipse of 95 % may hold
#: the largest rms over the bound that is asked for, by sensor and electronics
LIMITS = {
    ("UR5e", "12 bit, matched"): 1.3,
    ("UR5e", "16 bit, matched"): 1.3,
    ("UR5e", "12 bit, 20 mA"): 1.8,
    ("paper", "12 bit, matched"): 1.5,
    ("paper", "12 bit, 20 mA"): 1.8,
}


class Report:
    """Tables, gathered while they are measured.

    Args:
        names: of the decoders, the older one first.
    """

    def __init__(self, names: list[str]) -> None:
        self._names = names
        self._cells: list[Cell] = []
        self._lines: list[str] = []
        self._time: dict[str, tuple[float, ...]] = {}
        self._goals: list[list[str]] = []

    def agreement(self, worst: dict[str, float]) -> None:
        rows = [[name, f"{value:.1e}"] for name, value in worst.items()]
        self._add(
            "Plants against the exact field model: largest difference of Y, over its largest entry",
            ["sensor", "worst"],
            rows,
        )

    def cells(self, cells: list[Cell]) -> None:
        self._cells += cells

    def several(self, electric: str, found: dict[str, list[Several]]) -> None:
        rows = []
        total = _sum(found[self._names[-1]])
        self._goal(
            f"no certain place off a contact, {electric}", f"{total.any_off} of {total.cases}", total.any_off == 0
        )
        for name, kinds in found.items():
            for k in [*kinds, _sum(kinds)]:
                seeds = " ".join(map(str, k.worst[:5]))
                rows.append([name, k.kind, *map(str, (k.cases, k.touched, k.valid, k.any_off, k.all_off)), seeds])
        title = f"Several contacts, {electric}: cases with a valid frame within 20 whose normal is more than 20 deg off"
        self._add(title, ["decoder", "press", "cases", "touches", "ever valid", "off any", "off all", "cases"], rows)

    def power(self, found: list[Power]) -> None:
        rows = [
            [
                p.what,
                p.electronics,
                str(p.frames),
                *(f"{p.share[n]:.3f}" for n in self._names),
                *(f"{p.valid[n]:.3f}" for n in self._names),
                str(p.of),
            ]
            for p in found
        ]
        columns = [*(f"not one disc, {n}" for n in self._names), *(f"certain, {n}" for n in self._names)]
        self._add(
            "Not one disc: part of the touches, after so many frames",
            ["contacts", "electronics", "frames", *columns, "of"],
            rows,
        )

    def disturbances(self, found: list[Errors]) -> None:
        rows = [
            [
                e.what,
                *(f"{1e3 * e.median[n]:.3f} / {1e3 * e.most[n]:.3f}" for n in self._names),
                *(f"{e.valid[n]:.2f}" for n in self._names),
                str(e.of),
            ]
            for e in found
        ]
        columns = [*(f"{n} [mm]" for n in self._names), *(f"certain, {n}" for n in self._names)]
        self._add(
            "Disturbances and outlines, UR5e, 16 bit: error, median / 95 %, to the centroid",
            ["", *columns, "touches"],
            rows,
        )

    def collisions(self, found: dict[str, dict[str, Any]]) -> None:
        """Take what decode_collisions.py has found."""
        rows = [
            [
                case,
                *(str(row[key]) for key in ("collisions", "moved", "towards")),
                f"{row['worst_mm']:.1f}",
                " ".join(map(str, row["seeds"])),
            ]
            for case, row in found.items()
        ]
        title = "End to end, arm under guard: retreats that move towards a body by 2 mm more than a bare stop"
        self._add(title, ["collision", "cases", "moved away", "towards", "worst [mm]", "seeds"], rows)

    def run_time(self, spent: dict[str, tuple[float, ...]]) -> None:
        self._time = spent
        micro = [1e6 * spent[n][0] for n in self._names]
        self._goal(
            "frame, bytes to event, 25 us", f"{micro[-1]:.1f} us, the older one {micro[0]:.1f}", micro[-1] <= 25.0
        )
        rows = [[name, *(f"{1e6 * t:.1f}" for t in times)] for name, times in spent.items()]
        self._add("Run time, bytes to event, median [us]", ["decoder", "all but the first", "first", "second"], rows)

    def text(self) -> str:
        """Return the page."""
        top = [
            "# The decoder beside its bound",
            "",
            "Printed by `python -m bench decode --write`.",
            "",
            head("numpy", "ngsolve"),
        ]
        if self._cells:
            top += ["", "![error over the bound, and run time](decode.png)"]
        return "\n".join([*top, *self._goals_table(), *self._summary(), *self._grid(), *self._lines]) + "\n"

    def _goal(self, what: str, measured: str, met: bool) -> None:
        self._goals.append([what, measured, "yes" if met else "**no**"])

    def _goals_table(self) -> list[str]:
        """Return what the issue asks for beside what this run has found."""
        new, rows = self._names[-1], []
        for (sheet, electric), most in LIMITS.items():
            cells = [c for c in self._cells if (c.sheet, c.electronics, c.baseline) == (sheet, electric, 0.0)]
            if cells:
                ratio = _ratio(cells, new)
                met = "yes" if ratio <= most else "**no**"
                rows.append([f"rms over the bound, {sheet}, {electric}: {most:g}", f"{ratio:.2f}", met])
        if self._cells:
            worse = [c for c in self._cells if c.rms[new] > 1.05 * c.rms[self._names[0]]]
            found = f"{len(worse)} of {len(self._cells)} cells are"
            rows.append(["no cell more than 5 % worse than the older one", found, "**no**" if worse else "yes"])
            few = [c for c in self._cells if c.interval[new][1] < BAND[0]]
            many = [c for c in self._cells if c.interval[new][0] > BAND[1]]
            found = f"fewer in {len(few)}, more in {len(many)} of {len(self._cells)} cells, beyond what chance explains"
            rows.append(["95 % ellipse holds 93 to 97 % of the truths", found, "**no**" if few or many else "yes"])
        rows += self._goals
        return _table("What is asked, and what this run has found", ["goal", "measured", "met"], rows) if rows else []

    def _summary(self) -> list[str]:
        rows = []
        for key in dict.fromkeys((c.sheet, c.electronics, c.baseline) for c in self._cells):
            cells = [c for c in self._cells if (c.sheet, c.electronics, c.baseline) == key]
            row = [key[0], key[1], f"{100 * key[2]:g} %", f"{1e3 * _rms([c.bound for c in cells]):.4f}"]
            row += [f"{_ratio(cells, n):.2f}" for n in self._names]
            old, new = self._names[0], self._names[-1]
            row.append(f"{max(c.rms[new] / c.rms[old] for c in cells):.2f}")
            inside = [c.inside[new] for c in cells]
            row.append(
                " to ".join(f"{100 * v:.0f}" for v in (min(inside), max(inside))) if inside[0] == inside[0] else "none"
            )
            rows.append(row)
        columns = ["sensor", "electronics", "baseline off", "bound [mm]", *(f"rms / bound, {n}" for n in self._names)]
        return (
            _table(
                "One disc: rms of the second frame over the Cramer-Rao bound, all radii and ka",
                [*columns, "worst cell, new / old", "in the 95 % ellipse [%]"],
                rows,
            )
            if rows
            else []
        )

    def _grid(self) -> list[str]:
        rows = []
        for c in self._cells:
            ratio = [f"{c.rms[n] / c.bound:.2f}" for n in self._names]
            inside = c.inside[self._names[-1]]
            interval = [f"{100 * part:.0f}" for part in c.interval[self._names[-1]]]
            rows.append(
                [
                    c.sheet,
                    c.electronics,
                    f"{1e3 * c.radius:g}",
                    f"{c.ka:g}",
                    f"{100 * c.baseline:g} %",
                    f"{1e3 * c.bound:.4f}",
                    *ratio,
                    "" if math.isnan(inside) else f"{100 * inside:.0f} ({' to '.join(interval)})",
                    f"{c.frames[self._names[-1]]}/{c.of}",
                ]
            )
        columns = [
            "sensor",
            "electronics",
            "a [mm]",
            "ka",
            "baseline off",
            "bound [mm]",
            *self._names,
            "in the ellipse [%], 95 % interval",
            "frames",
        ]
        return _table("Every cell: rms over the bound", columns, rows) if rows else []

    def _add(self, title: str, columns: list[str], rows: list[list[str]]) -> None:
        self._lines += _table(title, columns, rows)

    def draw(self, path: Path) -> None:
        """Draw error against run time, and the ratio of every cell to the bound."""
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot

        figure, (left, right) = pyplot.subplots(1, 2, figsize=(11, 4.5))
        groups = list(dict.fromkeys((c.sheet, c.electronics) for c in self._cells))
        for number, key in enumerate(groups):
            cells = [c for c in self._cells if (c.sheet, c.electronics) == key and c.baseline == 0.0]
            points = [
                (1e6 * self._time[n][0], 1e3 * _rms([c.rms[n] for c in cells])) for n in self._names if n in self._time
            ]
            if points:
                left.plot(*zip(*points, strict=True), "o-", color=f"C{number}", label=", ".join(key))
                left.axhline(1e3 * _rms([c.bound for c in cells]), color=f"C{number}", linestyle=":")
            for style, name in zip(("x", "o"), self._names, strict=True):
                ratios = sorted(c.rms[name] / c.bound for c in cells)
                right.plot(
                    [number + (k + 0.5) / len(ratios) * 0.8 for k in range(len(ratios))],
                    ratios,
                    style,
                    color=f"C{number}",
                    markersize=4,
                    label=name if number == 0 else None,
                )
        left.set(xlabel="bytes to event, median [us]", ylabel="rms error of one frame [mm]", yscale="log")
        title = f"error against run time, from {self._names[0]} to {self._names[-1]}; dotted: Cramer-Rao bound"
        left.set_title(title, fontsize=9)
        left.legend(fontsize=7)
        right.axhline(1.0, color="black", linewidth=0.8)
        right.set(yscale="log", ylabel="rms over the bound, each cell", xticks=[n + 0.4 for n in range(len(groups))])
        right.set_xticklabels([f"{a}\n{b}" for a, b in groups], fontsize=6)
        right.legend(fontsize=7)
        figure.tight_layout()
        figure.savefig(path, dpi=110)


def _table(title: str, columns: list[str], rows: list[list[str]]) -> list[str]:
    lines = ["", f"**{title}**", "", "| " + " | ".join(columns) + " |", "|" + " --- |" * len(columns)]
    return lines + ["| " + " | ".join(row) + " |" for row in rows]


def _rms(values: list[float]) -> float:
    return math.sqrt(sum(v * v for v in values) / len(values))


def _ratio(cells: list[Cell], name: str) -> float:
    return _rms([c.rms[name] for c in cells]) / _rms([c.bound for c in cells])


def _sum(kinds: list[Several]) -> Several:
    total = Several("all", 0, 0, 0, 0, 0, [])
    for k in kinds:
        for field in ("cases", "touched", "any_off", "all_off", "valid"):
            setattr(total, field, getattr(total, field) + getattr(k, field))
    return total
