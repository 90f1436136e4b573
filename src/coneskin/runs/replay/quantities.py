"""Quantities in the details of events: their units for people, and how much of a difference counts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import NamedTuple

from coneskin.core.errors import RecordingError

__all__ = ["EXACT", "QUANTITIES", "Quantity", "Tolerances"]

_DEGREE = math.pi / 180.0  # rad


class Quantity(NamedTuple):
    """Kind of number.

    Attributes:
        si_unit: as in names of columns, such as "m"; empty for a ratio.
        factor: by which a value in SI is multiplied for people.
        unit: of the product.
        digits: after the decimal point.
        tolerance: the field of ``Tolerances`` that holds for it.
    """

    si_unit: str
    factor: float
    unit: str
    digits: int
    tolerance: str


_LENGTH = Quantity("m", 1e3, "mm", 1, "place")
_ANGLE = Quantity("rad", 1.0 / _DEGREE, "deg", 1, "angle")
_SPEED = Quantity("rad_s", 1.0, "rad/s", 4, "speed")
_RATIO = Quantity("", 1.0, "", 3, "level")
#: name of a detail -> what it is; an unknown number is compared as a ratio of its size
QUANTITIES: Mapping[str, Quantity] = {
    "u": _LENGTH,
    "point": _LENGTH,
    "line": _LENGTH,
    "progress": _LENGTH,
    "braking": _LENGTH,
    "ellipse 1": _LENGTH,
    "ellipse 2": _LENGTH,
    "radius": _LENGTH,
    "radius_deviation": _RATIO,
    "elongation": _LENGTH,
    "covariance": Quantity("m2", 1e6, "mm^2", 4, "place"),
    "velocity": Quantity("m_s", 1e3, "mm/s", 1, "place"),
    "phi": _ANGLE,
    "normal": _RATIO,
    "level": _RATIO,
    "slider": _RATIO,
    "before": _RATIO,
    "speed": _SPEED,
}


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Largest differences that do not count.

    The defaults let another machine's sine and cosine differ in the last bits, and nothing else.

    Attributes:
        place: of a length [m].
        angle: [rad].
        level: of a touch, and of any other ratio.
        speed: of a joint [rad/s].
        time: of an event [s].
        relative: of any other number, as a ratio of it.
    """

    place: float = 1e-9
    angle: float = 1e-9
    level: float = 1e-9
    speed: float = 1e-9
    time: float = 1e-9
    relative: float = 1e-9

    @classmethod
    def from_settings(cls, settings: Mapping[str, float]) -> Tolerances:
        """Return tolerances from values with the unit in the name.

        Args:
            settings: any of ``place_mm``, ``angle_deg``, ``level``, ``speed_rad_s``, ``time_ms``, ``relative``.

        Raises:
            RecordingError: a name is another, or a value is negative or not finite.
        """
        values = {}
        for name, value in settings.items():
            if name not in _UNITS:
                raise RecordingError(f"there is no tolerance {name}; there are {', '.join(_UNITS)}")
            if not (math.isfinite(value) and value >= 0.0):
                raise RecordingError(f"the tolerance {name} must be finite and not negative, got {value!r}")
            field, factor = _UNITS[name]
            values[field] = value * factor
        return cls(**values)

    @classmethod
    def from_words(cls, words: Iterable[str]) -> Tolerances:
        """Return tolerances from words such as "place_mm=0.5"; errors as of ``from_settings``."""
        settings = {}
        for word in words:
            name, _, text = word.partition("=")
            try:
                settings[name.strip()] = float(text)
            except ValueError:
                raise RecordingError(f"a tolerance is NAME=VALUE, such as place_mm=0.5, got {word!r}") from None
        return cls.from_settings(settings)


EXACT = Tolerances(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  #: every bit counts
_UNITS: Mapping[str, tuple[str, float]] = {
    "place_mm": ("place", 1e-3),
    "angle_deg": ("angle", _DEGREE),
    "level": ("level", 1.0),
    "speed_rad_s": ("speed", 1.0),
    "time_ms": ("time", 1e-3),
    "relative": ("relative", 1.0),
}
assert {field for field, _ in _UNITS.values()} == {item.name for item in fields(Tolerances)}
