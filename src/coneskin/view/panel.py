"""Text and timeline of a page's panel, as HTML and SVG. A recording is foreign: every word of it is escaped."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from coneskin.robot.guard.signals.journal import EventName, GuardEvent

from .history import PhaseWords
from .run_course import RunCourse

__all__ = ["EVENT_STYLE", "NOTICE", "event_list", "notice", "status", "timeline"]

NOTICE = "No safety display. What is drawn may be late, old or wrong; nobody may rely on it near an arm."
_MAX_SHOWN_EVENTS = 9  # events of the list
_MAX_LINE_LENGTH = 1200  # letters of a line
#: of the lines of events: three lines of the panel each, and all of it under the pointer or where it was clicked
EVENT_STYLE = """
#coneskin-events>div{padding-left:9ch;text-indent:-9ch;overflow:hidden;overflow-wrap:anywhere;cursor:pointer;
display:-webkit-box;-webkit-box-orient:vertical;-webkit-line-clamp:3}
#coneskin-events>div:hover,#coneskin-events>div:focus,#coneskin-events>div.now{display:block}
"""
_ALARM_EVENTS = {"contact", "contact_located", "contact_extended", "stopping", "stop_failed", "fault", "guard_exited"}


def notice() -> str:
    """Return the words that stand on every page."""
    style = "border:1px solid #b45309;background:#fef3c7;color:#78350f;padding:6px 8px;font-size:12px;margin:4px 10px"
    return f'<div id="coneskin-notice" style="{style}">{escape(NOTICE)}</div>'


def status(runs: Sequence[tuple[str, PhaseWords, str]], clock: str, stale: str = "", share: float | None = None) -> str:
    """Return the phases of the guards, what is wrong, and the time.

    Args:
        runs: title, phase and what is wrong, of each run on the page.
        clock: the time in words.
        stale: why what is shown is old; empty where it is not.
        share: where on the timeline the time is, 0 to 1; None without a timeline.
    """
    parts = []
    if share is not None:
        left = f"left:calc({100.0 * min(max(share, 0.0), 1.0):.2f}% - 1px)"
        parts.append(
            '<div style="position:relative;height:9px;margin:-4px 10px 0 10px">'
            f'<div style="position:absolute;{left};width:2px;height:9px;background:#111827"></div></div>'
        )
    for title, phase, wrong in runs:
        name = f'<span style="opacity:.8">{escape(title)}</span><br>' if len(runs) > 1 else ""
        parts.append(
            f'<div class="coneskin-phase" style="background:{phase.colour};color:white;padding:6px 10px;'
            f'font-size:15px;margin:4px 10px">{name}{escape(phase.text)}</div>'
        )
        if wrong:
            parts.append(
                f'<div class="coneskin-health" style="color:#b91c1c;font-size:12px;margin:2px 10px">'
                f"{escape(wrong[:400])}</div>"
            )
    if stale:
        parts.append(
            f'<div id="coneskin-stale" style="background:#111827;color:#fbbf24;padding:6px 10px;margin:4px 10px">'
            f"{escape(stale)}</div>"
        )
    parts.append(
        f'<div id="coneskin-clock" style="font-family:monospace;font-size:13px;margin:2px 10px">{escape(clock)}</div>'
    )
    return "".join(parts)


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
        style = "font-weight:700;" if index == now else "opacity:.45;" if index > now else ""
        colour = "#b91c1c" if event.name in _ALARM_EVENTS else "inherit"
        kind = ' class="now"' if index == now else ""
        rows.append(f'<div tabindex="0"{kind} style="{style}color:{colour}">{escape(_line(line))}</div>')
    return (
        f"<style>{EVENT_STYLE}</style>"
        '<div id="coneskin-events" style="font-family:monospace;font-size:11px;line-height:1.5;margin:2px 10px">'
        f"{''.join(rows) or 'no events'}</div>"
    )


def _line(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= _MAX_LINE_LENGTH else f"{text[:_MAX_LINE_LENGTH]} ..."


_WIDTH, _BAND, _TICK, _GAP = 1000.0, 16.0, 8.0, 6.0
_CONTACT_EVENTS = {EventName.CONTACT, EventName.CONTACT_LOCATED, EventName.CONTACT_EXTENDED}
_FAULT_EVENTS = {EventName.FAULT, EventName.GUARD_EXITED, EventName.GUARD_UNRESPONSIVE, EventName.STOP_FAILED}
_MAX_TICKS = 400  # ticks; a run with more faults than pixels has one wherever one looks


def timeline(courses: Sequence[RunCourse], since: float, until: float) -> str:
    """Return the timeline of runs.

    Args:
        courses: the runs.
        since: where it begins, on the page's clock [s].
        until: where it ends.
    """
    scale = _WIDTH / max(until - since, 1e-9)
    row = _BAND + _TICK + _GAP
    height = row * len(courses)
    parts = [
        f'<svg id="coneskin-timeline" viewBox="0 0 {_WIDTH:.0f} {height:.0f}" preserveAspectRatio="none" '
        f'style="width:calc(100% - 20px);height:{height:.0f}px;margin:4px 10px 0">'
    ]
    for number, course in enumerate(courses):
        top = number * row
        phases = course.history.phases
        ends = [*(change.time for change in phases[1:]), course.zero + until]
        for change, end in zip(phases, ends, strict=True):
            x0 = (max(change.time - course.zero, since) - since) * scale
            x1 = (min(end - course.zero, until) - since) * scale
            if x1 > x0:
                parts.append(
                    f'<rect x="{x0:.2f}" y="{top + _TICK:.1f}" width="{max(x1 - x0, 1.0):.2f}" height="{_BAND}" '
                    f'fill="{change.phase.colour}"><title>{escape(change.phase.text)}</title></rect>'
                )
        shown = [event for event in course.history.events if since <= event.time - course.zero <= until]
        for event in [event for event in shown if event.name in _CONTACT_EVENTS | _FAULT_EVENTS][-_MAX_TICKS:]:
            x = (event.time - course.zero - since) * scale
            colour = "#e11d48" if event.name in _CONTACT_EVENTS else "#111827"
            parts.append(f'<rect x="{x - 1.5:.2f}" y="{top:.1f}" width="3" height="{_TICK}" fill="{colour}"/>')
    return "".join([*parts, "</svg>"])
