"""Inputs and outputs of the simulated controller: registers that clients write, their watchdogs, and terminals.

Digital terminals are numbered as in RTDE's words of bits: 0 to 7 standard, 8 to 15 configurable, 16 and 17 in the tool.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from coneskin.core.errors import RobotRefused
from coneskin.robot.ur.rtde_codec import VARIABLES, Value

#: registers in which ur_rtde writes the number of a command, with register offset 0 and 24
_COMMAND_REGISTERS = ("input_int_register_0", "input_int_register_24")


#: variables that clients may write, by the RTDE guide's table of inputs
INPUTS = frozenset(
    (
        *("speed_slider_mask", "speed_slider_fraction", "external_force_torque"),
        *(f"{kind}_digital_output{word}" for kind in ("standard", "configurable", "tool") for word in ("", "_mask")),
        *(f"standard_analog_output_{word}" for word in ("mask", "type", "0", "1")),
        *(name for name in VARIABLES if name.startswith("input_")),
    )
)


#: what an adapter for EtherNet/IP or PROFINET holds, by the RTDE guide: registers 0 to 23, and bits 0 to 31
_FIELDBUS_INPUTS = (
    "input_bit_registers0_to_31",
    *(f"input_{kind}_register_{number}" for kind in ("int", "double") for number in range(24)),
)


@dataclass(slots=True)
class InputWatchdog:
    """Watchdog that a client must feed by writing an input variable, as rtde_set_watchdog sets it."""

    variable: str  #: name of the input
    period: float  #: longest time between two writes [s]
    action: str  #: effect on the program when it expires: "pause", "stop" or "ignore"
    fed: int  #: cycle of the last write


class ClientInputs:
    """Inputs of one controller. They keep their values after the client that wrote them has gone.

    Args:
        log: takes an event and its facts.
        fieldbus: an adapter on a fieldbus holds the lower half of the registers.

    Attributes:
        values: name of an input -> its value.
        owners: name of an input -> the session that may write it.
        watchdogs: name of an input -> the watchdog on it.
        watchdog_delay: by which every watchdog is late [s].
        external_forces: whether a client's external_force_torque counts as the measured one.
    """

    def __init__(self, log: Callable[..., None], fieldbus: bool = False) -> None:
        self.owners: dict[str, object] = {}
        self.watchdogs: dict[str, InputWatchdog] = {}
        self.values: dict[str, Value] = dict.fromkeys(INPUTS, 0)
        self.values["external_force_torque"] = (0.0,) * 6
        if fieldbus:
            self.owners.update(dict.fromkeys(_FIELDBUS_INPUTS, "fieldbus"))
        self.external_forces = False
        self.watchdog_delay = 0.0
        self._log = log
        self._fresh = False  # a command register was written, and no program has read it

    def write(self, values: Mapping[str, Value], cycle: int) -> None:
        """Take the values of a client's data packet at a cycle, name -> value, in the order of its recipe."""
        self.values.update(values)
        for variable in self.watchdogs.keys() & values.keys():
            self.watchdogs[variable].fed = cycle
        for register in _COMMAND_REGISTERS:
            if register in values:
                command = values[register]
                self._fresh = True
                if command:
                    self._log("received", command=command, values=list(values.values())[1:])

    def read_command(self, address: int) -> int:
        """Read an integer input register as a program does; log when it takes a command."""
        value = int(self.values[f"input_int_register_{address}"])  # type: ignore[arg-type]
        if self._fresh and address in (0, 24):
            self._fresh = False
            if value:
                self._log("taken", command=value)
        return value

    def wrench(self) -> Sequence[float]:
        """Return force [N] and torque [N m] at the tool: those that a client gives instead of a sensor, or none."""
        if not self.external_forces:
            return (0.0,) * 6
        return self.values["external_force_torque"]  # type: ignore[return-value]

    def read_bit(self, index: int) -> bool:
        """Return a boolean input register: 0 to 63 are the bits of two words."""
        if index >= 64:
            return bool(self.values[f"input_bit_register_{index}"])
        word = "input_bit_registers0_to_31" if index < 32 else "input_bit_registers32_to_63"
        return bool(int(self.values[word]) >> index % 32 & 1)  # type: ignore[arg-type]

    def watch(self, variable: str, frequency: float, action: str, cycle: int) -> None:
        """Watch an input from a cycle on, as the script function rtde_set_watchdog does; 0 Hz ends it."""
        self.watchdogs.pop(variable, None)
        if frequency > 0.0:
            self.watchdogs[variable] = InputWatchdog(variable, 1.0 / frequency + self.watchdog_delay, action, cycle)


_VOLTAGE = 1  # domain of an analog terminal; 0 is a current
_OUTPUT_RANGES = ((0.004, 0.020), (0.0, 10.0))  # of an output at 0 and at 1, by its domain [A], [V]
_MAX_INPUTS = (0.020, 10.0)  # of an input, likewise
_DIGITAL, _ANALOG = 18, 4


def with_bits(word: int, bits: int, on: bool) -> int:
    """Return a word with some bits switched on or off."""
    return word | bits if on else word & ~bits


class Terminals:
    """Terminals of one controller but for its digital outputs.

    Attributes:
        digital_inputs: word of bits.
        analog_inputs: two of the control box and two of the tool [A or V].
        input_domains: what each of them measures: 0 a current, 1 a voltage.
        ratios: of the two analog outputs, 0..1.
        output_domains: what they give.
        output_bits: boolean registers that programs write, as one word of 128 bits.
        flags: of programs, as one word of bits.
        tool_voltage: supply of the tool: 0, 12 or 24 [V].
        tool_output_mode: of the tool's digital outputs: 0 two outputs, 1 a supply of both pins together.
        tool_drive_modes: how each of them drives: 1 sinking, 2 sourcing, 3 both.
    """

    def __init__(self) -> None:
        self.digital_inputs = 0
        self.analog_inputs = [0.0] * _ANALOG
        self.input_domains = [_VOLTAGE] * _ANALOG
        self.ratios = [0.0, 0.0]
        self.output_domains = [_VOLTAGE, _VOLTAGE]
        self.output_bits = 0
        self.flags = 0
        self.tool_voltage = 0
        self.tool_output_mode = 0
        self.tool_drive_modes = [1, 1]

    def apply_digital(self, index: int, on: bool) -> int:
        """Switch a digital input, as what is wired to it does; return the word of all.

        Raises:
            RobotRefused: there is none of that number.
        """
        if not 0 <= index < _DIGITAL:
            raise RobotRefused(f"a digital input is a number from 0 to {_DIGITAL - 1}, got {index}")
        self.digital_inputs = with_bits(self.digital_inputs, 1 << index, on)
        return self.digital_inputs

    def apply_analog(self, index: int, value: float) -> list[float]:
        """Apply a voltage [V] or a current [A] to an analog input; return those of all.

        Raises:
            RobotRefused: there is none of that number, or it cannot take the value.
        """
        if not 0 <= index < _ANALOG:
            raise RobotRefused(f"an analog input is a number from 0 to {_ANALOG - 1}, got {index}")
        largest = _MAX_INPUTS[self.input_domains[index]]
        if not 0.0 <= value <= largest:
            raise RobotRefused(f"analog input {index} takes 0 to {largest:g} V or A, got {value:g}")
        self.analog_inputs[index] = value
        return self.analog_inputs

    def write_analog(self, values: Mapping[str, Value]) -> None:
        """Take the analog outputs of a client's data packet: those whose bit is in its mask."""
        mask = values.get("standard_analog_output_mask", 0)
        for index in range(2):
            if int(mask) >> index & 1:  # type: ignore[arg-type]
                kind = int(values.get("standard_analog_output_type", 0))  # type: ignore[arg-type]
                self.output_domains[index] = kind >> index & 1
                ratio = float(values.get(f"standard_analog_output_{index}", 0.0))  # type: ignore[arg-type]
                self.ratios[index] = min(1.0, max(0.0, ratio))

    def analog_output(self, index: int) -> float:
        """Return what an analog output gives [A or V]."""
        low, high = _OUTPUT_RANGES[self.output_domains[index]]
        return low + self.ratios[index] * (high - low)

    def analog_types(self) -> int:
        """Return RTDE's analog_io_types: bits 0-1 inputs, 2-3 outputs of the control box; 1 for a voltage."""
        kinds = (*self.input_domains[:2], *self.output_domains)
        return sum(kind << bit for bit, kind in enumerate(kinds))

    def tool_types(self) -> int:
        """Return RTDE's tool_analog_input_types: bits 0-1; 1 for a voltage."""
        return self.input_domains[2] | self.input_domains[3] << 1


def digital_outputs(values: Mapping[str, Value]) -> Iterator[tuple[int, bool]]:
    """Return number and new state of each digital output that a client's data packet has in its masks."""
    for name, first in (("standard", 0), ("configurable", 8), ("tool", 16)):
        mask = int(values.get(f"{name}_digital_output_mask", 0))  # type: ignore[arg-type]
        wanted = int(values.get(f"{name}_digital_output", 0))  # type: ignore[arg-type]
        yield from ((first + bit, bool(wanted >> bit & 1)) for bit in range(8 if first < 16 else 2) if mask >> bit & 1)
