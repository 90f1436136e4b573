"""Orders of the wires: all 24, with either drive of C and D, are told apart by four touches."""

import math
from dataclasses import replace
from functools import cache

import pytest

from coneskin.commissioning.examination.wires import (
    READING_NAMES,
    WIRINGS,
    TouchReadings,
    _identify,
    _Wiring,
    touch_places,
)
from coneskin.geometry.frustum import Frustum
from coneskin.skin.electronics import Polarity
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact, Matrix, measure, reorder, wire_order
from coneskin.skin.virtual.field_contacts import FieldContacts

#: a whole cylinder; a wide cone
SENSORS = [
    Sensor(Frustum(0.0376, 0.0372, 0.24)),
    Sensor(Frustum(0.05, 0.09, 0.1, math.radians(120.0))),
]
ORDERS = tuple(dict.fromkeys(wiring.wires for wiring in WIRINGS))
_ASIDE = {"A": (0.04, -0.05), "B": (-0.03, 0.06), "C": (0.05, 0.02), "D": (-0.06, -0.04)}  # parts a person is off


@cache
def sheets(number: int, name: str) -> Matrix:
    """The exact field of a touch beside the place that was asked for."""
    sensor, (along, around) = SENSORS[number], _ASIDE[name]
    u, phi = touch_places(sensor)[name]
    cone = sensor.frustum
    contact = LayerContact(u + along * cone.slant, phi + around * cone.wrap, 1.2e-3, 0.004, 0.004)
    return FieldContacts().admittances(sensor, [(contact,)])[0]


def readings(number: int, wiring: _Wiring) -> dict[str, TouchReadings]:
    """What a sensor reads that is wired so, rounded to counts."""
    sensor = SENSORS[number]
    driven = replace(sensor, polarity=Polarity("B", "D" if wiring.angular_turned else "C"))
    parts = sensor.electronics
    touched = {}
    for name in touch_places(sensor):
        at = measure(driven, [reorder(sheets(number, name), wire_order(wiring.wires))] * 3)
        counts = {
            key: round(getattr(at, key) / (parts.current_full_scale if "current" in key else parts.adc_volts) * 4095)
            for key in READING_NAMES
        }
        supply = parts.supply_volts / parts.adc_volts * 4095
        touched[name] = tuple(min(n / (4095 if "current" in key else supply), 1.3) for key, n in counts.items())
    return touched


def test_there_are_24_orders_and_the_right_one_is_first() -> None:
    assert len(set(ORDERS)) == 24
    assert WIRINGS[0] == _Wiring("ABCD", False)
    assert len(set(WIRINGS)) == 48


def test_an_order_is_named() -> None:
    assert _identify(SENSORS[0], readings(0, _Wiring("DBCA", False))).wiring == _Wiring("DBCA", False)


@pytest.mark.long
@pytest.mark.parametrize("wires", ORDERS)
def test_every_order_is_named(wires: str) -> None:
    """On one sensor or the other, and with C or D driven, by turns."""
    number, turned = ORDERS.index(wires) % 2, ORDERS.index(wires) % 4 > 1
    assert _identify(SENSORS[number], readings(number, _Wiring(wires, turned))).wiring == _Wiring(wires, turned)


def test_which_of_c_and_d_the_firmware_drives_is_told_from_their_wires() -> None:
    assert _identify(SENSORS[1], readings(1, _Wiring("ABDC", True))).wiring == _Wiring("ABDC", True)


def test_touches_of_one_place_alone_are_not_explained() -> None:
    read = readings(0, WIRINGS[0])
    assert _identify(SENSORS[0], dict.fromkeys(read, read["A"])).wiring is None
