"""Defects of a recording: what is missing from it, or stands where it should not, as values that say how much."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

__all__ = ["Defect", "DefectKind"]


class DefectKind(StrEnum):
    """Kinds of defect."""

    LOST = "lost"  #: chunks are missing: their bytes are damaged, or were cut out
    NOT_CLOSED = "not_closed"  #: the end is missing: the recorder was killed, or the file was cut off
    TWICE = "twice"  #: chunks stand twice; read once
    DISORDER = "disorder"  #: chunks stand in another order than they were written; read in the right one
    FOREIGN = "foreign"  #: chunks of another recording; not read
    STRAY = "stray"  #: bytes that are no chunk, where none is missing, or the file's damaged head; not read
    LEFT_OUT = "left_out"  #: the guard left blocks out, because the program did not take them
    DROPPED = "dropped"  #: blocks were dropped on purpose, by retention


#: with these, inputs of the guard are missing
_WITHOUT_INPUTS = frozenset({DefectKind.LOST, DefectKind.NOT_CLOSED, DefectKind.LEFT_OUT, DefectKind.DROPPED})


@dataclass(frozen=True, slots=True)
class Defect:
    """One defect.

    Attributes:
        kind: what is wrong.
        since: time of the last block before it [s, host clock]; -inf where there is none.
        until: time of the first block after it [s]; inf where there is none.
        offset: where it is in its file [bytes]; None where that is not known.
        size: bytes that are damaged, or not read.
        chunks: that are missing or in the wrong place; None where nobody knows.
        blocks: that are missing, at least.
        kinds: of block that are missing; None where nobody knows all of them.
        note: more words, for people.
    """

    kind: DefectKind
    since: float = -math.inf
    until: float = math.inf
    offset: int | None = None
    size: int = 0
    chunks: int | None = None
    blocks: int = 0
    kinds: frozenset[int] | None = None
    note: str = ""

    @property
    def inputs_missing(self) -> bool:
        """True where what went into the guard is missing, so that nothing after it can be compared."""
        return self.kind in _WITHOUT_INPUTS

    def describe(self, start: float = 0.0, name: Callable[[int], str] = str) -> str:
        """Return a line for people.

        Args:
            start: host time that counts as 0 [s].
            name: of a kind of block.
        """
        since = "the start" if math.isinf(self.since) else f"{self.since - start:.3f} s"
        until = "the end" if math.isinf(self.until) else f"{self.until - start:.3f} s"
        span = f"from {since} to {until}"
        at = "" if self.offset is None else f" at byte {self.offset}"
        chunks = "chunks" if self.chunks is None else "1 chunk" if self.chunks == 1 else f"{self.chunks} chunks"
        be, stand, were = ("is", "stands", "was") if self.chunks == 1 else ("are", "stand", "were")
        match self.kind:
            case DefectKind.LOST:
                what = f"{chunks} {be} missing, {span}: {self._content(name)}"
                what += f"; {self.size} bytes{at} are damaged" if self.size else "; nothing stands in their place"
            case DefectKind.NOT_CLOSED:
                what = f"the recording was not closed: nothing is known after {since}"
                what += f"; {self.size} bytes{at} are of a torn or damaged chunk" if self.size else ""
                what += f" ({self._content(name)}, to {until})" if self.blocks else ""
            case DefectKind.TWICE:
                what = f"{chunks} {stand} twice{at}, and {be} read once"
            case DefectKind.DISORDER:
                what = f"{chunks} {stand} in another place than written{at}, and {were} put in order"
            case DefectKind.FOREIGN:
                what = f"{chunks} of another recording{at}, {self.size} bytes, {be} not read"
            case DefectKind.STRAY:
                what = f"{self.size} bytes{at} are no part of the recording and are not read"
            case DefectKind.LEFT_OUT:
                return f"{self.note}, {span}"
            case DefectKind.DROPPED:
                what = f"dropped on purpose, {span}: {self._content(name)}"
        return f"{what}; {self.note}" if self.note else what

    def _content(self, name: Callable[[int], str]) -> str:
        if self.kinds is None:
            return f"at least {self.blocks} blocks" if self.blocks else "nobody knows how many blocks, of which kinds"
        return f"{self.blocks} blocks ({', '.join(map(name, sorted(self.kinds)))})"
