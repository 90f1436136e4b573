"""Marks of a calibration, a grid over the active area or those printed on the cover, and the words for them."""

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
from coneskin.geometry.drawing.touch_marks import mark_parts
from coneskin.scene.tables.sensor_keys import CONE_KEYS

if TYPE_CHECKING:
    from coneskin.skin.sensor import Sensor

__all__ = ["MARK_COUNTS", "calibration_marks", "find_design", "printed_marks"]

MARK_COUNTS = (4, 9, 16)  #: marks that there may be: 2, 3 or 4 along, and as many around


def calibration_marks(sensor: Sensor, count: int = 9) -> tuple[Mark, ...]:
    """Return the marks of a sensor, row by row from end 1, each row from the end of the one before.

    Around, the words have parts and no lengths: the face that is touched is farther out than the layers that are read.

    Args:
        sensor: that is calibrated.
        count: their number, one of MARK_COUNTS.
    """
    cone = sensor.frustum
    return tuple(
        Mark(along * cone.slant, around * cone.wrap, _place_words(along * cone.slant, along, around))
        for along, around in mark_parts(math.isqrt(count))
    )


def _place_words(u: float, along: float, around: float) -> str:
    """Return how a person finds a place: slant distance from end 1 [m], parts of the slant and of the wrap."""
    return (
        f"{1e3 * u:.1f} mm from electrode B (end 1) along the side, which is {100.0 * along:.0f} % of the way "
        f"to A, and {100.0 * around:.0f} % of the way around from electrode D to C (between their inner edges)"
    )


_DESIGN_FILE = "design.json"
_SHEET_FOLDER = re.compile(r"sheet-([1-9][0-9]?)")
_MAX_BYTES = 10_000_000
_SIZE_TOLERANCE = 1e-3  # mm or deg; design.json is rounded


def printed_marks(sensor: Sensor, sheet: Mapping[str, Any]) -> tuple[Mark, ...]:
    """Return the marks that are printed on the cover of a sensor; none where it is not of that design.

    Args:
        sensor: that is calibrated.
        sheet: the table of its sheet in design.json.
    """
    cone, drawn = sensor.frustum, sheet.get("active_cone", {})
    own = {key.name: key.in_file_unit(getattr(cone, key.plain)) for key in CONE_KEYS}
    if any(abs(drawn.get(name, math.inf) - value) > _SIZE_TOLERANCE for name, value in own.items()):
        return ()
    marks = []
    for row in sheet.get("touch_marks", ()):
        u, phi = 1e-3 * row["u_mm"], math.radians(row["phi_deg"])
        words = _place_words(u, u / cone.slant, phi / cone.wrap)
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
        path = place / _DESIGN_FILE
        if path.is_file():
            try:
                sheets = read_json(read_file(path, _MAX_BYTES))["sheets"]
                return dict(sheets[number])
            except (OSError, ValueError, TypeError, LookupError) as exc:
                raise SceneError([f"the marks of {path} cannot be read: {exc}"], path.name) from exc
    return None
