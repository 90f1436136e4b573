"""Text, timeline and traces of a page's panel, as HTML and SVG. A recording is foreign: every word of it is escaped.

Traces are values over time, of as few points as a small plot can show, with no peak lost.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from html import escape
from itertools import cycle

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.core.text import printable
from coneskin.robot.guard.signals.event_text import describe
from coneskin.robot.guard.signals.journal import CONTACT_EVENTS, EventName, GuardEvent, describe_way, stopping_contact

from .run_course import CHANNELS, PHASE_COLOURS, PhaseWords, RunCourse, Series

NOTICE = (
    '<div id="coneskin-notice">No safety display. What is drawn may be late, old or wrong; '
    "nobody may rely on it near an arm.</div>"
)
#: what is to be seen, for who looks for the first time
PAGE_LEGEND = (
    '<details id="coneskin-legend" open><summary>What you see</summary>'
    "Dark blue: a sheet of skin. Its edge and its bar turn magenta at a touch, pale yellow at a firm one.<br>"
    "Ring, disc and arrow: the place of a touch, where it is with 95 %, and the outward normal. "
    "No disc: not certain, or not told. The touch that stopped the arm stays until the reset.<br>"
    "&#9654; active, &#9670; the arm reacts, &#9632; it is stopped, ? not active, "
    "&#10005; grey: old, nothing new comes.</details>"
)
_MAX_SHOWN_EVENTS = 9  # events of the list
_MAX_LINE_LENGTH = 1200  # letters of a line
_ALARM_EVENTS = {"contact", "contact_located", "contact_extended", "stopping", "stop_failed", "fault", "guard_exited"}
_STOP_ENDS = {EventName.RESET, EventName.ACTIVATED, EventName.GUARD_EXITED}


def status(runs: Sequence[tuple[str, PhaseWords, str]]) -> str:
    """Return the phases of the guards, and what holds their arms or is wrong.

    Args:
        runs: title, phase, and the HTML of ``state_of``, of each run on the page.
    """
    parts = []
    for title, phase, state in runs:
        text = escape(f"{title}: {phase.text}" if len(runs) > 1 else phase.text)
        parts.append(f'<div class="coneskin-phase {phase.kind}" data-text="{text}">{text}</div>{state}')
    return "".join(parts)


def state_of(course: RunCourse, time: float) -> str:
    """Return the card of the stop that holds an arm at a time [s, host clock], or else what is wrong; as HTML.

    The card stays until the reset. It says what the events of the guard say, and nothing else.
    """
    events = [event for event in course.history.events if event.time <= time]
    held = _held_stop(events)
    if not held:
        cause, remedy = _cause_and_remedy(course.history.health(time))
        return _card([("wrong", cause), ("remedy", remedy)] if cause else [])
    return _card([("time", f"{held[0].time - course.zero:.3f} s"), *_stop_rows(held[0], held, events, course.zero)])


def _held_stop(events: Sequence[GuardEvent]) -> list[GuardEvent]:
    """Return the events of the stop that holds the arm, from "stopping" on; none where none does."""
    found: list[GuardEvent] = []
    for event in events:
        if event.name in (EventName.RESET, EventName.ACTIVATED):
            found = []
        elif found or event.name == EventName.STOPPING:
            found.append(event)
    return found


def _stop_rows(
    stop: GuardEvent, held: Sequence[GuardEvent], events: Sequence[GuardEvent], zero: float
) -> list[tuple[str, str]]:
    """Return name and words of all that is known of a stop: its cause, its place, how the arm came to stand."""
    last = {event.name: event.details for event in held}
    rows: list[tuple[str, str]] = []
    try:
        if (contact := stopping_contact(stop, events)) is not None:
            d = contact.details
            told = d.get("ellipse")
            sure = "error not told" if told is None else f"+- {max(0.1, 1e3 * math.hypot(*told[0])):.1f} mm (95 %)"
            sure = sure if d["location_valid"] else "not certain"
            place = f"u = {1e3 * d['u']:.1f} mm, phi = {math.degrees(d['phi']):.1f} deg, {sure}"
            rows += [("touch", f"{d['sensor']} ({d['link']})"), ("place", place), ("level", f"{d['level']:.2f} then")]
        else:
            rows += zip(("cause", "remedy"), _cause_and_remedy(stop.details["why"]), strict=True)
        faults = {
            _stem(event): event for event in held if event.name == EventName.FAULT and _stem(event) != _stem(stop)
        }
        rows += [("also", _cause_and_remedy(event.details["what"])[0]) for event in faults.values()]
        for stands in [event for event in held if event.name == EventName.STANDSTILL][:1]:
            paths = ", ".join(stands.details["paths"])
            rows.append(("stop path", f"{paths}, stands after {1e3 * (stands.time - stop.time):.0f} ms"))
        if EventName.STOP_FAILED in last:
            rows.append(("stop path", "standstill NOT confirmed: use the emergency stop"))
        if (retreated := last.get(EventName.RETREATED)) is not None:
            rows.append(("moved away", f"{describe_way(retreated)}: {_cause_and_remedy(retreated['why'])[0]}"))
    except (LookupError, TypeError, ValueError, AttributeError):  # recorded by another version, or damaged
        return [("stop", describe(stop, zero))]
    if EventName.LATCHED in last:
        rows.append(("next", "reset the guard when nobody touches the arm"))
    return rows


def _card(rows: Sequence[tuple[str, str]]) -> str:
    lines = "".join(
        f'<tr data-row="{name}"><th>{name}</th><td>{escape(_line(text))}</td></tr>' for name, text in rows if text
    )
    return f'<div class="coneskin-card"><table>{lines}</table></div>' if lines else ""


def _cause_and_remedy(text: str) -> tuple[str, str]:
    """Return the two halves of an error's text: what is wrong, and what to do; a bracket that is cut is closed."""
    cause, _, remedy = " ".join(text.split()).partition("; ")
    if cause.count("(") > cause.count(")"):
        cause, remedy = f"{cause})", remedy.replace(")", "", 1)
    return cause, remedy


def stop_entries(events: Sequence[GuardEvent], zero: float) -> list[tuple[GuardEvent, str]]:
    """Return one entry for each stop, and one for each other event; what is told again is counted.

    Args:
        zero: host time that counts as 0 [s].

    Returns:
        the first event of each entry, and its line.
    """
    groups: list[list[GuardEvent]] = []
    stopped = False
    for event in events:
        stopped = stopped and event.name not in _STOP_ENDS
        if stopped or (groups and _stem(event) == _stem(groups[-1][0])):
            groups[-1].append(event)
        else:
            groups.append([event])
        stopped = stopped or event.name == EventName.STOPPING
    return [(group[0], _entry(group, events, zero)) for group in groups]


def _entry(group: Sequence[GuardEvent], events: Sequence[GuardEvent], zero: float) -> str:
    for stop in (event for event in group if event.name == EventName.STOPPING):
        words = "; ".join(f"{name}: {text}" for name, text in _stop_rows(stop, group, events, zero) if text)
        return printable(f"{stop.time - zero:9.4f} s  stop; {words}")
    return describe(group[0], zero) + (f" ({len(group)} times)" if len(group) > 1 else "")


def _stem(event: GuardEvent) -> str:
    """Return what two events have in common that tell of the same: their words without numbers."""
    said = event.details.get("what", event.details.get("why"))
    return re.sub(r"[\d.]+", "#", _cause_and_remedy(said)[0]) if isinstance(said, str) else f"{event.name} {event.time}"


def event_list(lines: Sequence[tuple[GuardEvent, str]], now: int) -> str:
    """Return the events around the present one.

    Args:
        lines: events and their lines for people.
        now: index of the newest that has happened; -1 for none.
    """
    begin = max(0, min(now - _MAX_SHOWN_EVENTS + 3, len(lines) - _MAX_SHOWN_EVENTS))
    rows = []
    for index in range(begin, min(begin + _MAX_SHOWN_EVENTS, len(lines))):
        event, line = lines[index]
        kind = "now" if index == now else "ahead" if index > now else ""
        alarm = " alarm" if event.name in _ALARM_EVENTS else ""
        rows.append(f'<div tabindex="0" class="{kind}{alarm}">{escape(_line(line))}</div>')
    return f'<div id="coneskin-events">{"".join(rows) or "no events"}</div>'


def _line(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= _MAX_LINE_LENGTH else f"{text[:_MAX_LINE_LENGTH]} ..."


_WIDTH, _BAND, _TICK, _GAP = 1000.0, 16.0, 8.0, 6.0
#: height of a phase's band as a share: a shape, for those to whom its colour says nothing
_BAND_SHARES = {"unknown": 0.25, "active": 0.5, "moving": 0.75, "stopped": 1.0}
_FAULT_EVENTS = {EventName.FAULT, EventName.GUARD_EXITED, EventName.GUARD_UNRESPONSIVE, EventName.STOP_FAILED}
_MAX_TICKS = 400  # ticks; a run with more faults than pixels has one wherever one looks


def timeline(courses: Sequence[RunCourse], since: float, until: float) -> str:
    """Return the timeline of runs.

    Args:
        since: where it begins, on the page's clock [s].
        until: where it ends.
    """
    scale = _WIDTH / max(until - since, 1e-9)
    row = _BAND + _TICK + _GAP
    height = row * len(courses)
    parts = [
        f'<div class="coneskin-timeline"><svg id="coneskin-timeline" viewBox="0 0 {_WIDTH:.0f} {height:.0f}" '
        f'preserveAspectRatio="none" style="height:{height:.0f}px">'
    ]
    for number, course in enumerate(courses):
        top = number * row
        phases = course.history.phases
        ends = [*(change.time for change in phases[1:]), course.zero + until]
        for change, end in zip(phases, ends, strict=True):
            x0 = (max(change.time - course.zero, since) - since) * scale
            x1 = (min(end - course.zero, until) - since) * scale
            if x1 > x0:
                tall = _BAND * _BAND_SHARES[change.phase.kind]
                parts.append(
                    f'<rect x="{x0:.2f}" y="{top + _TICK + _BAND - tall:.1f}" width="{max(x1 - x0, 1.0):.2f}" '
                    f'height="{tall:g}" stroke="#111827" stroke-width=".5" fill="{PHASE_COLOURS[change.phase.kind]}">'
                    f"<title>{escape(change.phase.text)}</title></rect>"
                )
        shown = [event for event in course.history.events if since <= event.time - course.zero <= until]
        for event in [event for event in shown if event.name in CONTACT_EVENTS | _FAULT_EVENTS][-_MAX_TICKS:]:
            x = (event.time - course.zero - since) * scale
            colour, wide = ("#d646e0", 4) if event.name in CONTACT_EVENTS else ("#111827", 2)
            parts.append(
                f'<rect x="{x - 0.5 * wide:.2f}" y="{top:.1f}" width="{wide}" height="{_TICK}" fill="{colour}"/>'
            )
    return "".join([*parts, '</svg><div class="coneskin-cursor"></div></div>'])


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
    known = rows[np.isfinite(rows)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    if what == _LEVELS:
        return 0.0, 1.0
    if what == _SPEEDS:
        high = max(abs(low), abs(high), 1e-3)
        return -1.05 * high, 1.05 * high
    margin = 0.05 * (high - low) or 0.5
    return 0.0 if what == _FORCE else low - margin, high + margin


_PLOT_WIDTH, _PLOT_HEIGHT = 480.0, 120.0  # units of the drawing, which fills the panel


def trace_drawings(courses: Sequence[RunCourse], since: float, until: float, live: bool = False) -> str:
    """Return drawings of traces; of several, the page's script shows the one that its viewer chooses.

    Args:
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
    edges = np.linspace(since, max(until, since + 1e-6), _BIN_COUNT + 1)
    rows = np.array([_envelope(series, column, zero, edges) for _, series, column, zero in lines])
    low, high = _value_range(what, rows)
    x = np.repeat(np.arange(_BIN_COUNT) + 0.5, 2) * (_PLOT_WIDTH / _BIN_COUNT)
    paths, words = [], []
    for (name, *_), values, colour, dash in zip(lines, rows, cycle(_LINE_COLOURS), cycle(_LINE_DASHES), strict=False):
        course = _course(x, (high - values) / (high - low) * _PLOT_HEIGHT)
        look = f'fill="none" stroke="{colour}" stroke-width="1.5" vector-effect="non-scaling-stroke"'
        paths.append(f'<path d="{course}" data-name="{escape(name)}" stroke-dasharray="{dash}" {look}/>')
        words.append(f'<span style="color:{colour}">&#9644;</span> {escape(name)}')
    return (
        f'<div class="coneskin-plot" data-since="{since}" data-until="{until}" data-low="{low}" data-high="{high}" '
        f'data-width="{_PLOT_WIDTH}" data-height="{_PLOT_HEIGHT}">'
        f'<svg viewBox="0 0 {_PLOT_WIDTH:g} {_PLOT_HEIGHT:g}" preserveAspectRatio="none" '
        f'style="height:{_PLOT_HEIGHT:g}px">'
        f'{"".join(paths)}</svg><span style="top:0">{high:.3g}</span><span style="bottom:0">{low:.3g}</span>'
        '<div class="coneskin-cursor"></div><div class="coneskin-pointer" hidden></div></div>'
        f'<div class="coneskin-read"></div><div class="coneskin-ends"><span>{ends[0]}</span>'
        f"<span>{', '.join(words)}</span><span>{ends[1]}</span></div>"
    )


def _course(x: Floats, y: Floats) -> str:
    """Return the data of a path with a gap wherever there is no value."""
    words, drawing = [], False
    for across, down in zip(x.tolist(), y.tolist(), strict=True):
        if not np.isfinite(down):
            drawing = False
            continue
        words.append(f"{'L' if drawing else 'M'}{across:.1f} {down:.1f}")
        drawing = True
    return "".join(words)
