"""Measure on a real arm, or on URSim, what coneskin assumes of its controller (docs/safety.md).

    python scripts/measure_controller.py 192.168.1.10

It turns the last joint by at most 0.3 rad at 0.2 rad/s, asks first, and ends in a protective stop, which a person
unlocks at the teach pendant. Nothing else may run on the controller; it must be in remote mode. About half a minute.
"""

from __future__ import annotations

import argparse
import json
import socket
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

from coneskin.core.errors import ConeSkinError, RobotTimeout
from coneskin.robot.driver.values import StopPath
from coneskin.robot.ur.input_writers import HeartbeatRegisters, heartbeat_lines, set_slider
from coneskin.robot.ur.rtde_connection import RtdeConnection
from coneskin.robot.ur.stop_sockets import StopSockets

_NAMES = ("timestamp", "actual_qd", "runtime_state", "safety_status_bits", "output_int_register_47")
_SPEED = 0.2  # rad/s of the last joint
_STANDS = 0.005  # rad/s
_PLAYING, _PROTECTIVE = 2, 1 << 2
_PATIENCE = 3.0  # s
_WAIT = "def coneskin_waits():\n  sleep(5.0)\nend\n"


@dataclass(frozen=True)
class Measurement:
    """One measured assumption.

    Attributes:
        name: of the measurement.
        assumed: what coneskin assumes.
        measured: what was seen.
        holds: True where that agrees.
    """

    name: str
    assumed: str
    measured: str
    holds: bool


class _Rig:
    """Connections to one controller, and its newest state."""

    def __init__(self, host: str) -> None:
        self.host = host
        self.sockets = StopSockets(host).__enter__()
        self._states = RtdeConnection(host).__enter__()
        self._recipe = self._states.ask_outputs(_NAMES)
        self._states.start()
        self._sign = 1.0
        self.speed, self.playing, self.protective, self.register = 0.0, False, False, 0

    def until(self, what: Callable[[], bool], timeout: float = _PATIENCE) -> float:
        """Wait for a state; return how long it took on this computer's clock [s], infinity where it did not come."""
        start = time.monotonic()
        while time.monotonic() - start < timeout:
            try:
                payload = self._states.wait_data(timeout)
            except RobotTimeout:
                break
            _, qd, runtime, bits, self.register = self._recipe.unpack(payload)  # type: ignore[assignment]
            assert isinstance(qd, tuple)
            assert isinstance(bits, int)
            self.speed = max(map(abs, qd))
            self.playing, self.protective = runtime == _PLAYING, bool(bits & _PROTECTIVE)
            if what():
                return time.monotonic() - start
        return float("inf")

    def stands(self) -> bool:
        return self.speed < _STANDS

    def rest(self) -> None:
        """End what runs, and see the arm stand."""
        self.sockets.use(StopPath.COMMAND, 2.0)
        self.until(lambda: self.stands() and not self.playing)

    def move(self, lines: str = "") -> float:
        """Turn the last joint, to and fro from call to call; return how long it took until it was at its speed [s]."""
        self.rest()
        self._sign = -self._sign
        first = "".join(f"  {line}\n" for line in lines.splitlines())
        speed = f"[0, 0, 0, 0, 0, {self._sign * _SPEED}]"
        self.sockets.run(f"def coneskin_moves():\n{first}  speedj({speed}, 2.0, 1.5)\n  stopj(2.0)\nend\n")
        return self.until(lambda: self.speed > 0.95 * _SPEED)

    def stopped_after(self, stop: Callable[[], object], timeout: float = 1.0) -> float:
        """Move, stop, and return how long it took until the arm stood [s]; infinity where it did not stop in time."""
        self.move()
        stop()
        return self.until(self.stands, timeout)

    def close(self) -> None:
        self._states.close()
        self.sockets.close()


def _ms(seconds: float) -> str:
    return "did not happen" if seconds == float("inf") else f"{1e3 * seconds:.0f} ms"


def _start(rig: _Rig) -> Measurement:
    rig.rest()
    rig.sockets.run(_WAIT)
    delay = rig.until(lambda: rig.playing)
    return Measurement("a program starts", "within escalate_ms (25 ms)", _ms(delay), delay < 0.025)


def _secondary(rig: _Rig) -> Measurement:
    rig.sockets.run(_WAIT)
    rig.until(lambda: rig.playing)
    wanted = rig.register + 1
    rig.sockets.run(f"sec coneskin_marks():\n  write_output_integer_register(47, {wanted})\nend\n")
    delay = rig.until(lambda: rig.register == wanted)
    beside = "beside the program" if rig.playing else "and the program ended"
    return Measurement("a secondary program runs beside", "yes", f"{_ms(delay)}, {beside}", delay < 1.0 and rig.playing)


def _replaced(rig: _Rig) -> Measurement:
    delay = rig.stopped_after(lambda: rig.sockets.run(_WAIT))
    return Measurement("an upload ends the motion", "at 10 rad/s2 or softer", _ms(delay), delay < 1.0)


def _program(rig: _Rig) -> Measurement:
    delay = rig.stopped_after(lambda: rig.sockets.use(StopPath.PROGRAM, 10.0))
    return Measurement("stopj in a program", "the arm stands", _ms(delay), delay < 0.5)


def _command(rig: _Rig) -> Measurement:
    delay = rig.stopped_after(lambda: rig.sockets.use(StopPath.COMMAND, 10.0))
    return Measurement("stop of the dashboard", "the arm stands", _ms(delay), delay < 0.5)


def _pause(rig: _Rig) -> Measurement:
    def pause() -> None:
        with socket.create_connection((rig.host, 29999), 2.0) as dashboard:
            dashboard.sendall(b"pause\n")
            dashboard.recv(1000)

    delay = rig.stopped_after(pause)
    return Measurement("pause of the dashboard", "the arm stands", _ms(delay), delay < 0.5)


def _slider(rig: _Rig) -> list[Measurement]:
    delay = rig.stopped_after(lambda: set_slider(rig.host, 0.0, 1.0))
    rig.rest()
    set_slider(rig.host, 1.0, 1.0)
    rig.until(lambda: rig.protective, 0.5)
    left = "protective stop" if rig.protective else "nothing"
    return [
        Measurement("the speed slider at 0", "the arm stands", _ms(delay), delay < 0.5),
        Measurement("the slider is raised again, without a program", "nothing", left, not rig.protective),
    ]


def _watchdog(rig: _Rig) -> Measurement:
    with HeartbeatRegisters(rig.host) as heartbeat:
        heartbeat.write(1)
        rig.move(heartbeat_lines(10.0))
        for count in range(2, 12):
            heartbeat.write(count)
            rig.until(lambda: False, 0.02)
        kept = rig.playing
        delay = rig.until(lambda: not rig.playing, 1.0)
    return Measurement("the watchdog ends a program", "0.1 s after the last beat", _ms(delay), kept and delay < 0.15)


def _protective(rig: _Rig) -> Measurement:
    rig.move()
    rig.sockets.run("sec coneskin_protective():\n  protective_stop()\nend\n")
    delay = rig.until(lambda: rig.protective, 1.0)
    stands = rig.until(rig.stands, 1.0)
    return Measurement(
        "protective_stop() in a secondary program",
        "works beside a motion",
        f"shown after {_ms(delay)}, standing {_ms(stands)} later",
        delay < 0.5,
    )


def measure(host: str) -> list[Measurement]:
    """Measure everything; the arm ends in a protective stop."""
    rig = _Rig(host)
    try:
        rig.until(lambda: True)
        found = [part(rig) for part in (_start, _secondary, _program, _replaced, _command, _pause, _watchdog)]
        rig.rest()
        found += _slider(rig)
        if not rig.protective:
            found.append(_protective(rig))
        return found
    finally:
        rig.sockets.use(StopPath.COMMAND, 10.0)
        rig.close()


def main() -> int:
    """Ask, measure, print; return 0 where all that is assumed holds."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("host", help="the controller, or URSim")
    parser.add_argument("--yes", action="store_true", help="do not ask before the arm moves")
    parser.add_argument("--json", action="store_true", help="print JSON")
    args = parser.parse_args()
    if not args.yes:
        print(f"The last joint of the arm at {args.host} will turn by up to 0.3 rad. The emergency stop is in reach?")
        if input('type "move" to go on: ').strip() != "move":
            return 1
    try:
        found = measure(args.host)
    except ConeSkinError as exc:
        print(exc, file=sys.stderr)
        return 1
    if args.json:
        print(json.dumps([asdict(one) for one in found], indent=1))
    else:
        for one in found:
            print(f"{'ok ' if one.holds else 'NO '} {one.name:46} assumed: {one.assumed:28} measured: {one.measured}")
    return 0 if all(one.holds for one in found) else 1


if __name__ == "__main__":
    sys.exit(main())
