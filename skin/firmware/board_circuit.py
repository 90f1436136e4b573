"""Circuit of a board: its parts and nets for one sensor, and what a scene must say about it.

Every foil wire has a clamp, a bead or a resistor, and a capacitor. Switches, not the controller's pins, join the
electrodes to the rail and to ground. The amplifier's reference is above 0 V, so that its offset shows whatever its
sign. What the parts are and may do is in parts.toml; all that a builder needs is made from the list of components.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from coneskin.core.errors import SensorError
from coneskin.skin.electronics import SENSE_GAIN, LeadOhms, shunt_ohms
from coneskin.skin.sensor import Sensor

from .boards import BUILT_IN, Board, BoardFacts, Converter, boards, converters, part_catalog

_WIRE_OHMS = 1.0  # of the wire of an electrode, with bead, plug and foil
_QUIET_BITS = 12  # with fewer, a converter without noise of its own reads the same count for ever
_BIAS_SHARE = 127.0 / 10127.0  # of 3.3 V, at the amplifier's reference pin
_INPUT_OHMS = 470e3  # 25 nA of warm clamps and switches lift a guide that floats by 12 mV; over 10 Mohm by 250 mV
PIN_OHMS = 30.0  #: of a controller's pin that holds a pull-down at ground, 25 to 40
_USUAL_SILENCE_MS = 50  # what a scene allows by default
_SPI_PINS = {"10": "CS", "11": "MOSI", "12": "MISO", "13": "SCK"}  # of an Uno or Nano
_FIXED_VOLTS = 2.5  # of the cheap regulator
_SHUNT_PARTS = ((10.0, "resistor"), (1.0, "low_shunt"), (0.0, "least_shunt"))  # from so many ohm on
_LIST_COLUMNS = "count,names,what,value,number,second source,EUR each,EUR,data sheet,limits not sourced"
WIRES = (  # of the cable, each electrode a pair: what drives it, and what reads it
    *(("E_A", "white"), ("S_A", "brown"), ("E_B", "green"), ("S_B", "yellow"), ("E_C", "grey"), ("S_C", "pink")),
    *(("E_D", "blue"), ("S_D", "red"), ("GND", "black, violet"), ("SHIELD", "braid, here only")),
)


class Component(NamedTuple):
    """One part on the board."""

    name: str  #: such as R12
    part: str  #: its table in parts.toml
    value: str  #: such as "10 kohm"; empty where the part says all
    group: str  #: what it belongs to, for the drawing
    pins: Mapping[str, str]  #: pin -> net


class BoardCircuit(NamedTuple):
    """A board wired to one sensor."""

    board: Board
    facts: BoardFacts
    sensor: Sensor  #: with the electronics as the board has them
    shunt_ohms: float
    pulldown_ohms: float  #: of the resistor itself
    converter: Converter | None  #: in place of the board's own

    @property
    def keys(self) -> dict[str, float | int | list[float]]:
        """What a sensor's table in a scene says of this board: it overrules the sensor's file."""
        parts = self.sensor.electronics
        return {
            "adc_v": parts.adc_volts,
            "adc_bits": parts.adc_bits,
            "lead_ohm": [float(f"{ohms:g}") for ohms in parts.lead_ohms],
            "supply_v": parts.supply_volts,
            "pulldown_ohm": round(parts.pulldown_ohms, 1),
            "input_ohm": parts.input_ohms,
            "current_full_scale_ma": round(1e3 * parts.current_full_scale, 4),
            "current_zero_ma": round(1e3 * parts.current_zero, 6),
        }

    @property
    def monitoring(self) -> dict[str, float | int]:
        """What the scene's table of limits has to say of this board; empty where nothing."""
        found: dict[str, float | int] = {}
        if self.converter is not None:
            if (silence := 4000 // self.converter.rate_hz) >= _USUAL_SILENCE_MS:  # four frames
                found["skin_silence_ms"] = silence
            if self.converter.bits < _QUIET_BITS:
                found["stuck_frames"] = 0
        if self.facts.clock_ppm > 100:
            found["clock_drift_ppm"] = self.facts.clock_ppm
        return found

    @property
    def words(self) -> str:
        """Options of a command that name this board."""
        return f"--board {self.board.name}" + (f" --converter {self.converter.name}" if self.converter else "")

    @property
    def clip_share(self) -> float:
        """Drive current at which the amplifier, on 3V3, ends: a part of the larger one."""
        sensor, volts = self.sensor, 3.3 - 1e-3 * float(part_catalog()["amplifier"]["limits"]["swing_mv"][1])
        most = volts / (SENSE_GAIN * self.shunt_ohms) - sensor.electronics.current_zero
        return most / max(sensor.radial_amperes, sensor.angular_amperes)

    @property
    def components(self) -> list[Component]:
        """Everything, the board that the sketch runs on first."""
        return list(_components(self))

    def part_list(self) -> str:
        """Return the bill of materials as CSV, a line for all alike, with a price for all of them [EUR]."""
        catalog, lines = part_catalog(), io.StringIO()
        alike: dict[tuple[str, str], list[str]] = {}
        strip = "pin_strip" if self.board.name == "uno" else "socket"
        others = [Component("W1", "cable", "3 m", "", {}), *(Component(f"X{k}", strip, "", "", {}) for k in (1, 2))]
        for component in self.components:
            if package := catalog[component.part].get("adapter"):
                others.append(Component(f"X{component.name}", "adapter", package, "", {}))
        for component in [*self.components, *others]:
            alike.setdefault((component.part, component.value), []).append(component.name)
        rows = csv.writer(lines, lineterminator="\n")
        rows.writerow(_LIST_COLUMNS.split(","))
        for (part, value), names in alike.items():
            row, count = catalog[part], len(names)
            told = row["what"], value, *_order_numbers(row, value), row["price"], f"{count * row['price']:.1f}"
            guessed = " ".join(name for name, where in row.get("sources", {}).items() if "not sourced" in where)
            rows.writerow((count, " ".join(names), *told, row["source"], guessed))
        return lines.getvalue()

    def kicad_netlist(self) -> str:
        """Return the netlist that KiCad's layout reads; pins by their footprints' numbers where those are known."""
        catalog = part_catalog()
        nets: dict[str, list[str]] = {}
        found: list[str] = []
        for name, part, value, _, pins in self.components:
            row = catalog[part]
            told = value or row["number"]
            found.append(f'    (comp (ref "{name}") (value "{told}") (footprint "{row["footprint"]}"))')
            for pin, net in pins.items():
                ends = (f'(node (ref "{name}") (pin "{number}"))' for number in row["pins"].get(pin, [pin]))
                nets.setdefault(net, []).extend(ends)
        at = enumerate(nets.items(), 1)
        listed = [f'    (net (code "{n}") (name "{net}") {" ".join(nodes)})' for n, (net, nodes) in at]
        return "\n".join(['(export (version "E")', "  (components", *found, "  )", "  (nets", *listed, "  ))", ""])

    @property
    def pins(self) -> dict[str, str]:
        """Pins of the board -> nets."""
        board, facts = self.board, self.facts
        found = {facts.five_volts: "5V", "3V3": "3V3", "GND": "GND"}
        if facts.logic_volts > 3.3 and self.converter is None:
            found["AREF"] = "3V3"
        if self.converter is not None:
            found |= _SPI_PINS if self.converter.pull_down else dict(zip(facts.i2c, ("SDA", "SCL"), strict=True))
        elif board.common:
            found |= {board.common: "MUX", **{pin: f"MUX_{k}" for k, pin in enumerate(board.select)}}
        else:
            channels = (*board.sense, board.current, board.supply)
            found |= {channel: f"ADC_{name}" for channel, name in zip(channels, "ABCDIS", strict=True)}
        for pins, net in ((board.rail, "HIGH_"), (board.ground, "LOW_")):
            found |= {pin: net + name for pin, name in zip(pins, "ABCD", strict=True)}
        found |= {pin: f"DOWN_{name}" for pin, name in zip(board.pull_down, "CD", strict=True)}
        return {facts.pin_prefix + pin if pin.isdecimal() else pin: net for pin, net in found.items()}


def toml_lines(values: Mapping[str, float | int | list[float]]) -> list[str]:
    """Return keys and values as lines of TOML."""
    return [f"{key} = {value}" for key, value in values.items()]


def _ohms_text(ohms: float) -> str:
    """Return a resistance with its unit, as in "10 kohm"."""
    for unit, name in ((1e6, "Mohm"), (1e3, "kohm")):
        if ohms >= unit:
            return f"{ohms / unit:g} {name}"
    return f"{ohms:g} ohm"


def board_circuit(name: str, sensor: Sensor, converter: str = BUILT_IN) -> BoardCircuit:
    """Work out the circuit of a board for a sensor.

    Args:
        sensor: as its design or its scene has it.
        converter: that stands in for the board's own, such as "ads1115".

    Raises:
        SensorError: there is no such board or converter, or it cannot drive or read this sensor.
    """
    table = boards()
    if name not in table:
        raise SensorError(f"board must be one of {', '.join(table)}, got {name!r}")
    board, facts = table[name], BoardFacts(**part_catalog()[name]["facts"])
    switch, limits = _switch_for(sensor)
    if switch == "low_switch" and facts.logic_volts > 3.3:
        raise SensorError(
            f"{sensor.name} needs switches of half an ohm, whose inputs stand 3.3 V, and the pins of a {facts.title} "
            f"have {facts.logic_volts:g} V: take another board"
        )
    shunt, supply = shunt_ohms(sensor.electronics), sensor.electronics.supply_volts
    if supply != _FIXED_VOLTS:  # what a resistor of E96 at 100 uA gives
        supply = float(f"{10.0 ** (round(96.0 * math.log10(supply)) / 96.0):.3g}")
    bits, volts, other = board.bits + 1, 3.3, None  # the sketch makes a reading of two conversions; 3.3 V at its AREF
    if converter == BUILT_IN and not board.sense:
        raise SensorError(
            f"the converter of an {facts.title} is dead below 0.14 V and bent by per cents, and places touches "
            "centimetres off: give it a converter, as with --converter ads1115"
        )
    if converter != BUILT_IN:
        known = converters()
        if converter not in known:
            raise SensorError(f"converter must be one of {', '.join([BUILT_IN, *known])}, got {converter!r}")
        other = known[converter]
        if other.pull_down and facts.logic_volts < 5.0:
            raise SensorError(
                f"an {other.name.upper()} answers with 5 V, and the pins of a {facts.title} have "
                f"{facts.logic_volts:g} V: take another board, or another converter"
            )
        *electrodes, current, rail = other.channels
        board = board._replace(sense=tuple(electrodes), current=current, supply=rail, select=(), common="")
        board = board._replace(pull_down=other.pull_down or board.pull_down)
        bits, volts = other.bits + other.extra_bits, other.volts
    if supply > (highest := 0.94 * min(volts, facts.logic_volts)):  # of what reads it, with 6 % for tolerances
        raise SensorError(f"{sensor.name}: supply_v is {supply:g}, the board takes {highest:.3g} V at most: lower it")
    ampere = 1.0 / (SENSE_GAIN * shunt)  # A for a volt
    lead, resistor = _WIRE_OHMS + limits["on_ohm"][0], sensor.electronics.pulldown_ohms
    inputs = max(_INPUT_OHMS, 10.0 * resistor)
    # what a guide of the touch phase sees: the way to the pin, and the input beside it. It is read at the foil, before
    # the lead that the model of the circuit puts there; a lead more makes up for that to 1e-4 of the scale
    pulldown = 1.0 / (1.0 / (resistor + PIN_OHMS + _WIRE_OHMS) + 1.0 / inputs) + lead
    electronics = replace(
        sensor.electronics,
        supply_volts=supply,
        adc_bits=bits,
        adc_volts=volts,
        current_full_scale=volts * ampere,
        current_zero=3.3 * _BIAS_SHARE * ampere,
        lead_ohms=LeadOhms.equal(lead),
        input_ohms=inputs,
        pulldown_ohms=pulldown,
    )
    fitted = replace(sensor, electronics=electronics)
    largest, most = max(fitted.radial_amperes, fitted.angular_amperes), 1e-3 * limits["most_ma"][1]
    if largest > most:
        raise SensorError(
            f"the switches of a board carry at most {1e3 * most:g} mA, and {sensor.name} draws "
            f"{1e3 * largest:.3g} mA: give the sheets a higher resistance, or a lower supply_v"
        )
    return BoardCircuit(board, facts, fitted, shunt, resistor, other)


def _order_numbers(row: Mapping[str, Any], value: str) -> tuple[str, str]:
    """Return the order numbers of a part with a value, such as "2.2 kohm": of the first maker, and of the second."""
    if "orders" in row:
        return tuple(row["orders"][value])
    if "{" not in row["number"]:
        return row["number"], row["second"]
    figure, unit = value.split()
    letter = {"ohm": "R", "kohm": "K", "Mohm": "M"}[unit]
    short = figure.replace(".", letter) if "." in figure else figure + letter
    long = f"{float(figure):#.3g}".replace(".", letter).removeprefix("0")
    return row["number"].format(short=short, long=long), row["second"].format(short=short, long=long)


def _switch_for(sensor: Sensor) -> tuple[str, dict[str, list[float]]]:
    """Return the switches for a sensor's current, by their table in parts.toml, and their limits."""
    catalog, drawn = part_catalog(), 1e3 * max(sensor.radial_amperes, sensor.angular_amperes)
    name = "switch" if drawn <= catalog["switch"]["limits"]["most_ma"][1] else "low_switch"
    return name, catalog[name]["limits"]


def _components(circuit: BoardCircuit) -> Iterator[Component]:
    parts, shunt, converter = circuit.sensor.electronics, circuit.shunt_ohms, circuit.converter
    count: dict[str, int] = {}
    group = "supply and current"

    def part(letter: str, kind: str, value: str = "", **pins: str) -> Component:
        count[letter] = count.get(letter, 0) + 1
        return Component(f"{letter}{count[letter]}", kind, value, group, {k.strip("_"): net for k, net in pins.items()})

    def two(letter: str, kind: str, value: str, one: str, other: str) -> Component:
        return part(letter, kind, value, _1=one, _2=other)

    def filtered(net: str, value: str, kind: str = "decoupling") -> Component:
        return two("C", kind, value, net, "GND")

    yield Component("A1", circuit.board.name, circuit.facts.title, "the board", circuit.pins)
    yield filtered("5V", "10 uF")
    if parts.supply_volts == _FIXED_VOLTS:
        yield part("U", "regulator", IN="5V", OUT="REG", GND="GND")
    else:
        unused = {"ILIM": "GND", "PGFB": "5V"}  # no limit of the current, no quick start
        yield part("U", "adjustable", IN="5V", EN="5V", OUT="REG", OUTS="REG", SET="SET", GND="GND", **unused)
        yield two("R", "precise", _ohms_text(round(1e4 * parts.supply_volts, 6)), "SET", "GND")
        yield filtered("SET", "4.7 uF")
    yield filtered("REG", "10 uF")
    kind = next(kind for ohms, kind in _SHUNT_PARTS if shunt >= ohms)
    yield two("R", kind, f"{shunt:.3g} ohm", "REG", "RAIL")
    amplifier = {"IN+": "REG", "IN-": "RAIL", "REF": "BIAS", "OUT": "AMP", "VS": "3V3", "GND": "GND"}
    yield part("U", "amplifier", **amplifier)
    yield filtered("3V3", "100 nF")
    yield two("R", "precise", "10 kohm", "3V3", "BIAS")
    yield two("R", "precise", "127 ohm", "BIAS", "GND")
    yield filtered("BIAS", "1 uF")
    for net, to in (("AMP", "ADC_I"), ("RAIL", "ADC_S")):
        yield two("R", "resistor", "1 kohm", net, to)
        yield filtered(to, "470 pF", "filter")
    group = "switches"
    switch = _switch_for(circuit.sensor)[0]
    supply = "3V3" if switch == "low_switch" else "5V"
    for common, gate in (("RAIL", "HIGH_"), ("GND", "LOW_")):
        channels = {f"S{k}": common for k in (1, 2, 3, 4)} | {f"D{k}": f"DRIVE_{e}" for k, e in enumerate("ABCD", 1)}
        gates = {f"SEL{k}": gate + e for k, e in enumerate("ABCD", 1)}
        yield part("U", switch, **channels, **gates, VDD=supply, GND="GND")
        yield filtered(supply, "100 nF")
        for e in "ABCD":
            yield two("R", "resistor", "100 kohm", gate + e, "GND")
    group = "clamps, at J1"
    for wire in "ES":
        yield part("U", "clamp", **{f"IO{k}": f"{wire}_{e}" for k, e in enumerate("ABCD", 1)}, GND="GND")
    for e in "ABCD":
        group = f"electrode {e}"
        yield two("FB", "bead", "", f"DRIVE_{e}", f"E_{e}")
        yield filtered(f"E_{e}", "220 pF", "filter")
        yield two("R", "precise", _ohms_text(parts.input_ohms), f"S_{e}", "GND")
        yield two("R", "resistor", "1 kohm", f"S_{e}", f"ADC_{e}")
        yield filtered(f"ADC_{e}", "470 pF", "filter")
        if e in "CD":
            yield two("R", "precise", _ohms_text(circuit.pulldown_ohms), f"DRIVE_{e}", f"DOWN_{e}")
    group = "converter"
    inputs = [f"ADC_{name}" for name in "ABCDIS"]
    if converter is not None and converter.pull_down:
        channels = {f"CH{k}": net for k, net in enumerate(inputs)} | {"CH6": "GND", "CH7/COM": "GND"}
        lines = {"SDI": "MOSI", "SDO": "MISO", "SCK": "SCK", "CS/CONV": "CS", "VREF": "VREF", "REFCOMP": "REFCOMP"}
        yield part("U", converter.name, **channels, **lines, VDD="5V", GND="GND")
        for net, value in (("5V", "100 nF"), ("VREF", "2.2 uF"), ("REFCOMP", "10 uF")):
            yield filtered(net, value)
    elif converter is not None:
        supply = "5V" if circuit.facts.logic_volts > 3.3 else "3V3"
        for address, nets in (("GND", inputs[:4]), (supply, inputs[4:])):
            channels = {f"AIN{k}": net for k, net in enumerate(nets)}
            yield part("U", converter.name, **channels, ADDR=address, SDA="SDA", SCL="SCL", VDD=supply, GND="GND")
            yield filtered(supply, "100 nF")
        for net in ("SDA", "SCL"):
            yield two("R", "resistor", "2.2 kohm", supply, net)
    elif circuit.board.common:
        numbers = (*circuit.board.sense, circuit.board.current, circuit.board.supply)
        channels = {f"S{int(n) + 1}": net for n, net in zip(numbers, inputs, strict=True)} | {"S7": "GND", "S8": "GND"}
        lines = {f"A{k}": f"MUX_{k}" for k in (0, 1, 2)}
        yield part("U", "multiplexer", **channels, **lines, D="MUX", EN="3V3", VDD="3V3", VSS="GND", GND="GND")
        yield filtered("3V3", "100 nF")
    group = "connector and test points"
    yield part("J", "connector", **{f"_{k}": net for k, (net, _) in enumerate(WIRES, 1)})
    yield two("R", "jumper", "", "SHIELD", "GND")
    for net in ("GND", "5V", "3V3", "RAIL", "AMP", "BIAS"):
        yield part("TP", "test_point", _1=net)
