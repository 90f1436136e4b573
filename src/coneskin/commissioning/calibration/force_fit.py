"""Fit of a table of forces to presses with known ones, and what it is worth at a place where nobody pressed."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from coneskin.core.errors import SensorError, SkinError
from coneskin.skin.calibration import ForceTable

__all__ = ["KnownPress", "fit_forces"]

_LEAST_RISE = 2.0  # standard errors by which the next force must raise the level
_MODEL = 0.02  # of the force; no interpolation is better


class KnownPress(NamedTuple):
    """A press with a known force."""

    force: float  #: [N]
    place: int  #: number of the place
    level: float  #: mean while it rested


def fit_forces(presses: Sequence[KnownPress]) -> ForceTable:
    """Return the table that presses make, with the error that they have at a place that had no part in it.

    Args:
        presses: with two forces or more, each at two places or more.

    Raises:
        SkinError: the level does not rise with the force; the message says from which on.
    """
    table = _table(presses)
    forces = sorted({press.force for press in presses})
    logs = {f: [_log(p.level) for p in presses if p.force == f] for f in forces}
    spread = math.sqrt(statistics.fmean([statistics.pvariance(values) for values in logs.values()]))
    for low, high in pairwise(forces):
        rise = statistics.fmean(logs[high]) - statistics.fmean(logs[low])
        if rise < _LEAST_RISE * spread * math.sqrt(2.0 / len(logs[high])):
            raise SkinError(
                f"{high:g} N hardly give a higher level than {low:g} N, from place to place it differs more: "
                f"leave out the forces from {high:g} N on"
            )
    missed = []
    for place in sorted({press.place for press in presses}):
        rest = _table([press for press in presses if press.place != place])
        for press in presses:
            if press.place == place:
                level = min(max(press.level, rest.levels[0]), rest.levels[-1])
                read = rest.force(level)
                assert read is not None
                missed.append(math.log(read[0] / press.force))
    error = math.hypot(_MODEL, math.sqrt(statistics.fmean([value * value for value in missed])))
    return ForceTable(table.forces, table.levels, round(min(error, 0.99), 4))


def _table(presses: Sequence[KnownPress]) -> ForceTable:
    forces = sorted({press.force for press in presses})
    strengths = [math.exp(statistics.fmean([_log(p.level) for p in presses if p.force == f])) for f in forces]
    try:
        return ForceTable(tuple(forces), tuple(round(s / (1.0 + s), 5) for s in strengths), 0.0)
    except SensorError as exc:
        raise SkinError(f"the level does not rise with the force: {exc}") from exc


def _log(level: float) -> float:
    return math.log(level / (1.0 - level))
