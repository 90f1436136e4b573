"""Measure on a real arm, or on URSim, what coneskin assumes of its controller (docs/do/measure.md).

    python scripts/measure_controller.py 192.168.1.10 --model UR5e --file ur5e.json

It asks before each kind of motion, the smallest first, and does not believe that the arm moved: it looks. What is slow
and near comes before what is fast and far. Nothing else may run on the controller, which must be in remote control.
Each stop is measured --repeat times: its clock starts with the first byte that is sent, and ends once the arm stands.
Slider and position are left as they were found, also after Ctrl-C. Two hours with all motions; --joints, --speeds,
--motions and --paths choose fewer. With --protective the arm ends in a protective stop, which a person unlocks.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from coneskin.core.errors import ConeSkinError, RobotRefused
from coneskin.robot.arm.models import arm_model
from coneskin.robot.driver.values import StopPath
from coneskin.robot.ur.input_writers import HeartbeatRegisters, RtdeSpeedSlider, decode_fraction, heartbeat_lines
from coneskin.robot.ur.measured import MEASURED_DECELERATION
from coneskin.robot.ur.model_check import check_model, read_pose
from coneskin.robot.ur.rtde_connection import RtdeConnection
from coneskin.robot.ur.stop_sockets import StopSockets

_REGISTER = 45  # integer output register; the guard's own proof has 47
_NAMES = (
    "actual_q",
    "actual_qd",
    "actual_TCP_speed",
    "runtime_state",
    "safety_status_bits",
    f"output_int_register_{_REGISTER}",
)
_STANDS, _STEADY = 0.01, 5  # rad/s, and states in a row below it
_PLAYING, _PROTECTIVE = 2, 1 << 2
_PATIENCE = 5.0  # s
_ACCELERATION, _TOOL_ACCELERATION = 4.0, 2.0  # rad/s2, m/s2 with which the arm gets to its speed

_TOOL_SPEED = 0.5  # m/s at 100 %
_CRUISE = 0.4  # s at full speed in which the stop is sent
_WATCHDOG = 10.0  # Hz
_WAIT = "def coneskin_waits():\n  write_output_integer_register(%d, %d)\n  sleep(0.2)\nend\n"
_MOTIONS = ("speedj", "movej", "servoj", "speedl", "movel", "ur_rtde")
_TOOL_MOTIONS = ("speedl", "movel")
_PATHS = ("program", "command", "slider")


class Stuck(Exception):
    """The arm did not do what was asked of it; the message says what."""


class Rig:
    """Connections to one controller, its newest state, and how it was found."""

    def __init__(self, host: str, model: str) -> None:
        if (pose := read_pose(host)) is not None:
            check_model(arm_model(model), pose, host)
        self.host = host
        self.sockets = StopSockets(host).__enter__()
        self.slider = RtdeSpeedSlider(host).__enter__()
        self._states = RtdeConnection(host).__enter__()
        with RtdeConnection(host) as connection:
            self.version = "{}.{}".format(*connection.ask_version())
        self._recipe = self._states.ask_outputs(_NAMES)
        self._states.start()
        self.found_slider = decode_fraction(self.slider.wait_data(_PATIENCE))
        self.q: tuple[float, ...] = ()
        self.lead = self.tool = 0.0
        self.playing = self.protective = False
        self.register = self._steady = 0
        self.read()
        self.home = self.q
        if self.playing:
            raise Stuck("a program runs on the controller: end it first")
        if self.found_slider < 0.99:
            print(f"the speed slider is at {self.found_slider:.0%}: it is raised to 100 % now, and put back at the end")
            self.slider.set(1.0)

    def read(self) -> None:
        """Wait for the next state."""
        values: Any = self._recipe.unpack(self._states.wait_data(_PATIENCE))
        self.q, qd, twist, runtime, bits, self.register = values
        self.lead, self.tool = max(map(abs, qd)), math.hypot(*twist[:3])
        self._steady = self._steady + 1 if self.lead < _STANDS else 0
        self.playing, self.protective = runtime == _PLAYING, bool(bits & _PROTECTIVE)

    def until(self, what: Callable[[], bool], otherwise: str, since: float | None = None) -> float:
        """Wait for a state; return how long it took since a time, or since now [s]."""
        start = time.monotonic() if since is None else since
        while True:
            self.read()
            if what():
                return time.monotonic() - start
            if time.monotonic() - start > _PATIENCE:
                raise Stuck(otherwise)

    def stands(self) -> bool:
        return self._steady >= _STEADY

    def rest(self) -> None:
        """End what runs, see the arm stand, and only then raise the slider."""
        self.sockets.drain()
        self.sockets.use(StopPath.COMMAND, MEASURED_DECELERATION)
        self.until(lambda: self.stands() and not self.playing, "the arm does not stand after the dashboard's stop")
        self.slider.read()
        self.slider.set(1.0)

    def go_home(self) -> None:
        """Go slowly to where the arm was found."""
        self.rest()
        if max(abs(a - b) for a, b in zip(self.q, self.home, strict=True)) > 0.01:
            self.sockets.run(f"def coneskin_home():\n  movej({list(self.home)}, 0.5, 0.2)\nend\n")
            self.until(lambda: self.playing, "the way home did not begin")
            end = time.monotonic() + 60.0
            while self.playing and time.monotonic() < end:
                self.read()

    def leave(self) -> None:
        """Leave arm and slider as they were found."""
        try:
            if not self.protective:
                self.go_home()
            self.slider.set(self.found_slider)
        finally:
            for one in (self._states, self.slider, self.sockets):
                one.close()


def text(motion: str, joint: int, way: float, speed: float) -> str:
    """Return the program of a motion: of a joint, counted from 0 [rad/s], or of the tool along z [m/s]."""
    tool, accel = motion in _TOOL_MOTIONS, _TOOL_ACCELERATION if motion in _TOOL_MOTIONS else _ACCELERATION
    length = way * (speed * speed / accel + 2.0 * speed * _CRUISE)
    axis = [0.0] * 6
    axis[2 if tool else joint] = 1.0
    duration = speed / accel + 2.0 * _CRUISE
    lines = {
        "speedj": [f"speedj({[way * speed * a for a in axis]}, {accel}, {duration})"],
        "speedl": [f"speedl({[way * speed * a for a in axis]}, {accel}, {duration})"],
        "movej": [
            "q = get_target_joint_positions()",
            f"q[{joint}] = q[{joint}] + {length}",
            f"movej(q, {accel}, {speed})",
        ],
        "movel": [
            "p = get_target_tcp_pose()",
            f"movel(p[p[0], p[1], p[2] + {length}, p[3], p[4], p[5]], {accel}, {speed})",
        ],
        "servoj": [
            "q = get_target_joint_positions()",
            "v = 0.0",
            "t = 0.0",
            f"while t < {duration}:",
            f"  v = v + {way * accel} * get_steptime()",
            f"  if norm(v) > {speed}:",
            f"    v = {way * speed}",
            "  end",
            f"  q[{joint}] = q[{joint}] + v * get_steptime()",
            "  t = t + get_steptime()",
            "  servoj(q, 0, 0, get_steptime(), 0.05, 500)",
            "end",
        ],
    }[motion]
    return "def coneskin_moves():\n" + "".join(f"  {line}\n" for line in lines) + "  stopj(2.0)\nend\n"


def summary(values: Sequence[float]) -> dict[str, float]:
    """Return p50, p95 and the worst of some values, and how many they are."""
    ordered = sorted(values)
    at = [ordered[min(len(ordered) - 1, math.ceil(share * len(ordered)) - 1)] for share in (0.5, 0.95)]
    return {"n": len(ordered), "p50": at[0], "p95": at[1], "worst": ordered[-1]}


def stop_once(rig: Rig, motion: str, joint: int, way: float, speed: float, path: str) -> tuple[float, float, float]:
    """Move, stop; return when it slows down and when it stands [s], and the leading joint's way till then [rad]."""
    rig.rest()
    where = list(rig.q)
    arm: Any = None
    if motion == "ur_rtde":
        from coneskin.robot.ur.ur_rtde import UrArm

        arm = UrArm(rig.host, 2.0).__enter__()
        target = [
            q + way * (speed**2 / _ACCELERATION + 2.0 * speed * _CRUISE) * (i == joint) for i, q in enumerate(where)
        ]
        arm.move("move_j", target, speed, _ACCELERATION)
    else:
        rig.sockets.run(text(motion, joint, way, speed))

    def now() -> float:
        if arm is not None:
            arm.kick()
        return rig.tool if motion in _TOOL_MOTIONS else rig.lead

    try:
        rig.until(
            lambda: now() > 0.9 * speed,
            f"the arm did not reach {speed:.2f} rad/s or m/s with {motion}: nothing is measured",
        )
        top, before, sent = rig.lead, rig.q, time.monotonic()
        if path == "slider":
            rig.slider.set(0.0)
        else:
            rig.sockets.use(StopPath(path), MEASURED_DECELERATION)
        slows = rig.until(lambda: rig.lead < 0.95 * top, f"{path} did not slow {motion} down", sent)
        stood = rig.until(rig.stands, f"{path} did not stop {motion}", sent)
    finally:
        if arm is not None:
            rig.rest()
            arm.__exit__()
    return slows, stood, max(abs(a - b) for a, b in zip(rig.q, before, strict=True))


def measure_stops(rig: Rig, args: argparse.Namespace, ask: Callable[[str], bool]) -> Iterator[dict[str, Any]]:
    """Yield each kind of stop, from small and slow to fast."""
    model = arm_model(args.model)
    for share in sorted(args.speeds):
        for motion in args.motions:
            for joint in (
                [0] if motion in _TOOL_MOTIONS else [number - 1 for number in sorted(args.joints, reverse=True)]
            ):
                tool = motion in _TOOL_MOTIONS
                speed = share / 100.0 * (_TOOL_SPEED if tool else model.joint_speed[joint])
                accel = _TOOL_ACCELERATION if tool else _ACCELERATION
                room = speed**2 / accel + 2.0 * speed * _CRUISE
                what = (
                    f"the tool goes {100.0 * room:.0f} cm up and down"
                    if tool
                    else f"joint {joint + 1} turns {math.degrees(room):.0f} deg to and fro"
                )
                if not tool and math.degrees(room) > args.room_deg:
                    print(f"left out: {what} at {share} %: --room-deg allows {args.room_deg:g}")
                    continue
                if not ask(f"{what}, {motion} at {speed:.2f} {'m/s' if tool else 'rad/s'}"):
                    continue
                for path in args.paths:
                    if (path, motion) == ("slider", "servoj"):
                        continue  # servoj does not heed it
                    rig.go_home()
                    one = [stop_once(rig, motion, joint, 1.0 - 2.0 * (k % 2), speed, path) for k in range(args.repeat)]
                    slows, times, ways = zip(*one, strict=True)
                    facts: dict[str, Any] = {
                        "path": path,
                        "motion": motion,
                        "joint": None if tool else joint + 1,
                        "share": share,
                        "speed": speed,
                    }
                    facts |= {"slows_s": summary(slows), "stands_s": summary(times), "way_rad": summary(ways)}
                    late, stood = (1e3 * facts[name]["p95"] for name in ("slows_s", "stands_s"))
                    turned = math.degrees(facts["way_rad"]["worst"])
                    print(f"  {path:8} slows after {late:4.0f} ms, stands after {stood:5.0f} ms, {turned:5.1f} deg")
                    yield facts


def measure_start(rig: Rig, repeat: int) -> dict[str, float]:
    """Return how long a program takes from its last byte to its first cycle."""
    found = []
    for count in range(1, repeat + 1):
        rig.rest()
        sent = time.monotonic()
        rig.sockets.run(_WAIT % (_REGISTER, rig.register % 1000 + 1 + count))
        wanted = rig.register % 1000 + 1 + count
        found.append(rig.until(lambda: rig.register == wanted, "a program did not start", sent))  # noqa: B023
    return summary(found)


def measure_secondary(rig: Rig, repeat: int) -> dict[str, float]:
    """Return how long a secondary program takes beside another, which must go on."""
    found = []
    for _ in range(repeat):
        rig.rest()
        rig.sockets.run("def coneskin_waits():\n  sleep(2.0)\nend\n")
        rig.until(lambda: rig.playing, "a program did not start")
        wanted, sent = rig.register % 1000 + 1, time.monotonic()
        rig.sockets.run(f"sec coneskin_marks():\n  write_output_integer_register({_REGISTER}, {wanted})\nend\n")
        found.append(rig.until(lambda: rig.register == wanted, "a secondary program did not run", sent))  # noqa: B023
        if not rig.playing:
            raise Stuck("a secondary program has ended the main one: no protective stop of the guard is certain")
    return summary(found)


def measure_watchdog(rig: Rig, repeat: int) -> dict[str, float]:
    """Return how long after its period the controller's watchdog ends a program; negative where before."""
    found = []
    with HeartbeatRegisters(rig.host) as heartbeat:
        for beat in range(repeat):
            rig.rest()
            heartbeat.write(2 * beat + 1)
            lines = "".join(f"  {line}\n" for line in heartbeat_lines(_WATCHDOG).splitlines())
            rig.sockets.run(f"def coneskin_waits():\n{lines}  sleep(4.0)\nend\n")
            rig.until(lambda: rig.playing, "a program did not start")
            for count in range(5):
                heartbeat.write(2 * beat + 2 + count % 2)
                rig.read()
            sent = time.monotonic()
            heartbeat.write(2 * beat + 3)
            found.append(
                rig.until(lambda: not rig.playing, "the watchdog has not ended the program", sent) - 1.0 / _WATCHDOG
            )
    return summary(found)


def in_local_control(host: str) -> bool:
    """Tell whether new connections are refused because the controller is in local control."""
    try:
        StopSockets(host).__enter__().close()
    except RobotRefused as exc:
        if "local control" not in str(exc):
            raise
        return True
    return False


def measure_switch(rig: Rig) -> dict[str, object]:
    """Return what a controller in local control takes; a person switches it."""
    answer("switch the pendant to Local Control, then press Enter ")
    while not in_local_control(rig.host):
        answer("it is still in Remote Control: switch it to Local Control, then press Enter ")
    rig.sockets.ask()
    wanted = rig.register % 1000 + 1
    rig.sockets.run(f"sec coneskin_marks():\n  write_output_integer_register({_REGISTER}, {wanted})\nend\n")
    end = time.monotonic() + 1.0
    said: list[str] = []
    while time.monotonic() < end:
        rig.read()
        said += [why for _, _, why in rig.sockets.drain()]
    taken = rig.register == wanted
    answer("switch it back to Remote Control, then press Enter ")
    while in_local_control(rig.host):
        answer("it is still in Local Control: switch it back to Remote Control, then press Enter ")
    rig.sockets.close()
    rig.sockets = StopSockets(rig.host).__enter__()
    return {"program_taken": taken, "seen": bool(said), "new_connections_work": True}


def measure_protective(rig: Rig) -> dict[str, float]:
    """Return how long protective_stop() in a secondary program takes beside a motion; once, as a person unlocks it."""
    rig.rest()
    rig.sockets.run(text("speedj", 5, 1.0, 0.2))
    rig.until(lambda: rig.lead > 0.18, "the arm did not move")
    sent = time.monotonic()
    rig.sockets.run("sec coneskin_protective():\n  protective_stop()\nend\n")
    shown = rig.until(lambda: rig.protective, "protective_stop() in a secondary program does nothing", sent)
    return {"shown_s": shown, "stands_s": rig.until(rig.stands, "the protective stop did not stop the arm", sent)}


def answer(question: str) -> str:
    """Return what a person answers."""
    try:
        return input(question).strip().lower()
    except EOFError:
        raise Stuck("nobody can answer: standard input is closed; run it in a terminal, or with --yes") from None


def main() -> int:
    """Ask, measure, write the file; return 0 where all was measured."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("host", help="the controller, or URSim")
    add("--model", required=True, help="the arm, such as UR5e; it is compared with the controller's")
    add("--file", type=Path, required=True, help="where the results go, JSON")
    add("--repeat", type=int, default=20, help="how often each is measured (%(default)s)")
    add("--joints", type=int, nargs="+", default=[1, 2, 3], choices=range(1, 7), help="joints, from 1 (1 2 3)")
    add("--speeds", type=int, nargs="+", default=[25, 50, 100], metavar="PERCENT", help="of the highest (25 50 100)")
    add("--motions", nargs="+", default=list(_MOTIONS), choices=_MOTIONS, help="kinds of motion (all)")
    add("--paths", nargs="+", default=list(_PATHS), choices=_PATHS, help="ways to stop (all)")
    add("--room-deg", type=float, default=120.0, help="that a joint may turn (%(default)g)")
    add("--protective", action="store_true", help="measure the protective stop too, at the end")
    add("--switch", action="store_true", help="measure what a switch to local control does; you switch it")
    add("--yes", action="store_true", help="do not ask before each motion")
    args = parser.parse_args()
    if not args.file.parent.is_dir():
        parser.error(f"--file: there is no folder {args.file.parent}; make it first")

    def ask(what: str) -> bool:
        print(what)
        return args.yes or answer('  room free, emergency stop in reach? "y" to go on: ') == "y"

    facts: dict[str, Any] = {
        "host": args.host,
        "model": args.model,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    facts |= {"complete": False, "stops": []}
    rig: Rig | None = None
    try:
        rig = Rig(args.host, args.model)
        facts["version"] = rig.version
        print("no motion: program start, secondary program, watchdog")
        for key, measure in (
            ("start_s", measure_start),
            ("secondary_s", measure_secondary),
            ("watchdog_s", measure_watchdog),
        ):
            facts[key] = measure(rig, args.repeat)
            print(f"  {key[:-2]}: {1e3 * facts[key]['p50']:.0f} ms (p50), {1e3 * facts[key]['worst']:.0f} ms (worst)")
        if args.switch:
            facts["switch"] = measure_switch(rig)
            print("  switch: " + ", ".join(f"{key} {value}" for key, value in facts["switch"].items()))
        for stop in measure_stops(rig, args, ask):
            facts["stops"].append(stop)
        if args.protective and ask("joint 6 turns by up to 10 deg, and the arm ends in a protective stop"):
            rig.go_home()
            facts["protective"] = measure_protective(rig)
            print(
                "  protective: " + ", ".join(f"{k[:-2]} after {1e3 * v:.0f} ms" for k, v in facts["protective"].items())
            )
            print("the arm is in a protective stop: unlock it on the pendant")
        facts["complete"] = True
    except (ConeSkinError, Stuck, KeyboardInterrupt) as exc:
        print(f"ended: {exc or type(exc).__name__}", file=sys.stderr)
    finally:
        if rig is not None:
            try:
                rig.leave()
            except (ConeSkinError, Stuck) as exc:
                print(f"slider and position are not as they were found: {exc}", file=sys.stderr)
    if "start_s" not in facts:
        print(f"nothing was measured: {args.file} is not written", file=sys.stderr)
        return 1
    args.file.write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")
    print(f"{args.file}: compare it with `coneskin doctor SCENE --measured {args.file}`")
    return 0 if facts["complete"] else 1


if __name__ == "__main__":
    sys.exit(main())
