"""Refusals of a calibration: too few touches, and what is no small error of a sheet, with its likely cause."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from coneskin.commissioning.misreadings import RIGHT, Place, explain, misfit
from coneskin.core.errors import SkinError
from coneskin.skin.calibration import MAP_LIMITS

if TYPE_CHECKING:
    from coneskin.skin.sensor import Sensor

__all__ = ["LEAST_TOUCHES", "KnownTouch", "check_bends", "check_offsets_and_gains", "check_touches"]

LEAST_TOUCHES = 4  #: at different places
_APART = 0.3  # of the sheet, between the outermost of them


class KnownTouch(NamedTuple):
    """Touch of a known place."""

    mark: Place  #: where it was
    read: Place  #: what the sensor decoded there, without a place map


def check_touches(sensor: Sensor, touches: Sequence[KnownTouch]) -> None:
    """Refuse touches that nothing can be fitted to, and those that a wiring or a mounting explains.

    Raises:
        SkinError: says what is missing, or the cause.
    """
    places = sorted({touch.mark for touch in touches})
    along, around = [mark.u for mark in places], [mark.phi for mark in places]
    cone = sensor.frustum
    enough = len(places) >= LEAST_TOUCHES
    enough = (
        enough and max(along) - min(along) >= _APART * cone.slant and max(around) - min(around) >= _APART * cone.wrap
    )
    if not enough:
        got = ", ".join(f"{1e3 * mark.u:.0f} mm, {math.degrees(mark.phi):.0f} deg" for mark in places)
        raise SkinError(
            f"{sensor.name}: a calibration needs touches at {LEAST_TOUCHES} places or more, the outermost of them "
            f"{100 * _APART:.0f} % of the sheet apart along and around; got {len(places)}: {got or 'none'}"
        )
    marks, read = [touch.mark for touch in touches], [touch.read for touch in touches]
    if misfit(sensor, RIGHT, marks, read).rest > 1.0:
        cause = explain(sensor, marks, read)
        if cause.startswith("it reads as if"):
            raise SkinError(f"{sensor.name} cannot be calibrated: {cause}; mend that, and begin again")


def check_offsets_and_gains(
    sensor: Sensor, along: Sequence[float], around: Sequence[float], sheet_ohms: tuple[float, float] | None = None
) -> None:
    """Refuse offsets and gains that are no small error of this sheet.

    Args:
        sensor: that was touched.
        along: offset and gain that would be fitted to the fraction along.
        around: the same around.
        sheet_ohms: what its untouched sheets have per square, if they are as large as the scene says [ohm].

    Raises:
        SkinError: says the likely mistake.
    """
    cone = sensor.frustum
    sizes = cone.slant, cone.wrap * cone.radius_at(0.5 * cone.slant)
    hint = ""
    if sheet_ohms is not None:
        hint = (
            f" As large as the scene says, its untouched sheets would have {sheet_ohms[0]:.0f} and {sheet_ohms[1]:.0f} "
            f"ohm per square; the scene says {sensor.upper_sheet_ohms:g} and {sensor.lower_sheet_ohms:g}"
        )
    for word, key, (offset, gain), size in zip(
        ("along", "around"), ("height_mm", "wrap_deg"), (along, around), sizes, strict=True
    ):
        if abs(gain) > MAP_LIMITS[1]:
            said = "short" if gain > 0.0 else "long"
            raise SkinError(
                f"{sensor.name} cannot be calibrated: it reads distances {word} {100.0 * abs(gain):.1f} % too {said}, "
                f"and {100.0 * MAP_LIMITS[1]:g} % are allowed. Is it another sheet than the scene says ({key}), were "
                "the marks measured from another edge than that of the active area, or has an electrode come off in "
                f"part?{hint}"
            )
        if abs(offset) > MAP_LIMITS[0]:
            raise SkinError(
                f"{sensor.name} cannot be calibrated: it reads all places {1e3 * abs(offset) * size:.0f} mm off "
                f"{word}, and {1e3 * MAP_LIMITS[0] * size:.0f} mm are allowed. Were the marks measured from another "
                f"edge than that of the active area, or is the sheet turned or shifted on its link (xyz_mm, "
                f"rpy_deg)?{hint}"
            )


def check_bends(sensor: Sensor, along: Sequence[float], around: Sequence[float]) -> None:
    """Refuse a map that bends places by more than any sheet of some quality does.

    Raises:
        SkinError: with the numbers.
    """
    for word, numbers in (("along", along), ("around", around)):
        if any(abs(value) > most for value, most in zip(numbers, MAP_LIMITS, strict=True)):
            raise SkinError(
                f"{sensor.name} cannot be calibrated: it bends places {word} by more than a calibration takes off "
                f"({', '.join(f'{value:+.3f}' for value in numbers)}): is the sheet torn, or far from uniform?"
            )
