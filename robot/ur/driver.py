"""Driver of Universal Robots arms, as ``coneskin.robot.driver.protocol`` describes one.

What a scene does not need is not imported, such as the writers of inputs.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from coneskin.core.finding import Finding
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.driver.protocol import ArmDriver, ExaminationScope
from coneskin.robot.driver.values import StopPath

from .rtde_codec import decode_state
from .rtde_connection import StateReader
from .stop_sockets import StopSockets

if TYPE_CHECKING:
    from .input_writers import HeartbeatRegisters, RegisterWriter, RtdeSpeedSlider
    from .program_io import RtdeOutputWriter, RtdeVariableReader


class _UrDriver:
    """Driver of the UR family."""

    process = "coneskin.robot.ur.driver_process"
    #: a protective stop is a program too, sent over the same connection
    lost_with: ClassVar[Mapping[str, frozenset[StopPath]]] = {
        "program": frozenset({StopPath.PROGRAM, StopPath.PROTECTIVE}),
        "command": frozenset({StopPath.COMMAND}),
        "slider": frozenset({StopPath.SLIDER}),
    }
    decode_state = staticmethod(decode_state)

    def decode_speed_fraction(self, payload: bytes) -> float:
        from .input_writers import decode_fraction

        return decode_fraction(payload)

    def check_model(self, arm: ArmModel, host: str) -> None:
        from .model_check import check_model, read_pose

        if (pose := read_pose(host)) is not None:
            check_model(arm, pose, host)

    def state_reader(self, host: str, timeout: float = 2.0) -> StateReader:
        return StateReader(host, timeout)

    def setpoint_writer(self, host: str) -> RegisterWriter:
        from .input_writers import RegisterWriter

        return RegisterWriter(host)

    def speed_slider(self, host: str, *, claim: bool = True) -> RtdeSpeedSlider:
        from .input_writers import RtdeSpeedSlider

        return RtdeSpeedSlider(host, claim=claim)

    def heartbeat_writer(self, host: str) -> HeartbeatRegisters:
        from .input_writers import HeartbeatRegisters

        return HeartbeatRegisters(host)

    def heartbeat_lines(self, frequency: float) -> str:
        from .input_writers import heartbeat_lines

        return heartbeat_lines(frequency)

    def decode_heartbeat(self, payload: bytes) -> int:
        from .input_writers import decode_echo

        return decode_echo(payload)

    def variable_reader(self, host: str) -> RtdeVariableReader:
        from .program_io import RtdeVariableReader

        return RtdeVariableReader(host)

    def output_writer(self, host: str) -> RtdeOutputWriter:
        from .program_io import RtdeOutputWriter

        return RtdeOutputWriter(host)

    def stop_connections(self, host: str, timeout: float = 2.0) -> StopSockets:
        return StopSockets(host, timeout)

    def examine(self, arm: ArmModel, host: str, scope: ExaminationScope) -> list[Finding]:
        from .examination import examine

        return examine(arm, host, scope)


UR_DRIVER: ArmDriver = _UrDriver()
