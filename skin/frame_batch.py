"""Batch of frames, found in many bytes at once with numpy: for scans and replays, not for the live path."""

from __future__ import annotations

from binascii import crc_hqx
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from .wire import FRAME_LENGTH, FRAME_LENGTHS, SYNC, VERSION

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["FrameBatch", "find_frames"]

#: offset of each 16-bit field in a frame [bytes]; the shortest has one supply for all phases
_FIELD_OFFSETS = {
    **{"device": 4, "sequence": 8, "touch_c": 14, "touch_d": 16, "touch_current": 18},
    **{"radial_c": 20, "radial_d": 22, "radial_current": 24},
    **{"angular_a": 26, "angular_b": 28, "angular_current": 30, "touch_supply": 32},
}
_SUPPLY_OFFSETS = {"radial_supply": 34, "angular_supply": 36}  # of the longer ones


@dataclass(frozen=True, slots=True)
class FrameBatch:
    """Frames in the order of their bytes; arrays of one length.

    Attributes:
        bytes: all that was looked at.
        starts: offset of each frame [bytes].
        lengths: of each [bytes].
    """

    bytes: NDArray[np.uint8]
    starts: NDArray[np.int64]
    lengths: NDArray[np.int64]

    @property
    def ends(self) -> NDArray[np.int64]:
        """Offset behind each frame [bytes]."""
        return self.starts + self.lengths

    @property
    def sensors(self) -> NDArray[np.uint8]:
        """Number of the sensor."""
        return self.bytes[self.starts + 6]

    @property
    def statuses(self) -> NDArray[np.uint8]:
        """Bits of ``wire.Status``."""
        return self.bytes[self.starts + 7]

    @property
    def clocks(self) -> NDArray[np.int64]:
        """Device clock [us]."""
        found: NDArray[np.int64] = self._word(10).astype("int64") | self._word(12).astype("int64") << 16
        return found

    def field(self, name: str) -> NDArray[np.uint16]:
        """Return a 16-bit field of ``wire.Frame``, such as ``touch_c`` or ``device``."""
        import numpy as np

        if name in _SUPPLY_OFFSETS:
            return self._word(
                np.where(self.lengths == FRAME_LENGTH, _FIELD_OFFSETS["touch_supply"], _SUPPLY_OFFSETS[name])
            )
        return self._word(_FIELD_OFFSETS[name])

    def of(self, device: int, sensor: int) -> NDArray[np.bool_]:
        """Return which frames are those of a sensor."""
        found: NDArray[np.bool_] = (self.sensors == sensor) & (self.field("device") == device)
        return found

    def pick(self, chosen: NDArray[np.bool_]) -> FrameBatch:
        """Return some of the frames."""
        return FrameBatch(self.bytes, self.starts[chosen], self.lengths[chosen])

    def _word(self, offset: int | NDArray[np.int64]) -> NDArray[np.uint16]:
        at = self.starts + offset
        found: NDArray[np.uint16] = self.bytes[at + 1].astype("uint16") << 8 | self.bytes[at]
        return found


def find_frames(data: bytes) -> FrameBatch:
    """Return the frames whose sync, version, length and checksum are right.

    Differs from ``FrameDecoder`` only where a whole frame with the right checksum begins inside of another.
    """
    import numpy as np

    values = np.frombuffer(data, np.uint8)
    if (regular := _regular(values)) is not None:
        return regular
    starts = np.flatnonzero((values[:-1] == SYNC[0]) & (values[1:] == SYNC[1])) if len(values) > 1 else np.arange(0)
    starts = starts[starts + FRAME_LENGTH <= len(values)]
    found, lengths = [], []
    for length in FRAME_LENGTHS:
        here = starts[(values[starts + 2] == VERSION) & (values[starts + 3] == length)]
        here = here[here + length <= len(values)]
        if len(here):
            here = here[_remainders(np.lib.stride_tricks.sliding_window_view(values, length)[here]) == 0]
        found.append(here)
        lengths.append(np.full(len(here), length))
    at, long = np.concatenate(found), np.concatenate(lengths)
    order = np.argsort(at, kind="stable")
    return FrameBatch(values, at[order], long[order])


def _regular(values: NDArray[np.uint8]) -> FrameBatch | None:
    """Return the frames where nothing else stands before the last of them and all are of one layout, else None."""
    import numpy as np

    if len(values) < FRAME_LENGTH or bytes(values[:3]) != SYNC + bytes((VERSION,)) or values[3] not in FRAME_LENGTHS:
        return None
    length = int(values[3])
    count = len(values) // length
    rows = values[: count * length].reshape(count, length)
    if not (rows[:, :4] == rows[0, :4]).all() or _remainders(rows).any():
        return None
    return FrameBatch(values, np.arange(count) * length, np.full(count, length))


def _remainders(rows: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Return the remainder of each frame, 0 where its checksum is right: the sum of what each of its bytes leaves."""
    import numpy as np

    length = rows.shape[1]
    found: NDArray[np.uint16] = np.zeros(len(rows), np.uint16)
    for at, table in enumerate(_tables(length)):
        found ^= table[rows[:, at]]
    return found


@cache
def _tables(length: int) -> NDArray[np.uint16]:
    """Return what each byte at each place of a frame leaves: the checksum is linear, and begins with 0."""
    import numpy as np

    return np.array(
        [[crc_hqx(bytes([byte]) + bytes(length - 1 - at), 0) for byte in range(256)] for at in range(length)], np.uint16
    )
