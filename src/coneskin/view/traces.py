"""Traces of a run: values over time in as few points as a small plot can show, with no peak lost.

A page that Python serves draws them with viser, a page in a file as SVG.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from html import escape
from itertools import cycle
from typing import TYPE_CHECKING, Any, NamedTuple

from .history import CHANNELS, Series
from .run_course import RunCourse

if TYPE_CHECKING:
    from coneskin.core.arrays import Floats

__all__ = ["COLOURS", "MOST_LINES", "TracePlot", "trace_drawings", "traces"]

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
    names, rows = names[:MOST_LINES], rows[:MOST_LINES]
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
COLOURS = ("#2563eb", "#ea580c", "#16a34a", "#7c3aed", "#854d0e", "#0891b2", "#db2777", "#4b5563")
MOST_LINES = 12  #: of one plot


class TracePlot:
    """Plot of runs.

    Args:
        gui: viser's ``GuiApi``.
        courses: the runs.
        since: from when on, on the page's clock [s].
        until: until when.
        fixed: touch levels alone are drawn, and nobody can choose: on a page that all viewers share.
    """

    def __init__(self, gui: Any, courses: Sequence[RunCourse], since: float, until: float, fixed: bool = False) -> None:
        self._gui, self._strands, self._since, self._until = gui, courses, since, until
        names = self._names = _trace_names(courses)
        self._folder = gui.add_folder("traces")
        self._shown = names[0]
        with self._folder:
            choice = None if fixed else gui.add_dropdown("show", names, initial_value=names[0])
            self._plot = self._make()
        if choice is not None:
            choice.on_update(lambda _event: self._change(str(choice.value)))

    def move(self, since: float, until: float) -> None:
        """Draw another stretch of time."""
        self._since, self._until = since, until
        found = traces(self._strands, self._shown, since, until)
        self._plot.data, self._plot.scales = (found.times, *found.values), _scales(found)

    def remove(self) -> None:
        """Take the plot off the page."""
        self._folder.remove()

    def _change(self, what: str) -> None:
        if what not in self._names or what == self._shown:
            return
        old, self._shown = self._plot, what
        with self._folder:
            self._plot = self._make()
        old.remove()

    def _make(self) -> Any:
        found = traces(self._strands, self._shown, self._since, self._until)
        series: list[dict[str, Any]] = [{"label": "time [s]"}]
        series += [{"label": n, "stroke": c, "width": 1.5} for n, c in zip(found.names, cycle(COLOURS), strict=False)]
        return self._gui.add_uplot(
            (found.times, *found.values), tuple(series), scales=_scales(found), legend={"show": True}, aspect=1.7
        )


def _value_range(found: _Traces) -> tuple[float, float]:
    """Return from where to where the values of traces are drawn, with a margin; 0 to 1 where there are none."""
    import numpy as np

    known = found.values[np.isfinite(found.values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    margin = 0.05 * (high - low) or 0.5
    return low - margin, high + margin


def _scales(found: _Traces) -> dict[str, Any]:
    """Return the axes of a plot; one that looks for its own range finds none where a value is missing (NaN)."""
    return {"x": {"time": False, "auto": True}, "y": {"auto": False, "range": _value_range(found)}}


_WIDTH, _HEIGHT = 480.0, 120.0  # units of the drawing, which fills the panel


def trace_drawings(courses: Sequence[RunCourse], since: float, until: float) -> str:
    """Return a choice of traces and the drawing of each, of which all but the first are hidden.

    Args:
        courses: the runs.
        since: from when on, on the page's clock [s].
        until: until when.
    """
    names = _trace_names(courses)
    options = "".join(f'<option value="{number}">{escape(name)}</option>' for number, name in enumerate(names))
    drawings = [_drawing(traces(courses, name, since, until)) for name in names]
    hidden = ["", *[" hidden"] * (len(names) - 1)]
    drawn = "".join(f'<div class="coneskin-trace"{a}>{b}</div>' for a, b in zip(hidden, drawings, strict=True))
    return f'<div id="coneskin-traces"><label>traces <select>{options}</select></label>{drawn}</div>'


def _drawing(found: _Traces) -> str:
    low, high = _value_range(found)
    span = float(found.times[-1] - found.times[0])
    x = (found.times - found.times[0]) / max(span, 1e-9) * _WIDTH
    lines, words = [], []
    for name, values, colour in zip(found.names, found.values, cycle(COLOURS), strict=False):
        course = _course(x, (high - values) / (high - low) * _HEIGHT)
        lines.append(f'<path d="{course}" fill="none" stroke="{colour}" vector-effect="non-scaling-stroke"/>')
        words.append(f'<span style="color:{colour}">&#9644;</span> {escape(name)}')
    return (
        f'<div style="position:relative"><svg viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" preserveAspectRatio="none" '
        f'style="display:block;width:100%;height:{_HEIGHT:g}px;background:#f9fafb">{"".join(lines)}</svg>'
        f'<span style="position:absolute;left:2px;top:0">{high:.3g}</span>'
        f'<span style="position:absolute;left:2px;bottom:0">{low:.3g}</span><div class="coneskin-cursor"></div></div>'
        f"<div>{', '.join(words)}</div>"
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
