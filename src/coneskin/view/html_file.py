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

from .page_server import PageServer, page_client
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

_PAGE_STYLE = """
body #root{width:calc(100% - 384px);overflow:hidden;transform:translateZ(0)}
#coneskin{position:fixed;top:12px;right:12px;width:360px;max-height:calc(100% - 24px);overflow:auto;z-index:9;
background:rgba(255,255,255,.93);font:13px system-ui,sans-serif;box-shadow:0 1px 8px rgba(0,0,0,.25);padding:10px}
#coneskin-timeline{cursor:pointer}
@media(max-width:700px){body #root{width:100%;height:45%}
#coneskin{left:0;right:0;top:45%;bottom:0;width:auto;max-height:none}}
#root .mantine-NumberInput-root,#root .mantine-Slider-label{display:none}
"""  # the client's own field and label count from the first picture, which is not where the run's clock has its zero

#: moves the client's own playback by its field for the time, and follows what its slider shows
_PAGE_SCRIPT = """
(function () {
  const data = JSON.parse(document.getElementById('coneskin-data').textContent);
  const panel = document.getElementById('coneskin');
  const head = document.getElementById('coneskin-head');
  const clock = document.getElementById('coneskin-clock');
  const list = document.getElementById('coneskin-events');
  const cursors = [...panel.querySelectorAll('.coneskin-cursor')];
  const levels = [...panel.querySelectorAll('.coneskin-level')];
  const marks = [...panel.querySelectorAll('.coneskin-level-mark')];
  const forces = [...panel.querySelectorAll('.coneskin-force b')];
  const rows = data.events.map((event) => {
    const row = document.createElement('div');
    row.textContent = event[1];
    row.tabIndex = 0;
    row.onclick = () => jump(event[0]);
    list.appendChild(row);
    return row;
  });
  function field() { return document.querySelector('#root input:not([role=slider])'); }
  function shown() {
    const thumb = document.querySelector('#root [role=slider]');
    return thumb === null ? null : parseFloat(thumb.getAttribute('aria-valuenow'));
  }
  function jump(time) {
    const input = field();
    if (input === null) return;
    const setter = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set;
    const steps = Math.min(Math.max(Math.ceil(1e4 * time), 1), Math.floor(1e4 * data.duration));  // of its slider
    setter.call(input, (1e-4 * steps).toFixed(4));
    input.dispatchEvent(new Event('input', { bubbles: true }));
    input.dispatchEvent(new Event('blur', { bubbles: true }));
  }
  const timeline = document.getElementById('coneskin-timeline');
  timeline.onclick = (event) => {
    const box = timeline.getBoundingClientRect();
    jump(data.duration * (event.clientX - box.left) / box.width);
  };
  function last(changes, time) {
    let found = changes[0];
    for (const change of changes) { if (change[0] <= time + 1e-4) found = change; else break; }
    return found;
  }
  let before = null;
  function follow() {
    const time = shown();
    if (time !== null && time !== before) {
      before = time;
      clock.textContent = (1e-3 * Math.floor(1e3 * (time + data.since))).toFixed(3) + ' s';
      cursors.forEach((cursor) => { cursor.style.left = (100 * time / data.duration) + '%'; });
      const words = last(data.heads, time)[1];  // from Python, which has escaped what a recording says
      if (head.innerHTML !== words) head.innerHTML = words;
      let bar = 0, pressed = 0;
      data.runs.forEach((run) => {
        run.levels.forEach((changes, sheet) => {
          const level = last(changes, time)[1];
          levels[bar].textContent = run.words[sheet][level];
          marks[bar].style.left = level + '%';
          bar += 1;
        });
        if (run.forces.length > 0) { forces[pressed].textContent = last(run.forces, time)[1]; pressed += 1; }
      });
      rows.forEach((row, k) => { row.style.opacity = data.events[k][0] <= time + 1e-4 ? 1 : 0.4; });
    }
    requestAnimationFrame(follow);
  }
  follow();
})();
"""


def write_html(path: Path, courses: Sequence[RunCourse]) -> float:
    """Write runs into one HTML file.

    Args:
        path: of the file; a page that is there is replaced, and nothing else.
        courses: the runs.

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
        f"<title>coneskin: {escape(courses[0].stage.title)}</title><style>{_PAGE_STYLE}</style>"
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
        reach = max(course.stage.reach for course in courses)
        look_at_stages(server, reach, len(courses))
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
        f'<script type="application/json" id="coneskin-data">{text}</script><script>{_PAGE_SCRIPT}</script>'
    )


def _head(courses: Sequence[RunCourse], at: float) -> str:
    """Return the phases and the cards of runs at a time on the page's clock [s]."""
    moments = ((course, course.zero + at) for course in courses)
    return status([(course.stage.title, course.history.phase(t), state_of(course, t)) for course, t in moments])
