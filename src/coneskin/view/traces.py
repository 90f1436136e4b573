"""Traces of a run: values over time, as SVG of as few points as a small plot can show, with no peak lost."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from html import escape
from itertools import cycle
from typing import TYPE_CHECKING, NamedTuple

from .history import CHANNELS, Series
from .run_course import RunCourse

if TYPE_CHECKING:
    from coneskin.core.arrays import Floats

__all__ = ["trace_drawings", "traces"]

_BIN_COUNT = 240  # each with its least and its largest value
_LEVELS, _SPEEDS, _FORCE = "touch level", "joint speed [rad/s]", "contact force [N]"


class _Traces(NamedTuple):
    """Values over time.

    Attributes:
        names: of the values.
        times: on the page's clock [s], shape (n,).
        values: one row for each name, NaN where there is none, shape (k, n).
    """

    names: tuple[str, ...]
    times: Floats
    values: Floats


def _trace_names(courses: Sequence[RunCourse]) -> list[str]:
    """Return what can be drawn of runs."""
    sensors = [sheet.name for sheet in courses[0].stage.sheets]
    arm = [_SPEEDS] if any(course.history.speeds.times for course in courses) else []
    force = [_FORCE] if any(course.history.forces.times for course in courses) else []
    return [_LEVELS, *force, *arm, *(f"channels of {name}" for name in sensors)]


def traces(courses: Sequence[RunCourse], what: str, since: float, until: float) -> _Traces:
    """Return traces of runs.

    Args:
        courses: the runs.
        what: one of ``_trace_names``.
        since: from when on, on the page's clock [s].
        until: until when.
    """
    import numpy as np

    edges = np.linspace(since, max(until, since + 1e-6), _BIN_COUNT + 1)
    times = np.repeat(0.5 * (edges[:-1] + edges[1:]), 2)
    names: list[str] = []
    rows: list[Floats] = []
    for number, course in enumerate(courses, 1):
        before = f"run {number}: " if len(courses) > 1 else ""
        for name, series, column in _columns(course, what):
            names.append(before + name)
            rows.append(_envelope(series, column, course.zero, edges))
    names, rows = names[:_MAX_LINES], rows[:_MAX_LINES]
    return _Traces(tuple(names), times, np.array(rows).reshape(len(rows), len(times)))


def _columns(course: RunCourse, what: str) -> list[tuple[str, Series, int]]:
    history = course.history
    if what == _LEVELS:
        return [(name, series, 0) for name, series in history.levels.items()]
    if what == _FORCE:
        return [("force", history.forces, 0)]
    if what == _SPEEDS:
        return [(f"joint {joint + 1}", history.speeds, joint) for joint in range(6)]
    sensor = what.removeprefix("channels of ")
    found = history.channels.get(sensor, Series())
    return [(channel, found, column) for column, channel in enumerate(CHANNELS)]


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


def _value_range(what: str, found: _Traces) -> tuple[float, float]:
    """Return from where to where values are drawn: levels and forces from 0, speeds as far below 0 as above."""
    import numpy as np

    known = found.values[np.isfinite(found.values)]
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
    names = _trace_names(courses)[: 1 if live else None]
    options = "".join(f'<option value="{number}">{escape(name)}</option>' for number, name in enumerate(names))
    choice = f"<b>{escape(names[0])}</b>" if live else f"<select>{options}</select>"
    ends = (f"{since - until:.0f} s", "now") if live else (f"{since:.3f} s", f"{until:.3f} s")
    drawings = [_drawing(name, traces(courses, name, since, until), ends) for name in names]
    hidden = ["", *[" hidden"] * (len(names) - 1)]
    drawn = "".join(f'<div class="coneskin-trace"{a}>{b}</div>' for a, b in zip(hidden, drawings, strict=True))
    return f'<div id="coneskin-traces"><label>traces {choice}</label>{drawn}</div>'


def _drawing(what: str, found: _Traces, ends: tuple[str, str]) -> str:
    low, high = _value_range(what, found)
    since, until = float(found.times[0]), float(found.times[-1])
    x = (found.times - since) / max(until - since, 1e-9) * _WIDTH
    lines, words = [], []
    for name, values, colour, dash in zip(
        found.names, found.values, cycle(_LINE_COLOURS), cycle(_LINE_DASHES), strict=False
    ):
        course = _course(x, (high - values) / (high - low) * _HEIGHT)
        look = f'fill="none" stroke="{colour}" stroke-width="1.5" vector-effect="non-scaling-stroke"'
        lines.append(f'<path d="{course}" data-name="{escape(name)}" stroke-dasharray="{dash}" {look}/>')
        words.append(f'<span style="color:{colour}">&#9644;</span> {escape(name)}')
    return (
        f'<div class="coneskin-plot" data-since="{since}" data-until="{until}" data-low="{low}" data-high="{high}" '
        f'data-width="{_WIDTH}" data-height="{_HEIGHT}">'
        f'<svg viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" preserveAspectRatio="none" style="height:{_HEIGHT:g}px">'
        f'{"".join(lines)}</svg><span style="top:0">{high:.3g}</span><span style="bottom:0">{low:.3g}</span>'
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
