"""Electronics that match a sensor's sheets: supply, converter, pull-downs and shunt, from parts that can be bought.

The drive current follows from the sheets' resistances, over four decades from a slender link to a wide ring. A full
scale that is ten times too large costs three bits of it, and with them the size of a contact; one that is too small
hides a short. So the shunt is chosen from the larger of the two currents, and the converter's bits from the smaller.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from .electronics import Electronics, LeadOhms

__all__ = ["HEADROOM", "SENSE_GAIN", "GivenElectronics", "match_electronics", "shunt_ohms"]

#: Full scale of the current over the untouched drive current, at least. A short is told from twice the current on;
#: presses on both sides of the seam raise the larger current to 1.5 times, the smaller one to 2.4 times.
HEADROOM = 2.2
SENSE_GAIN = 50.0  #: voltage gain of the amplifier between the shunt and the converter
_E24 = (
    *(1.0, 1.1, 1.2, 1.3, 1.5, 1.6, 1.8, 2.0, 2.2, 2.4, 2.7, 3.0),
    *(3.3, 3.6, 3.9, 4.3, 4.7, 5.1, 5.6, 6.2, 6.8, 7.5, 8.2, 9.1),
)
_E96 = tuple(round(10.0 ** (k / 96.0), 2) for k in range(96))  # IEC 60063; a shunt has 1 %
_SUPPLIES = (4.096, 3.0, 2.5, 2.048, 1.25, 1.024, 0.512)  # V; voltage references
_SUPPLY_SHARE = 0.8  # of the converter's range that the supply may take: its tolerance of 10 % stays inside
_MAX_DRIVE = 0.05  # A; what an operational amplifier drives
_MIN_COUNTS = 100.0  # of the smaller drive current
_MOST_BITS = 16
_LEAST_PULLDOWN = 10e3  # ohm
_MOST_PULLDOWN = 100e3  # ohm; above it, a leak of a few hundred kilo-ohms looks like a touch
_PULLDOWN_RATIO = 2.0  # over the larger sheet resistance: a guide behind the whole sheet still sees two thirds


@dataclass(frozen=True, slots=True)
class GivenElectronics:
    """Electronics as far as they are given; None: to be chosen.

    Attributes:
        supply_volts: as in Electronics, and so are the others.
        adc_volts: see there.
        adc_bits: see there.
        pulldown_ohms: see there.
        input_ohms: see there.
        lead_ohms: see there.
        current_full_scale: see there.
    """

    supply_volts: float | None = None
    adc_volts: float = 3.3
    adc_bits: int | None = None
    pulldown_ohms: float | None = None
    input_ohms: float = 10e6
    lead_ohms: LeadOhms = LeadOhms(1.0, 1.0, 1.0, 1.0)  # noqa: RUF009  # a tuple
    current_full_scale: float | None = None


def match_electronics(radial_ohms: float, angular_ohms: float, given: GivenElectronics | None = None) -> Electronics:
    """Choose the electronics for a sensor; none is ever refused here.

    * Supply: the largest reference within 80 % of the converter's range with which neither sheet draws more than 50 mA.
    * Full scale of the current: the E96 shunt that gives the least range above 2.2 times the larger drive current.
    * Bits: 12, or as many up to 16 as give the smaller drive current 100 counts.
    * Pull-downs: the E24 value from twice the larger sheet resistance on, 10 to 100 kohm.

    Args:
        radial_ohms: resistance of the upper sheet from A to B [ohm].
        angular_ohms: resistance of the lower sheet from C to D [ohm].
        given: what is fixed already; all to be chosen by default.

    Raises:
        SensorError: a value that is given is out of range.
    """
    given = given or GivenElectronics()
    leads = given.lead_ohms
    loops = (radial_ohms + leads.a + leads.b, angular_ohms + leads.c + leads.d)
    supply = given.supply_volts
    if supply is None:
        fitting = [volts for volts in _SUPPLIES if volts <= _SUPPLY_SHARE * given.adc_volts] or [
            _SUPPLY_SHARE * given.adc_volts
        ]
        supply = next((volts for volts in fitting if volts <= _MAX_DRIVE * min(loops)), fitting[-1])
    largest, smallest = supply / min(loops), supply / max(loops)
    full_scale = given.current_full_scale
    if full_scale is None:
        full_scale = given.adc_volts / (SENSE_GAIN * _below(given.adc_volts / (SENSE_GAIN * HEADROOM * largest)))
    bits = given.adc_bits
    if bits is None:
        bits = 12
        while bits < _MOST_BITS and smallest / full_scale * ((1 << bits) - 1) < _MIN_COUNTS:
            bits += 2
    pulldown = given.pulldown_ohms
    if pulldown is None:
        needed = _above(_PULLDOWN_RATIO * max(radial_ohms, angular_ohms))
        pulldown = min(max(needed, _LEAST_PULLDOWN), _MOST_PULLDOWN, 0.1 * given.input_ohms)
    return Electronics(
        supply_volts=supply,
        adc_volts=given.adc_volts,
        adc_bits=bits,
        pulldown_ohms=pulldown,
        input_ohms=given.input_ohms,
        lead_ohms=leads,
        current_full_scale=full_scale,
    )


def shunt_ohms(electronics: Electronics) -> float:
    """Return the shunt that gives the full scale of the current with an amplifier of SENSE_GAIN [ohm]."""
    return electronics.adc_volts / (SENSE_GAIN * electronics.current_full_scale)


def _decade(ohms: float) -> float:
    return 10.0 ** math.floor(math.log10(min(max(ohms, 1e-9), 1e12)))


def _below(ohms: float) -> float:
    """Return the largest value of the E96 series that is not above a resistance."""
    decade = _decade(ohms)
    return max((value for value in _E96 if value * decade <= ohms), default=1.0) * decade


def _above(ohms: float) -> float:
    """Return the smallest value of the E24 series that is not below a resistance."""
    decade = _decade(ohms)
    return min((value for value in _E24 if value * decade >= ohms), default=10.0) * decade
