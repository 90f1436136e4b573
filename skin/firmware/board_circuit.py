"""Circuit of a board: the values of its parts for one sensor, and what a scene must say about it."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from coneskin.core.errors import SensorError
from coneskin.skin.electronics import SENSE_GAIN, LeadOhms, shunt_ohms
from coneskin.skin.sensor import Sensor

from .boards import BOARD_FACTS, BUILT_IN, Board, BoardFacts, Converter, boards, converters

_SWITCH_OHMS = 2.0  # of an analog switch
_WIRE_OHMS = 1.0  # of the wire of an electrode
_QUIET_BITS = 12  # with fewer, a converter without noise of its own reads the same count for ever
_EXTRA_BITS = 1  # that the sketch's usual setting adds to the converter's: two conversions for a reading


class Part(NamedTuple):
    """A line of the bill of materials."""

    number: int
    what: str
    value: str
    where: str


class BoardCircuit(NamedTuple):
    """A board wired to one sensor."""

    board: Board
    facts: BoardFacts
    sensor: Sensor  #: with the electronics as the board has them
    shunt_ohms: float
    converter: Converter | None  #: in place of the board's own

    @property
    def supply_permille(self) -> int:
        """The rail, of the converter's range."""
        parts = self.sensor.electronics
        return round(1e3 * parts.supply_volts / parts.adc_volts)

    @property
    def keys(self) -> dict[str, float | int | list[float]]:
        """What a sensor's table in a scene says of this board: it overrules the sensor's file."""
        parts = self.sensor.electronics
        found: dict[str, float | int | list[float]] = {
            "adc_bits": parts.adc_bits,
            "lead_ohm": [float(f"{ohms:g}") for ohms in parts.lead_ohms],
            "supply_v": parts.supply_volts,
            "pulldown_ohm": parts.pulldown_ohms,
            "current_full_scale_ma": round(1e3 * parts.current_full_scale, 4),
        }
        return found if self.converter is None else {**found, "adc_v": parts.adc_volts}

    @property
    def monitoring(self) -> dict[str, float | int]:
        """What the scene's table of limits has to say of this board; empty where nothing."""
        found: dict[str, float | int] = {}
        if self.converter is not None:
            silence = 4000 // self.converter.rate_hz  # [ms], four frames
            found |= {"skin_silence_ms": silence, "skin_late_ms": silence}
            if self.converter.bits < _QUIET_BITS:
                found["stuck_frames"] = 0
        if self.facts.clock_ppm > 100:
            found["clock_drift_ppm"] = self.facts.clock_ppm
        return found

    @property
    def parts(self) -> list[Part]:
        """The bill of materials."""
        parts = self.sensor.electronics
        found = [
            Part(1, "board", self.facts.title, ""),
            Part(1, "voltage regulator, fixed, 50 mA or more", f"{parts.supply_volts:g} V", "from 3.3 V or 5 V"),
            Part(1, "shunt, 1 %", f"{self.shunt_ohms:.3g} ohm", "between the regulator and the rail"),
            Part(1, "current-sense amplifier", f"{SENSE_GAIN:g} V/V", "over the shunt, fed by 3.3 V"),
            Part(4, "analog switch, closed by a high gate", f"{_SWITCH_OHMS:g} ohm or less", "rail to A, B, C, D"),
            Part(4, "resistor", "100 kohm", "each gate of a switch to ground: open while the board starts"),
            Part(2, "resistor, 1 %", ohms_text(parts.pulldown_ohms), "C and D to their pull-down pins"),
            Part(4, "resistor", ohms_text(parts.input_ohms), "A, B, C, D to ground, at the channels"),
            Part(1, "capacitor", "1 uF", "regulator's output to ground, before the shunt"),
        ]
        if self.converter is not None:
            part, name = "converter, address pin to ground (0x48) and to its supply (0x49)", self.converter.name.upper()
            found.append(Part(2, part, name, "I2C pins of the board; fed by 5 V, or 3.3 V"))
        if self.board.common:
            found.append(Part(1, "analog multiplexer, 8 to 1", "", f"six channels to {self.board.common}"))
        return found

    @property
    def scene_lines(self) -> str:
        """What the scene says about this board, TOML."""
        lines = [
            "[[link.sensor]]              # beside its file, or its radii",
            *(f"{key} = {value_text(value)}" for key, value in self.keys.items()),
            "[source]",
            'kind = "serial"',
            'port = "/dev/ttyACM0"        # yours',
            f"baud = {self.board.baud}",
        ]
        if self.monitoring:
            lines += ["[monitoring]", *(f"{key} = {value_text(value)}" for key, value in self.monitoring.items())]
        return "\n".join(lines) + "\n"


def value_text(value: float | int | list[float]) -> str:
    """Return a value as TOML has it."""
    if isinstance(value, list):
        return f"[{', '.join(map(value_text, value))}]"
    return f"{value:.10g}"


def ohms_text(ohms: float) -> str:
    """Return a resistance with its unit, as in "10 kohm"."""
    for unit, name in ((1e6, "Mohm"), (1e3, "kohm")):
        if ohms >= unit:
            return f"{ohms / unit:g} {name}"
    return f"{ohms:g} ohm"


def board_circuit(name: str, sensor: Sensor, converter: str = BUILT_IN) -> BoardCircuit:
    """Work out the circuit of a board for a sensor.

    Args:
        name: of the board.
        sensor: as its design or its scene has it.
        converter: that stands in for the board's own, such as "ads1115".

    Raises:
        SensorError: there is no such board or converter, or it cannot drive or read this sensor.
    """
    table = boards()
    if name not in table:
        raise SensorError(f"board must be one of {', '.join(table)}, got {name!r}")
    board, facts = table[name], BOARD_FACTS[name]
    driven = _WIRE_OHMS + _SWITCH_OHMS
    ground = _WIRE_OHMS + facts.pin_ohms
    leads = LeadOhms(
        *((ground, driven) if sensor.b_positive else (driven, ground)),
        *((driven, ground) if sensor.c_positive else (ground, driven)),
    )
    shunt = shunt_ohms(sensor.electronics)
    other = None
    if converter == BUILT_IN:
        electronics = replace(sensor.electronics, adc_bits=board.bits + _EXTRA_BITS, lead_ohms=leads)
    else:
        known = converters()
        if converter not in known:
            raise SensorError(f"converter must be one of {', '.join([BUILT_IN, *known])}, got {converter!r}")
        other = known[converter]
        *electrodes, current, rail = other.channels
        board = board._replace(sense=tuple(electrodes), current=current, supply=rail, select=(), common="")
        electronics = replace(
            sensor.electronics,
            adc_bits=other.bits + other.extra_bits,
            adc_volts=other.volts,
            current_full_scale=other.volts / (SENSE_GAIN * shunt),  # by the same shunt
            lead_ohms=leads,
        )
    fitted = replace(sensor, electronics=electronics)
    largest = max(fitted.radial_amperes, fitted.angular_amperes)
    if largest > facts.pin_amperes:
        raise SensorError(
            f"the pins of a {facts.title} carry at most {1e3 * facts.pin_amperes:g} mA, and {sensor.name} draws "
            f"{1e3 * largest:.3g} mA: give the sheets a higher resistance, a lower supply_v, or take another board"
        )
    return BoardCircuit(board, facts, fitted, shunt, other)
