"""Readings of a frame by the names of the converter's inputs, those of the driven electrodes among them."""

from __future__ import annotations

from collections.abc import Mapping

from coneskin.skin.wire import DrivenPotentials, Frame

from .circuit import ConverterInputs

__all__ = ["counts_of", "frame_of", "with_counts"]

_DRIVEN = DrivenPotentials._fields
_ALWAYS = tuple(name for name in ConverterInputs._fields if name not in _DRIVEN)


def frame_of(head: tuple[int, int, int, int, int, int], counts: Mapping[str, int]) -> Frame:
    """Return the frame of these readings.

    Args:
        head: version, device, sensor, status, sequence, clock.
        counts: by the names of ConverterInputs; without the driven potentials where the frame carries none.
    """
    driven = DrivenPotentials._make(counts[name] for name in _DRIVEN) if _DRIVEN[0] in counts else None
    return Frame._make((*head, *(counts[name] for name in _ALWAYS), driven))


def counts_of(frame: Frame) -> dict[str, int]:
    """Return the readings that a frame carries."""
    counts = {name: getattr(frame, name) for name in _ALWAYS}
    return counts if frame.driven is None else counts | frame.driven._asdict()


def with_counts(frame: Frame, changes: Mapping[str, int]) -> Frame:
    """Return the frame with other readings; it must carry them."""
    return frame_of(frame[:6], {**counts_of(frame), **changes})
