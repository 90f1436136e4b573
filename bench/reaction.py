"""Collisions in bulk: touch -> frame -> stop on the wire -> slowdown -> standstill, beside the floor of a bare call.

    python bench/reaction.py [--collisions 2000] [--floors 500] [--modes moveJ,servoJ] [--keep rows.jsonl] [--json]

A simulated arm moves in one of the modes below; its virtual skin is touched at a random time; the guard stops it, and
is reset. In turns with that, in the same run, the same arm moves in the same way without coneskin and is stopped by the
bare call that the guard ends up making: ur_rtde's, or a program of one stopj on a socket that is open already. Both are
timed by the same reader of the controller's state, and judged by the same rule (robot/stop_watch.py).

    moveJ, moveL, speedJ, servoJ   through the guarded arm; moves are asynchronous on the wheel's side
    sync                           control = "foreign": a program of its own with ur_rtde's synchronous moveJ
    script                         control = "foreign": a raw URScript program

With --keep every collision is added to a file, and a run that was interrupted goes on from there. The exit code is 0
only if every touch has stopped the arm, and was called a touch. What it does not show: a real adapter, controller and
arm; the simulated controller takes what has come once in 2 ms.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
import random
import select
import socket
import subprocess
import sys
import tempfile
import threading
import time
from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from coneskin.errors import ConeSkinError
from coneskin.replay import read_run
from coneskin.robot.journal import Kind, decode_event
from coneskin.robot.sim_process import SimulatedController, free_host
from coneskin.robot.state_reader import StateReader, decode_state
from coneskin.robot.stop_watch import StopWatch, Way
from coneskin.scene_reader import parse_scene
from coneskin.session import Session, guard

MODES = ("moveJ", "moveL", "speedJ", "servoJ", "sync", "script")
FOREIGN = ("sync", "script")
EACH = 200  # collisions in a turn
HOME = [math.radians(q) for q in (-40.0, -90.0, 90.0, -90.0, -90.0, 0.0)]
REACH = 0.9  # rad of the base to both sides of HOME
SPEED, ACCELERATION, DECELERATION = 1.0, 20.0, 10.0
TOOL_SPEED, TOOL_ACCELERATION = 0.5, 10.0  # of moveL: about 0.8 rad/s of the base
SCENE = """\
[arm]
model = "UR5e"
host = "{host}"
control = "{control}"
[[link]]
name = "forearm"
[[link.sensor]]
radius1_mm = 37.6
radius2_mm = 37.2
height_mm = 260
xyz_mm = [0, 0, 80]
[source]
kind = "virtual"
[reaction]
kind = "stop"
deceleration_rad_s2 = 10
[watch]
skin_silence_ms = 250
skin_late_ms = 250
arm_silence_ms = 250
settle_ms = 10
"""
COLUMNS = (
    ("touch begins -> frame read", "touch_frame"),
    ("frame read -> stop sent", "frame_command"),
    ("stop sent -> come to the controller", "command_came"),
    ("stop sent -> slower", "command_slower"),
    ("frame read -> slower", "frame_slower"),
    ("stop sent -> standing", "command_standing"),
)
CLOCK = time.monotonic


# ---- the arm's ways to move


def goal(side: int) -> list[float]:
    return [HOME[0] + side * REACH, *HOME[1:]]


def poses(tool: Sequence[float]) -> dict[int, list[float]]:
    """Tool poses to both sides of the one at HOME, on a straight line the way that the base turns it."""
    x, y, *rest = tool
    radius = math.hypot(x, y)
    return {side: [x - side * 0.35 * y / radius, y + side * 0.35 * x / radius, *rest] for side in (-1, 1)}


def servo_target(start: Sequence[float], side: int, seconds: float) -> list[float]:
    """Speeds up in 0.1 s and then goes on with SPEED; never farther than REACH."""
    ramp = min(seconds, 0.1)
    way = SPEED * (0.5 * ramp * ramp / 0.1 + max(0.0, seconds - 0.1))
    return [min(max(start[0] + side * way, HOME[0] - REACH), HOME[0] + REACH), *start[1:]]


def script(side: int) -> bytes:
    return f"def bench_move():\n  movej({goal(side)}, a={ACCELERATION}, v={SPEED})\nend\n".encode()


class GuardedArm:
    """Moves the arm in an owner's mode, through the session."""

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
                self._arm.speed_j([side * SPEED, 0.0, 0.0, 0.0, 0.0, 0.0], ACCELERATION)
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


class ForeignArm:
    """Moves the arm beside the guard: by a program in another process, or one in the controller."""

    def __init__(self, mode: str, host: str, stack: ExitStack) -> None:
        self._child: Child | None = stack.enter_context(Child("--mover", host)) if mode == "sync" else None
        self._raw = stack.enter_context(script_socket(host)) if mode == "script" else None

    def start(self, side: int, _q: list[float]) -> None:
        if self._raw is not None:
            self._raw.sendall(script(side))
        elif self._child is not None:
            self._child.ask("prepare")
            self._child.say(str(side))

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
    """The controller may talk on this port, and must not be kept waiting."""
    while not enough.is_set():
        if select.select([raw], [], [], 0.1)[0] and not raw.recv(1 << 16):
            return


class Child:
    """This script again, in a process of its own: a line in, a line out."""

    def __init__(self, *arguments: str) -> None:
        self._command = [sys.executable, __file__, *arguments]

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


def run_mover(host: str) -> None:
    """In a child: synchronous moves of a program that knows nothing of a guard."""
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


def run_floor(host: str, mode: str, tool: list[float]) -> None:
    """In a child: move, wait so long, and call the stop; answers when it called."""
    if mode in FOREIGN:
        with ExitStack() as stack:
            arm, raw = ForeignArm(mode, host, stack), stack.enter_context(script_socket(host))
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
            begin = CLOCK()
            while (now := CLOCK() - begin) < wait:
                control.servoJ(servo_target(q, side, now), 0.0, 0.0, 0.002, 0.1, 300.0)
                time.sleep(max(0.0, min(0.002 - (CLOCK() - begin - now), begin + wait - CLOCK())))
        if mode != "servoJ":
            time.sleep(wait)
        called = CLOCK()
        {"speedJ": control.speedStop, "servoJ": control.servoStop}.get(mode, control.stopJ)(DECELERATION)
        answer(called)


# ---- one turn: some collisions under guard, or some bare stops


def chosen(simulated: SimulatedController, mode: str, rng: random.Random) -> tuple[int, float, list[float]]:
    """The side with more room, how long to move before the stop [s], and where the arm is."""
    q = simulated.wait_standing()["q"]
    side = -1 if q[0] > HOME[0] else 1
    speeding_up = 0.15 if mode == "servoJ" else 0.10  # the arm lags behind its targets
    return side, speeding_up + 0.08 * rng.random(), q


def guarded_turn(mode: str, count: int, rng: random.Random) -> list[dict[str, Any]]:
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        host, log = free_host(), folder / "log.jsonl"
        simulated = stack.enter_context(SimulatedController("UR5e", host, HOME, log=log))
        control = "foreign" if mode in FOREIGN else "owner"
        scene = parse_scene(SCENE.format(host=host, control=control))
        session = stack.enter_context(guard(scene, recording=folder / "run.rec"))
        arm = ForeignArm(mode, host, stack) if mode in FOREIGN else GuardedArm(session, mode, simulated.state()["tcp"])
        touched, before = [], 0
        for _ in range(count):
            side, wait, q = chosen(simulated, mode, rng)
            arm.start(side, q)
            time.sleep(wait)
            touched.append(session.touch(0.02 + 0.22 * rng.random(), 6.2 * rng.random(), force=20.0, duration=0.04))
            for name in ("latched", "touch_ended"):
                if session.wait_for((name,), 10.0, after=before) is None:
                    raise RuntimeError(f"no {name} within 10 s: {[e.name for e in session.events[before:]]}")
            arm.over()
            before = len(session.events)
            reset(session)
        session.close()
        return read_turn(mode, folder / "run.rec", touched, came(mode, simulated))


def reset(session: Session) -> None:
    """Reset as soon as it is allowed: the skin must be quiet for some frames."""
    end = CLOCK() + 10.0
    while True:
        try:
            session.reset()
            return
        except ConeSkinError:
            if CLOCK() > end:
                raise
            time.sleep(0.005)


def came(mode: str, simulated: SimulatedController) -> list[float]:
    """When a stop came to the controller, in order [s]."""
    if mode in FOREIGN:
        return [e["monotonic"] for e in simulated.events("script") if "stop" in e["first_line"]]
    return [e["monotonic"] for e in simulated.events("received") if e["command"] == STOP_COMMANDS[mode]]


#: numbers of ur_rtde 1.6.5's own protocol: stopJ, speedStop, servoStop
STOP_COMMANDS = {"moveJ": 34, "moveL": 34, "speedJ": 15, "servoJ": 16}


def read_turn(mode: str, path: Path, touched: list[float], arrivals: list[float]) -> list[dict[str, Any]]:
    """The times of each collision, from the recording."""
    run = read_run(path)
    states = [decode_state(b.time, b.payload) for b in run.blocks if b.kind == Kind.ARM]
    samples = [(state.time, state.speed) for state in states]
    commands = [b.time for b in run.blocks if b.kind == Kind.COMMAND and b.payload[:7] in (b"owner\nS", b"script\n")]
    events = [decode_event(b) for b in run.blocks if b.kind == Kind.EVENT]
    rows = []
    for number, begin in enumerate(touched):
        end = touched[number + 1] if number + 1 < len(touched) else math.inf
        mine = [event for event in events if begin <= event.time < end]
        stop = next((event for event in mine if event.name == "stopping"), None)
        if stop is None:
            rows.append({"mode": mode, "who": "guard", "missed": True, "events": [event.name for event in mine]})
            continue
        frame = stop.time  # when the bytes were read that made it stop
        command = commands[bisect_left(commands, frame)]
        row = follow(mode, "guard", command, samples, arrivals, since=frame)
        row |= {"touch_frame": frame - begin, "frame_command": command - frame}
        row["frame_slower"] = row["command_slower"] + command - frame
        row["called"] = stop.details["why"]
        row["escalated"] = sum(event.name == "escalated" for event in mine)
        rows.append(row)
    return rows


def floor_turn(mode: str, count: int, rng: random.Random) -> list[dict[str, Any]]:
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        host, log = free_host(), folder / "log.jsonl"
        simulated = stack.enter_context(SimulatedController("UR5e", host, HOME, log=log))
        reader = stack.enter_context(StateReader(host))
        child = stack.enter_context(Child("--floor", host, mode, json.dumps(simulated.state()["tcp"])))
        samples: list[tuple[float, float]] = []
        over = threading.Event()
        thread = threading.Thread(target=read_states, args=(reader, samples, over))
        thread.start()
        stack.callback(thread.join)
        stack.callback(over.set)
        called = []
        for _ in range(count):
            side, wait, q = chosen(simulated, mode, rng)
            called += child.ask(json.dumps([side, wait, *q]))
            simulated.wait_standing()
            time.sleep(0.05)
        arrivals = came(mode, simulated)
        return [follow(mode, "floor", call, samples, arrivals, since=call) for call in called]


def read_states(reader: StateReader, samples: list[tuple[float, float]], over: threading.Event) -> None:
    while not over.is_set():
        select.select([reader], [], [], 0.1)
        for payload in reader.read():
            state = decode_state(CLOCK(), payload)
            samples.append((state.time, state.speed))


def follow(
    mode: str, who: str, command: float, samples: list[tuple[float, float]], arrivals: list[float], since: float
) -> dict[str, Any]:
    """How a stop went on after it was sent [s], by the guard's own rule for slower and standing.

    The first arrival since then counts: a stop may be there before its send has returned.
    """
    at = bisect_left(samples, (command, 0.0))
    speed = samples[at - 1][1]
    watch = StopWatch(command, speed, (Way.OWNER,), 9.0, 9.0, 0.01)
    for time_, value in samples[at:]:
        watch.sample(time_, value)
        if watch.standing_at is not None:
            break
    if watch.slowed_at is None or watch.standing_at is None:
        raise RuntimeError(f"{mode}: the arm did not stand after a stop of the {who}")
    arrival = bisect_left(arrivals, since)
    return {
        "mode": mode,
        "who": who,
        "speed": speed,
        "command_came": arrivals[arrival] - command if arrival < len(arrivals) else math.nan,
        "command_slower": watch.slowed_at - command,
        "command_standing": watch.standing_at - command,
    }


# ---- all of it, and the table


def quantile(values: Sequence[float], share: float) -> float:
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else math.nan


def summary(rows: list[dict[str, Any]], mode: str) -> dict[str, Any]:
    """Quantiles [ms] of each column, for the guard and for the floor, and what the guard adds."""
    found: dict[str, Any] = {"mode": mode}
    for who in ("guard", "floor"):
        mine = [row for row in rows if row["mode"] == mode and row["who"] == who]
        good = [row for row in mine if not row.get("missed")]
        found[who] = {"count": len(mine), "missed": len(mine) - len(good)}
        found[who]["misnamed"] = sum(row.get("called", "touch") != "touch" for row in good)
        found[who]["escalated"] = sum(bool(row.get("escalated")) for row in good)
        for _, key in COLUMNS:
            values = [1e3 * row[key] for row in good if key in row and math.isfinite(row[key])]
            if values:
                found[who][key] = [round(quantile(values, share), 3) for share in (0.5, 0.99, 0.999)]
    if found["guard"].get("frame_slower") and found["floor"].get("command_slower"):
        pairs = zip(found["guard"]["frame_slower"], found["floor"]["command_slower"], strict=True)
        found["added"] = [round(a - b, 3) for a, b in pairs]
    return found


def show(rows: list[dict[str, Any]], modes: Sequence[str]) -> None:
    print(f"{'ms: median / p99 / p99.9':48}{'guard':>27}{'bare call':>27}")
    for mode in modes:
        found = summary(rows, mode)
        counts = [f"{found[who]['count']}" for who in ("guard", "floor")]
        print(f"\n{mode:48}{counts[0]:>27}{counts[1]:>27}")
        for words, key in COLUMNS:
            cells = [found[who].get(key) for who in ("guard", "floor")]
            print(f"  {words:46}" + "".join(f"{cell(values):>27}" for values in cells))
        print(f"  {'added: frame -> slower, over call -> slower':46}{cell(found.get('added')):>27}")
        guarded = found["guard"]
        print(f"  did not stop: {guarded['missed']}; stopped, but called a fault: {guarded['misnamed']}; ", end="")
        print(f"needed a second way to stop: {guarded['escalated']}")


def cell(values: Sequence[float] | None) -> str:
    return " / ".join(f"{value:.2f}" for value in values) if values else "-"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--collisions", type=int, default=2000, help="in each mode (%(default)s)")
    parser.add_argument("--floors", type=int, help="bare calls in each mode (as many)")
    parser.add_argument("--modes", default=",".join(MODES), help="(%(default)s)")
    parser.add_argument("--keep", type=Path, metavar="FILE", help="add each collision to this file; go on from it")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--mover", metavar="HOST", help=argparse.SUPPRESS)
    parser.add_argument("--floor", nargs=3, metavar=("HOST", "MODE", "TOOL"), help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.mover:
        run_mover(args.mover)
        return 0
    if args.floor:
        host, mode, tool = args.floor
        run_floor(host, mode, json.loads(tool))
        return 0
    modes = args.modes.split(",")
    if unknown := set(modes) - set(MODES):
        parser.error(f"no such mode: {', '.join(sorted(unknown))}; there are {', '.join(MODES)}")
    machine = f"{platform.platform()}, {os.cpu_count()} cores, Python {platform.python_version()}"
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], cwd=Path(__file__).parent, capture_output=True, text=True
    )
    head = f"{machine}\ncommit {commit.stdout.strip()}, {datetime.now(UTC):%F %R} UTC, load {os.getloadavg()[0]:.1f}"
    rows = [json.loads(line) for line in args.keep.read_text().splitlines()] if args.keep and args.keep.exists() else []
    try:
        measure(modes, args, rows)
    except KeyboardInterrupt:
        print("\ninterrupted: this is what was measured", file=sys.stderr)
    if args.json:
        print(json.dumps({"machine": head, "modes": [summary(rows, mode) for mode in modes]}))
    else:
        print(head + "\n")
        show(rows, modes)
    return 1 if any(row.get("missed") or row.get("called", "touch") != "touch" for row in rows) else 0


def measure(modes: Sequence[str], args: argparse.Namespace, rows: list[dict[str, Any]]) -> None:
    """All modes in turns, so that a busy machine is busy for all."""
    rng = random.Random(args.seed + len(rows))
    turns: tuple[tuple[str, Callable[..., list[dict[str, Any]]]], ...] = (
        ("guard", guarded_turn),
        ("floor", floor_turn),
    )
    while True:
        left = 0
        for mode in modes:
            for who, turn in turns:
                done = sum(row["mode"] == mode and row["who"] == who for row in rows)
                wanted = args.floors if who == "floor" and args.floors is not None else args.collisions
                if done >= wanted:
                    continue
                left += wanted - done
                new = turn(mode, min(max(1, EACH * wanted // args.collisions), wanted - done), rng)
                rows += new
                if args.keep:
                    with args.keep.open("a") as file:
                        file.writelines(json.dumps(row) + "\n" for row in new)
                print(f"\r{mode} {who}: {done + len(new)} of {wanted}    ", end="", file=sys.stderr, flush=True)
        if not left:
            print(file=sys.stderr)
            return


if __name__ == "__main__":
    sys.exit(main())
