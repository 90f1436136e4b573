"""Fault injection into a virtual sensor: each fault of device, wiring and line that a detector must find.

Frames are numbered from 0 in the order in which the device sends them, all sensors together. ``..._every=n`` hits frame
n - 1, 2 n - 1 and so on; ``..._after=n`` hits frame n and, where the fault lasts, every later one. 0 or None: never.
"""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import dataclass, field, fields

from coneskin.core.errors import SensorError, SkinConnectionError
from coneskin.skin.wire import Frame, Status, encode

from .circuit import ConverterInputs, WiringFaults, counts_of, frame_of


@dataclass(frozen=True, slots=True)
class FaultInjection:
    """Faults to inject, and when.

    Attributes:
        drop_every: frames that are never sent.
        corrupt_every: frames with one to eight wrong bits.
        garbage_every: frames with 1 to 40 random bytes before them.
        duplicate_every: frames sent twice.
        swap_every: frames sent after their successor (out of order).
        cut_after: one frame of which only the beginning is sent; the stream goes on.
        stall_after: from here on nothing is sent, though the line stays up.
        stall_frames: how many frames the stall lasts; 0: for ever. The clock goes on meanwhile.
        unplug_after: from here on the line is gone.
        replay_after: from here on the device sends its first frames once more, clock and sequence included.
        restart_after: the device starts anew: sequence and clock from zero, status RESTARTED once.
        clock_jump_after: from here on the device clock is ahead.
        clock_jump_us: by so much [us].
        stuck_after: from here on a channel keeps its value.
        stuck_channel: name of a count of ConverterInputs, "supply" for that of every phase, or "all".
        saturate_after: from here on the stuck channel stands at ``saturate_count`` instead.
        saturate_count: the value.
        gain_after: from here on what ``gain_of`` names reads ``gain`` times as much.
        gain_of: an electrode, whose input it is; "current" or "supply", in every phase; or "touch": all of that phase.
        gain: the ratio; 0: it is dead.
        status_after: from here on the device reports ``status``.
        status: bits of Status.
        wiring_after: from here on ``wiring`` is broken.
        wiring: open wires and shorts.

    Raises:
        SensorError: a number is negative, or no channel has that name.
    """

    drop_every: int = 0
    corrupt_every: int = 0
    garbage_every: int = 0
    duplicate_every: int = 0
    swap_every: int = 0
    cut_after: int | None = None
    stall_after: int | None = None
    stall_frames: int = 0
    unplug_after: int | None = None
    replay_after: int | None = None
    restart_after: int | None = None
    clock_jump_after: int | None = None
    clock_jump_us: int = 1_000_000
    stuck_after: int | None = None
    stuck_channel: str = "all"
    saturate_after: int | None = None
    saturate_count: int = 0xFFFF
    gain_after: int | None = None
    gain_of: str = "current"
    gain: float = 1.0
    status_after: int | None = None
    status: int = Status.SELF_TEST
    wiring_after: int | None = None
    wiring: WiringFaults = field(default_factory=WiringFaults)

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if each.name.endswith(("_every", "_after", "_frames")) and value is not None and not value >= 0:
                raise SensorError(f"faults.{each.name} must not be negative, got {value!r}")
        if self.stuck_channel not in (*_CHANNEL_NAMES, "supply", "all"):
            raise SensorError(
                f"faults.stuck_channel must be one of {', '.join(_CHANNEL_NAMES)}, supply, all, "
                f"got {self.stuck_channel!r}"
            )
        if self.gain_of not in _INPUT_READINGS:
            raise SensorError(f"faults.gain_of must be one of {', '.join(_INPUT_READINGS)}, got {self.gain_of!r}")
        if not 0.0 <= self.gain <= 10.0:
            raise SensorError(f"faults.gain must be from 0 to 10, got {self.gain!r}")

    def wiring_at(self, index: int) -> WiringFaults:
        """Return the wiring faults while frame ``index`` is measured."""
        return self.wiring if _from(self.wiring_after, index) else WiringFaults()


_CHANNEL_NAMES = ConverterInputs._fields
#: Readings of an input of the converter, by their names.
_INPUT_READINGS = {
    "A": ("angular_a",),
    "B": ("angular_b",),
    "C": ("touch_c", "radial_c"),
    "D": ("touch_d", "radial_d"),
    "current": ("touch_current", "radial_current", "angular_current"),
    "supply": ("touch_supply", "radial_supply", "angular_supply"),
    "touch": ("touch_c", "touch_d", "touch_current"),
}


class FaultyLine:
    """The line from the device to the reader: frames in, the bytes that arrive out; the seed is of random damage."""

    def __init__(self, faults: FaultInjection, seed: int = 0) -> None:
        self.faults = faults
        self._random = random.Random(f"line {seed}")
        self._index = 0
        self._stuck: dict[tuple[int, int], Frame] = {}
        self._first: list[bytes] = []
        self._held = b""
        self._restart: dict[tuple[int, int], tuple[int, int]] = {}

    def send(self, frame: Frame) -> bytes:
        """Send the next frame.

        Returns:
            the bytes that arrive, none to many.

        Raises:
            SkinConnectionError: the line is gone.
        """
        faults, index = self.faults, self._index
        self._index += 1
        if _from(faults.unplug_after, index):
            raise SkinConnectionError(f"the virtual skin was unplugged after {faults.unplug_after} frames")
        data = encode(self._falsify(frame, index))
        if faults.replay_after is not None:
            if index < faults.replay_after:
                self._first.append(data)
            elif self._first:
                data = self._first[index % len(self._first)]  # all of those before
        if _from(faults.stall_after, index) and (
            not faults.stall_frames or index < (faults.stall_after or 0) + faults.stall_frames
        ):
            return b""
        return self._damage(data, index)

    def _falsify(self, frame: Frame, index: int) -> Frame:
        """Apply the faults of the device: wrong content, right checksum."""
        faults = self.faults
        key = (frame.device, frame.sensor)
        if _from(faults.stuck_after, index):
            kept = self._stuck.setdefault(key, frame)
            frame = _with_counts(frame, {name: counts_of(kept)[name] for name in self._stuck_channels(kept)})
        if _from(faults.saturate_after, index):
            frame = _with_counts(frame, dict.fromkeys(self._stuck_channels(frame), faults.saturate_count))
        if _from(faults.gain_after, index):
            counts = counts_of(frame)
            spoilt = {name: min(round(faults.gain * counts[name]), 0xFFFF) for name in _INPUT_READINGS[faults.gain_of]}
            frame = _with_counts(frame, spoilt)
        if _from(faults.status_after, index):
            frame = frame._replace(status=frame.status | faults.status)
        if _from(faults.clock_jump_after, index):
            frame = frame._replace(clock_us=(frame.clock_us + faults.clock_jump_us) & 0xFFFFFFFF)
        if _from(faults.restart_after, index):
            status = frame.status if key in self._restart else frame.status | Status.RESTARTED
            sequence, clock = self._restart.setdefault(key, (frame.sequence, frame.clock_us))
            frame = frame._replace(
                status=status,
                sequence=(frame.sequence - sequence) & 0xFFFF,
                clock_us=(frame.clock_us - clock) & 0xFFFFFFFF,
            )
        return frame

    def _stuck_channels(self, frame: Frame) -> list[str]:
        name = self.faults.stuck_channel
        return [each for each in counts_of(frame) if name == "all" or each == name or each.endswith(f"_{name}")]

    def _damage(self, data: bytes, index: int) -> bytes:
        """Apply the faults of the line: lost, wrong or added bytes."""
        faults, rng = self.faults, self._random
        if _hits(faults.drop_every, index):
            data = b""
        if data and _hits(faults.corrupt_every, index):
            wrong = bytearray(data)
            for _ in range(rng.randint(1, 8)):
                wrong[rng.randrange(len(wrong))] ^= 1 << rng.randrange(8)
            data = bytes(wrong)
        if index == faults.cut_after:
            data = data[: rng.randrange(1, len(data))]
        if _hits(faults.duplicate_every, index):
            data += data
        if _hits(faults.garbage_every, index):
            data = rng.randbytes(rng.randint(1, 40)) + data
        if _hits(faults.swap_every, index):
            self._held = data
            return b""
        data, self._held = data + self._held, b""
        return data


def _with_counts(frame: Frame, changes: Mapping[str, int]) -> Frame:
    """Return the frame with other readings; it must carry them."""
    return frame_of(frame[:6], {**counts_of(frame), **changes})


def _from(after: int | None, index: int) -> bool:
    return after is not None and index >= after


def _hits(every: int, index: int) -> bool:
    return bool(every) and index % every == every - 1
