"""Motions of bench `reaction`: under guard, by an external program, and bare, in a process without a guard.

python -m bench reaction-moves planner HOST            # lines on stdin: "prepare", or the side to move to
python -m bench reaction-moves baseline HOST MODE TOOL  # lines: [side, seconds to move before the stop, *q]
"""

from __future__ import annotations

import json
import math
import os
import select
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from typing import Any

from coneskin.core.errors import ConeSkinError
from coneskin.session.session import Session
from tests.support.scenes import START

MODES = ("moveJ", "moveL", "speedJ", "servoJ", "sync", "script")
EXTERNAL_MODES = ("sync", "script", "urcl")
URCL_MOVER = "CONESKIN_URCL_MOVER"  # environment variable: program and script of mode urcl, with a tab between
MOVE_REACH = 0.9  # rad of the base to both sides of START
SPEED, ACCELERATION, DECELERATION = 1.0, 20.0, 10.0
TOOL_SPEED, TOOL_ACCELERATION = 0.5, 10.0  # of moveL: about 0.8 rad/s of the base
CLOCK = time.monotonic


def goal(side: int) -> list[float]:
    return [START[0] + side * MOVE_REACH, *START[1:]]


def poses(tool: Sequence[float]) -> dict[int, list[float]]:
    """Return tool poses to both sides of the one at START, on a straight line along which the base turns it."""
    x, y, *rest = tool
    radius = math.hypot(x, y)
    return {side: [x - side * 0.35 * y / radius, y + side * 0.35 * x / radius, *rest] for side in (-1, 1)}


def servo_target(start: Sequence[float], side: int, seconds: float) -> list[float]:
    """Return the target after this time: speed up in 0.1 s, go on with SPEED, never farther than REACH."""
    ramp = min(seconds, 0.1)
    travel = SPEED * (0.5 * ramp * ramp / 0.1 + max(0.0, seconds - 0.1))
    return [min(max(start[0] + side * travel, START[0] - MOVE_REACH), START[0] + MOVE_REACH), *start[1:]]


def script(side: int) -> bytes:
    return f"def bench_move():\n  movej({goal(side)}, a={ACCELERATION}, v={SPEED})\nend\n".encode()


class GuardedArm:
    """Arm moved in a mode of the driver process, through the session."""

    def __init__(self, session: Session, mode: str, tool: Sequence[float]) -> None:
        self._arm, self._mode, self._poses = session.arm, mode, poses(tool)
        self._thread: threading.Thread | None = None

    def start(self, side: int, q: list[float]) -> None:
        match self._mode:
            case "moveJ":
                self._arm.move_j(goal(side), SPEED, ACCELERATION, wait=False)
            case "moveL":
                self._arm.move_l(self._poses[side], TOOL_SPEED, TOOL_ACCELERATION, wait=False)
            case "speedJ":
                self._arm.speed_j([side * SPEED, 0.0, 0.0, 0.0, 0.0, 0.0], ACCELERATION, duration=5.0)
            case _:
                self._thread = threading.Thread(target=self._stream, args=(side, q))
                self._thread.start()

    def _stream(self, side: int, q: list[float]) -> None:
        begin = due = CLOCK()
        with suppress(ConeSkinError):  # Collision: that is how it ends
            while CLOCK() - begin < 3.0:
                self._arm.servo_j(servo_target(q, side, CLOCK() - begin))
                due += 0.002
                time.sleep(max(0.0, due - CLOCK()))

    def over(self) -> None:
        if self._thread is not None:
            self._thread.join()
            self._thread = None


class ExternalArm:
    """Arm moved beside the guard: by a program in another process, or one in the controller."""

    def __init__(self, mode: str, host: str, stack: ExitStack) -> None:
        self._mode = mode
        self._child: Child | None = None
        if mode == "sync":
            self._child = stack.enter_context(Child(sys.executable, "-m", "bench.reaction.moves", "planner", host))
        elif mode == "urcl":
            program, text = os.environ[URCL_MOVER].split("\t")
            self._child = stack.enter_context(Child(program, host, text))
        self._raw = stack.enter_context(script_socket(host)) if mode == "script" else None

    def start(self, side: int, _q: list[float]) -> None:
        if self._raw is not None:
            self._raw.sendall(script(side))
        elif self._child is not None:
            self._child.ask("prepare")
            self._child.say(str(goal(side)[0] if self._mode == "urcl" else side))

    def over(self) -> None:
        if self._child is not None:
            self._child.hear()  # its moveJ has returned, because its program is gone


@contextmanager
def script_socket(host: str) -> Iterator[socket.socket]:
    with socket.create_connection((host, 30003), 5.0) as raw:
        raw.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        drained = threading.Event()
        thread = threading.Thread(target=_drain, args=(raw, drained), daemon=True)
        thread.start()
        yield raw
        drained.set()
        thread.join()


def _drain(raw: socket.socket, enough: threading.Event) -> None:
    """Discard what the controller sends: it must not be kept waiting."""
    while not enough.is_set():
        if select.select([raw], [], [], 0.1)[0] and not raw.recv(1 << 16):
            return


class Child:
    """Process that moves an arm: a line in, a line out."""

    def __init__(self, *command: str) -> None:
        self._command = command

    def __enter__(self) -> Child:
        self._process = subprocess.Popen(self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        try:
            self.hear()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()

    def say(self, line: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()

    def hear(self) -> list[float]:
        assert self._process.stdout is not None
        while line := self._process.stdout.readline():
            if line.startswith("="):  # the wheel prints lines of its own
                return [float(word) for word in line[1:].split()]
        raise RuntimeError("the process that moves the arm has ended")

    def ask(self, line: str) -> list[float]:
        self.say(line)
        return self.hear()


def answer(*values: float) -> None:
    print("=" + " ".join(map(repr, values)), flush=True)


def end_with_parent() -> None:
    """End this process soon after the one that started it: what is killed closes no child, and the wheel may block."""

    def watch(parent: int) -> None:
        while os.getppid() == parent:
            time.sleep(0.2)
        os._exit(1)

    threading.Thread(target=watch, args=(os.getppid(),), daemon=True).start()


def run_mover(host: str) -> None:
    """Make synchronous moves in a child, as a program that knows nothing of a guard."""
    import rtde_control

    control = rtde_control.RTDEControlInterface(host)
    answer()
    for line in sys.stdin:
        if line.strip() == "prepare":
            revive(control)
        else:
            control.moveJ(goal(int(line)), SPEED, ACCELERATION)
        answer()


def revive(control: Any) -> None:
    """Upload the control program again where a stop has replaced it, and wait until it runs."""
    while not control.isProgramRunning():
        control.reuploadScript()
        end = CLOCK() + 1.0
        while not control.isProgramRunning() and CLOCK() < end:
            time.sleep(0.005)


def run_baseline(host: str, mode: str, tool: list[float]) -> None:
    """Move in a child, wait so long, call the stop, and answer when it was called."""
    if mode in EXTERNAL_MODES:
        with ExitStack() as stack:
            arm, raw = ExternalArm(mode, host, stack), stack.enter_context(script_socket(host))
            stop = f"def bench_stop():\n  stopj({DECELERATION})\nend\n".encode()
            answer()
            for line in sys.stdin:
                side, wait, *q = json.loads(line)
                arm.start(side, q)
                time.sleep(wait)
                called = CLOCK()
                raw.sendall(stop)
                arm.over()
                answer(called)
        return
    import rtde_control

    control = rtde_control.RTDEControlInterface(host)
    targets = poses(tool)
    answer()
    for line in sys.stdin:
        side, wait, *q = json.loads(line)
        if mode == "moveJ":
            control.moveJ(goal(side), SPEED, ACCELERATION, True)
        elif mode == "moveL":
            control.moveL(targets[side], TOOL_SPEED, TOOL_ACCELERATION, True)
        elif mode == "speedJ":
            control.speedJ([side * SPEED, 0.0, 0.0, 0.0, 0.0, 0.0], ACCELERATION, 0.002)
        else:
            # the stop comes at any time between two targets, as it does under guard: the wheel sends it only when the
            # controller has taken the target before it
            begin = due = CLOCK()
            while (now := CLOCK() - begin) < wait:
                control.servoJ(servo_target(q, side, now), 0.0, 0.0, 0.002, 0.1, 300.0)
                due += 0.002
                time.sleep(max(0.0, min(due, begin + wait) - CLOCK()))
        if mode != "servoJ":
            time.sleep(wait)
        called = CLOCK()
        {"speedJ": control.speedStop, "servoJ": control.servoStop}.get(mode, control.stopJ)(DECELERATION)
        answer(called)


if __name__ == "__main__":
    end_with_parent()
    job, host, *rest = sys.argv[1:]
    if job == "planner":
        run_mover(host)
    else:
        run_baseline(host, rest[0], json.loads(rest[1]))
