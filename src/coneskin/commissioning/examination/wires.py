"""Order of the four wires: which electrode is on which terminal, found from touches near A, B, C and D.

There are 24 orders. Eight of them join each pair of terminals to one sheet, and read mirrored or exchanged places; the
others drive the two sheets against each other, and no current flows through them while nothing touches. The firmware
may also drive the other electrode of a pair than ``radial_positive`` and ``angular_positive`` say. Each hypothesis is
put into the circuit (ideal resistors for the sheets), and the one whose readings are nearest to what was measured is
the answer.

Driving A in place of B reads as their wires exchanged do, to less than the noise: in the touch phase both are driven.
C and D are told apart there, each by its own pull-down; so D in place of C is not the same as their wires exchanged.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from itertools import permutations
from typing import NamedTuple

from coneskin.core.finding import Finding
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import (
    RIGHT_WIRES,
    ConverterInputs,
    LayerContact,
    Matrix,
    ResistorLadder,
    measure,
    reorder,
    wire_order,
)

#: electrodes on the terminals A, B, C, D, as in "BACD"; the right order first
_ORDERS = tuple("".join(order) for order in permutations(RIGHT_WIRES))
_ORDER_INDICES = {wires: wire_order(wires) for wires in _ORDERS}
_REFINED_WIRINGS = 6  # wirings whose place is looked for as well
_EDGE_PART, _MIDDLE_PART = 0.15, 0.5  # parts of slant and wrap at which the touches are asked for
_PLACE_ERROR = 0.1  # part of slant and wrap by which a person may be off
_TOUCH_SIEMENS = tuple(10.0 ** (-4.5 + 0.5 * k) for k in range(7))  # conductances that a touch may have, 0.03 to 32 mS
_VOLTS_ERROR, _CURRENT_ERROR = 0.03, 0.05  # parts of the supply, and of the larger drive current, of the model
_CLEAR_FACTOR, _CLEAR_MISFIT = 2.0, 0.25  # by which factor the second best must be worse, and how bad it must be


#: Readings of one touch, in their order: of touch, radial and angular phase, two potentials and a drive current each.
READING_NAMES = ConverterInputs._fields[:9]
#: Means of these readings: potentials over the supply, and drive currents over the full scale.
TouchReadings = tuple[float, ...]


class _Wiring(NamedTuple):
    """One way in which a sensor may be wired."""

    wires: str  #: electrodes on the terminals A, B, C, D
    angular_turned: bool  #: the firmware drives the other one of C and D


class _WireVerdict(NamedTuple):
    """Answer, and how sure it is."""

    wiring: _Wiring | None  #: None where none explains what was read, or two do
    likely: tuple[_Wiring, _Wiring]  #: the best and the next best
    misfit: float  #: root mean square of the differences, in errors of the model
    second: float  #: that of the next best


#: every hypothesis, the right one first
WIRINGS = tuple(_Wiring(wires, turned) for wires in _ORDERS for turned in (False, True))


def touch_places(sensor: Sensor) -> dict[str, tuple[float, float]]:
    """Return the places near A, B, C and D: u [m] and phi [rad]."""
    cone, far = sensor.frustum, 1.0 - _EDGE_PART
    middle_u, middle_phi = _MIDDLE_PART * cone.slant, _MIDDLE_PART * cone.wrap
    return {
        "A": (far * cone.slant, middle_phi),
        "B": (_EDGE_PART * cone.slant, middle_phi),
        "C": (middle_u, far * cone.wrap),
        "D": (middle_u, _EDGE_PART * cone.wrap),
    }


def _identify(sensor: Sensor, touched: Mapping[str, TouchReadings]) -> _WireVerdict:
    """Find the order of the wires by the readings of the touches, as of ``touch_places``."""
    touches = [_Touch(sensor, place, touched[name]) for name, place in touch_places(sensor).items()]
    rough = {wiring: sum(touch.rough(wiring) for touch in touches) for wiring in WIRINGS}
    near = sorted(rough, key=rough.__getitem__)[:_REFINED_WIRINGS]
    fine = {wiring: sum(touch.fine(wiring) for touch in touches) for wiring in near}
    ranked, scale = sorted(near, key=fine.__getitem__), len(READING_NAMES) * len(touches)
    best, second = (math.sqrt(fine[wiring] / scale) for wiring in ranked[:2])
    clear = second > _CLEAR_FACTOR * best and second > _CLEAR_MISFIT
    return _WireVerdict(ranked[0] if clear else None, (ranked[0], ranked[1]), best, second)


class _Touch:
    """One touch, and how well each wiring explains it."""

    def __init__(self, sensor: Sensor, place: tuple[float, float], read: TouchReadings) -> None:
        self._sensor, self._place, self._read = sensor, place, read
        polarity = replace(sensor.polarity, angular="D" if sensor.c_positive else "C")
        self._driven = {False: sensor, True: replace(sensor, polarity=polarity)}
        self._sheets = cache(self._admittance)
        self._siemens: dict[_Wiring, float] = {}

    def rough(self, wiring: _Wiring) -> float:
        """Return the sum of squares at the best conductance."""
        self._siemens[wiring] = min(_TOUCH_SIEMENS, key=lambda siemens: self._squares(wiring, 0.0, 0.0, siemens))
        return self._squares(wiring, 0.0, 0.0, self._siemens[wiring])

    def fine(self, wiring: _Wiring) -> float:
        """Return the same at the best place as well, by a search along its axes; ``rough`` was called before."""
        at = (0.0, 0.0, self._siemens[wiring])
        best, step = self._squares(wiring, *at), _PLACE_ERROR
        while step > _PLACE_ERROR / 20.0:
            along, around, siemens = at
            tries = [
                *((along + step, around, siemens), (along - step, around, siemens)),
                *((along, around + step, siemens), (along, around - step, siemens)),
                *((along, around, siemens * (1.0 + 4.0 * step)), (along, around, siemens / (1.0 + 4.0 * step))),
            ]
            inside = [one for one in tries if max(abs(one[0]), abs(one[1])) <= _PLACE_ERROR]
            found = min((self._squares(wiring, *one), one) for one in inside)
            if found[0] < best:
                best, at = found
            else:
                step *= 0.5
        return best

    def _squares(self, wiring: _Wiring, along: float, around: float, siemens: float) -> float:
        sensor, parts = self._driven[wiring.angular_turned], self._sensor.electronics
        sheets = reorder(self._sheets(along, around, siemens), _ORDER_INDICES[wiring.wires])
        at = measure(sensor, (sheets, sheets, sheets))
        current = max(sensor.radial_amperes, sensor.angular_amperes) / parts.current_full_scale
        total = 0.0
        for name, value in zip(READING_NAMES, self._read, strict=True):
            expected = getattr(at, name)
            if name.endswith("current"):
                off = (min(expected / parts.current_full_scale, 1.0) - value) / (_CURRENT_ERROR * max(current, value))
            else:
                off = (expected / parts.supply_volts - value) / _VOLTS_ERROR
            total += min(off * off, 100.0)
        return total

    def _admittance(self, along: float, around: float, siemens: float) -> Matrix:
        cone, (u, phi) = self._sensor.frustum, self._place
        contact = LayerContact(u + along * cone.slant, phi + around * cone.wrap, siemens)
        return ResistorLadder().admittance(self._sensor, (contact,))


_RIGHT_ORDER = _ORDERS[0]
_OTHER_ELECTRODE = {"A": "B", "B": "A", "C": "D", "D": "C"}
_GOOD_MISFIT = 0.3  # misfit of what explains the touches
_RADIAL_TURNED = "BACD"  # reads what the other radial_positive reads


class WirePatch(NamedTuple):
    """Keys with which a scene reads a sensor rightly whose wires are exchanged."""

    sensor: str  #: its name
    keys: dict[str, str]


def examine_wires(sensor: Sensor, touched: Mapping[str, TouchReadings]) -> tuple[Finding, WirePatch | None]:
    """Find exchanged wires by the readings of the touches near A, B, C and D.

    Returns:
        the finding, and what in the scene would mend it; None where nothing is wrong, or the wires must be moved.
    """
    item, rule = f"{sensor.name}, wires", "terminals A, B, C, D carry the electrodes A, B, C, D"
    wiring, likely, misfit, second = _identify(sensor, touched)
    if wiring is None:
        value = f"nothing explains the touches clearly (misfit {misfit:.2f}, the next best {second:.2f})"
        if misfit < _GOOD_MISFIT:
            value = f"terminals A, B, C, D have the electrodes {likely[0].wires} or {likely[1].wires}: both explain it"
        remedy = "were the four places touched, firmly? Repeat it; then look for an open wire or a short"
        return Finding(item, "bad", value, rule, remedy), None
    wires, turned = wiring
    if wires == _RIGHT_ORDER and not turned:
        return Finding(item, "ok", "in order, and the polarity is right", rule), None
    said = [f"terminal {terminal} has electrode {letter}" for terminal, letter in _moved(wires)]
    keys = {}
    if wires == _RADIAL_TURNED:
        driven = _OTHER_ELECTRODE[sensor.polarity.radial]
        said = [f"{said[0]}, {said[1]}, or the firmware drives {driven} in place of the other"]
        keys["radial_positive"] = driven
    if turned:
        keys["angular_positive"] = _OTHER_ELECTRODE[sensor.polarity.angular]
        said.append(
            f"the firmware drives {keys['angular_positive']}, not {sensor.polarity.angular}, in the angular phase"
        )
    value, written = "; ".join(said), " and ".join(f'{key} = "{word}"' for key, word in keys.items())
    if wires in (_RIGHT_ORDER, _RADIAL_TURNED):
        remedy = f"write {written} for this sensor" + (", or exchange A and B" if wires != _RIGHT_ORDER else "")
        return Finding(item, "bad", value, rule, remedy), WirePatch(sensor.name, keys)
    remedy = "move the wire on terminal " + ", ".join(f"{terminal} to {letter}" for terminal, letter in _moved(wires))
    return Finding(item, "bad", value, rule, remedy + (f"; then write {written}" if turned else "")), None


def _moved(wires: str) -> list[tuple[str, str]]:
    """Return each terminal that has another electrode than its own, with that electrode."""
    return [(terminal, letter) for terminal, letter in zip(_RIGHT_ORDER, wires, strict=True) if letter != terminal]
