"""Examination of a sensor's wires by four guided touches: near A, near B, near C and near D."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from coneskin.core.finding import Finding

from .wire_order import ORDERS, TouchReadings, identify, touch_places

if TYPE_CHECKING:
    from coneskin.skin.sensor import Sensor

__all__ = ["WirePatch", "examine_wires", "touch_words"]

_RIGHT = ORDERS[0]
_OTHER = {"A": "B", "B": "A", "C": "D", "D": "C"}
_GOOD = 0.3  # misfit of what explains the touches
_RADIAL_TURNED = "BACD"  # reads what the other radial_positive reads


class WirePatch(NamedTuple):
    """Keys with which a scene reads a sensor rightly whose wires are exchanged."""

    sensor: str  #: its name
    keys: dict[str, str]


def touch_words(sensor: Sensor, electrode: str) -> str:
    """Return the place near an electrode, for a person."""
    u, phi = touch_places(sensor)[electrode]
    where = {
        "A": "end 2, half way between the straight edges",
        "B": "end 1, half way between the straight edges",
        "C": "the straight edge phi = wrap, half way between the ends",
        "D": "the straight edge phi = 0, half way between the ends",
    }[electrode]
    return (
        f"{sensor.name} near electrode {electrode}: {where} (u = {1e3 * u:.0f} mm, phi = {math.degrees(phi):.0f} deg)"
    )


def examine_wires(sensor: Sensor, touched: Mapping[str, TouchReadings]) -> tuple[Finding, WirePatch | None]:
    """Find exchanged wires.

    Args:
        sensor: as the scene describes it.
        touched: readings of the touches near A, B, C and D.

    Returns:
        the finding, and what in the scene would mend it; None where nothing is wrong, or the wires must be moved.
    """
    item, rule = f"{sensor.name}, wires", "terminals A, B, C, D carry the electrodes A, B, C, D"
    wiring, likely, misfit, second = identify(sensor, touched)
    if wiring is None:
        value = f"nothing explains the touches clearly (misfit {misfit:.2f}, the next best {second:.2f})"
        if misfit < _GOOD:
            value = f"terminals A, B, C, D have the electrodes {likely[0].wires} or {likely[1].wires}: both explain it"
        remedy = "were the four places touched, firmly? Repeat it; then look for an open wire or a short"
        return Finding(item, "bad", value, rule, remedy), None
    wires, turned = wiring
    if wires == _RIGHT and not turned:
        return Finding(item, "ok", "in order, and the polarity is right", rule), None
    said = [f"terminal {terminal} has electrode {letter}" for terminal, letter in _moved(wires)]
    keys = {}
    if wires == _RADIAL_TURNED:
        said = [f"{said[0]}, {said[1]}, or the firmware drives {_OTHER[sensor.polarity.radial]} in place of the other"]
        keys["radial_positive"] = _OTHER[sensor.polarity.radial]
    if turned:
        keys["angular_positive"] = _OTHER[sensor.polarity.angular]
        said.append(
            f"the firmware drives {keys['angular_positive']}, not {sensor.polarity.angular}, in the angular phase"
        )
    value, written = "; ".join(said), " and ".join(f'{key} = "{word}"' for key, word in keys.items())
    if wires in (_RIGHT, _RADIAL_TURNED):
        remedy = f"write {written} for this sensor" + (", or exchange A and B" if wires != _RIGHT else "")
        return Finding(item, "bad", value, rule, remedy), WirePatch(sensor.name, keys)
    remedy = "move the wire on terminal " + ", ".join(f"{terminal} to {letter}" for terminal, letter in _moved(wires))
    return Finding(item, "bad", value, rule, remedy + (f"; then write {written}" if turned else "")), None


def _moved(wires: str) -> list[tuple[str, str]]:
    """Return each terminal that has another electrode than its own, with that electrode."""
    return [(terminal, letter) for terminal, letter in zip(_RIGHT, wires, strict=True) if letter != terminal]
