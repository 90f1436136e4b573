"""A scan finds the touches of a replay, with the same first and last frame."""

from dataclasses import replace as changed
from pathlib import Path
from random import Random

import pytest

from coneskin.core.recording.block import Block
from coneskin.core.recording.recorder import Recorder
from coneskin.robot.guard.signals.journal import BlockKind, EventName
from coneskin.runs.replay import touch_scan
from coneskin.runs.replay.run import Run, read_run
from coneskin.runs.replay.touch_scan import scan_touches
from coneskin.skin.frame_batch import find_frames
from coneskin.skin.wire import FrameDecoder
from tests.scene.scenes import record
from tests.support.paths import COLLISION


def exact(run: Run) -> list[tuple[str, float, float]]:
    began = [event for event in run.events if event.name == EventName.CONTACT]
    ended = [event.time for event in run.events if event.name == EventName.TOUCH_ENDED]
    return [(b.details["sensor"], b.time, e) for b, e in zip(began, ended, strict=True)]


@pytest.mark.parametrize("batch", [1 << 22, 700, 5000])
def test_it_finds_what_a_replay_finds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, batch: int) -> None:
    monkeypatch.setattr(touch_scan, "_BATCH_SIZE", batch)
    record(tmp_path / "run.rec")
    for path in (tmp_path, COLLISION):
        run = read_run(path)
        found = scan_touches(run)
        assert [(touch.sensor, touch.began, touch.ended) for touch in found] == exact(run)
        assert found[0].peak > 0.3


def test_frames_that_are_cut_anywhere_are_found(tmp_path: Path) -> None:
    run = read_run(COLLISION)
    blocks = []
    for block in run.blocks:
        if block.kind == BlockKind.SKIN and len(block.payload) > 20:
            blocks += [block._replace(payload=block.payload[:17]), block._replace(payload=block.payload[17:])]
        else:
            blocks.append(block)
    assert scan_touches(changed(run, blocks=tuple(blocks))) == scan_touches(run)


def test_a_run_that_ends_in_a_touch(tmp_path: Path) -> None:
    run = read_run(COLLISION)
    contact = next(event.time for event in run.events if event.name == EventName.CONTACT)
    blocks = tuple(block for block in run.blocks if block.time < contact + 0.1)
    (touch,) = scan_touches(changed(run, blocks=blocks))
    assert (touch.began, touch.ended) == (contact, float("inf"))


def test_the_batch_finds_the_frames_of_the_decoder() -> None:
    data = b"".join(block.payload for block in read_run(COLLISION).select(kinds=frozenset({BlockKind.SKIN})))
    random, noisy = Random(3), bytearray(data)
    for _ in range(400):
        noisy[random.randrange(len(noisy))] ^= 1 << random.randrange(8)
    for stream in (data, bytes(noisy), b"", data[:35], b"\xc5"):
        frames, batch = FrameDecoder().feed(stream), find_frames(stream)
        assert batch.field("touch_c").tolist() == [frame.touch_c for frame in frames]
        assert batch.field("angular_supply").tolist() == [frame.angular_supply for frame in frames]
        assert batch.clocks.tolist() == [frame.clock_us for frame in frames]
        assert batch.of(0, 1).tolist() == [(frame.device, frame.sensor) == (0, 1) for frame in frames]
        assert batch.sensors.tolist() == [frame.sensor for frame in frames]


def test_a_file_of_wrong_payloads_is_refused(tmp_path: Path) -> None:
    with Recorder(tmp_path / "run.rec") as recorder:
        recorder.write(Block(BlockKind.SKIN, 1.0, b"abc"))
    from coneskin.core.recording.reader import RecordedBlocks, read_recording

    blocks = read_recording(tmp_path / "run.rec").blocks
    assert isinstance(blocks, RecordedBlocks)
    assert list(blocks.payloads(BlockKind.SKIN)) == [(1.0, b"abc")]
    assert list(blocks.payloads(BlockKind.ARM)) == []
