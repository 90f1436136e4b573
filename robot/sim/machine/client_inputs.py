"""Inputs of the simulated controller that its clients write, and the watchdogs on them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from coneskin.robot.sim.motion.arm import CYCLE, SimulatedArm
from coneskin.robot.sim.urscript.values import values_of
from coneskin.robot.ur.rtde_codec import Value
from coneskin.robot.ur.rtde_variables import VARIABLES

__all__ = ["INPUTS", "ClientInputs", "InputWatchdog"]

#: registers in which ur_rtde writes the number of a command, with register offset 0 and 24
_COMMAND_REGISTERS = ("input_int_register_0", "input_int_register_24")
_GET_FORWARD_KINEMATICS = 44  #: number of that command of ur_rtde


#: variables that clients may write, by the RTDE guide's table of inputs
INPUTS = frozenset(
    (
        *("speed_slider_mask", "speed_slider_fraction", "external_force_torque"),
        *(f"{kind}_digital_output{word}" for kind in ("standard", "configurable", "tool") for word in ("", "_mask")),
        *(f"standard_analog_output_{word}" for word in ("mask", "type", "0", "1")),
        *(name for name in VARIABLES if name.startswith("input_")),
    )
)


@dataclass(slots=True)
class InputWatchdog:
    """Watchdog that a client must feed by writing an input variable, as rtde_set_watchdog sets it.

    Attributes:
        variable: name of the input.
        period: longest time between two writes [s].
        action: effect on the program when it expires: "pause", "stop" or "ignore".
        fed: cycle of the last write.
    """

    variable: str
    period: float
    action: str
    fed: int

    def expired(self, cycle: int) -> bool:
        """Return whether the last write is too long ago at a cycle."""
        return (cycle - self.fed) * CYCLE > self.period


class ClientInputs:
    """Inputs of one controller. They keep their values after the client that wrote them has gone.

    Args:
        arm: gives its active tool.
        fixed: True where ur_rtde's forward kinematics use the active tool (``Options.quirks``).
        log: takes an event and its facts.

    Attributes:
        owners: name of an input -> the session that may write it.
        watchdogs: name of an input -> the watchdog on it.
        external_forces: whether a client's external_force_torque counts as the measured one.
    """

    def __init__(self, arm: SimulatedArm, fixed: bool, log: Callable[..., None]) -> None:
        self.owners: dict[str, object] = {}
        self.watchdogs: dict[str, InputWatchdog] = {}
        self._values: dict[str, Value] = dict.fromkeys(INPUTS, 0)
        self._values["external_force_torque"] = (0.0,) * 6
        self.external_forces = False
        self._arm = arm
        self._fixed = fixed
        self._log = log
        self._fresh = False  # a command register was written, and no program has read it

    def __contains__(self, name: str) -> bool:
        """Return whether there is an input of a name."""
        return name in self._values

    def __getitem__(self, name: str) -> Value:
        """Return the value of an input."""
        return self._values[name]

    def write(self, values: Mapping[str, Value], cycle: int) -> None:
        """Take the values of a client's data packet at a cycle, name -> value, in the order of its recipe."""
        self._values.update(values)
        for variable in self.watchdogs.keys() & values.keys():
            self.watchdogs[variable].fed = cycle
        for register in _COMMAND_REGISTERS:
            if register in values:
                command = values[register]
                self._fresh = True
                if command:
                    self._log("received", command=command, values=list(values.values())[1:])
                if command == _GET_FORWARD_KINEMATICS and self._fixed:
                    self._fix_forward_kinematics(values)

    def _fix_forward_kinematics(self, names: Mapping[str, Value]) -> None:
        """Use the active tool where the packet has none, instead of what an earlier command left behind."""
        if "input_double_register_6" not in names:
            for i, value in enumerate(values_of(self._arm.tcp), 6):
                self._values[f"input_double_register_{i}"] = value

    def read_command(self, address: int) -> int:
        """Read an integer input register as a program does; log when it takes a command."""
        value = int(self._values[f"input_int_register_{address}"])  # type: ignore[arg-type]
        if self._fresh and address in (0, 24):
            self._fresh = False
            if value:
                self._log("taken", command=value)
        return value

    def wrench(self) -> Sequence[float]:
        """Return force [N] and torque [N m] at the tool: those that a client gives instead of a sensor, or none."""
        if not self.external_forces:
            return (0.0,) * 6
        return self._values["external_force_torque"]  # type: ignore[return-value]

    def read_bit(self, index: int) -> bool:
        """Return a boolean input register: 0 to 63 are the bits of two words."""
        if index >= 64:
            return bool(self._values[f"input_bit_register_{index}"])
        word = "input_bit_registers0_to_31" if index < 32 else "input_bit_registers32_to_63"
        return bool(int(self._values[word]) >> index % 32 & 1)  # type: ignore[arg-type]

    def watch(self, variable: str, frequency: float, action: str, cycle: int) -> None:
        """Watch an input from a cycle on, as the script function rtde_set_watchdog does; 0 Hz ends it."""
        self.watchdogs.pop(variable, None)
        if frequency > 0.0:
            self.watchdogs[variable] = InputWatchdog(variable, 1.0 / frequency, action, cycle)
