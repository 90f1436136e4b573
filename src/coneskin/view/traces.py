"""Traces of a run: values over time in as few points as a small plot can show, with no peak lost."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from .history import CHANNELS, Series
from .strand import Strand

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["Traces", "trace_names", "traces"]

_BINS = 240  # each with its least and its largest value
_LEVELS, _SPEEDS, _FORCE = "touch level", "joint speed [rad/s]", "contact force [N]"


class Traces(NamedTuple):
    """Values over time.

    Attributes:
        names: of the values.
        times: on the page's clock [s], shape (n,).
        values: one row for each name, NaN where there is none, shape (k, n).
    """

    names: tuple[str, ...]
    times: NDArray[np.float64]
    values: NDArray[np.float64]


def trace_names(strands: Sequence[Strand]) -> list[str]:
    """Return what can be drawn of runs."""
    sensors = [sheet.name for sheet in strands[0].stage.sheets]
    arm = [_SPEEDS] if any(strand.history.speeds.times for strand in strands) else []
    force = [_FORCE] if any(strand.history.forces.times for strand in strands) else []
    return [_LEVELS, *force, *arm, *(f"channels of {name}" for name in sensors)]


def traces(strands: Sequence[Strand], what: str, since: float, until: float) -> Traces:
    """Return traces of runs.

    Args:
        strands: the runs.
        what: one of ``trace_names``.
        since: from when on, on the page's clock [s].
        until: until when.
    """
    import numpy as np

    edges = np.linspace(since, max(until, since + 1e-6), _BINS + 1)
    times = np.repeat(0.5 * (edges[:-1] + edges[1:]), 2)
    names: list[str] = []
    rows: list[NDArray[np.float64]] = []
    for number, strand in enumerate(strands, 1):
        before = f"run {number}: " if len(strands) > 1 else ""
        for name, series, column in _columns(strand, what):
            names.append(before + name)
            rows.append(_envelope(series, column, strand.zero, edges))
    return Traces(tuple(names), times, np.array(rows).reshape(len(rows), len(times)))


def _columns(strand: Strand, what: str) -> list[tuple[str, Series, int]]:
    history = strand.history
    if what == _LEVELS:
        return [(name, series, 0) for name, series in history.levels.items()]
    if what == _FORCE:
        return [("force", history.forces, 0)]
    if what == _SPEEDS:
        return [(f"joint {joint + 1}", history.speeds, joint) for joint in range(6)]
    sensor = what.removeprefix("channels of ")
    found = history.channels.get(sensor, Series())
    return [(channel, found, column) for column, channel in enumerate(CHANNELS)]


def _envelope(series: Series, column: int, zero: float, edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the least and the largest value of each bin, NaN for one without a value."""
    import numpy as np

    found = np.full(2 * (len(edges) - 1), np.nan)
    first, last = bisect_left(series.times, zero + edges[0]), bisect_right(series.times, zero + edges[-1])
    if first == last:
        return found
    at = np.array(series.times[first:last]) - zero
    values = np.array([row[column] for row in series.values[first:last]])
    bins = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, len(edges) - 2)
    starts = np.flatnonzero(np.diff(bins, prepend=-1))
    found[2 * bins[starts]] = np.minimum.reduceat(values, starts)
    found[2 * bins[starts] + 1] = np.maximum.reduceat(values, starts)
    return found
