"""Retention keeps the events, and all around some moments; what it drops is said, and is no damage."""

import os
from pathlib import Path

import pytest

from coneskin.cli import main
from coneskin.core.errors import RecordingError
from coneskin.core.recording.block import Block
from coneskin.core.recording.defects import DefectKind
from coneskin.core.recording.reader import read_recording
from coneskin.core.recording.recorder import Recorder
from coneskin.core.recording.retention import prune_file
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.runs.replay.run import read_run
from coneskin.session.event_log import EventLog, discard_recording, new_recording, prune_run
from tests.scene.scenes import record

EVENT = 10


def long_recording(path: Path, part_size: int | None = None) -> list[Block]:
    """100 s: a block each 10 ms, an event each 20 s."""
    written = []
    with Recorder(path, part_size=part_size, copied=frozenset({20})) as recorder:
        for number in range(10_000):
            block = Block(1, 0.01 * number, os.urandom(20)) if number % 2000 else Block(EVENT, 0.01 * number, b"e")
            recorder.write(Block(20, 0.0, b"head") if number == 0 else block)
            written.append(Block(20, 0.0, b"head") if number == 0 else block)
    return written


def prune(path: Path, *windows: tuple[float, float]) -> int:
    return sum(1 for _ in prune_file(path, windows, frozenset({20, EVENT})))


def test_events_and_windows_stay_and_the_rest_is_said(tmp_path: Path) -> None:
    written = long_recording(tmp_path / "run.rec")
    size = (tmp_path / "run.rec").stat().st_size
    assert prune(tmp_path / "run.rec", (39.0, 41.0)) > 1000  # steps
    got = read_recording(tmp_path / "run.rec")
    assert {defect.kind for defect in got.defects} == {DefectKind.DROPPED}
    assert all("dropped on purpose" in defect.describe() for defect in got.defects)
    left = list(got)
    assert set(written) >= set(left) >= {b for b in written if b.kind in (20, EVENT) or 39.0 <= b.time <= 41.0}
    assert sum(defect.blocks for defect in got.defects) == len(written) - len(left)
    assert got.size < size / 20
    assert sorted(os.listdir(tmp_path)) == ["run.rec"]
    assert (tmp_path / "run.rec").stat().st_mode & 0o777 == 0o600
    prune(tmp_path / "run.rec", (39.0, 41.0))
    again = read_recording(tmp_path / "run.rec")
    assert (list(again), again.defects) == (left, got.defects)


def test_a_long_recording_is_shortened_while_it_goes_on(tmp_path: Path) -> None:
    steps: list[Path] = []

    def retain(path: Path):  # type: ignore[no-untyped-def]
        steps.append(path)
        yield from prune_file(path, [], frozenset({20, EVENT}))

    with Recorder(tmp_path / "run.rec", 20_000, frozenset({20}), keep=2, retain=retain) as recorder:
        recorder.write(Block(20, 0.0, b"head"))
        for number in range(1, 10_000):
            recorder.write(Block(EVENT if number % 2000 == 0 else 1, 0.01 * number, os.urandom(20)))
    assert len(recorder.parts) > 8
    assert steps == recorder.parts[: len(steps)]
    assert len(steps) >= len(recorder.parts) - 4
    sizes = [part.stat().st_size for part in recorder.parts]
    assert max(sizes[: len(steps) - 1]) < 3000 < 20_000 <= sizes[-2]
    got = read_recording(tmp_path / "run.rec")
    assert {defect.kind for defect in got.defects} == {DefectKind.DROPPED}
    assert [block.time for block in got if block.kind == EVENT] == [20.0, 40.0, 60.0, 80.0]


def test_a_pruned_run_keeps_its_collision_and_is_not_called_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    happened = record(tmp_path / "run.rec")
    before, after = prune_run(tmp_path, around=0.2)
    assert after < before
    run = read_run(tmp_path)
    assert [(event.name, event.time) for event in run.events] == [(event.name, event.time) for event in happened]
    contact = next(event for event in happened if event.name == "contact")
    near = {block.kind for block in run.select(contact.time - 0.1, contact.time + 0.1)}
    assert near >= {BlockKind.SKIN, BlockKind.ARM, BlockKind.EVENT}
    assert main(["replay", str(tmp_path)]) == 4
    assert "dropped on purpose" in capsys.readouterr().out


def test_the_command_prunes_and_goes_on_after_a_file_that_it_cannot(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record(tmp_path / "run.rec")
    before = (tmp_path / "run.rec").stat().st_size
    assert main(["runs", "prune", str(tmp_path / "none.rec"), str(tmp_path), "--around", "0.1"]) == 1
    printed = capsys.readouterr().out
    assert "none.rec: not pruned: cannot read the recording" in printed
    assert f"{tmp_path}: {before / 1e6:.3f} -> " in printed
    assert (tmp_path / "run.rec").stat().st_size < 0.8 * before


def test_a_run_that_did_not_start_leaves_no_folder(tmp_path: Path) -> None:
    path = new_recording(tmp_path / "runs")
    log = EventLog(path)
    log.open({"scene": ""})
    log.close()
    discard_recording(path)
    assert os.listdir(tmp_path / "runs") == []
    path = new_recording(tmp_path / "runs")
    (path.parent / "notes.txt").touch()
    discard_recording(path)
    assert os.listdir(path.parent) == ["notes.txt"]


def test_a_recording_that_goes_on_is_not_pruned_and_loses_nothing(tmp_path: Path) -> None:
    path = tmp_path / "run.rec"
    blocks = [Block(1, 0.1 * number, b"s") for number in range(100)]
    with Recorder(path) as recorder:
        recorder.write(*blocks[:50], flush=True)
        with pytest.raises(RecordingError, match="is being recorded now"):
            prune_run(path)
        recorder.write(*blocks[50:])
    assert list(read_recording(path)) == blocks
    prune_run(path)
    assert not list(read_recording(path))


def test_what_is_around_damage_stays_because_a_touch_may_be_in_it(tmp_path: Path) -> None:
    path = tmp_path / "run.rec"
    with Recorder(path) as recorder:
        for number in range(4000):
            recorder.write(Block(1, 0.01 * number, os.urandom(20)))
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)
    before = list(read_recording(path).select(16.0, 24.0))
    assert 700 < len(before) < 800
    prune_run(path)
    assert list(read_recording(path).select(16.0, 24.0)) == before
    assert not list(read_recording(path).select(0.0, 10.0))
