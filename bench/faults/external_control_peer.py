"""Driver that moves an arm through Universal Robots' external_control.urscript, for bench `faults`.

external_control_peer.py HOST SCRIPT START GOAL servoj|speedj

SCRIPT is resources/external_control.urscript of Universal Robots' client library. Its placeholders are filled in here,
it is sent as the library does without a URCap, and the arm gets its setpoints over the library's reverse interface,
125 times a second. A line of JSON says that it moves, another that its program is gone; then it does nothing more.
"""

from __future__ import annotations

import json
import operator
import re
import select
import socket
import struct
import sys
import time
from collections.abc import Iterator
from pathlib import Path

VERSION = (5, 25, 0)  # of the controller that coneskin simulates
SPEED, ACCELERATION = 1.0, 2.0  # rad/s, rad/s2
PERIOD = 0.008  # s
SILENCE_TIME = 200  # ms for which the script waits for the next setpoint
JOINT_UNIT = 1_000_000  # of a number on the wire
MODES = {"servoj": 1, "speedj": 2}  # as in the script
SOCKETS = ("TRAJECTORY_SERVER", "SCRIPT_COMMAND_SERVER", "SERVER")  # in the order in which it opens them
_COMPARE = {"<": operator.lt, ">=": operator.ge}


def chosen_lines(text: str) -> Iterator[str]:
    """Yield the lines that are for this version: the script has conditions between them."""
    taken = [[True, True]]  # of each condition around: whether this branch is taken; whether one before it was
    for line in text.splitlines():
        tag = re.fullmatch(r"\s*\{% (if|elif|else|endif)(?: ROBOT_SOFTWARE_VERSION (<|>=) v([\d.]+))? %\}\s*", line)
        if tag is None:
            if all(branch for branch, _ in taken):
                yield line
            continue
        word, compare, version = tag.groups()
        holds = not version or _COMPARE[compare](VERSION, tuple(map(int, version.split("."))))
        if word == "if":
            taken.append([holds, holds])
        elif word == "endif":
            taken.pop()
        else:
            taken[-1] = [holds and not taken[-1][1], holds or taken[-1][1]]


def filled_in(text: str, ports: dict[str, int]) -> str:
    """Return the script as a program, with the ports of this process."""
    values: dict[str, object] = {f"{name}_PORT_REPLACE": port for name, port in ports.items()}
    values |= {
        "BEGIN_REPLACE": "",
        "JOINT_STATE_REPLACE": JOINT_UNIT,
        "TIME_REPLACE": 1000,
        "SERVER_IP_REPLACE": "127.0.0.1",
    }
    values["SERVO_J_REPLACE"] = "lookahead_time=0.03, gain=2000"  # as the library has them
    body = re.sub(r"\{\{(\w+)\}\}", lambda found: str(values[found[1]]), "\n".join(chosen_lines(text)))
    return "def external_control():\n" + body + "\nend\n"


def setpoint(mode: str, start: list[float], goal: list[float], seconds: float) -> list[float]:
    """Return joint positions, or speeds, after a time: speed up, go on with SPEED, never beyond the goal."""
    way = goal[0] - start[0]
    side = 1.0 if way > 0.0 else -1.0
    ramp = min(seconds, SPEED / ACCELERATION)
    gone = 0.5 * ACCELERATION * ramp * ramp + SPEED * (seconds - ramp)
    if mode == "servoj":
        return [start[0] + side * min(gone, abs(way)), *start[1:]]
    return [side * ACCELERATION * ramp if gone < abs(way) else 0.0, *([0.0] * 5)]


def main(host: str, script: str, start: str, goal: str, mode: str) -> None:
    listeners = {}
    for name in SOCKETS:
        listeners[name] = socket.create_server(("127.0.0.1", 0))
        listeners[name].settimeout(20.0)
    ports = {name: sock.getsockname()[1] for name, sock in listeners.items()}
    text = filled_in(Path(script).read_text(encoding="utf-8"), ports)
    with socket.create_connection((host, 30002), 5.0) as sender:
        sender.sendall(text.encode())
        connections = [listeners[name].accept()[0] for name in SOCKETS]
    reverse = connections[-1]
    reverse.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    print(json.dumps({"moves": time.monotonic()}), flush=True)
    begin = due = time.monotonic()
    try:
        while not select.select([reverse], [], [], 0)[0]:  # it sends nothing; readable is closed
            values = setpoint(mode, json.loads(start), json.loads(goal), time.monotonic() - begin)
            reverse.sendall(
                struct.pack(">8i", SILENCE_TIME, *(round(JOINT_UNIT * value) for value in values), MODES[mode])
            )
            due += PERIOD
            time.sleep(max(0.0, due - time.monotonic()))
    except OSError:
        pass
    print(json.dumps({"gone": time.monotonic()}), flush=True)
    sys.stdin.read()


if __name__ == "__main__":
    main(*sys.argv[1:])
