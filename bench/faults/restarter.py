"""External program of bench `faults` that goes on whenever it is stopped.

faults_restarter.py HOST GOAL loop 20     an ordinary loop of ur_rtde: a move that fails starts the script again
faults_restarter.py HOST GOAL raw 20      the same raw program, sent again every 20 ms from a line of input on
"""

from __future__ import annotations

import json
import select
import socket
import sys
import time

SPEED, ACCELERATION = 1.0, 2.0


def loop(host: str, goal: list[float], wait: float) -> None:
    from rtde_control import RTDEControlInterface

    control = RTDEControlInterface(host)
    while True:
        if not control.moveJ(goal, SPEED, ACCELERATION):
            control.reuploadScript()
        time.sleep(wait)


def raw(host: str, goal: list[float], wait: float) -> None:
    sys.stdin.readline()
    program = f"def bench_move():\n  movej({goal}, a={ACCELERATION}, v={SPEED})\nend\n".encode()
    with socket.create_connection((host, 30003), 5.0) as sock:
        while True:
            sock.sendall(program)
            until = time.monotonic() + wait
            while (left := until - time.monotonic()) > 0.0 and select.select([sock], [], [], left)[0]:
                if not sock.recv(1 << 16):
                    return


if __name__ == "__main__":
    {"loop": loop, "raw": raw}[sys.argv[3]](sys.argv[1], json.loads(sys.argv[2]), 1e-3 * float(sys.argv[4]))
