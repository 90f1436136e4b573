"""``coneskin demo``: the skin of a simulated arm is touched, and the arm stops and retreats. No hardware.

A script touches the skin. Everything else is the real thing: bytes through a pseudo-terminal and pyserial, the guard in
its own process, the unmodified ur_rtde wheel against a controller in another process, a recording, and its replay. On a
computer for which there is no such wheel, a URScript program moves the arm.

example:
  coneskin demo                          about 15 s; writes runs/demo-.../
  coneskin demo --reaction stop --json

Exit code: 0 only if the stop was seen in measured joint speed and the replay gave the same events.
"""

from __future__ import annotations

import argparse
import json
import math
import shlex
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import Collision, ConeSkinError, MissingExtra, RecordingError, RobotRefused
from coneskin.core.files import explain_os_error
from coneskin.core.recording.block import Block
from coneskin.core.text import read_json
from coneskin.robot.guard.signals.journal import BlockKind, EventName, GuardEvent, describe_way

from .terminal import print_hint, print_line

if TYPE_CHECKING:
    from coneskin.runs.replay.run import Run
    from coneskin.scene.values.scene import Scene
    from coneskin.session.session import Session

_TOUCHED_U = 0.13  #: m; slant distance of the touch from end 1
_FROM_DEG = (-40.0, -90.0, 90.0, -90.0, -90.0, 0.0)  #: joint positions at the start
_TO_DEG = (60.0, -80.0, 80.0, -90.0, -90.0, 0.0)  #: joint positions at the end


def _leading_side(scene: Scene) -> float:
    """Return the azimuth of the sensor's leading side [rad]: there an obstacle would hit the arm."""
    from coneskin.robot.arm.kinematics import link_pose, point_jacobian
    from coneskin.robot.arm.models import arm_model
    from coneskin.scene.build import place_on_arm

    assert scene.arm is not None
    (placed,), arm = place_on_arm(scene), arm_model(scene.arm.model)
    middle = [math.radians(0.5 * (a + b)) for a, b in zip(_FROM_DEG, _TO_DEG, strict=True)]
    qd = [math.radians(b - a) for a, b in zip(_FROM_DEG, _TO_DEG, strict=True)]

    def towards(phi: float) -> float:
        point, normal = placed.place(_TOUCHED_U, phi)
        rows = point_jacobian(arm, middle, placed.link, point)
        n = link_pose(arm, middle, placed.link).rotate(normal)
        return sum(n[k] * sum(j * v for j, v in zip(rows[k], qd, strict=True)) for k in range(3))

    return max((math.radians(degree) for degree in range(360)), key=towards)


_MAX_DELAY = 0.05  # s between two inputs of a kind that come 500 times a second: what a scene allows by default
_STREAM_NAMES: dict[int, str] = {BlockKind.SKIN: "frames of the skin", BlockKind.ARM: "states of the arm"}


def _hold_up(blocks: Iterable[Block]) -> str:
    """Return in words how long a busy computer held up what must not wait in a recording; empty where it did not."""
    longest: dict[str, float] = {}
    newest: dict[int, float] = {}
    for block in blocks:
        if block.kind == BlockKind.OVERRUN:
            name, late = "the guard", float(read_json(block.payload)["late"])
        elif (name := _STREAM_NAMES.get(block.kind, "")) != "":
            late = block.time - newest.get(block.kind, block.time)
            newest[block.kind] = block.time
        else:
            continue
        longest[name] = max(longest.get(name, 0.0), late)
    held = [f"{name} for {1e3 * late:.0f} ms" for name, late in longest.items() if late > _MAX_DELAY]
    if not held:
        return ""
    limit = f"{1e3 * _MAX_DELAY:.0f} ms are as much as a guard should bear"
    return f"this computer was too busy: it held up {', '.join(held)} ({limit})"


def _collision_facts(run: Run, touched: float) -> dict[str, Any]:
    """Return the times after the touch [ms], and what happened."""
    events = run.events

    def first(name: str, since: float = -math.inf) -> GuardEvent | None:
        return next((event for event in events if event.name == name and event.time >= since), None)

    contact, retreated = first(EventName.CONTACT), first(EventName.RETREATED)
    placed = first(EventName.CONTACT_LOCATED) or contact
    since = contact.time if contact else math.inf

    def after(name: str) -> float | None:
        event = first(name, since)
        return None if event is None else round(1e3 * (event.time - touched), 3)

    commands = [block.time for block in run.blocks if block.kind == BlockKind.COMMAND and block.time >= since]
    return {
        "contacts": sum(e.name == EventName.CONTACT for e in events),
        "frame_ms": after("contact"),
        "command_ms": round(1e3 * (commands[0] - touched), 3) if commands else None,
        "slower_ms": after("decelerating"),
        "standstill_ms": after("standstill"),
        "latched_ms": after("latched"),
        "retreat_mm": None if retreated is None else round(1e3 * retreated.details["progress"], 2),
        "way": None if retreated is None else describe_way(retreated.details),
        "cut_short": retreated.details["why"] if retreated is not None and not retreated.details["complete"] else None,
        "u_mm": None if placed is None else round(1e3 * placed.details["u"], 2),
        "phi_deg": None if placed is None else round(math.degrees(placed.details["phi"]), 2),
    }


def _print_report(facts: dict[str, Any], folder: Path, missing: str) -> None:
    """Print the facts of a run in this folder, what is missing from its recording, and the next command."""
    print("\nafter the touch began:")
    for key, words in (
        ("frame_ms", "frame over the threshold decoded"),
        ("command_ms", "stop sent"),
        ("slower_ms", "arm decelerating, as measured"),
        ("standstill_ms", "standstill, as measured"),
        ("latched_ms", "latched: standstill after the reaction"),
    ):
        value = facts[key]
        print(f"  {'never' if value is None else f'{value:8.2f} ms'}  {words}")
    if facts["retreat_mm"] is not None:
        print(f"  {facts['way']}, along the normal")
    if facts["cut_short"] is not None:
        print(f"  the retreat was NOT made as far as it was to: {facts['cut_short']}; on a quieter machine it is")
    print("replay: " + ("the same events, bit by bit" if facts["same_in_replay"] else "NOT the same events"))
    if missing:
        print(f"recording: {missing}")
    print(f"written to {folder}: run.rec, scene.toml, summary.json" + (", run.png" if facts["picture"] else ""))
    view = "" if find_spec("viser") else " (after pip install 'coneskin[view]')"
    print_hint(f"see it in a browser{view}: coneskin view {shlex.quote(str(folder))}")
    print_hint(f"next: coneskin replay {shlex.quote(str(folder))} --events")


_JOINT_SPEED = 1.0  # rad/s, of the leading joint
_JOINT_ACCELERATION = 2.0  # rad/s2, of the leading joint
_TOUCH_DELAY = 0.9  # s after the start of the second move: in the middle of it, at full speed
_EVENT_TIMEOUT = 2.0  # s for an event that has happened to be printed
_MOVE_TIME = 10.0  # s, in which the arm would have arrived
_CHECK_PERIOD = 0.02  # s
_PRIMARY_PORT = 30001  # takes URScript
_MAX_ATTEMPTS = 3  # where this computer holds the demo up
_BUSY_REMEDY = "end what else it does, and run the demo again"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add = parser.add_argument
    add("-o", "--output", type=Path, metavar="DIR", help="folder for the run (default runs/demo-TIME)")
    add("--reaction", choices=("stop", "retreat"), default="retreat", help="to a touch (default retreat)")
    add("--json", action="store_true", help="print one JSON object at the end")


def run(args: argparse.Namespace) -> int:
    """Run the demo."""
    from coneskin.robot.sim.process import free_host
    from coneskin.robot.ur.ur_rtde import wheel_remedy
    from coneskin.runs.replay.run import read_run
    from coneskin.scene.reader import parse_scene
    from coneskin.scene.required_packages import missing_packages

    folder = args.output or Path("runs") / time.strftime("demo-%Y-%m-%dT%H-%M-%S")
    with explain_os_error(RobotRefused, f"cannot make the folder {folder}", "; name another with -o"):
        folder.mkdir(parents=True)
    host = free_host()
    # the tube of the UR5e's forearm as ``coneskin design`` finds it
    text = Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    for control in ("internal", "external"):
        scene_text = text.format(host=host, control=control, reaction=args.reaction)
        scene = parse_scene(scene_text, "scene.toml", folder)
        if not missing_packages(scene)[0]:
            break
    (folder / "scene.toml").write_text(scene.text, encoding="utf-8")

    def say(line: str) -> None:
        if not args.json:
            print_line(line)

    say("coneskin demo: a simulated UR5e with a virtual skin on its forearm. Not a safety-rated device.")
    if control == "external":
        say(f"a URScript program moves the arm, because ur-rtde is not installed: {wheel_remedy()}")
    if scene.moves_away:
        _commission(scene, say)
    for left in reversed(range(_MAX_ATTEMPTS)):
        cause = ""
        try:
            touched = _touch_by_script(scene, folder, say)
        except ConeSkinError as exc:
            with suppress(RecordingError):  # which tells what held the run up, where there is one
                cause = _hold_up(read_run(folder).blocks)
            if not cause:
                raise
            if not left:
                raise RobotRefused(f"{cause}; {_BUSY_REMEDY}. What followed: {exc}") from exc
        else:
            recorded = read_run(folder)
            facts = {**_collision_facts(recorded, touched), "same_in_replay": recorded.replay().same}
            as_it_should = facts["standstill_ms"] is not None and facts["same_in_replay"] and facts["contacts"] == 1
            if facts["same_in_replay"] and (not as_it_should or facts["cut_short"]):  # no computer makes it differ
                cause = _hold_up(recorded.blocks)
        if not cause or not left:
            break
        print(f"coneskin demo: {cause}; the arm is touched again", file=sys.stderr)
        (folder / "run.rec").unlink()
    facts["picture"] = _draw(recorded, folder, say)
    (folder / "summary.json").write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")
    if args.json:
        print(json.dumps({**facts, "folder": str(folder)}))
    else:
        _print_report(facts, folder, recorded.missing)
    if cause:
        print(f"coneskin demo: {cause}; {_BUSY_REMEDY}", file=sys.stderr)
    return 0 if as_it_should else 1


class _Transcript:
    """Lines of the guard, which come from a thread of their own, and of the program, in the order of their times."""

    def __init__(self, say: Callable[[str], None], began: Callable[[], float]) -> None:
        self._say, self._began = say, began
        self._seen: set[str] = set()
        self._changed = threading.Condition()

    def event(self, event: GuardEvent) -> None:
        """Print an event of the guard."""
        from coneskin.robot.guard.signals.event_text import describe

        self._say(describe(event, self._began()))
        with self._changed:
            self._seen.add(event.name)
            self._changed.notify_all()

    def line(self, text: str, after: str) -> None:
        """Print what the program does now, once the event after which it does so has been printed."""
        now = time.monotonic()
        with self._changed:
            self._changed.wait_for(lambda: after in self._seen, _EVENT_TIMEOUT)
        self._say(f"{now - self._began():9.4f} s  {text}")


def _commission(scene: Scene, say: Callable[[str], None]) -> None:
    """Touch marks on the virtual skin and write the record without which the arm would only stop.

    Raises:
        RobotRefused: the skin has not passed.
    """
    from coneskin.commissioning.acceptance.commission import Commissioner
    from coneskin.commissioning.skin_watch import TouchSession
    from coneskin.scene.commissioning_record import write_record

    say("commissioning of the skin, by virtual touches (a real one: a person, with `coneskin commission`)")
    session = TouchSession(scene, lambda notice: say(f"  {notice.kind}: {notice.text}"), simulated=True)
    record = Commissioner(session).run("the demo")
    write_record(scene, record)
    if not record.passed:
        raise RobotRefused(f"the virtual skin has not passed its commissioning: {record.cause}")


def _touch_by_script(scene: Scene, folder: Path, say: Callable[[str], None]) -> float:
    """Touch the arm while it moves, and print what the guard does; return when the touch began [s]."""
    from coneskin.robot.sim.process import SimulatedController
    from coneskin.session.session import guard

    assert scene.arm is not None
    touches: list[float] = []
    phi, start = _leading_side(scene), [math.radians(q) for q in _FROM_DEG]
    transcript = _Transcript(say, lambda: guarded.began)
    guarded = guard(scene, recording=folder / "run.rec", on_event=transcript.event)
    timer = threading.Timer(_TOUCH_DELAY, lambda: touches.append(guarded.touch(_TOUCHED_U, phi, duration=0.15)))
    with SimulatedController("UR5e", scene.arm.host, start), guarded as session:
        transcript.line("the arm moves", after="activated")
        timer.start()
        try:
            _move(session, [math.radians(q) for q in _TO_DEG])
            print("coneskin demo: the arm arrived although it was touched", file=sys.stderr)
        except Collision as exc:
            transcript.line(f"the program gets Collision: {exc}", after="latched")
        finally:
            timer.join()
    if not touches:
        raise RobotRefused("the virtual skin was not touched: its process did not answer")
    return touches[0]


def _move(session: Session, q: list[float]) -> None:
    """Move the arm to joint positions [rad], by the wheel or, with external control, by a program on the controller.

    Raises:
        Collision: the skin was touched, and the arm has reacted.
    """
    arm = session.scene.arm
    assert arm is not None
    if arm.control == "internal":
        session.arm.move_j(q, _JOINT_SPEED, _JOINT_ACCELERATION)
        return
    with socket.create_connection((arm.host, _PRIMARY_PORT), _EVENT_TIMEOUT) as controller:
        controller.sendall(f"def demo():\n  movej({q}, a={_JOINT_ACCELERATION}, v={_JOINT_SPEED})\nend\n".encode())
        end = time.monotonic() + _MOVE_TIME
        while time.monotonic() < end:
            session.check()
            time.sleep(_CHECK_PERIOD)


def _draw(recorded: Run, folder: Path, say: Callable[[str], None]) -> str | None:
    from coneskin.runs.replay.run_picture import draw_run

    try:
        draw_run(recorded, folder / "run.png")
    except MissingExtra as exc:
        say(f"no picture: {exc}")
        return None
    return "run.png"
