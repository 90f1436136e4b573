"""Marks: places on a sensor that a person is asked to touch, chosen so that no misreading can hide."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from coneskin.commissioning.misreadings import power, shifts

if TYPE_CHECKING:
    from coneskin.commissioning.touching import Mark
    from coneskin.skin.sensor import Sensor

__all__ = ["LEAST_MARKS", "LEAST_POWER", "azimuth_margin", "plan_marks", "slant_places"]

LEAST_MARKS = 5  #: marks on each sensor
LEAST_POWER = 2.0  #: tolerances by which each misreading must miss one of the marks
_MOST_MARKS = 9
_ALONG = (0.2, 0.5, 0.8)  # parts of the slant at which there are marks
_EDGE = 0.1  # part of the wrap beside each edge without marks
_FINGER = 0.015  # m from an edge that a finger needs


def slant_places(sensor: Sensor) -> list[float]:
    """Return the slant distances at which a sensor may have marks [m]."""
    return [part * sensor.frustum.slant for part in _ALONG]


def azimuth_margin(sensor: Sensor) -> float:
    """Return the azimuth beside each straight edge in which a sensor has no marks [rad]."""
    cone = sensor.frustum
    return min(max(_EDGE * cone.wrap, _FINGER / min(cone.radius1, cone.radius2)), 0.25 * cone.wrap)


def plan_marks(
    sensor: Sensor, offered: Sequence[Mark], taken: Sequence[Mark] = (), refused: Collection[Mark] = ()
) -> tuple[Mark, ...] | None:
    """Choose marks that show every misreading.

    Args:
        sensor: that has them.
        offered: all places that can be described.
        taken: marks that were touched already; they come first in the result.
        refused: marks that a person cannot reach.

    Returns:
        at least LEAST_MARKS of them, of at least LEAST_POWER together; None where those that are left do not suffice.
    """
    chosen = list(taken)
    left = [mark for mark in offered if mark not in chosen and mark not in refused]
    moved = {mark: shifts(sensor, mark.place) for mark in (*chosen, *left)}

    def worth(mark: Mark) -> tuple[float, float]:
        """Return the power with a further mark, as far as it matters, then its distance from the others."""
        cone = sensor.frustum
        apart = (math.hypot((mark.u - o.u) / cone.slant, (mark.phi - o.phi) / cone.wrap) for o in chosen)
        return min(power(sensor, [moved[one] for one in (*chosen, mark)]), 2.0 * LEAST_POWER), min(apart, default=0.0)

    while len(chosen) < LEAST_MARKS or power(sensor, [moved[mark] for mark in chosen]) < LEAST_POWER:
        if not left or len(chosen) >= _MOST_MARKS:
            return None
        best = max(left, key=worth)
        left.remove(best)
        chosen.append(best)
    return tuple(chosen)
