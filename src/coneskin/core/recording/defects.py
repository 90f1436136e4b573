"""Search for the defects of a recording: from the numbers of its chunks, and from what is damaged between them."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from .block import END
from .defect import Defect, DefectKind
from .scan import Damage, Extent

__all__ = ["find_defects", "kinds_of"]

_END_BIT = 1 << END


def kinds_of(mask: int) -> frozenset[int]:
    """Return the kinds of block that bits stand for; what is the file's own is no kind."""
    return frozenset(kind for kind in range(1, 63) if mask >> kind & 1)


def find_defects(
    extents: Sequence[Extent], damages: Sequence[tuple[Path, int, Damage]], run: int
) -> tuple[tuple[Extent, ...], tuple[Defect, ...]]:
    """Return the extents of a recording in the order in which they were written, and what is wrong.

    Args:
        extents: of all of its files, in their order.
        damages: file, number of extents before it, and the damage; in their order.
        run: number of the recording.
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
    known = _Holes(holes)
    highest = 0
    followings = [0, *(extent.following for extent in extents)]
    comings = [*(extent.first for extent in extents), None]
    for extent in extents:
        if extent.run == run:
            if extent.first < highest and id(extent) not in again:
                defects.append(_misplaced(DefectKind.DISORDER, extent))
            highest = max(highest, extent.following)
    for path, before, damage in damages:
        hole = known.of(damage, followings[before], comings[before], run)
        at_end = followings[before] == covered and comings[before] is None
        if hole is None and not closed and (at_end or _number(damage, run) >= covered):
            hole = tail
        if hole is not None:
            hole.take(path, damage)
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

    def take(self, path: Path, damage: Damage) -> None:
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
        return Defect(
            kind,
            self.since,
            self.until,
            self.offset,
            self.size,
            chunks,
            self.blocks,
            kinds_of(self.kinds) if all_known else None,
            "" if self.path is None else self.path.name,
        )


class _Holes:
    """Holes by their numbers and by their neighbours."""

    def __init__(self, holes: Sequence[_Hole]) -> None:
        self._firsts = [hole.first for hole in holes]
        self._holes = holes
        self._by_first = {hole.first: hole for hole in holes}
        self._by_following = {hole.following: hole for hole in holes}

    def of(self, damage: Damage, before: int, after: int | None, run: int) -> _Hole | None:
        """Return the hole that damaged bytes stand in; None where they stand in none.

        Args:
            damage: the bytes.
            before: the number that would follow the chunk before them.
            after: the number of the chunk after them.
            run: number of the recording.
        """
        number = _number(damage, run)
        if number < 0:
            return self._by_first.get(before) or self._by_following.get(after)
        at = bisect_right(self._firsts, number) - 1
        hole = self._holes[at] if at >= 0 else None
        return hole if hole is not None and number < (hole.following or number + 1) else None
