"""Terminals of the simulated control box and tool: what a test applies to them, and what programs put on them.

Digital ones are numbered as in RTDE's words of bits: 0 to 7 standard, 8 to 15 configurable, 16 and 17 in the tool.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from coneskin.core.errors import RobotRefused
from coneskin.robot.ur.rtde_codec import Value

__all__ = ["CURRENT", "VOLTAGE", "Terminals", "digital_outputs"]

CURRENT = 0  #: domain of an analog terminal
VOLTAGE = 1  #: the other
_RANGES = {CURRENT: (0.004, 0.020), VOLTAGE: (0.0, 10.0)}  # of an output at 0 and at 1 [A], [V]
_LARGEST = {CURRENT: 0.020, VOLTAGE: 10.0}  # of an input
_DIGITAL, _ANALOG = 18, 4


class Terminals:
    """Terminals of one controller but for its digital outputs.

    Attributes:
        digital_inputs: word of bits.
        analog_inputs: two of the control box and two of the tool [A or V].
        input_domains: what each of them measures: ``CURRENT`` or ``VOLTAGE``.
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
        self.input_domains = [VOLTAGE] * _ANALOG
        self.ratios = [0.0, 0.0]
        self.output_domains = [VOLTAGE, VOLTAGE]
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
        bit = 1 << index
        self.digital_inputs = self.digital_inputs | bit if on else self.digital_inputs & ~bit
        return self.digital_inputs

    def apply_analog(self, index: int, value: float) -> list[float]:
        """Apply a voltage [V] or a current [A] to an analog input; return those of all.

        Raises:
            RobotRefused: there is none of that number, or it cannot take the value.
        """
        if not 0 <= index < _ANALOG:
            raise RobotRefused(f"an analog input is a number from 0 to {_ANALOG - 1}, got {index}")
        largest = _LARGEST[self.input_domains[index]]
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
        low, high = _RANGES[self.output_domains[index]]
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
