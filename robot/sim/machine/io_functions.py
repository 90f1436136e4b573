"""URScript functions of registers, inputs and outputs, and those that PolyScope writes from a robot's installation.

Modes of the tool's connector are told to clients. Nothing is wired to the tool's serial line, nobody pushes an arm in
freedrive, and the safety system does not choose how hard it goes to another mode: these take no effect.

Source: Universal Robots, "The URScript Programming Language", modules interfaces and motion.
"""

from __future__ import annotations

from collections.abc import Container
from typing import Any

from coneskin.robot.sim.urscript.values import ScriptError, number, show
from coneskin.robot.ur.rtde_codec import VARIABLES

from .inputs_outputs import CURRENT, VOLTAGE
from .script_host import ScriptHost

_REGISTERS, _BITS = 48, 128
_INPUT_ACTION_NAMES = ("pause", "stop", "ignore")


def index_of(address: Any, count: int) -> int:
    """Return the number of a register, an input or an output.

    Raises:
        ScriptError: there is none of that number.
    """
    if isinstance(address, str | list) or not 0 <= (index := int(address)) < count:
        raise ScriptError(f"a number from 0 to {count - 1} was expected, got {show(address)}")
    return index


class IoFunctions:
    """URScript functions of registers, inputs and outputs."""

    _host: ScriptHost

    # registers

    def read_input_integer_register(self, address: int) -> int:
        """Return an integer that a client wrote."""
        return self._host.inputs.read_command(index_of(address, _REGISTERS))

    def read_input_float_register(self, address: int) -> float:
        """Return a number that a client wrote."""
        name = f"input_double_register_{index_of(address, _REGISTERS)}"
        return float(self._host.inputs[name])  # type: ignore[arg-type]

    def read_input_boolean_register(self, address: int) -> bool:
        """Return a truth value that a client wrote."""
        return self._host.inputs.read_bit(index_of(address, _BITS))

    def read_output_integer_register(self, address: int) -> int:
        """Return an integer that a program wrote."""
        return self._host.output_ints[index_of(address, _REGISTERS)]

    def read_output_float_register(self, address: int) -> float:
        """Return a number that a program wrote."""
        return self._host.output_doubles[index_of(address, _REGISTERS)]

    def read_output_boolean_register(self, address: int) -> bool:
        """Return a truth value that a program wrote."""
        return bool(self._host.terminals.output_bits >> index_of(address, _BITS) & 1)

    def write_output_integer_register(self, address: int, value: Any) -> None:
        """Set an integer that clients can read."""
        if not -(2**31) <= int(value) < 2**31:
            raise ScriptError(f"an integer register holds 32 bits, got {value}")
        self._host.output_ints[index_of(address, _REGISTERS)] = int(value)

    def write_output_float_register(self, address: int, value: Any) -> None:
        """Set a number that clients can read."""
        self._host.output_doubles[index_of(address, _REGISTERS)] = float(value)

    def write_output_boolean_register(self, address: int, value: Any) -> None:
        """Set a truth value that clients can read."""
        bit = 1 << index_of(address, _BITS)
        terminals = self._host.terminals
        terminals.output_bits = terminals.output_bits | bit if value else terminals.output_bits & ~bit

    def rtde_set_watchdog(self, variable_name: Any, min_frequency: float, action: Any = "pause") -> None:
        """Choose what happens when a client writes a variable too rarely."""
        name, wanted = str(variable_name), str(action).lower()
        if name not in self._host.inputs or name not in VARIABLES:
            raise ScriptError(f"rtde_set_watchdog: there is no input {name[:99]!r}")
        if wanted not in _INPUT_ACTION_NAMES:
            raise ScriptError(f"rtde_set_watchdog: an action is {', '.join(_INPUT_ACTION_NAMES)}, got {wanted[:99]!r}")
        self._host.inputs.watch(name, float(min_frequency), wanted, self._host.cycle)

    # analog

    def get_standard_analog_in(self, n: int) -> float:
        """Return what is applied to an analog input [A or V]."""
        return self._host.terminals.analog_inputs[index_of(n, 2)]

    def get_tool_analog_in(self, n: int) -> float:
        """Return what is applied to an analog input of the tool [A or V]."""
        return self._host.terminals.analog_inputs[2 + index_of(n, 2)]

    def get_analog_in(self, n: int) -> float:
        """Return what is applied to an analog input [A or V]: 0-1 control box, 2-3 tool."""
        return self._host.terminals.analog_inputs[index_of(n, 4)]

    def get_standard_analog_out(self, n: int) -> float:
        """Return the level of an analog output, 0..1."""
        return self._host.terminals.ratios[index_of(n, 2)]

    get_analog_out = get_standard_analog_out

    def set_standard_analog_out(self, n: int, f: float) -> None:
        """Set the level of an analog output, 0..1."""
        if not 0.0 <= f <= 1.0:
            raise ScriptError(f"the level of an analog output is from 0 to 1, got {show(f)}")
        self._host.terminals.ratios[index_of(n, 2)] = float(f)

    set_analog_out = set_standard_analog_out

    def set_standard_analog_input_domain(self, port: int, domain: int) -> None:
        """Choose what an analog input measures: 0 a current, 1 a voltage."""
        self._host.terminals.input_domains[index_of(port, 2)] = (CURRENT, VOLTAGE)[index_of(domain, 2)]

    def set_tool_analog_input_domain(self, port: int, domain: int) -> None:
        """Choose what an analog input of the tool measures: 0 a current, 1 a voltage."""
        self._host.terminals.input_domains[2 + index_of(port, 2)] = (CURRENT, VOLTAGE)[index_of(domain, 2)]

    def set_analog_outputdomain(self, port: int, domain: int) -> None:
        """Choose what an analog output gives: 0 a current, 1 a voltage."""
        self._host.terminals.output_domains[index_of(port, 2)] = (CURRENT, VOLTAGE)[index_of(domain, 2)]

    def set_tool_voltage(self, voltage: int) -> None:
        """Set the supply of the tool: 0, 12 or 24 V."""
        if voltage not in (0, 12, 24):
            raise ScriptError(f"the supply of the tool is 0, 12 or 24 V, got {show(voltage)}")
        self._host.terminals.tool_voltage = int(voltage)

    def get_flag(self, n: int) -> bool:
        """Return a flag that the program has set."""
        return bool(self._host.terminals.flags >> index_of(n, 32) & 1)

    def set_flag(self, n: int, b: Any) -> None:
        """Set a flag, which stays when the program ends."""
        bit = 1 << index_of(n, 32)
        terminals = self._host.terminals
        terminals.flags = terminals.flags | bit if b else terminals.flags & ~bit

    # connector of the tool

    def set_tool_output_mode(self, mode: int) -> None:
        """Choose what the tool's digital outputs are: 0 two outputs, 1 a supply of both pins together."""
        self._host.terminals.tool_output_mode = int(_one_of(mode, (0, 1), "the mode of the tool's outputs"))

    def set_tool_digital_output_mode(self, n: int, mode: int) -> None:
        """Choose how an output of the tool drives: 1 sinking (NPN), 2 sourcing (PNP), 3 both (push and pull)."""
        index = index_of(n, 2)
        self._host.terminals.tool_drive_modes[index] = int(_one_of(mode, (1, 2, 3), "the mode of a tool output"))

    def set_tool_communication(
        self, enabled: Any, baud_rate: int, parity: int, stop_bits: int, rx_idle_chars: float, tx_idle_chars: float
    ) -> None:
        """Set up the tool's serial line, to which nothing is wired."""
        if not isinstance(enabled, bool):
            raise ScriptError(f"the tool's serial line is enabled by True or False, got {show(enabled)}")
        _one_of(baud_rate, _BAUD_RATES, "a baud rate of the tool [bit/s]")
        _one_of(parity, (0, 1, 2), "the parity (none, odd, even)")
        _one_of(stop_bits, (1, 2), "the number of stop bits")
        for name, value, least in (("rx_idle_chars", rx_idle_chars, 1.0), ("tx_idle_chars", tx_idle_chars, 0.0)):
            if not least <= number(value, name) <= 40.0:
                raise ScriptError(f"{name} is from {least:g} to 40, got {show(value)}")

    # actions of inputs

    def set_input_actions_to_default(self) -> None:
        """Take all actions from all inputs."""

    def set_standard_digital_input_action(self, port: int, action: Any) -> None:
        """Let a standard input switch freedrive, or nothing."""
        self._check_action(port, 8, action)

    set_configurable_digital_input_action = set_standard_digital_input_action

    def set_tool_digital_input_action(self, port: int, action: Any) -> None:
        """Let an input of the tool switch freedrive, or nothing."""
        self._check_action(port, 2, action)

    def set_gp_boolean_input_action(self, port: int, action: Any) -> None:
        """Let a boolean register that clients write switch freedrive, or nothing."""
        self._check_action(port, 128, action)

    def _check_action(self, port: Any, count: int, action: Any) -> None:
        index_of(port, count)
        _one_of(action, _INPUT_ACTIONS, "the action of an input")

    # safety

    def set_safety_mode_transition_hardness(self, type: Any) -> None:
        """Choose how the arm goes from one safety mode to another: 0 softly, 1 hard."""
        _one_of(type, (0, 1), "the hardness of a transition")


def _add_digital(infix: str, first: int, count: int) -> None:
    """Add the functions of digital inputs and outputs of one kind: ``get_{infix}digital_in`` and so on."""

    def get_in(self: IoFunctions, n: int) -> bool:
        return bool(self._host.terminals.digital_inputs >> first + index_of(n, count) & 1)

    def get_out(self: IoFunctions, n: int) -> bool:
        return bool(self._host.digital_outputs >> first + index_of(n, count) & 1)

    def set_out(self: IoFunctions, n: int, b: Any) -> None:
        self._host.set_digital(1 << first + index_of(n, count), bool(b))

    setattr(IoFunctions, f"get_{infix}digital_in", get_in)
    setattr(IoFunctions, f"get_{infix}digital_out", get_out)
    setattr(IoFunctions, f"set_{infix}digital_out", set_out)


for _infix, _first, _count in (("standard_", 0, 8), ("configurable_", 8, 8), ("tool_", 16, 2), ("", 0, 18)):
    _add_digital(_infix, _first, _count)

_BAUD_RATES = (9600, 19200, 38400, 57600, 115_200, 1_000_000, 2_000_000, 5_000_000)
_INPUT_ACTIONS = ("default", "freedrive")


def _one_of(value: Any, allowed: Container[Any], name: str) -> Any:
    if isinstance(value, list) or value not in allowed:
        raise ScriptError(f"{name} is one of {show(allowed).strip('()')}, got {show(value)}")
    return value
