"""Defects of a recording: what is missing from it, or stands where it should not, and how much that is.

They are found from the numbers of the chunks, and from what is damaged between them. What retention has dropped on
purpose is written into the recording.
"""

from __future__ import annotations

import json
import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from coneskin.core.errors import RecordingError
from coneskin.core.text import read_json

from .block import DROPPED, END, Block, is_time
from .scan import Damage, Extent


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
    """One defect."""

    kind: DefectKind  #: what is wrong
    since: float = -math.inf  #: time of the last block before it [s, host clock]; -inf where there is none
    until: float = math.inf  #: time of the first block after it [s]; inf where there is none
    offset: int | None = None  #: where it is in its file [bytes]; None where that is not known
    size: int = 0  #: bytes that are damaged, or not read
    chunks: int | None = None  #: that are missing or in the wrong place; None where nobody knows
    blocks: int = 0  #: that are missing, at least
    kinds: frozenset[int] | None = None  #: of block that are missing; None where nobody knows all of them
    note: str = ""  #: more words, for people

    @classmethod
    def noted(cls, block: Block) -> Defect:
        """Return what a note says that retention has dropped.

        Raises:
            RecordingError: it says nothing that can be.
        """
        try:
            facts: dict[str, Any] = read_json(block.payload)
            since, until, blocks, size = (facts[key] for key in ("since", "until", "blocks", "bytes"))
            kinds = frozenset(facts["kinds"])
            whole = all(type(count) is int and count >= 0 for count in (blocks, size, *kinds))
            if block.kind != DROPPED or not whole or not (is_time(since) and is_time(until)):
                raise ValueError("a time or a number cannot be")
        except (ValueError, TypeError, KeyError) as exc:
            raise RecordingError(f"the block of {block.time:.6f} s does not say what was dropped: {exc}") from exc
        return cls(DefectKind.DROPPED, since, until, size=size, blocks=blocks, kinds=kinds)

    def note_block(self) -> Block:
        """Return the note of what was dropped, which stands where it began."""
        kinds = sorted(self.kinds or ())
        facts = {"since": self.since, "until": self.until, "blocks": self.blocks, "bytes": self.size, "kinds": kinds}
        return Block(DROPPED, self.since, json.dumps(facts).encode())

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


_END_BIT = 1 << END


def find_defects(
    extents: Sequence[Extent], damages: Sequence[tuple[Path, int, Damage]], run: int
) -> tuple[tuple[Extent, ...], tuple[Defect, ...]]:
    """Return the extents of a recording in the order in which they were written, and what is wrong.

    Args:
        extents: of all of its files, in their order.
        damages: file, number of extents before it, and the damage; in their order.
    """
    foreign = (extent for extent in extents if extent.run != run)
    defects = [_misplaced(DefectKind.FOREIGN, extent, extent.end - extent.offset) for extent in foreign]
    order = sorted((extent for extent in extents if extent.run == run), key=lambda extent: extent.first)
    holes: list[_Hole] = []
    again: set[int] = set()
    covered, since = 0, -math.inf
    for extent in order:
        if extent.first > covered:
            holes.append(_Hole(covered, extent.first, since, extent.since))
        elif extent.first < covered:
            again.add(id(extent))
            twice = min(extent.following, covered) - extent.first
            defects.append(replace(_misplaced(DefectKind.TWICE, extent), chunks=twice))
        if extent.following > covered:
            covered, since = extent.following, extent.until
    closed = bool(order) and any(extent.following == covered and extent.last_kinds & _END_BIT for extent in order)
    tail = _Hole(covered, None, since, math.inf)
    firsts = [hole.first for hole in holes]
    by_first, by_following = {hole.first: hole for hole in holes}, {hole.following: hole for hole in holes}
    highest = 0
    followings = [0, *(extent.following for extent in extents)]
    comings = [*(extent.first for extent in extents), None]
    for extent in extents:
        if extent.run == run:
            if extent.first < highest and id(extent) not in again:
                defects.append(_misplaced(DefectKind.DISORDER, extent))
            highest = max(highest, extent.following)
    for path, before, damage in damages:
        number = _number(damage, run)
        if number < 0:
            hole = by_first.get(followings[before]) or by_following.get(comings[before])
        else:
            at = bisect_right(firsts, number) - 1
            hole = holes[at] if at >= 0 and number < (holes[at].following or number + 1) else None
        at_end = followings[before] == covered and comings[before] is None
        if hole is None and not closed and (at_end or number >= covered):
            hole = tail
        if hole is not None:
            hole.feed(path, damage)
        else:
            size = damage.end - damage.offset
            defects.append(Defect(DefectKind.STRAY, offset=damage.offset, size=size, note=path.name))
    defects += [hole.defect(DefectKind.LOST) for hole in holes]
    if not closed:
        defects.append(tail.defect(DefectKind.NOT_CLOSED))
    return tuple(order), tuple(defects)


def _number(damage: Damage, run: int) -> int:
    """Return the number of the chunk that damaged bytes were; -1 where nobody knows."""
    return -1 if damage.head is None or damage.head.run != run else damage.head.sequence


def _misplaced(kind: DefectKind, extent: Extent, size: int = 0) -> Defect:
    chunks = extent.following - extent.first
    return Defect(kind, extent.since, extent.until, extent.offset, size, chunks, note=extent.path.name)


class _Hole:
    """Hole in the numbers of the chunks, and the damaged bytes that stand in it."""

    def __init__(self, first: int, following: int | None, since: float, until: float) -> None:
        self.first, self.following = first, following
        self.since, self.until = since, until
        self.offset: int | None = None
        self.size = self.blocks = self.known = self.kinds = 0
        self.path: Path | None = None

    def feed(self, path: Path, damage: Damage) -> None:
        if self.offset is None:
            self.offset, self.path = damage.offset, path
        self.size += damage.end - damage.offset
        if damage.head is not None and damage.head.sequence >= self.first:
            self.blocks += damage.head.blocks
            self.known += damage.head.span
            self.kinds |= damage.head.kinds
            if self.following is None:
                self.until = damage.head.until

    def defect(self, kind: DefectKind) -> Defect:
        chunks = None if self.following is None else self.following - self.first
        all_known = self.known == chunks if chunks is not None else self.known > 0
        kinds = frozenset(kind for kind in range(1, 63) if self.kinds >> kind & 1) if all_known else None  # bits
        note = "" if self.path is None else self.path.name
        return Defect(kind, self.since, self.until, self.offset, self.size, chunks, self.blocks, kinds, note)
