"""Judge of a recording of the fault campaign: what it must not lack or hold."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from coneskin.core.errors import ConeSkinError
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.runs.replay.run import Run, read_run, replay
from coneskin.skin.wire import FrameDecoder


def longest_gap(path: Path, since: float, until: float) -> float:
    """Return the longest time in which no byte of the skin was read, between these times [s]."""
    with suppress(ConeSkinError):
        times = [block.time for block in read_run(path).blocks if block.kind == BlockKind.SKIN]
        times = [time for time in times if since <= time <= until]
        return max((b - a for a, b in itertools.pairwise(times)), default=0.0)
    return 0.0


def judge_recording(path: Path, fault_at: float, active_at: float, touched: bool) -> Iterator[str]:
    """Yield what the recording lacks, or must not hold, one line each."""
    try:
        run = read_run(path)
    except ConeSkinError as exc:
        yield f"the recording cannot be read: {exc}"
        return
    names = [(event.name, event.time) for event in run.events]
    if not touched and any(name == "retreating" for name, _ in names):
        yield "it retreated without a touch"
    early = [event for event in run.events if event.name in ("stopping", "speed_reduced") and event.time < fault_at]
    if early:
        yield f"it reacted {fault_at - early[0].time:.3f} s before the fault: {early[0].details}"
    last = max((block.time for block in run.blocks), default=0.0)
    if last < fault_at - 0.06:
        yield f"the recording ends {fault_at - last:.3f} s before the fault"
    if missing := _missing_frames(run, active_at, fault_at):
        yield f"{missing} frames before the fault are not in the recording"
    again = replay(run)
    if not again.agrees:
        yield f"its replay is another: {again.differences[:1]}"


def _missing_frames(run: Run, since: float, until: float) -> int:
    decoder = FrameDecoder()
    before: dict[int, int] = {}  # by sensor
    missing = 0
    for block in run.blocks:
        if block.kind == BlockKind.SKIN and since <= block.time < until - 0.01:
            for frame in decoder.feed(block.payload):
                if frame.sensor in before:
                    missing += (frame.sequence - before[frame.sensor] - 1) & 0xFFFF
                before[frame.sensor] = frame.sequence
    return missing
