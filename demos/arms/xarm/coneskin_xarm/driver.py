"""Driver of an xArm: the first tier. States come over the report of port 30000, which the maker's SDK decodes.

The stop is ``set_state(4)`` of the control port. The controller brakes with its own deceleration, and takes no motion
until a person, or a program, sets another state.
"""

import contextlib
import ctypes
import io
import math
import socket
import struct
import time
from collections.abc import Mapping
from typing import Any, ClassVar

from coneskin.core.channel import wait_readable
from coneskin.core.errors import RobotConnectionError, RobotRefused, RobotTimeout
from coneskin.robot.arm.kinematics import forward
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.driver.tcp import TcpReader, TcpStops
from coneskin.robot.driver.values import ControllerState, StopPath

with contextlib.redirect_stdout(io.StringIO()):  # the SDK prints its version, also into what a program reads
    from xarm.core.config.x_config import XCONF
    from xarm.x3.report import ReportDataStructure

_JOINTS = 6
_MODEL_TOLERANCE = 5e-3  # m at the flange, without a tool
_PRIVATE_PROTOCOL, _MOVING, _STOP = 2, 1, 4
_HEAD = struct.Struct(">3HB")  # transaction, protocol, length from here on, register
REPORT_SIZE = ctypes.sizeof(ReportDataStructure.create(XCONF.SocketConf.TCP_REPORT_RT_PORT))


def request(register: int, *values: int) -> bytes:
    """Return a request of the maker's protocol over the control port."""
    return _HEAD.pack(1, _PRIVATE_PROTOCOL, 1 + len(values), register) + bytes(values)


def report(payload: bytes) -> Any:
    """Return the report in a payload, as the SDK decodes it.

    Raises:
        RobotConnectionError: it is none.
    """
    if len(payload) != REPORT_SIZE or int.from_bytes(payload[:4]) != REPORT_SIZE:
        raise RobotConnectionError(f"a report of port 30000 must have {REPORT_SIZE} bytes and say so")
    found = ReportDataStructure.create(XCONF.SocketConf.TCP_REPORT_RT_PORT)
    found.update(payload)
    return found


class _Reports(TcpReader):
    port = XCONF.SocketConf.TCP_REPORT_RT_PORT

    def split(self, data: bytes) -> tuple[list[bytes], bytes]:
        whole = len(data) // REPORT_SIZE * REPORT_SIZE
        return [data[at : at + REPORT_SIZE] for at in range(0, whole, REPORT_SIZE)], data[whole:]


class _Stops(TcpStops):
    ports: ClassVar[Mapping[str, int]] = {"control": XCONF.SocketConf.TCP_CONTROL_PORT}

    def prove(self) -> None:
        self.ask()
        (sock,) = self.sockets().values()
        wait_readable([sock], self._timeout)
        try:
            answer = sock.recv(4096, socket.MSG_PEEK)
        except OSError:
            answer = b""
        if why := "it does not answer" if len(answer) < _HEAD.size else self.refusal("control", answer):
            raise RobotRefused(f"the controller {self.host} takes no stop: {why}")

    def ask(self) -> None:
        self.send("control", request(XCONF.UxbusReg.GET_STATE))

    def refusal(self, name: str, data: bytes) -> str:
        spoken = len(data) < _HEAD.size or _HEAD.unpack_from(data)[1] == _PRIVATE_PROTOCOL
        return "" if spoken else f"the {name} port of {self.host} speaks another protocol"

    def use(self, path: StopPath, deceleration: float) -> bool:  # noqa: ARG002 - the controller has its own
        return path is StopPath.COMMAND and self.send("control", request(XCONF.UxbusReg.SET_STATE, _STOP))


class _XArmDriver:
    lost_with: ClassVar[Mapping[str, frozenset[StopPath]]] = {"control": frozenset({StopPath.COMMAND})}

    def decode_state(self, time: float, payload: bytes) -> ControllerState:
        found = report(payload)
        q, qd = tuple(found.actual_joint_angle[:_JOINTS]), tuple(found.actual_joint_velocity[:_JOINTS])
        if not math.isfinite(sum(q) + sum(qd)):
            raise RobotConnectionError(f"a position or a speed is not finite: {q} rad, {qd} rad/s")
        return ControllerState(time, 1e-6 * found.timestamp, q, qd, True, False, found.state == _MOVING)

    def check_model(self, arm: ArmModel, host: str) -> None:
        with _Reports(host) as reader:
            end, payloads = time.monotonic() + 2.0, []
            while not payloads and time.monotonic() < end:
                wait_readable([reader], 0.1)
                payloads = reader.read()
        if not payloads:
            raise RobotTimeout(f"the controller {host} sends no report on port {_Reports.port}")
        found = report(payloads[-1])
        place = [1e-3 * value for value in found.actual_tcp_pose[:3]]
        apart = math.dist(place, forward(arm, found.actual_joint_angle[: arm.joints]).translation)
        if not apart <= _MODEL_TOLERANCE:
            raise RobotRefused(
                f"the flange of the arm at {host} is {1e3 * apart:.0f} mm from that of a {arm.name}: another arm, "
                "or a tool offset?"
            )

    def state_reader(self, host: str, timeout: float = 2.0) -> _Reports:
        return _Reports(host, timeout)

    def stop_connections(self, host: str, timeout: float = 2.0) -> _Stops:
        return _Stops(host, timeout)


DRIVER = _XArmDriver()
