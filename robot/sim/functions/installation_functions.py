"""URScript functions that PolyScope writes before each program, from the robot's installation.

Modes of the tool's connector are told to clients. Nothing is wired to the tool's serial line, nobody pushes an arm in
freedrive, and the safety system does not choose how hard it goes to another mode: these take no effect.

Source: Universal Robots, "The URScript Programming Language", modules interfaces and motion.
"""

from __future__ import annotations

from collections.abc import Container
from typing import Any

from coneskin.robot.sim.urscript.values import ScriptError, number, show

from .io_functions import index_of
from .script_host import ScriptHost

__all__ = ["InstallationFunctions"]

_BAUD_RATES = (9600, 19200, 38400, 57600, 115_200, 1_000_000, 2_000_000, 5_000_000)
_INPUT_ACTIONS = ("default", "freedrive")


class InstallationFunctions:
    """URScript functions of a robot's installation."""

    _host: ScriptHost

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


def _one_of(value: Any, allowed: Container[Any], name: str) -> Any:
    if isinstance(value, list) or value not in allowed:
        raise ScriptError(f"{name} is one of {show(allowed).strip('()')}, got {show(value)}")
    return value
