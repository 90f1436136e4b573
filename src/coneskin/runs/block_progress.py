"""Progress through the blocks of a long run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

from coneskin.core.recording.block import Block
from coneskin.core.recording.reader import RecordedBlocks

if TYPE_CHECKING:
    from .replay.run import Run

__all__ = ["Progress", "silent", "watch"]

Progress = Callable[[float], None]  #: takes the fraction that is done, from 0 to 1

_STEP = 1.0  # s of a run between two calls


def silent(fraction: float) -> None:
    """Show nothing."""


def watch(run: Run, blocks: Iterable[Block], progress: Progress) -> Iterator[Block]:
    """Yield blocks of a run, and tell from their times how much of it is done; of a run in a file only."""
    if progress is silent or not isinstance(run.blocks, RecordedBlocks):
        yield from blocks
        return
    since = run.blocks.since
    duration = max(run.blocks.until - since, _STEP)
    due = since + _STEP
    for block in blocks:
        if block.time >= due:
            due = block.time + _STEP
            progress(min((block.time - since) / duration, 1.0))
        yield block
    progress(1.0)
