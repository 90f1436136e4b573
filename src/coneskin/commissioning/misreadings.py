"""Misreadings: what a sensor reads whose wires are exchanged, or whose sheet is not mounted as its scene says.

Exchanged wires mirror a place in one coordinate or the other, or exchange the two: seven ways, the symmetries of a
square. A sheet at another place on the link adds an offset along and about the link. Both together are found here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from coneskin.scene.commissioning_record import MAX_MISS
from coneskin.skin.sensor import Sensor

_FULL_TURN = 2.0 * math.pi  # rad
_MAX_PART = 0.2  # part of the slant, and of the wrap: how well a person finds a mark on a small sensor
_MIN_OFFSET_READINGS = 3  # readings; fewer can be explained by an offset too easily


class Place(NamedTuple):
    """Place on a sensor."""

    u: float  #: slant distance from end 1 [m]
    phi: float  #: azimuth [rad]


class _Misreading(NamedTuple):
    """One way to read a place wrongly."""

    mirror_radial: bool  #: A for B
    mirror_angular: bool  #: C for D
    exchanged: bool  #: the pair A, B for the pair C, D, before that
    cause: str  #: for people, after "it reads as if"


class _Misfit(NamedTuple):
    """Difference between readings and what a misreading would give, its best offset taken off."""

    u: float  #: offset along the link [m]
    phi: float  #: offset about the link [rad], within half a turn
    rest: float  #: largest difference that is left, in tolerances
    largest: float  #: largest difference without the offset, in tolerances


RIGHT = _Misreading(False, False, False, "the sheet were")
WRONG = (
    _Misreading(True, False, False, "A and B were exchanged (their wires, or radial_positive)"),
    _Misreading(
        False,
        True,
        False,
        "C and D were exchanged (their wires, or angular_positive), or the sheet's inner face were out",
    ),
    _Misreading(True, True, False, "A and B, and C and D, were exchanged, or the sheet lay end for end on the link"),
    *(
        _Misreading(a, c, True, "the wires of A and B were on C and D" + (", the other way round" if a or c else ""))
        for a in (False, True)
        for c in (False, True)
    ),
)


def tolerance(sensor: Sensor) -> Place:
    """Return how far from its mark a reading may be, along and about: 20 mm and 25 deg, less on a small sensor."""
    cone = sensor.frustum
    along, around = MAX_MISS
    return Place(min(along, _MAX_PART * cone.slant), min(around, _MAX_PART * cone.wrap))


def misread(sensor: Sensor, wrong: _Misreading, place: Place) -> Place:
    """Return what a sensor reads at a place when it reads so."""
    radial, angular = sensor.fractions(*place)
    if wrong.exchanged:
        radial, angular = angular, radial
    radial = 1.0 - radial if wrong.mirror_radial else radial
    return Place(*sensor.place(radial, 1.0 - angular if wrong.mirror_angular else angular))


def miss(sensor: Sensor, mark: Place, read: Place) -> tuple[float, float]:
    """Return by how much a touch of a mark is read off it, along and around [m]."""
    around = sensor.frustum.radius_at(mark.u) * math.remainder(read.phi - mark.phi, _FULL_TURN)
    return read.u - mark.u, around


def misfit(sensor: Sensor, wrong: _Misreading, marks: Sequence[Place], read: Sequence[Place]) -> _Misfit:
    """Compare readings with what a misreading of the marks would give.

    Args:
        marks: where it was touched; at least one.
        read: what it read there, in the same order.
    """
    allowed = tolerance(sensor)
    along, around = [], []
    for mark, reading in zip(marks, read, strict=True):
        expected = misread(sensor, wrong, mark)
        along.append(reading.u - expected.u)
        around.append(math.remainder(reading.phi - expected.phi, _FULL_TURN))
    u, half_u = 0.5 * (min(along) + max(along)), 0.5 * (max(along) - min(along))
    phi, half_phi = _middle(around)
    largest = max(max(map(abs, along)) / allowed.u, max(map(abs, around)) / allowed.phi)
    return _Misfit(u, phi, max(half_u / allowed.u, half_phi / allowed.phi), largest)


def _middle(angles: Sequence[float]) -> tuple[float, float]:
    """Return the middle of the smallest arc that holds all angles [rad], and half its length [rad]."""
    ordered = sorted(angle % _FULL_TURN for angle in angles)
    gaps = [(after - before, after) for before, after in pairwise(ordered)]
    gap, start = max([*gaps, (ordered[0] + _FULL_TURN - ordered[-1], ordered[0])])
    half = 0.5 * (_FULL_TURN - gap)
    return math.remainder(start + half, _FULL_TURN), half


def shifts(sensor: Sensor, place: Place) -> tuple[Place, ...]:
    """Return by how much each misreading in ``WRONG`` moves a place."""
    moved = (misread(sensor, wrong, place) for wrong in WRONG)
    return tuple(Place(seen.u - place.u, seen.phi - place.phi) for seen in moved)


def power(sensor: Sensor, marks: Sequence[tuple[Place, ...]]) -> float:
    """Return how clearly marks show each misreading, in tolerances.

    Wherever about and along the link the sheet may be mounted, every misreading is farther from one of the marks than
    this. Below 1 one of them could pass.

    Args:
        marks: ``shifts`` of each mark; none at all show nothing.
    """
    if not marks:
        return 0.0
    allowed, least = tolerance(sensor), math.inf
    for moved in zip(*marks, strict=True):
        along = [shift.u for shift in moved]
        _, half_phi = _middle([shift.phi for shift in moved])
        least = min(least, max(0.5 * (max(along) - min(along)) / allowed.u, half_phi / allowed.phi))
    return least


def explain(sensor: Sensor, marks: Sequence[Place], read: Sequence[Place]) -> str:
    """Return the likely cause of readings that are not where they should be, for people.

    Args:
        marks: where it was touched; at least one.
        read: what it read there, in the same order.
    """
    fits = [(wrong, misfit(sensor, wrong, marks, read)) for wrong in (RIGHT, *WRONG)]
    plain = [wrong.cause for wrong, fit in fits[1:] if fit.largest <= 1.0]
    if plain:
        return "it reads as if " + ", or as if ".join(dict.fromkeys(plain))
    if len(marks) >= _MIN_OFFSET_READINGS:
        wrong, fit = min(fits, key=lambda item: item[1].rest + (0.0 if item[0] is RIGHT else 0.5))
        if fit.rest <= 1.0:
            joint = " " if wrong is RIGHT else ", and it were "
            return f"it reads as if {wrong.cause}{joint}{_offset(sensor, fit)}"
    return "no exchange of wires and no turn of the sheet explains it alone: was the right place touched?"


def _offset(sensor: Sensor, fit: _Misfit) -> str:
    allowed, said = tolerance(sensor), []
    if abs(fit.phi) > 0.3 * allowed.phi:
        said.append(f"turned about the link by {-math.degrees(fit.phi):+.0f} deg (rpy_deg)")
    if abs(fit.u) > 0.3 * allowed.u:
        said.append(f"shifted along the link by {-1e3 * fit.u:+.0f} mm (xyz_mm)")
    return " and ".join(said) or "where the scene says"
