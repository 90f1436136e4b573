"""Changes of levels and forces over a run, as a page in a file has them: when each bar is to be drawn otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .moment import Moment
from .stage.level_scale import force_words, level_words
from .stage.sheet_surface import SheetSurface

__all__ = ["LevelChanges"]

_STEPS = 100  # of a level, which a bar can show


class LevelChanges:
    """Changes of one run, taken moment by moment.

    Args:
        sheets: of its stage.
    """

    def __init__(self, sheets: Sequence[SheetSurface]) -> None:
        self._sheets = sheets
        self._levels: list[list[tuple[float, int]]] = [[] for _ in sheets]
        self._forces: list[tuple[float, str]] = []

    def take(self, time: float, moment: Moment) -> None:
        """Take what is seen at a time [s], later than those before; what has not changed is passed over."""
        for sheet, changes in zip(self._sheets, self._levels, strict=True):
            level = round(_STEPS * min(max(moment.levels[sheet.name], 0.0), 1.0))
            if not changes or changes[-1][1] != level:
                changes.append((round(time, 4), level))
        if moment.force is not None and (not self._forces or self._forces[-1][1] != force_words(moment.force)):
            self._forces.append((round(time, 4), force_words(moment.force)))

    def data(self) -> dict[str, Any]:
        """Return the changes for JSON: of each sheet level [%] and the words for each level; of the force its words."""
        words = [[level_words(sheet, level / _STEPS) for level in range(_STEPS + 1)] for sheet in self._sheets]
        return {"levels": self._levels, "words": words, "forces": self._forces}
