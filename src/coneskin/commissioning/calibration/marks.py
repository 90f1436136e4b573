"""Marks of a calibration: a grid over the active area, and words by which a person finds its points on the sheet."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from coneskin.commissioning.touching import Mark
from coneskin.geometry.drawing.touch_marks import mark_parts

if TYPE_CHECKING:
    from coneskin.skin.sensor import Sensor

__all__ = ["MARK_COUNTS", "calibration_marks", "place_words"]

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
        Mark(along * cone.slant, around * cone.wrap, place_words(along * cone.slant, along, around))
        for along, around in mark_parts(math.isqrt(count))
    )


def place_words(u: float, along: float, around: float) -> str:
    """Return how a person finds a place: slant distance from end 1 [m], parts of the slant and of the wrap."""
    return (
        f"{1e3 * u:.1f} mm from electrode B (end 1) along the side, which is {100.0 * along:.0f} % of the way "
        f"to A, and {100.0 * around:.0f} % of the way around from electrode D to C (between their inner edges)"
    )
