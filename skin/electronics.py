"""Electronics of a sensor: supply, converter, resistors, thresholds, and the parts that match given sheets.

The circuit (docs/look-up/wire-format.md): each electrode A, B, C, D has one wire, which drives it in one phase and
reads it in another. The drive current is measured in the supply line; the supply is measured behind that.

Matching parts: the drive current follows from the sheets' resistances, over four decades from a slender link to a wide
ring. A full scale that is ten times too large costs three bits of it, and with them the size of a contact; one that is
too small hides a short. So the shunt is chosen from the larger of the two currents, and the converter's bits from the
smaller.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Literal, NamedTuple

from coneskin.core.errors import SensorError


class LeadOhms(NamedTuple):
    """Resistance of the wire and the switch of each electrode [ohm]."""

    a: float
    b: float
    c: float
    d: float

    @classmethod
    def equal(cls, ohms: float) -> LeadOhms:
        """Return the same resistance for all four electrodes."""
        return cls(ohms, ohms, ohms, ohms)


_ONE_OHM = LeadOhms(1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Electronics:
    """Supply, converter and resistors.

    Attributes:
        supply_volts: potential of the positive electrode, U0 in the paper [V].
        adc_volts: input that gives the highest count [V].
        adc_bits: resolution of the converter, 8 to 16.
        pulldown_ohms: resistor from each of C and D to ground in the touch phase [ohm].
        input_ohms: resistor from each guide electrode to ground in the other phases [ohm]; it brings an untouched
            guide to 0 V.
        lead_ohms: wire and switch of each electrode [ohm].
        current_full_scale: drive current that gives the highest count [A], counted from a converter's zero.
        current_zero: what the reading of no drive current stands for [A]; a bias, with which an amplifier's offset of
            either sign can be read.

    Raises:
        SensorError: a value is not positive, the bias is over a tenth of the full scale, or the supply does not fit
            into the converter's range.
    """

    supply_volts: float = 2.5
    adc_volts: float = 3.3
    adc_bits: int = 12
    pulldown_ohms: float = 10e3
    input_ohms: float = 10e6
    lead_ohms: LeadOhms = _ONE_OHM
    current_full_scale: float = 0.02
    current_zero: float = 0.0

    def __post_init__(self) -> None:
        units = {"supply_volts": "V", "adc_volts": "V", "current_full_scale": "A"}
        values = {f.name: (getattr(self, f.name), units.get(f.name, "ohm")) for f in fields(self)}
        del values["adc_bits"], values["lead_ohms"], values["current_zero"]
        values |= {f"lead_ohms.{name}": (ohms, "ohm") for name, ohms in self.lead_ohms._asdict().items()}
        for name, (value, unit) in values.items():
            if not (math.isfinite(value) and value > 0.0):
                raise SensorError(f"electronics.{name} must be finite and above 0 {unit}, got {value!r} {unit}")
        if not (isinstance(self.adc_bits, int) and 8 <= self.adc_bits <= 16):
            raise SensorError(f"electronics.adc_bits must be a whole number from 8 to 16, got {self.adc_bits!r}")
        if self.supply_volts > 0.95 * self.adc_volts:
            raise SensorError(
                "electronics.supply_volts must be at most 95 % of adc_volts, or a reading at the positive electrode "
                f"looks like a short: got {self.supply_volts!r} V of {self.adc_volts!r} V"
            )
        if not 0.0 <= self.current_zero <= 0.1 * self.current_full_scale:
            raise SensorError(
                "electronics.current_zero must be from 0 A to a tenth of current_full_scale, got "
                f"{self.current_zero!r} A of {self.current_full_scale!r} A"
            )
        if self.input_ohms < 10.0 * self.pulldown_ohms:
            raise SensorError(
                "electronics.input_ohms must be at least 10 times pulldown_ohms, or the guides load the field: "
                f"got {self.input_ohms!r} ohm and {self.pulldown_ohms!r} ohm"
            )

    @property
    def full_count(self) -> int:
        """The highest count of the converter."""
        return (1 << self.adc_bits) - 1

    def volts(self, count: int) -> float:
        """Return the potential that a count stands for [V]."""
        return count * self.adc_volts / self.full_count

    def amperes(self, count: float) -> float:
        """Return the drive current that a count stands for [A]."""
        return count * self.current_full_scale / self.full_count - self.current_zero

    def count_volts(self, volts: float) -> int:
        """Return the count of the converter for a potential [V]: rounded, held within its range."""
        return min(max(round(volts * self.full_count / self.adc_volts), 0), self.full_count)

    def count_amperes(self, amperes: float) -> int:
        """Return the count of the converter for a drive current [A]: rounded, held within its range."""
        counts = (amperes + self.current_zero) * self.full_count / self.current_full_scale
        return min(max(round(counts), 0), self.full_count)


@dataclass(frozen=True, slots=True)
class Polarity:
    """The electrode of each pair that is at the supply; the other is at ground.

    The paper's figure 3 text and its eq. 13 agree only if r1 is the arc of B; then B is positive (eq. 13) and C is
    (eq. 21). A sensor that is wired the other way round is described here, not re-soldered.

    Raises:
        SensorError: another electrode is named.
    """

    radial: Literal["A", "B"] = "B"  #: "B" (end 1, the default) or "A" (end 2)
    angular: Literal["C", "D"] = "C"  #: "C" (the edge phi = wrap, the default) or "D" (the edge phi = 0)

    def __post_init__(self) -> None:
        if self.radial not in ("A", "B"):
            raise SensorError(f'polarity.radial must be "A" or "B", got {self.radial!r}')
        if self.angular not in ("C", "D"):
            raise SensorError(f'polarity.angular must be "C" or "D", got {self.angular!r}')


@dataclass(frozen=True, slots=True)
class Thresholds:
    """The levels from which a value counts; all of them are ratios.

    Attributes:
        touch_level: level from which an untouched sensor is touched.
        release_level: level below which a touched sensor is no longer touched.
        location_level: level from which the location of a touch is to be trusted.
        current_low: drive current of a phase that is too low, as a ratio of the normal one: an open wire.
        current_high: drive current of a phase that is too high, as a ratio of the normal one: a short.
        supply_tolerance: how far the supply may be from its nominal value, as a ratio of it.
        balance: how far the drive current of the touch phase may be from the current through the two pull-downs, as a
            ratio of the largest possible one.
        guide_spread: difference of the two guides of a phase from which on the location is not to be trusted
            (contacts far apart in both u and phi, or a fault), as a ratio of the supply.
        overshoot: how far outside the driven range a guide may be, as a ratio of the supply.

    Raises:
        SensorError: a ratio is outside its range, or two of them are in the wrong order.
    """

    touch_level: float = 0.10
    release_level: float = 0.05
    location_level: float = 0.20
    current_low: float = 0.5
    current_high: float = 2.0
    supply_tolerance: float = 0.10
    balance: float = 0.10
    guide_spread: float = 0.15
    overshoot: float = 0.02

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            top = math.inf if field.name == "current_high" else 1.0
            if not (math.isfinite(value) and 0.0 < value < top):
                raise SensorError(f"thresholds.{field.name} must be above 0 and below {top:g}, got {value!r}")
        if not self.release_level < self.touch_level <= self.location_level:
            raise SensorError(
                "thresholds must satisfy release_level < touch_level <= location_level, got "
                f"{self.release_level!r}, {self.touch_level!r}, {self.location_level!r}"
            )
        if not self.current_low < 1.0 < self.current_high:
            raise SensorError(
                f"thresholds must satisfy current_low < 1 < current_high, got {self.current_low!r} "
                f"and {self.current_high!r}"
            )


#: Full scale of the current over the untouched drive current, at least. A short is told from twice the current on;
#: presses on both sides of the seam raise the larger current to 1.5 times, the smaller one to 2.4 times.
HEADROOM = 2.2
SENSE_GAIN = 50.0  #: voltage gain of the amplifier between the shunt and the converter
_E24_SERIES = (
    *(1.0, 1.1, 1.2, 1.3, 1.5, 1.6, 1.8, 2.0, 2.2, 2.4, 2.7, 3.0),
    *(3.3, 3.6, 3.9, 4.3, 4.7, 5.1, 5.6, 6.2, 6.8, 7.5, 8.2, 9.1),
)
_E96_SERIES = tuple(round(10.0 ** (k / 96.0), 2) for k in range(96))  # IEC 60063; a shunt has 1 %
_SUPPLY_REFERENCES = (4.096, 3.0, 2.5, 2.048, 1.25, 1.024, 0.512)  # V; voltage references
_SUPPLY_SHARE = 0.8  # of the converter's range that the supply may take: its tolerance of 10 % stays inside
_MAX_DRIVE = 0.05  # A; what an operational amplifier drives
_MIN_COUNTS = 100.0  # of the smaller drive current
_MAX_BITS = 16
_MIN_PULLDOWN = 10e3  # ohm
_MAX_PULLDOWN = 100e3  # ohm; above it, a leak of a few hundred kilo-ohms looks like a touch
_PULLDOWN_RATIO = 2.0  # over the larger sheet resistance: a guide behind the whole sheet still sees two thirds


@dataclass(frozen=True, slots=True)
class GivenElectronics:
    """Electronics as far as they are given, with the attributes of `Electronics`; None: to be chosen."""

    supply_volts: float | None = None
    adc_volts: float = 3.3
    adc_bits: int | None = None
    pulldown_ohms: float | None = None
    input_ohms: float = 10e6
    lead_ohms: LeadOhms = _ONE_OHM
    current_full_scale: float | None = None
    current_zero: float = 0.0


def match_electronics(radial_ohms: float, angular_ohms: float, given: GivenElectronics | None = None) -> Electronics:
    """Choose the electronics for a sensor; none is ever refused here.

    * Supply: the largest reference within 80 % of the converter's range with which neither sheet draws more than 50 mA.
    * Full scale of the current: the shunt of E96, under 1 ohm of E24, that gives the least range above 2.2 times the
      larger drive current.
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
        fitting = [volts for volts in _SUPPLY_REFERENCES if volts <= _SUPPLY_SHARE * given.adc_volts] or [
            _SUPPLY_SHARE * given.adc_volts
        ]
        supply = next((volts for volts in fitting if volts <= _MAX_DRIVE * min(loops)), fitting[-1])
    largest, smallest = supply / min(loops), supply / max(loops)
    full_scale = given.current_full_scale
    if full_scale is None:
        bound = given.adc_volts / (SENSE_GAIN * HEADROOM * largest)
        shunt, _ = _of_series(_E96_SERIES if bound >= 1.0 else _E24_SERIES, bound)
        full_scale = given.adc_volts / (SENSE_GAIN * shunt)
    bits = given.adc_bits
    if bits is None:
        bits = 12
        while bits < _MAX_BITS and smallest / full_scale * ((1 << bits) - 1) < _MIN_COUNTS:
            bits += 2
    pulldown = given.pulldown_ohms
    if pulldown is None:
        _, needed = _of_series(_E24_SERIES, _PULLDOWN_RATIO * max(radial_ohms, angular_ohms))
        pulldown = min(max(needed, _MIN_PULLDOWN), _MAX_PULLDOWN, 0.1 * given.input_ohms)
    return Electronics(
        supply_volts=supply,
        adc_volts=given.adc_volts,
        adc_bits=bits,
        pulldown_ohms=pulldown,
        input_ohms=given.input_ohms,
        lead_ohms=leads,
        current_full_scale=full_scale,
        current_zero=given.current_zero,
    )


def shunt_ohms(electronics: Electronics) -> float:
    """Return the shunt that gives the full scale of the current with an amplifier of SENSE_GAIN [ohm]."""
    return electronics.adc_volts / (SENSE_GAIN * electronics.current_full_scale)


def _of_series(series: Sequence[float], ohms: float) -> tuple[float, float]:
    """Return the values of a series that are next to a resistance: not above it, and not below."""
    decade = 10.0 ** math.floor(math.log10(min(max(ohms, 1e-9), 1e12)))
    below = max((value for value in series if value * decade <= ohms), default=1.0)
    return below * decade, min((value for value in series if value * decade >= ohms), default=10.0) * decade
