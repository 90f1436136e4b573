"""Marks that a design has printed on the cover of a sensor, as its design.json says."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.commissioning.touching import Mark
from coneskin.core.errors import SceneError
from coneskin.core.files import read_file
from coneskin.core.text import read_json
from coneskin.scene.tables.sensor_keys import CONE_KEYS

from .marks import place_words

if TYPE_CHECKING:
    from coneskin.skin.sensor import Sensor

__all__ = ["find_design", "printed_marks"]

_DESIGN = "design.json"
_SHEET_FOLDER = re.compile(r"sheet-([1-9][0-9]?)")
_MAX_BYTES = 10_000_000
_SAME = 1e-3  # mm or deg; design.json is rounded


def printed_marks(sensor: Sensor, sheet: Mapping[str, Any]) -> tuple[Mark, ...]:
    """Return the marks that are printed on the cover of a sensor; none where it is not of that design.

    Args:
        sensor: that is calibrated.
        sheet: the table of its sheet in design.json.
    """
    cone, drawn = sensor.frustum, sheet.get("active_cone", {})
    own = {key.name: key.in_file_unit(getattr(cone, key.plain)) for key in CONE_KEYS}
    if any(abs(drawn.get(name, math.inf) - value) > _SAME for name, value in own.items()):
        return ()
    marks = []
    for row in sheet.get("touch_marks", ()):
        u, phi = 1e-3 * row["u_mm"], math.radians(row["phi_deg"])
        words = place_words(u, u / cone.slant, phi / cone.wrap)
        marks.append(Mark(u, phi, f"at the cross with number {row['number']}, {words}"))
    return tuple(marks)


def find_design(sensor_file: Path) -> Mapping[str, Any] | None:
    """Return the table of the sheet that a sensor file was written with; None where there is no design beside it.

    Raises:
        SceneError: there is one, and it cannot be read.
    """
    folder = sensor_file.parent
    own = _SHEET_FOLDER.fullmatch(folder.name)
    places = [(folder, 0), *([(folder.parent, int(own[1]) - 1)] if own else [])]
    for place, number in places:
        path = place / _DESIGN
        if path.is_file():
            try:
                sheets = read_json(read_file(path, _MAX_BYTES))["sheets"]
                return dict(sheets[number])
            except (OSError, ValueError, TypeError, LookupError) as exc:
                raise SceneError([f"the marks of {path} cannot be read: {exc}"], path.name) from exc
    return None
