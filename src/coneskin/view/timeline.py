"""Timeline of runs as a drawing (SVG): phases as bands, touches and faults as ticks."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from coneskin.robot.guard.signals.journal import EventName

from .strand import Strand

__all__ = ["timeline"]

_WIDTH, _BAND, _TICK, _GAP = 1000.0, 16.0, 8.0, 6.0
_CONTACT = {EventName.CONTACT, EventName.CONTACT_LOCATED, EventName.CONTACT_EXTENDED}
_WRONG = {EventName.FAULT, EventName.GUARD_EXITED, EventName.GUARD_UNRESPONSIVE, EventName.STOP_FAILED}
_MOST = 400  # ticks; a run with more faults than pixels has one wherever one looks


def timeline(strands: Sequence[Strand], since: float, until: float) -> str:
    """Return the timeline of runs.

    Args:
        strands: the runs.
        since: where it begins, on the page's clock [s].
        until: where it ends.
    """
    scale = _WIDTH / max(until - since, 1e-9)
    row = _BAND + _TICK + _GAP
    height = row * len(strands)
    parts = [
        f'<svg id="coneskin-timeline" viewBox="0 0 {_WIDTH:.0f} {height:.0f}" preserveAspectRatio="none" '
        f'style="width:calc(100% - 20px);height:{height:.0f}px;margin:4px 10px 0">'
    ]
    for number, strand in enumerate(strands):
        top = number * row
        phases = strand.history.phases
        ends = [*(change.time for change in phases[1:]), strand.zero + until]
        for change, end in zip(phases, ends, strict=True):
            x0 = (max(change.time - strand.zero, since) - since) * scale
            x1 = (min(end - strand.zero, until) - since) * scale
            if x1 > x0:
                parts.append(
                    f'<rect x="{x0:.2f}" y="{top + _TICK:.1f}" width="{max(x1 - x0, 1.0):.2f}" height="{_BAND}" '
                    f'fill="{change.phase.colour}"><title>{escape(change.phase.text)}</title></rect>'
                )
        shown = [event for event in strand.history.events if since <= event.time - strand.zero <= until]
        for event in [event for event in shown if event.name in _CONTACT | _WRONG][-_MOST:]:
            x = (event.time - strand.zero - since) * scale
            colour = "#e11d48" if event.name in _CONTACT else "#111827"
            parts.append(f'<rect x="{x - 1.5:.2f}" y="{top:.1f}" width="3" height="{_TICK}" fill="{colour}"/>')
    return "".join([*parts, "</svg>"])
