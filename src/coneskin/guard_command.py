"""``coneskin guard``: guard the arm of a scene, and move it if the scene says how."""

from __future__ import annotations

import argparse
import json
import math
import queue
import signal
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import Collision, RobotRefused

if TYPE_CHECKING:
    from .scene import Scene
    from .session import Session

__all__ = ["add_arguments", "run"]

_EXAMPLE = """\
example:
  coneskin guard scene.toml              until Ctrl-C; type "reset" and Enter after a collision
  coneskin guard scene.toml --check      read the scene, say what is in it, touch nothing

The scene's keys: docs/scene.md. exit code: 0 nothing has happened, 1 a mistake or a fault, 3 a collision.
coneskin is not a safety-rated device: docs/safety.md.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.epilog = _EXAMPLE
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("scene", type=Path, metavar="SCENE", help="scene file, TOML")
    parser.add_argument("--check", action="store_true", help="read the scene and stop there")
    parser.add_argument("--once", action="store_true", help="end after the first collision or fault")
    parser.add_argument("--duration-s", type=_positive, help="end after so long, and after the move under way")
    parser.add_argument("--json", action="store_true", help="print each event as a JSON object, one a line")


def _positive(text: str) -> float:
    value = float(text)
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"must be above 0 s, got {text}")
    return value


def run(args: argparse.Namespace) -> int:
    """Guard until told to end."""
    from .scene import load

    scene = load(args.scene)
    if args.check:
        print(json.dumps(_facts(scene)) if args.json else "\n".join(f"{k:<9} {v}" for k, v in _facts(scene).items()))
        return 0
    from .robot.journal import GuardEvent
    from .session import guard
    from .timeline import describe

    start = time.monotonic()

    def show(event: GuardEvent) -> None:
        if event.name == "died":
            return  # the error that ends this program says it
        if args.json:
            print(json.dumps({"t": event.time - start, "name": event.name, **event.details}), flush=True)
        else:
            print(describe(event, start), flush=True)

    signal.signal(signal.SIGTERM, _as_interrupt)
    code = 0
    try:
        with guard(scene, on_event=show) as session:
            if session.recording and not args.json:
                print(f"recording to {session.recording}", flush=True)
            end = math.inf if args.duration_s is None else time.monotonic() + args.duration_s
            code = _guard(session, _Person(), end, args.once)
    except KeyboardInterrupt:
        print("coneskin guard: ended by you; the arm was stopped first", file=sys.stderr)
    return code


def _as_interrupt(_signal: int, _frame: object) -> None:
    """SIGTERM ends the guard as Ctrl-C does: the arm is stopped and the recording closed."""
    raise KeyboardInterrupt


def _guard(session: Session, person: _Person, end: float, once: bool) -> int:
    """Guard until the end [s]; the exit code says whether anything has happened."""
    code = 0
    while time.monotonic() < end:
        try:
            _watch(session, person, end)
            break
        except (Collision, RobotRefused) as exc:
            print(f"coneskin guard: {exc}", file=sys.stderr, flush=True)
            code = 3 if isinstance(exc, Collision) else max(code, 1)
            if once:
                break
            again = "; its motion then goes on" if session.scene.motion else ""
            print(f'type "reset" and Enter to let the arm move again{again}', file=sys.stderr, flush=True)
            while time.monotonic() < end and not person.serve(session, 0.2):
                pass
    return code


def _watch(session: Session, person: _Person, end: float) -> None:
    """Make the scene's motion, or wait, until the end or until the guard stops the arm."""
    moves = _moves(session) if session.scene.motion else None
    while time.monotonic() < end:
        session.check()
        if moves is None:
            person.serve(session, 0.1)
        elif next(moves, None) is None:
            return


def _moves(session: Session) -> Iterator[tuple[float, ...]]:
    """The scene's motion, one move at a time."""
    motion, done = session.scene.motion, 0
    assert motion is not None
    while motion.rounds == 0 or done < motion.rounds:
        for point in motion.waypoints:
            session.arm.move_j(point, motion.speed, motion.acceleration)
            yield point
        done += 1


class _Person:
    """Lines typed at the terminal, read by a thread so that nothing waits for them on any system."""

    def __init__(self) -> None:
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        threading.Thread(target=self._read, name="coneskin terminal", daemon=True).start()

    def _read(self) -> None:
        for line in sys.stdin or ():
            self._lines.put(line)

    def serve(self, session: Session, timeout: float) -> bool:
        """Take a line, if one comes within the timeout [s]; True after a reset."""
        try:
            line = self._lines.get(timeout=timeout)
        except queue.Empty:
            return False
        if line.strip().lower() != "reset":
            print('type "reset" and Enter to let the arm move again', flush=True)
            return False
        try:
            session.reset()
        except RobotRefused as exc:
            print(exc, file=sys.stderr, flush=True)
            return False
        return True


def _facts(scene: Scene) -> dict[str, Any]:
    """What the scene has, for people and programs."""
    facts: dict[str, Any] = {"scene": scene.name}
    if scene.arm:
        facts["arm"] = f"{scene.arm.model} at {scene.arm.host}, control {scene.arm.control}"
    for link in scene.links:
        for item in link.sensors:
            sensor, cone, pose = item.sensor, item.sensor.frustum, item.placed.link_frustum
            place = ", ".join(f"{1e3 * x:g}" for x in pose.translation)
            turn = ", ".join(f"{math.degrees(x):g}" for x in pose.rpy)
            facts[f"sensor {sensor.name}"] = (
                f"id {sensor.device_id}/{sensor.sensor_id} on the {link.name}: radius {1e3 * cone.radius1:g} to "
                f"{1e3 * cone.radius2:g} mm, height {1e3 * cone.height:g} mm, wrap {math.degrees(cone.wrap):g} deg, "
                f"at ({place}) mm, rpy ({turn}) deg, in the {link.frame} frame"
            )
    if scene.source:
        facts["source"] = scene.source.kind + (f" {scene.source.port}" if scene.source.port else "")
    if scene.reaction:
        facts["reaction"] = scene.reaction.kind
    if scene.source and scene.source.touches:
        facts["touches"] = str(len(scene.source.touches))
    if scene.motion:
        facts["motion"] = f"{len(scene.motion.waypoints)} waypoints, {scene.motion.rounds or 'endless'} rounds"
    if scene.recording:
        facts["recording"] = str(scene.recording.folder)
    return facts
