"""Traces of a run: values over time, as SVG of as few points as a small plot can show, with no peak lost."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from html import escape
from itertools import cycle
from typing import TYPE_CHECKING

from .history import CHANNELS, Series
from .run_course import RunCourse

if TYPE_CHECKING:
    from coneskin.core.arrays import Floats

_BIN_COUNT = 240  # each with its least and its largest value
_LEVELS, _SPEEDS, _FORCE = "touch level", "joint speed [rad/s]", "contact force [N]"
_Line = tuple[str, Series, int, float]  # name, values, which of them, and the host time that is 0 [s]


def _plots(courses: Sequence[RunCourse]) -> dict[str, list[_Line]]:
    """Return what can be drawn of runs, each with its lines."""
    plots: dict[str, list[_Line]] = {}
    for number, course in enumerate(courses, 1):
        history, whose = course.history, f"run {number}: " if len(courses) > 1 else ""
        lines = [(_LEVELS, name, series, 0) for name, series in history.levels.items()]
        lines += [(_FORCE, "force", history.forces, 0)] if history.forces.times else []
        lines += [
            (_SPEEDS, f"joint {k + 1}", history.speeds, k) for k in range(len(next(iter(history.speeds.values), ())))
        ]
        for sensor, series in history.channels.items():
            lines += [(f"channels of {sensor}", channel, series, k) for k, channel in enumerate(CHANNELS)]
        for what, name, series, column in lines:
            plots.setdefault(what, []).append((whose + name, series, column, course.zero))
    return plots


def _envelope(series: Series, column: int, zero: float, edges: Floats) -> Floats:
    """Return the least and the largest value of each bin, NaN for one without a value."""
    import numpy as np

    found = np.full(2 * (len(edges) - 1), np.nan)
    first, last = bisect_left(series.times, zero + edges[0]), bisect_right(series.times, zero + edges[-1])
    if first == last:
        return found
    at = np.array(series.times[first:last]) - zero
    values = np.array([row[column] for row in series.values[first:last]])
    bins = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, len(edges) - 2)
    starts = np.flatnonzero(np.diff(bins, prepend=-1))
    found[2 * bins[starts]] = np.minimum.reduceat(values, starts)
    found[2 * bins[starts] + 1] = np.maximum.reduceat(values, starts)
    return found


#: of the lines, in their order
_LINE_COLOURS = ("#2563eb", "#ea580c", "#16a34a", "#7c3aed", "#854d0e", "#0891b2", "#db2777", "#4b5563")
_LINE_DASHES = ("", "6 3", "2 2", "8 2 2 2")  # a shape as well
_MAX_LINES = 12  # of one plot


def _value_range(what: str, rows: Floats) -> tuple[float, float]:
    """Return from where to where values are drawn: levels and forces from 0, speeds as far below 0 as above."""
    import numpy as np

    known = rows[np.isfinite(rows)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    if what == _LEVELS:
        return 0.0, 1.0
    if what == _SPEEDS:
        high = max(abs(low), abs(high), 1e-3)
        return -1.05 * high, 1.05 * high
    margin = 0.05 * (high - low) or 0.5
    return 0.0 if what == _FORCE else low - margin, high + margin


_WIDTH, _HEIGHT = 480.0, 120.0  # units of the drawing, which fills the panel


def trace_drawings(courses: Sequence[RunCourse], since: float, until: float, live: bool = False) -> str:
    """Return drawings of traces; of several, the page's script shows the one that its viewer chooses.

    Args:
        courses: the runs.
        since: from when on, on the page's clock [s].
        until: until when.
        live: touch levels alone, up to now.
    """
    plots = list(_plots(courses).items())[: 1 if live else None]
    options = "".join(f'<option value="{number}">{escape(name)}</option>' for number, (name, _) in enumerate(plots))
    choice = f"<b>{escape(plots[0][0])}</b>" if live else f"<select>{options}</select>"
    ends = (f"{since - until:.0f} s", "now") if live else (f"{since:.3f} s", f"{until:.3f} s")
    drawings = [_drawing(name, lines[:_MAX_LINES], since, until, ends) for name, lines in plots]
    hidden = ["", *[" hidden"] * (len(plots) - 1)]
    drawn = "".join(f'<div class="coneskin-trace"{a}>{b}</div>' for a, b in zip(hidden, drawings, strict=True))
    return f'<div id="coneskin-traces"><label>traces {choice}</label>{drawn}</div>'


def _drawing(what: str, lines: Sequence[_Line], since: float, until: float, ends: tuple[str, str]) -> str:
    import numpy as np

    edges = np.linspace(since, max(until, since + 1e-6), _BIN_COUNT + 1)
    rows = np.array([_envelope(series, column, zero, edges) for _, series, column, zero in lines])
    low, high = _value_range(what, rows)
    x = np.repeat(np.arange(_BIN_COUNT) + 0.5, 2) * (_WIDTH / _BIN_COUNT)
    paths, words = [], []
    for (name, *_), values, colour, dash in zip(lines, rows, cycle(_LINE_COLOURS), cycle(_LINE_DASHES), strict=False):
        course = _course(x, (high - values) / (high - low) * _HEIGHT)
        look = f'fill="none" stroke="{colour}" stroke-width="1.5" vector-effect="non-scaling-stroke"'
        paths.append(f'<path d="{course}" data-name="{escape(name)}" stroke-dasharray="{dash}" {look}/>')
        words.append(f'<span style="color:{colour}">&#9644;</span> {escape(name)}')
    return (
        f'<div class="coneskin-plot" data-since="{since}" data-until="{until}" data-low="{low}" data-high="{high}" '
        f'data-width="{_WIDTH}" data-height="{_HEIGHT}">'
        f'<svg viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" preserveAspectRatio="none" style="height:{_HEIGHT:g}px">'
        f'{"".join(paths)}</svg><span style="top:0">{high:.3g}</span><span style="bottom:0">{low:.3g}</span>'
        '<div class="coneskin-cursor"></div><div class="coneskin-pointer" hidden></div></div>'
        f'<div class="coneskin-read"></div><div class="coneskin-ends"><span>{ends[0]}</span>'
        f"<span>{', '.join(words)}</span><span>{ends[1]}</span></div>"
    )


def _course(x: Floats, y: Floats) -> str:
    """Return the data of a path with a gap wherever there is no value."""
    import numpy as np

    words, drawing = [], False
    for across, down in zip(x.tolist(), y.tolist(), strict=True):
        if not np.isfinite(down):
            drawing = False
            continue
        words.append(f"{'L' if drawing else 'M'}{across:.1f} {down:.1f}")
        drawing = True
    return "".join(words)
