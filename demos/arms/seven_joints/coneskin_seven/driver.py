"""Driver of the arm: the first tier, enough to stop it whatever moves it."""

import math
import socket
from typing import ClassVar

from coneskin.core.errors import RobotConnectionError, RobotRefused
from coneskin.robot.arm.kinematics import forward
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.driver.tcp import TcpReader, TcpStops
from coneskin.robot.driver.values import ControllerState, StopPath

from .protocol import COMMAND_PORT, MARK, STATE, STATE_PORT

_MODEL_TOLERANCE = 1e-3  # m at the flange


class _States(TcpReader):
    port = STATE_PORT

    def split(self, data: bytes) -> tuple[list[bytes], bytes]:
        whole = len(data) // STATE.size * STATE.size
        return [data[at : at + STATE.size] for at in range(0, whole, STATE.size)], data[whole:]


class _Stops(TcpStops):
    ports: ClassVar = {"command": COMMAND_PORT}

    def prove(self) -> None:
        if (answer := ask(self.host, "stops?", self._timeout)) != "yes":
            raise RobotRefused(f"the controller {self.host} takes no stops: it answers {answer!r}")

    def ask(self) -> None:
        self.send("command", b"stops?\n")

    def refusal(self, name: str, data: bytes) -> str:
        words = data.decode("ascii", "replace").split()
        return f"the {name} port of {self.host} says {words}" if set(words) - {"yes", "ok"} else ""

    def use(self, path: StopPath, deceleration: float) -> bool:
        return path is StopPath.COMMAND and self.send("command", f"stop {deceleration!r}\n".encode())


class _SevenDriver:
    lost_with: ClassVar = {"command": frozenset({StopPath.COMMAND})}

    def decode_state(self, time: float, payload: bytes) -> ControllerState:
        if len(payload) != STATE.size or not payload.startswith(MARK):
            raise RobotConnectionError(f"a state must be {STATE.size} bytes with {MARK!r} before, got {payload[:20]!r}")
        _, clock, *joints, running = STATE.unpack(payload)
        if not math.isfinite(clock + sum(joints)):
            raise RobotConnectionError(f"the controller's clock, a position or a speed is not finite: {joints}")
        return ControllerState(time, clock, tuple(joints[:7]), tuple(joints[7:]), True, False, bool(running))

    def check_model(self, arm: ArmModel, host: str) -> None:
        x, y, z, *q = map(float, ask(host, "flange?", 2.0).split())
        if (apart := math.dist((x, y, z), forward(arm, q).translation)) > _MODEL_TOLERANCE:
            raise RobotRefused(f"the flange of the arm at {host} is {1e3 * apart:.1f} mm from that of a {arm.name}")

    def state_reader(self, host: str, timeout: float = 2.0) -> _States:
        return _States(host, timeout)

    def stop_connections(self, host: str, timeout: float = 2.0) -> _Stops:
        return _Stops(host, timeout)


def ask(host: str, line: str, timeout: float) -> str:
    """Return the controller's answer to a line, over a connection of its own."""
    try:
        with socket.create_connection((host, COMMAND_PORT), timeout) as sock:
            sock.sendall(line.encode() + b"\n")
            return sock.makefile().readline().strip()
    except OSError as exc:
        raise RobotConnectionError(f"the controller {host}:{COMMAND_PORT} does not answer: {exc}") from exc


DRIVER = _SevenDriver()
