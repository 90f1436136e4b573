"""``coneskin demo``: a simulated arm runs into something soft, and its skin makes it stop and retreat. No hardware.

The force comes from the physics engine, in real time; where that is not installed, a script touches the skin.
Everything between the two ends is the real thing: bytes through a pseudo-terminal and pyserial, the guard in its own
process, the unmodified ur_rtde wheel against a controller in another process, a recording, and its replay.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

from coneskin.core.errors import (
    Collision,
    ConeSkinError,
    MissingExtra,
    RecordingError,
    RobotConnectionError,
    RobotRefused,
)
from coneskin.scene.required_packages import has_physics_engine

from .demonstration.report import collision_facts, hold_up, print_report
from .demonstration.scene import FROM_DEG, TO_DEG, TOUCHED_U, leading_side, make_scene

if TYPE_CHECKING:
    import socket
    from collections.abc import Callable

    from coneskin.impact.simulation.impact_outcome import ImpactOutcome
    from coneskin.robot.guard.signals.journal import GuardEvent
    from coneskin.runs.replay.run import Run
    from coneskin.scene.values.scene import Scene
    from coneskin.session.session import Session

__all__ = ["add_arguments", "run"]

_EXAMPLE = """\
example:
  coneskin demo                          about 15 s; writes runs/demo-.../
  coneskin demo --reaction stop --json

exit code: 0 only if the stop was seen in measured joint speed and the replay gave the same events.
"""

_SPEED = 1.0  # rad/s, of the leading joint
_ACCELERATION = 2.0  # rad/s2, of the leading joint
_TOUCH_DELAY = 0.9  # s after the start of the second move: in the middle of it, at full speed
_EVENT_TIMEOUT = 2.0  # s for an event that has happened to be printed


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.epilog = _EXAMPLE
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help="folder for the run (default runs/demo-TIME)")
    parser.add_argument(
        "--reaction",
        choices=("stop", "retreat"),
        default="retreat",
        help="what the arm does when it is touched (default retreat)",
    )
    parser.add_argument("--host", help="loopback address for the simulated controller (default: a free one)")
    parser.add_argument("--json", action="store_true", help="print one JSON object at the end")


def run(args: argparse.Namespace) -> int:
    """Run the demo."""
    from coneskin.robot.sim.process import free_host
    from coneskin.runs.replay.run import read_run, replay

    folder = args.output or Path("runs") / time.strftime("demo-%Y-%m-%dT%H-%M-%S")
    try:
        folder.mkdir(parents=True)
    except OSError as exc:
        raise RobotRefused(f"cannot make the folder {folder}: {exc.strerror or exc}; name another with -o") from exc
    host = args.host or free_host()
    soft = has_physics_engine()
    scene = make_scene(host, args.reaction, soft, folder)
    (folder / "scene.toml").write_text(scene.text, encoding="utf-8")

    def say(line: str) -> None:
        if not args.json:
            print(line, flush=True)

    say("coneskin demo: a simulated UR5e with a virtual skin on its forearm. Not a safety-rated device.")
    if not soft:
        say("a script touches it: to let it run into something soft, pip install 'coneskin[physics]'")
    if scene.moves_away:
        _commission(scene, say)
    try:
        touched, force = _meet(scene, soft, folder, say)
    except ConeSkinError as exc:
        if cause := _cause(folder):
            raise RobotRefused(f"{cause}. What followed: {exc}") from exc
        raise
    recorded = read_run(folder)
    again = replay(recorded)
    facts = collision_facts(recorded, touched)
    facts["peak_n"], facts["clamp_n"] = (None, None) if force is None else (round(force.peak, 1), round(force.clamp, 1))
    facts["same_in_replay"] = again.same
    facts["picture"] = _draw(recorded, folder, say)
    (folder / "summary.json").write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")
    if args.json:
        print(json.dumps({**facts, "folder": str(folder)}))
    else:
        print_report(facts, folder, recorded.missing)
    alone = facts["contacts"] == 1 or (soft and facts["contacts"] > 1)  # what is soft may swing back
    as_it_should = facts["standstill_ms"] is not None and again.same and alone
    if (not as_it_should or facts["cut_short"]) and (cause := hold_up(recorded.blocks)):
        print(f"coneskin demo: {cause}", file=sys.stderr)
    return 0 if as_it_should else 1


def _meet(scene: Scene, soft: bool, folder: Path, say: Callable[[str], None]) -> tuple[float, ImpactOutcome | None]:
    """Let the arm run into something; return when that began [s], and with which forces where physics is there."""
    from coneskin.robot.sim.process import SimulatedController

    assert scene.arm is not None
    start_q = [math.radians(q) for q in FROM_DEG]
    with contextlib.ExitStack() as stack:
        plant = None
        if soft:
            from coneskin.impact.simulation.live_plant import LivePlant

            plant = stack.enter_context(LivePlant(scene, start_q))
        line = None if plant is None else plant.controller
        controller = stack.enter_context(SimulatedController("UR5e", scene.arm.host, start_q, plant=line))
        if plant is None:
            return _touch_by_script(scene, folder, say), None
        _collide(scene, folder, say, lambda _: None, plant.skin)
        if lost := controller.state()["plant_lost"]:
            raise RobotConnectionError(f"the simulated arm was lost: {lost}")
        force, touched = plant.outcome()
        if math.isnan(touched):
            raise RobotRefused("the arm met nothing, though there is a body in its way")
        return touched, force


def _cause(folder: Path) -> str:
    """Return what held the run up, by its recording; empty where nothing did, or none tells."""
    from coneskin.runs.replay.run import read_run

    try:
        return hold_up(read_run(folder).blocks)
    except RecordingError:
        return ""


class _Transcript:
    """Lines of the guard, which come from a thread of their own, and of the program, in the order of their times.

    Args:
        say: prints a line.
        began: gives the zero of the times, which is that of the recording [s].
    """

    def __init__(self, say: Callable[[str], None], began: Callable[[], float]) -> None:
        self._say = say
        self._began = began
        self._seen: set[str] = set()
        self._changed = threading.Condition()

    def event(self, event: GuardEvent) -> None:
        """Print an event of the guard."""
        from coneskin.runs.replay.event_text import describe

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
    from coneskin.scene.commissioning_record import write_record

    say("commissioning of the skin, by virtual touches (a real one: a person, with `coneskin commission`)")
    record = Commissioner(scene, lambda notice: say(f"  {notice.kind}: {notice.text}"), simulated=True).run("the demo")
    write_record(scene, record)
    if not record.passed:
        raise RobotRefused(f"the virtual skin has not passed its commissioning: {record.cause}")


def _collide(
    scene: Scene,
    folder: Path,
    say: Callable[[str], None],
    meanwhile: Callable[[Session], None],
    pressed_by: socket.socket | None = None,
) -> None:
    """Move, and print what the guard does.

    Args:
        scene: of the demo.
        folder: of the run.
        say: prints a line.
        meanwhile: is called as the motion begins.
        pressed_by: line from the physics.
    """
    from coneskin.session.session import guard

    transcript = _Transcript(say, lambda: guarded.began)
    guarded = guard(scene, recording=folder / "run.rec", on_event=transcript.event, pressed_by=pressed_by)
    with guarded as session:
        transcript.line("the arm moves", after="activated")
        meanwhile(session)
        try:
            session.arm.move_j([math.radians(q) for q in TO_DEG], _SPEED, _ACCELERATION)
            print("coneskin demo: the arm arrived although it was touched", file=sys.stderr)
        except Collision as exc:
            transcript.line(f"the program gets Collision: {exc}", after="latched")


def _touch_by_script(scene: Scene, folder: Path, say: Callable[[str], None]) -> float:
    """Touch the arm while it moves; return when the touch began [s]."""
    touches: list[float] = []
    phi = leading_side(scene)
    timers: list[threading.Timer] = []

    def touch_later(session: Session) -> None:
        timer = threading.Timer(_TOUCH_DELAY, lambda: touches.append(session.touch(TOUCHED_U, phi, duration=0.15)))
        timer.start()
        timers.append(timer)

    try:
        _collide(scene, folder, say, touch_later)
    finally:
        for timer in timers:
            timer.join()
    if not touches:
        raise RobotRefused("the virtual skin was not touched: its process did not answer")
    return touches[0]


def _draw(recorded: Run, folder: Path, say: Callable[[str], None]) -> str | None:
    from coneskin.runs.replay.run_picture import draw_run

    try:
        draw_run(recorded, folder / "run.png")
    except MissingExtra as exc:
        say(f"no picture: {exc}")
        return None
    return "run.png"
