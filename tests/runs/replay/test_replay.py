"""A recording runs again: the same events, bit by bit; cut anywhere, it says what is missing."""

import json
import re
from dataclasses import replace as changed
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from coneskin.core.errors import RecordingError
from coneskin.core.recording.block import Block
from coneskin.core.recording.defects import Defect, DefectKind
from coneskin.core.recording.recorder import Recorder
from coneskin.core.version import code_versions, recorded_version
from coneskin.robot.guard.signals.journal import BlockKind, EventName, GuardEvent
from coneskin.runs.comparison import compare_decisions, comparison_lines
from coneskin.runs.decisions import decide_again, recorded_decisions
from coneskin.runs.replay.event_details import event_differences
from coneskin.runs.replay.run import Run, Verdict, read_run
from coneskin.scene.settings import resolved_settings
from coneskin.scene.values.scene import Commissioning
from tests.scene.scenes import FULL, SKIN_ONLY, record
from tests.support.sweep import sweep

EVENTS = ["activated", "stopping", "contact", "decelerating", "contact_located", "standstill", "latched", "touch_ended"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    record(folder / "run.rec")
    return folder


@pytest.fixture(scope="module")
def run(folder: Path) -> Run:
    return read_run(folder)


def test_the_run_is_a_collision(run: Run) -> None:
    """The tests below rest on this: a touch at u = 70 mm, phi = 90 deg, a stop, a standstill, a latch."""
    assert [event.name for event in run.events] == EVENTS
    placed = run.events[4].details
    assert placed["sensor"] == "towards the wrist"
    assert (placed["u"], placed["phi"]) == (pytest.approx(0.07, abs=1e-3), pytest.approx(1.5708, abs=0.02))


def test_the_same_events_bit_by_bit(run: Run) -> None:
    result = run.replay()
    assert result.same
    assert result.differences == []
    assert result.missing == ""
    assert [(e.name, e.time) for e in result.events] == [(e.name, e.time) for e in run.events]
    assert result.frames == sum(len(block.payload) for block in run.blocks if block.kind == BlockKind.SKIN) > 36 * 1000
    assert result.duration == pytest.approx(1.5, abs=0.01)


def test_the_picture_for_a_notebook_reaches_from_its_left_edge_to_its_right_one(run: Run) -> None:
    page = run._repr_html_()
    (width,), (points,) = re.findall(r"viewBox='0 0 (\d+) ", page), re.findall(r"points='(.*?)'", page)
    across = [float(point.partition(",")[0]) for point in points.split()]
    assert (across[0], across[-1]) == pytest.approx((0.0, float(width)), abs=0.01 * float(width))
    assert across == sorted(across)
    (touch,) = re.findall(r"<path d='M([\d.]+) ", page)
    assert float(touch) / float(width) == pytest.approx(0.6 / 1.5, abs=0.02), "0.6 s after the begin of 1.5 s"


def test_one_bit_of_an_event_is_seen(run: Run) -> None:
    where = next(i for i, block in enumerate(run.blocks) if block.payload.startswith(b'["contact"'))
    blocks = list(run.blocks)
    name, details = json.loads(blocks[where].payload)
    details["u"] *= 1.0 + 2.3e-16
    blocks[where] = GuardEvent(name, blocks[where].time, details).block()
    result = changed(run, blocks=tuple(blocks)).replay()
    assert not result.same
    assert result.differences == ["0.6040 s, contact: u 69.905 mm, by -1.4e-14 mm"]


@pytest.mark.parametrize("removed", sweep(range(len(EVENTS)), short=3))
def test_a_recorded_event_more_or_less_is_seen(run: Run, removed: int) -> None:
    where = [i for i, block in enumerate(run.blocks) if block.kind == BlockKind.EVENT][removed]
    blocks = tuple(run.blocks)
    fewer = blocks[:where] + blocks[where + 1 :]
    more = blocks[: where + 1] + blocks[where:]
    (line,) = changed(run, blocks=fewer).replay().differences
    assert line.endswith(": is new")
    (line,) = changed(run, blocks=more).replay().differences
    assert line.endswith(": was recorded, and is not replayed")


def test_events_that_are_recorded_but_not_replayed_are_seen_in_a_cut_run_too(run: Run) -> None:
    blocks = tuple(block for block in run.blocks if block.kind != BlockKind.SKIN)
    cut = Defect(DefectKind.NOT_CLOSED, since=max(block.time for block in blocks))
    assert changed(run, blocks=blocks, defects=(cut,)).replay().differences


@pytest.mark.long
@settings(max_examples=12, suppress_health_check=list(HealthCheck))
@given(st.data())
def test_a_changed_byte_of_the_skin_is_no_accident(run: Run, data: st.DataObject) -> None:
    """Either the events differ and ``same`` says so, or they do not: never an exception, never a wrong verdict."""
    skin = [i for i, block in enumerate(run.blocks) if block.kind == BlockKind.SKIN]
    where = data.draw(st.sampled_from(skin))
    blocks = list(run.blocks)
    payload = bytearray(blocks[where].payload)
    payload[data.draw(st.integers(0, len(payload) - 1))] ^= data.draw(st.integers(1, 255))
    blocks[where] = blocks[where]._replace(payload=bytes(payload))
    result = changed(run, blocks=tuple(blocks)).replay()
    equal = [tuple(e) for e in map(_as_json, result.events)] == [tuple(e) for e in map(_as_json, run.events)]
    assert result.same == equal
    assert bool(result.differences) == (not equal)


def _as_json(event: GuardEvent) -> tuple[str, float, str]:
    return event.name, event.time, json.dumps(event.details)


def test_a_damaged_touch_is_not_the_same(run: Run) -> None:
    """The frame in which the touch is first seen, made unreadable: the contact comes a frame later."""
    contact = next(i for i, block in enumerate(run.blocks) if block.payload.startswith(b'["contact"'))
    blocks = list(run.blocks)
    where = max(i for i, block in enumerate(blocks[:contact]) if block.kind == BlockKind.SKIN)
    blocks[where] = blocks[where]._replace(payload=bytes(len(blocks[where].payload)))
    assert not changed(run, blocks=tuple(blocks)).replay().same


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("short") / "run.rec"
    record(path, SKIN_ONLY)
    return path.read_bytes()


def test_a_run_that_is_cut_anywhere_replays_and_says_so(short: bytes, tmp_path: Path) -> None:
    path = tmp_path / "cut.rec"
    lengths = sorted({*range(0, len(short), len(short) // 40), *range(len(short) - 30, len(short))})
    seen, said = set(), set()
    for length in lengths:
        path.write_bytes(short[:length])
        try:
            run = read_run(path)
        except RecordingError as exc:
            seen.add("unreadable")
            said.add(str(exc))
            continue
        result = run.replay()
        seen.add("replayed")
        assert "was not closed: nothing is known after" in result.missing, length
        assert result.verdict == Verdict.INCOMPLETE, (length, result.differences)
        assert result.duration <= 1.5
    assert seen == {"unreadable", "replayed"}
    assert all("no recording" in line or "no header" in line for line in said)


def test_another_scene_gives_other_events(run: Run) -> None:
    from coneskin.scene.reader import parse_scene

    deaf = parse_scene(FULL.replace("id = 2", "id = 2\ntouch_level = 0.99\nlocation_level = 0.999"))
    result = run.replay(deaf)
    assert not result.same
    assert "contact" not in [event.name for event in result.events]


def test_another_scene_keeps_its_own_commissioning_and_else_has_that_of_the_run(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("coneskin.runs.replay.run.build_core", lambda scene, placed, detector: scene.commissioning)
    own, bare = Commissioning(False, "its own"), changed(run.scene(), commissioning=None)
    assert run.build_core(changed(bare, commissioning=own)) == own
    assert run.build_core(bare) == run.commissioning


def test_a_guard_that_could_not_start_replays(tmp_path: Path, run: Run) -> None:
    """The event of its death comes from its process, not from the core: nothing to replay, and nothing different."""
    path = tmp_path / "run.rec"
    with Recorder(path) as recorder:
        recorder.write(Block(BlockKind.HEADER, 0.0, json.dumps(run.header).encode()))
        recorder.write(GuardEvent("guard_exited", 0.0, {"what": "no port"}).block())
    result = read_run(tmp_path).replay()
    assert result.verdict == Verdict.INCOMPLETE
    assert result.differences == []
    assert [event.name for event in result.recorded] == ["guard_exited"]


@pytest.mark.parametrize(
    "payload",
    [b"", b"no json", b"[]", b"5", b'{"scene": 1}', b'{"scene": "", "name": "", "folder": 5, "clocks": {}}', b"\xff"],
)
def test_a_header_that_cannot_be_read_is_one_clear_line(tmp_path: Path, payload: bytes) -> None:
    with Recorder(tmp_path / "run.rec") as recorder:
        recorder.write(Block(BlockKind.HEADER, 0.0, payload))
    with pytest.raises(RecordingError, match=r"run.rec has a header that this coneskin cannot read: "):
        read_run(tmp_path)


def test_no_run_at_all(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"cannot read the recording .*run.rec: No such file"):
        read_run(tmp_path)
    for name in ("2026-01-31T12-00-00", "2026-02-01T09-00-00"):
        (tmp_path / "runs" / name).mkdir(parents=True)
        (tmp_path / "runs" / name / "run.rec").touch()
    with pytest.raises(RecordingError, match=r"runs is a folder of 2 runs: name one .*2026-02-01T09-00-00$"):
        read_run(tmp_path / "runs")
    with Recorder(tmp_path / "run.rec"):
        pass
    with pytest.raises(RecordingError, match="has no header: the run ended before it began"):
        read_run(tmp_path)
    (tmp_path / "run.rec").write_bytes(b"something else")
    with pytest.raises(RecordingError, match="no recording of coneskin"):
        read_run(tmp_path / "run.rec")


def test_a_replay_tells_how_far_it_is(run: Run) -> None:
    told: list[float] = []
    assert run.replay(progress=told.append).same
    assert told == sorted(told)
    assert 0.0 < told[0] < told[-1] == 1.0


def test_other_code_and_other_filled_in_values_are_named_before_any_difference(run: Run) -> None:
    assert run.recorded_by == ""  # the rig writes no version
    assert run.other_code() == (
        f"recorded by coneskin an unknown version, replayed by {recorded_version(code_versions())}",
    )
    mine = {**code_versions(), "resolved": resolved_settings(run.scene())}
    assert changed(run, header={**run.header, **mine}).other_code() == ()
    mine["resolved"]["monitoring"]["settle"] = 0.125
    then = changed(run, header={**run.header, **mine})
    (line,) = then.other_code()
    assert re.fullmatch(r"the scene is filled in otherwise .*: monitoring\.settle 0\.125 -> 0\.\d+", line)
    assert then.replay().other_code == (line,)
    comparison = compare_decisions(recorded_decisions(then), decide_again(then))
    assert comparison_lines(comparison)[1] == f"  {line}"


STANDING = GuardEvent(EventName.STANDSTILL, 102.0, {"speed": 0.001, "paths": ["driver"], "clock_us": 5})


@pytest.mark.parametrize(
    ("time", "details", "line"),
    [
        (102.0022, {}, "2.0000 s, standstill: 2.2 ms later"),
        (101.9999999, {}, "2.0000 s, standstill: 0.0001 ms earlier"),
        (102.0, {"speed": 0.0017}, "2.0000 s, standstill: speed 0.0010 -> 0.0017 rad/s"),
        (102.0, {"speed": 0.0010000000000000002}, "2.0000 s, standstill: speed 0.001 rad/s, by +2.2e-19 rad/s"),
        (102.0, {"clock_us": 6}, "2.0000 s, standstill: clock_us 5 -> 6"),
        (102.0, {"paths": ["x"]}, "2.0000 s, standstill: paths 'driver' -> 'x'"),
        (102.0, {"more": 1}, "2.0000 s, standstill: more is new"),
        (102.0, {"speed": None}, "2.0000 s, standstill: speed is not known any more"),
    ],
)
def test_what_differs_is_told_with_its_unit(time: float, details: dict[str, Any], line: str) -> None:
    other = GuardEvent(EventName.STANDSTILL, time, {**STANDING.details, **details})
    assert list(event_differences([STANDING], [other], 100.0)) == [line]


def test_an_event_without_a_partner_does_not_move_the_others() -> None:
    ended = GuardEvent(EventName.ENDING, 103.0, {"what": "the guard was told to end"})
    both = [STANDING, ended]
    assert list(event_differences(both, both, 100.0)) == []
    (line,) = event_differences([ended], both, 100.0)
    assert line == "2.0000 s  standstill: 0.0010 rad/s; stop paths tried: driver: is new"
    assert list(event_differences([STANDING], [ended], 100.0)) == [
        "2.0000 s  standstill: 0.0010 rad/s; stop paths tried: driver: "
        "replayed as 3.0000 s  ending: the guard was told to end"
    ]
