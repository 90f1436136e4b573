"""Quiet inputs of a guard, many at once: for replays, which they make many times faster. The live guard has no part.

Most of a run is an arm that moves and a skin that nobody touches. An input is *calm* where, on its own, it makes
nothing happen. While the guard is active and nothing is due, calm inputs change only what is learned. The classes that
learn it do so without the rest, in the same operations on the same numbers. Afterwards the guard is bit by bit what it
would be if it had been fed one by one. All other inputs are fed one by one.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import RobotConnectionError
from coneskin.core.recording.block import Block
from coneskin.core.version import code_build
from coneskin.robot.driver.messages import StatusReport
from coneskin.skin.detection.quiet_frames import QuietFrames, find_quiet_frames
from coneskin.skin.frame_batch import find_frames

from .companion_monitor import HELD_UP
from .core import GuardCore
from .signals.journal import BlockKind

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from coneskin.robot.driver.values import ControllerState

    from .arm_supervisor import ArmSupervisor

__all__ = ["BATCH", "take_inputs"]

BATCH = 4096  #: inputs that are looked at together: some seconds, 5 MB
_MIN_BATCH = 6  # inputs; fewer are quicker one by one
_RETRY_INPUTS = 24  # inputs that are taken one by one where the guard is at work
_TIME_ROUNDING = 1e-6  # s; far above the rounding of a time
_CALM_KINDS = frozenset({BlockKind.TICK, BlockKind.PROGRAM, BlockKind.DRIVER, BlockKind.SLIDER})
_CALM_REPORTS = ("alive", "done", "released")  # to an active guard


def take_inputs(core: GuardCore, blocks: Sequence[Block], take: Callable[[Block], None]) -> None:
    """Give inputs to a guard that the live guard would be given one by one.

    Args:
        core: the guard.
        blocks: inputs in a row, best ``BATCH`` of them. Numpy has to be there.
        take: gives the guard one input, which may make something happen.
    """
    if code_build() == "compiled":  # one by one it is faster, and what is learned cannot be handed over
        for block in blocks:
            take(block)
        return
    if not blocks:
        return
    batch = _Batch(core, blocks)
    times, end, at, retry = batch.times, len(blocks), 0, 0
    while at < end:
        stop = batch.calm_until(at) if at >= retry else at
        if stop - at >= _MIN_BATCH:
            stop = bisect_left(times, core.quiet_until() - _TIME_ROUNDING, at, stop)
            if stop - at >= _MIN_BATCH and (reached := batch.give(at, stop)) > at:
                at = reached
                continue
            retry = at + _RETRY_INPUTS
        take(blocks[at])
        at += 1


class _Batch:
    """Inputs in a row, and what each is on its own."""

    def __init__(self, core: GuardCore, blocks: Sequence[Block]) -> None:
        import numpy as np

        self._core, self._blocks = core, blocks
        times = np.array([block.time for block in blocks])
        self.times: list[float] = times.tolist()
        calm = np.zeros(len(blocks), bool)
        steps = np.diff(times)
        calm[1:] = (steps >= 0.0) & (steps <= HELD_UP)
        kinds = np.array([block.kind for block in blocks])
        self._states: dict[int, ControllerState] = {}
        self._others: list[int] = np.flatnonzero(kinds != BlockKind.SKIN).tolist()
        for number in np.flatnonzero((kinds != BlockKind.SKIN) & (kinds != BlockKind.ARM)).tolist():
            calm[number] &= self._fits(blocks[number])
        if core.arm is not None:
            self._arm(core.arm, np.flatnonzero(kinds == BlockKind.ARM), calm)
        self._skin(np.flatnonzero(kinds == BlockKind.SKIN), calm)
        self._rough: list[int] = np.flatnonzero(~calm).tolist()

    def calm_until(self, at: int) -> int:
        """Return the number of the first input, from one on, that is not calm."""
        found = bisect_left(self._rough, at)
        return self._rough[found] if found < len(self._rough) else len(self._blocks)

    def give(self, at: int, stop: int) -> int:
        """Give the guard calm inputs in a row. Return the number of the first that it has not taken."""
        stream, known = self._core.stream, self._bytes_before(at)
        if stream.decoder.rest != self._data[self._frame_starts[self._frames_before(at)] : known]:
            return at  # what came before was damaged
        while stop - at >= _MIN_BATCH:
            first, behind = self._frames_before(at), self._frames_before(stop)
            reached = self._learn(first, behind)
            if reached == behind:
                self._pass(at, stop, behind - first)
                return stop
            stop = bisect_left(self._frames_after, reached + 1)  # the input with which that frame has come
        return at

    def _learn(self, first: int, behind: int) -> int:
        """Let the detectors learn from frames. Return the number of the first that is not quiet, or ``behind``."""
        parts = []
        for detector, numbers, frames in self._sensors:
            begin, end = bisect_left(numbers, first), bisect_left(numbers, behind)
            if begin < end:
                parts.append((detector, numbers, frames, begin, end))
        for final in (True,) if len(parts) == 1 else (False, True):
            for detector, numbers, frames, begin, end in parts:
                reached = detector.learn(frames, begin, end, final)
                if reached < end:
                    return int(numbers[reached])
        return behind

    def _pass(self, at: int, stop: int, frames: int) -> None:
        """Give the guard the rest of calm inputs, once the detectors have learned from the frames."""
        core, blocks, states = self._core, self._blocks, self._states
        nothing: list[Any] = []
        for number in self._others[bisect_left(self._others, at) : bisect_left(self._others, stop)]:
            core.feed_quiet(blocks[number], states.get(number), nothing)
        assert not nothing, "a quiet input made something happen"
        end = self._bytes_before(stop)
        begun = self._frame_starts[self._frames_before(stop)]
        core.stream.decoder.skip_to(frames, self._data[begun:end])
        core.skip_to(self.times[stop - 1])

    def _bytes_before(self, number: int) -> int:
        return self._bytes_after[number - 1] if number else self._bytes_at_start

    def _frames_before(self, number: int) -> int:
        return self._frames_after[number - 1] if number else 0

    def _fits(self, block: Block) -> bool:
        """Tell whether an input that is neither the skin's nor a state of the arm is calm."""
        arm = self._core.arm
        if block.kind not in _CALM_KINDS:
            return False
        if arm is not None and block.kind == BlockKind.DRIVER:
            return StatusReport.decode(block.payload).kind in _CALM_REPORTS
        if arm is not None and block.kind == BlockKind.SLIDER:
            try:
                arm.driver.decode_speed_fraction(block.payload)
            except RobotConnectionError:
                return False
        return True

    def _arm(self, arm: ArmSupervisor, numbers: NDArray[np.int64], calm: NDArray[np.bool_]) -> None:
        """Decode the states of the arm, and take from calm inputs what does not show the same as the state before."""
        blocks, states, decode = self._blocks, self._states, arm.driver.decode_state
        running = None if arm.state is None else arm.state.program_running
        rough = []
        for number in numbers.tolist():
            _, time, payload = blocks[number]
            try:
                state = states[number] = decode(time, payload)
            except RobotConnectionError:
                rough.append(number)
                continue
            if state.program_running is not running or state.stopped_by_safety or not state.powered:
                rough.append(number)
                running = state.program_running
        calm[rough] = False

    def _skin(self, numbers: NDArray[np.int64], calm: NDArray[np.bool_]) -> None:
        """Find the frames, and take from calm inputs those whose bytes are more than good, plain frames."""
        import numpy as np

        stream = self._core.stream
        rest, payloads = stream.decoder.rest, [self._blocks[number].payload for number in numbers.tolist()]
        self._data = data = rest + b"".join(payloads)
        self._bytes_at_start = len(rest)
        sizes = np.zeros(len(self._blocks), np.int64)
        sizes[numbers] = [len(payload) for payload in payloads]
        after = len(rest) + np.cumsum(sizes)
        batch = find_frames(data)
        starts, ends, count = batch.starts, batch.ends, len(batch.starts)
        breaks = np.zeros(count + 1, np.int64)  # frames that do not begin where the one before ends
        breaks[1:count] = np.cumsum(starts[1:] != ends[:-1])
        breaks[count] = breaks[count - 1] + 1
        arrived = np.array(self.times)[np.searchsorted(after, ends, side="left")]
        plain = np.zeros(count, bool)
        self._sensors: list[tuple[Any, list[int], QuietFrames]] = []
        for detector in stream.detectors:
            own = batch.of(detector.sensor.device_id, detector.sensor.sensor_id)
            frames = find_quiet_frames(detector.sensor, batch.pick(own), arrived[own])
            plain[own] = frames.plain
            self._sensors.append((detector, np.flatnonzero(own).tolist(), frames))
        rough = np.concatenate([[0], np.cumsum(~plain)])
        begin, end = (after - sizes)[numbers], after[numbers]
        first, last = np.searchsorted(ends, begin, side="right"), np.searchsorted(ends, end, side="left")
        whole = (begin < end) & (last < count)
        first, last = np.minimum(first, count), np.minimum(last, count)
        whole &= breaks[first] == breaks[last]
        whole &= np.append(starts, len(data))[first] <= begin
        done = np.searchsorted(ends, end, side="right")
        calm[numbers] &= whole & (rough[done] == rough[first])
        self._bytes_after: list[int] = after.tolist()
        self._frames_after: list[int] = np.searchsorted(ends, after, side="right").tolist()
        self._frame_starts: list[int] = [*starts.tolist(), len(data)]
