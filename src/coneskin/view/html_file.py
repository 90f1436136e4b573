"""File of a page that opens in a browser without Python: scene, playback and events in one HTML file.

viser's client plays the scene; its panel is not in such a file, so what it says (phase, events, the notice) is added
here, and follows the time that the client shows.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import Any

from coneskin.core.errors import RecordingError
from coneskin.core.files import explain_os_error, write_whole

from .page_server import PageServer, browser_text, page_client
from .panel import NOTICE, PAGE_LEGEND, state_of, status, timeline, trace_drawings
from .run_course import RunCourse, event_lines
from .stage.level_scale import level_bars, level_words
from .stage.stage import SheetSurface
from .stage_nodes import look_at_stages, nodes_of_runs

_LEVEL_STEPS = 100  # of a level, which a bar can show


_PICTURE_RATE = 30.0  # pictures a second ...
_MAX_PICTURES = 6000  # ... but not more than these in a file
_MAX_EVENTS = 3000  # in a file, each with a picture of its own ...
_EVENT_DELAY = 1e-6  # ... so long after it [s]
_PAGE_BEGIN = b"<!doctype html"  # of every page


def write_html(path: Path, courses: Sequence[RunCourse]) -> float:
    """Write runs into one HTML file.

    Args:
        path: of the file; a page that is there is replaced, and nothing else.

    Returns:
        pictures a second that the file has.

    Raises:
        MissingExtra: viser is not installed.
        RecordingError: the file cannot be written, or is something else than a page.
    """
    _check_target(path)
    since, until = min(item.span[0] for item in courses), max(item.span[1] for item in courses)
    duration = max(until - since, 1e-3)
    count = min(max(2, int(duration * _PICTURE_RATE)), _MAX_PICTURES)
    pictures = _pictures(courses, since, duration, count)
    scene = _serialized(courses, since, pictures)
    embedded = base64.b64encode(scene).decode("ascii")
    head = (
        f"<title>coneskin: {escape(courses[0].stage.title)}</title><style>{browser_text('file.css')}</style>"
        f'<script>window.__VISER_EMBED_DATA__="{embedded}";window.__VISER_EMBED_CONFIG__={{darkMode:false}};</script>'
    )
    page = page_client().replace("</head>", f"{head}</head>", 1)
    at = page.rindex("</body>")
    page = page[:at] + _panel(courses, since, until, pictures) + page[at:]
    with explain_os_error(RecordingError, f"cannot write {path}"):
        write_whole(path, page)
    return count / duration


def _check_target(path: Path) -> None:
    """Refuse a file that is no page: a recording, perhaps, that was named by mistake."""
    if not path.is_file():
        return  # the writing says whether that is possible
    with explain_os_error(RecordingError, f"cannot write {path}"), path.open("rb") as file:
        start = file.read(len(_PAGE_BEGIN))
    if start and start.lower() != _PAGE_BEGIN:
        raise RecordingError(f"{path} exists already and is no page, so it is not replaced: name another file")


def _pictures(courses: Sequence[RunCourse], since: float, duration: float, count: int) -> list[float]:
    """Return the times of the pictures from the first one on [s]: even steps, and one just after each event."""
    even = {duration * picture / (count - 1) for picture in range(count)}
    events = {time - since + _EVENT_DELAY for time, _, _ in event_lines(courses)[:_MAX_EVENTS]}
    return sorted(even | {at for at in events if 0.0 <= at < duration})


def _serialized(courses: Sequence[RunCourse], since: float, pictures: Sequence[float]) -> bytes:
    """Return the scene and its pictures as viser's client reads them."""
    with PageServer("coneskin", port=0x2F00) as server:
        taken = server.serializer()
        look_at_stages(server, max(course.stage.reach for course in courses), len(courses))
        server.scene.set_up_direction("+z")
        nodes = nodes_of_runs(server.scene, courses)
        before = 0.0
        for at in pictures:
            if at > before:
                taken.insert_sleep(at - before)
            before = at
            for course, drawn in zip(courses, nodes, strict=True):
                drawn.show(course.moment(since + at))
        return bytes(taken.serialize())


def _bar_changes(course: RunCourse, since: float, pictures: Sequence[float]) -> dict[str, Any]:
    """Return for JSON when the bars of a run change: of each sheet level [%] and words for each, of the force words."""
    history, sheets = course.history, course.stage.sheets

    def changes(what: Callable[[float], object]) -> list[tuple[float, object]]:
        found: list[tuple[float, object]] = []
        for at in pictures:
            if (now := what(course.zero + since + at)) is not None and (not found or found[-1][1] != now):
                found.append((round(at, 4), now))
        return found

    def level(sheet: SheetSurface) -> Callable[[float], int]:
        return lambda time: round(_LEVEL_STEPS * min(max(history.level(sheet.name, time), 0.0), 1.0))

    words = [[level_words(sheet, step / _LEVEL_STEPS) for step in range(_LEVEL_STEPS + 1)] for sheet in sheets]
    forces = changes(lambda time: None if (force := history.force(time)) is None else f"{force:.1f} N")
    return {"levels": [changes(level(sheet)) for sheet in sheets], "words": words, "forces": forces}


def _panel(courses: Sequence[RunCourse], since: float, until: float, pictures: Sequence[float]) -> str:
    several = len(courses) > 1
    bars = []
    for number, course in enumerate(courses, 1):
        none = {sheet.name: 0.0 for sheet in course.stage.sheets}
        force = course.history.force(course.zero + since)
        bars.append(level_bars(course.stage.sheets, none, force, f"run {number}" if several else ""))
    lines = event_lines(courses)[:_MAX_EVENTS]
    heads = {at - since: _head(courses, at) for at in dict.fromkeys([since, *(time for time, _, _ in lines)])}
    events = [(time - since, " ".join(text.split())) for time, _, text in lines]
    facts = {"since": since, "duration": max(until - since, 1e-3), "heads": list(heads.items()), "events": events}
    data = {**facts, "runs": [_bar_changes(course, since, pictures) for course in courses]}
    text = json.dumps(data).replace("<", "\\u003c")  # so that no word of a recording ends the element
    title = "" if several else f'<div class="coneskin-title">{escape(courses[0].stage.title)}</div>'
    return (
        f'<div id="coneskin">{NOTICE}{title}<div id="coneskin-head"></div><div id="coneskin-clock"></div>'
        f"{timeline(courses, since, until)}"
        f'{"".join(bars)}{trace_drawings(courses, since, until)}<div id="coneskin-events"></div>{PAGE_LEGEND}</div>'
        f'<script type="application/json" id="coneskin-data">{text}</script><script>{browser_text("file.js")}</script>'
    )


def _head(courses: Sequence[RunCourse], at: float) -> str:
    """Return the phases and the cards of runs at a time on the page's clock [s]."""
    moments = ((course, course.zero + at) for course in courses)
    return status([(course.stage.title, course.history.phase(t), state_of(course, t)) for course, t in moments])
