"""URScript functions of registers, inputs and outputs, and those that PolyScope writes from a robot's installation.

Functions of devices that are not there (Modbus units, encoders, Euromap, screwdrivers) answer as a controller whose
device is not connected: a program goes on, and the log and every client of the primary interface are told once. Modes
of the tool's connector are told to clients. Nothing is wired to the tool's serial line, nobody pushes an arm in
freedrive, and the safety system does not choose how hard it goes to another mode: these take no effect.

Source: Universal Robots, "The URScript Programming Language", modules interfaces and motion.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Generator, Mapping
from typing import Any

from coneskin.robot.sim.urscript.value_functions import named
from coneskin.robot.sim.urscript.values import Array, PoseValue, ScriptError, Struct, make_list, number, show
from coneskin.robot.ur.rtde_codec import VARIABLES

from .inputs_outputs import with_bits
from .script_host import CallingProgram, ScriptHost

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


class AbsentHandle:
    """Handle of a device that is not there."""

    def call(self, _name: str, _arguments: Any, _host: ScriptHost) -> Generator[None, None, int]:
        """Return 0, whatever is called."""
        yield from ()
        return 0


class IoFunctions:
    """URScript functions of registers, inputs and outputs."""

    _host: ScriptHost
    _program: CallingProgram
    _tell_not_simulated: Callable[[str], None]

    # devices that are not there

    def modbus_add_signal(self, IP: Any, slave: int, address: int, type: int, name: Any, *rest: Any) -> None:
        """Add a signal of a Modbus unit: bits of types 0 and 1, else registers, so many as the second of the rest."""
        del IP, slave, address
        self._add_signal(name, False if type in (0, 1) else 0, rest[1] if len(rest) > 1 else 1)

    def modbus_add_rw_signal(self, IP: Any, slave: int, read: int, count: int, *rest: Any) -> None:
        """Add registers of a Modbus unit that are read and written."""
        del IP, slave, read
        self._add_signal(rest[2], 0, count)

    def _add_signal(self, name: Any, value: Any, count: Any) -> None:
        self._tell_not_simulated("modbus_add_signal: no unit is connected")
        self._program.signals[str(name)] = value if count == 1 else make_list([value] * int(count))

    def modbus_get_signal_status(self, name: Any, *_: Any) -> Any:
        """Return the value of a signal as it is before a unit has answered."""
        if str(name) not in self._program.signals:
            raise ScriptError(f"there is no Modbus signal {show(name)}")
        return self._program.signals[str(name)]

    def eip_writer_factory(self, name: Any, size: int) -> AbsentHandle:
        """Return a handle of data to a scanner of EtherNet/IP that is not there: its methods do nothing."""
        self._tell_not_simulated(f"EtherNet/IP: no scanner is connected to {show(name)} of {show(size)} bytes")
        return AbsentHandle()

    eip_reader_factory = eip_writer_factory

    # registers

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
        terminals = self._host.terminals
        terminals.output_bits = with_bits(terminals.output_bits, 1 << index_of(address, _BITS), bool(value))

    def rtde_set_watchdog(self, variable_name: Any, min_frequency: float, action: Any = "pause") -> None:
        """Choose what happens when a client writes a variable too rarely."""
        name, wanted = str(variable_name), str(action).lower()
        if name not in self._host.inputs.values or name not in VARIABLES:
            raise ScriptError(f"rtde_set_watchdog: there is no input {name[:99]!r}")
        if wanted not in _INPUT_ACTION_NAMES:
            raise ScriptError(f"rtde_set_watchdog: an action is {', '.join(_INPUT_ACTION_NAMES)}, got {wanted[:99]!r}")
        self._host.inputs.watch(name, float(min_frequency), wanted, self._host.cycle)

    # terminals

    def set_standard_analog_out(self, n: int, f: float) -> None:
        """Set the level of an analog output, 0..1."""
        if not 0.0 <= f <= 1.0:
            raise ScriptError(f"the level of an analog output is from 0 to 1, got {show(f)}")
        self._host.terminals.ratios[index_of(n, 2)] = float(f)

    set_analog_out = set_standard_analog_out

    def set_tool_voltage(self, voltage: int) -> None:
        """Set the supply of the tool: 0, 12 or 24 V."""
        if voltage not in (0, 12, 24):
            raise ScriptError(f"the supply of the tool is 0, 12 or 24 V, got {show(voltage)}")
        self._host.terminals.tool_voltage = int(voltage)

    def set_flag(self, n: int, b: Any) -> None:
        """Set a flag, which stays when the program ends."""
        terminals = self._host.terminals
        terminals.flags = with_bits(terminals.flags, 1 << index_of(n, 32), bool(b))

    def set_tool_output_mode(self, mode: int) -> None:
        """Choose what the tool's digital outputs are: 0 two outputs, 1 a supply of both pins together."""
        self._host.terminals.tool_output_mode = int(_one_of(mode, (0, 1), "the mode of the tool's outputs"))

    def set_tool_digital_output_mode(self, n: int, mode: int) -> None:
        """Choose how an output of the tool drives: 1 sinking (NPN), 2 sourcing (PNP), 3 both (push and pull)."""
        index = index_of(n, 2)
        self._host.terminals.tool_drive_modes[index] = int(_one_of(mode, (1, 2, 3), "the mode of a tool output"))


def add_host_functions(functions: Mapping[str, Callable[..., Any]]) -> None:
    """Add functions that are given the controller, and then what a program gives them."""

    def add(name: str, function: Callable[..., Any]) -> None:
        def call(self: IoFunctions, *values: Any, **by_name: Any) -> Any:
            return function(self._host, *values, **by_name)

        setattr(IoFunctions, name, call)

    for name, function in functions.items():
        add(name, named(name, function))


def _digital_functions(infix: str, first: int, count: int) -> dict[str, Callable[..., Any]]:
    """Return the functions of digital inputs and outputs of one kind, counted from the first."""
    return {
        f"get_{infix}digital_in": lambda host, n: bool(host.terminals.digital_inputs >> first + index_of(n, count) & 1),
        f"get_{infix}digital_out": lambda host, n: bool(host.digital_outputs >> first + index_of(n, count) & 1),
        f"set_{infix}digital_out": lambda host, n, b: host.set_digital(1 << first + index_of(n, count), bool(b)),
    }


def _choose_domain(domains: list[int], first: int, port: Any, domain: Any) -> None:
    """Choose what an analog terminal measures or gives: 0 a current, 1 a voltage."""
    domains[first + index_of(port, 2)] = index_of(domain, 2)


def _domain_function(domains: str, first: int) -> Callable[..., None]:
    """Return the function for two terminals, from a first one on, by the name of the list of their domains."""
    return lambda host, port, domain: _choose_domain(getattr(host.terminals, domains), first, port, domain)


#: function -> what it does with the controller; analog values are in A or V, levels of outputs from 0 to 1
_TERMINAL_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "get_rtde_value": lambda host, name: host.rtde_value(str(name)),
    "read_input_integer_register": lambda host, address: host.inputs.read_command(index_of(address, _REGISTERS)),
    "read_input_float_register": lambda host, address: float(
        host.inputs.values[f"input_double_register_{index_of(address, _REGISTERS)}"]
    ),
    "read_input_boolean_register": lambda host, address: host.inputs.read_bit(index_of(address, _BITS)),
    "read_output_integer_register": lambda host, address: host.output_ints[index_of(address, _REGISTERS)],
    "read_output_float_register": lambda host, address: host.output_doubles[index_of(address, _REGISTERS)],
    "read_output_boolean_register": lambda host, address: bool(
        host.terminals.output_bits >> index_of(address, _BITS) & 1
    ),
    "get_flag": lambda host, n: bool(host.terminals.flags >> index_of(n, 32) & 1),
    "get_analog_in": lambda host, n: host.terminals.analog_inputs[index_of(n, 4)],
    "get_standard_analog_in": lambda host, n: host.terminals.analog_inputs[index_of(n, 2)],
    "get_tool_analog_in": lambda host, n: host.terminals.analog_inputs[2 + index_of(n, 2)],
    **dict.fromkeys(
        ("get_standard_analog_out", "get_analog_out"), lambda host, n: host.terminals.ratios[index_of(n, 2)]
    ),
    "set_standard_analog_input_domain": _domain_function("input_domains", 0),
    "set_tool_analog_input_domain": _domain_function("input_domains", 2),
    "set_analog_outputdomain": _domain_function("output_domains", 0),
    **_digital_functions("standard_", 0, 8),
    **_digital_functions("configurable_", 8, 8),
    **_digital_functions("tool_", 16, 2),
    **_digital_functions("", 0, 18),
}
add_host_functions(_TERMINAL_FUNCTIONS)


def _add_absent(name: str, answer: Any) -> None:
    """Add a function of a device that is not there, or of what this arm has not: it takes anything."""

    def call(self: IoFunctions, *_: Any, **__: Any) -> Any:
        self._tell_not_simulated(name)
        return answer

    setattr(IoFunctions, name, call)


def _add_without_effect(name: str, parameters: Mapping[str, range | tuple[Any, ...] | None]) -> None:
    """Add a function that checks what it is given, and does nothing else."""

    def call(_: IoFunctions, *values: Any, **by_name: Any) -> None:
        given = dict(zip(parameters, values, strict=False)) | by_name
        if len(values) + len(by_name) > len(given) or not given.keys() <= parameters.keys():
            raise ScriptError(f"{name} takes {', '.join(parameters) or 'nothing'}")
        for parameter, allowed in parameters.items():
            value = given.get(parameter)
            if isinstance(allowed, range) and not allowed[0] <= number(value, parameter) <= allowed[-1]:
                raise ScriptError(f"{parameter} is from {allowed[0]} to {allowed[-1]}, got {show(value)}")
            if isinstance(allowed, tuple):
                _one_of(value, allowed, parameter)

    setattr(IoFunctions, name, call)


#: answer -> functions that give it
_ABSENT_DEVICES: tuple[tuple[Any, str], ...] = (
    (-0x20000, "modbus_get_error"),  # "disconnected" in the upper 16 bits
    (
        0,
        """encoder_get_tick_count encoder_unwind_delta_tick_count get_conveyor_tick_count read_port_register
        modbus_get_time_since_signal_invalid""",
    ),
    (1.0, "jerk_gain_scaling_get motion_version_get"),
    (False, "get_euromap_input get_euromap_output read_port_bit"),
    (Array((0.0,) * 3), "get_base_acceleration"),
    (PoseValue((0.0,) * 6), "path_offset_get"),
    (Struct(mass=0.0, cog=Array((0.0,) * 3)), "estimate_payload"),
    (
        None,
        """conveyor_pulse_decode encoder_enable_pulse_decode encoder_enable_set_tick_count encoder_set_tick_count
        end_screw_driving high_holding_torque_disable high_holding_torque_enable jerk_gain_scaling_set
        modbus_delete_signal modbus_request_update_signal_value modbus_reset_connection modbus_send_custom_command
        modbus_set_digital_input_action modbus_set_output_register modbus_set_output_signal
        modbus_set_runstate_dependent_choice modbus_set_signal_update_frequency modbus_set_signal_watchdog
        motion_version_set path_offset_disable path_offset_enable path_offset_set path_offset_set_alpha_filter
        path_offset_set_max_offset pause_on_error_code position_deviation_warning powerdown reset_revolution_counter
        screw_driving set_base_acceleration set_baselight_iec set_baselight_off set_baselight_solid
        set_conveyor_tick_count set_euromap_output set_euromap_runstate_dependent_choice
        set_runstate_configurable_digital_output_to_value set_runstate_configurable_digital_outputs
        set_runstate_gp_boolean_output_to_value set_runstate_outputs set_runstate_standard_analog_output_to_value
        set_runstate_standard_digital_output_to_value set_runstate_standard_digital_outputs
        set_runstate_tool_digital_output_to_value set_runstate_tool_digital_outputs stop_conveyor_tracking
        tool_wrench_limit_disable tool_wrench_limit_set track_conveyor_circular track_conveyor_linear write_port_bit
        write_port_register""",
    ),
)
_INPUT_ACTIONS = ("default", "freedrive")
_FREEDRIVE_PARAMETERS = {"freeAxes": None, "feature": None}
#: functions that change nothing a program or a client could see -> their parameters, and what these may be
NO_EFFECT: dict[str, Mapping[str, range | tuple[Any, ...] | None]] = {
    **{name: {} for name in ("end_force_mode", "end_freedrive_mode", "end_teach_mode", "teach_mode", "zero_ftsensor")},
    **dict.fromkeys(("freedrive_mode", "freedrive_mode_no_incorrect_payload_check"), _FREEDRIVE_PARAMETERS),
    "set_analog_inputrange": {"port": range(4), "range": range(5)},
    "set_configurable_digital_input_action": {"port": range(8), "action": _INPUT_ACTIONS},
    "set_gp_boolean_input_action": {"port": range(128), "action": _INPUT_ACTIONS},
    "set_input_actions_to_default": {},
    "set_safety_mode_transition_hardness": {"type": (0, 1)},
    "set_standard_digital_input_action": {"port": range(8), "action": _INPUT_ACTIONS},
    "set_tool_communication": {
        "enabled": (False, True),
        "baud_rate": (9600, 19200, 38400, 57600, 115_200, 1_000_000, 2_000_000, 5_000_000),
        "parity": (0, 1, 2),
        "stop_bits": (1, 2),
        "rx_idle_chars": range(1, 41),
        "tx_idle_chars": range(41),
    },
    "set_tool_digital_input_action": {"port": range(2), "action": _INPUT_ACTIONS},
    "varmsg": {"name": None, "value": None},
}
for _name, _parameters in NO_EFFECT.items():
    _add_without_effect(_name, _parameters)
for _answer, _names in _ABSENT_DEVICES:
    for _name in _names.split():
        _add_absent(_name, _answer)


def _one_of(value: Any, allowed: Container[Any], name: str) -> Any:
    if isinstance(value, list) or value not in allowed:
        raise ScriptError(f"{name} is one of {show(allowed).strip('()')}, got {show(value)}")
    return value
