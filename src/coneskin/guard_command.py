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
from typing import TYPE_CHECKING

from .errors import Collision, ConeSkinError, RobotRefused
from .verdict import NOT_SEEN, STANDS, exit_code, stands

if TYPE_CHECKING:
    from .scene import Scene
    from .session import Session

__all__ = ["add_arguments", "run"]

_EXAMPLE = """\
example:
  coneskin guard scene.toml              until Ctrl-C; type "reset" and Enter after a collision
  coneskin guard scene.toml --check      read the scene, say what is in it, touch nothing

The scene's keys: docs/scene.md. exit code: 0 nothing has happened, 1 a mistake or a fault, 3 a collision; Ctrl-C and
SIGTERM do not change it. With --check: 0 a guard can start with this scene, 1 it has mistakes or lacks something.
coneskin is not a safety-rated device: docs/safety.md.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.epilog = _EXAMPLE
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("scene", type=Path, metavar="SCENE", help="scene file, TOML")
    parser.add_argument("--check", action="store_true", help="say what is in the scene, and stop there")
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
        return _check(scene, args.json)
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
    session = guard(scene, on_event=show)
    work = _Work(session, math.inf if args.duration_s is None else args.duration_s, args.once)
    try:
        with session:
            if session.recording and not args.json:
                print(f"recording to {session.recording}", flush=True)
            work.run()
    except KeyboardInterrupt:
        print(f"coneskin guard: ended by you; {_last_words(session)}", file=sys.stderr)
    else:
        if scene.arm is not None and not stands(session.events):
            print(f"coneskin guard: {_last_words(session)}", file=sys.stderr)
    return max(work.code, exit_code(session.events))


def _check(scene: Scene, as_json: bool) -> int:
    """Say what is in a scene; 1 where a guard would refuse it."""
    from .scene_facts import facts, lacks

    found, missing = facts(scene), lacks(scene)
    if as_json:
        print(json.dumps({**found, "cannot_guard_yet": missing} if missing else found))
    else:
        print("\n".join(f"{key:<9} {value}" for key, value in found.items()))
    for line in missing:
        print(f"coneskin guard: {scene.name} cannot guard yet: {line}", file=sys.stderr)
    return 1 if missing else 0


def _last_words(session: Session) -> str:
    """What is known of the arm when everything has ended."""
    if session.scene.arm is None:
        return "there is no arm in the scene"
    if not any(event.name == "armed" for event in session.events):
        return "it had not armed, and has not moved the arm"
    return STANDS if stands(session.events) else f"{NOT_SEEN}: look at it"


def _as_interrupt(_signal: int, _frame: object) -> None:
    """SIGTERM ends the guard as Ctrl-C does: the arm is stopped and the recording closed."""
    raise KeyboardInterrupt


class _Work:
    """What the command does while it guards.

    Args:
        session: entered before ``run``.
        duration: of the whole [s].
        once: end after the first collision or fault.

    Attributes:
        code: what the errors so far amount to.
    """

    def __init__(self, session: Session, duration: float, once: bool) -> None:
        self.code = 0
        self._session = session
        self._duration = duration
        self._once = once
        self._end = math.inf

    def run(self) -> None:
        """Guard until the end."""
        person, stopped = _Person(), False
        self._end = time.monotonic() + self._duration
        while time.monotonic() < self._end:
            try:
                if stopped:
                    self._offer_reset(person)
                    stopped = False
                self._watch(person)
                return
            except ConeSkinError as exc:
                self.code = 3 if isinstance(exc, Collision) else max(self.code, 1)
                lost, stopped = self._lost(), isinstance(exc, Collision | RobotRefused)
                if (lost and (self._once or not self._foreign)) or not (lost or stopped):
                    raise
                print(f"coneskin guard: {exc}", file=sys.stderr, flush=True)
                if self._once:
                    return
                if lost:
                    self._hold()

    @property
    def _foreign(self) -> bool:
        arm = self._session.scene.arm
        return arm is not None and arm.control == "foreign"

    def _lost(self) -> bool:
        """Whether the guard hangs, or is gone."""
        try:
            self._session.check_guard()
        except ConeSkinError:
            return True
        return False

    def _offer_reset(self, person: _Person) -> None:
        """Wait for a person to let the arm move again."""
        again = "; its motion then goes on" if self._session.scene.motion else ""
        print(f'type "reset" and Enter to let the arm move again{again}', file=sys.stderr, flush=True)
        while time.monotonic() < self._end and not person.serve(self._session, 0.2):
            self._session.check_guard()

    def _hold(self) -> None:
        """An arm that another program moves has lost its guard: stay, so that it is kept standing."""
        print(
            "the arm is kept standing from here until the guard lives again, or you end this with Ctrl-C",
            file=sys.stderr,
            flush=True,
        )
        while time.monotonic() < self._end and self._lost():
            time.sleep(0.1)

    def _watch(self, person: _Person) -> None:
        """Make the scene's motion, or wait, until the end or until the guard stops the arm."""
        moves = self._moves() if self._session.scene.motion else None
        while time.monotonic() < self._end:
            self._session.check()
            if moves is None:
                person.serve(self._session, 0.1)
            elif next(moves, None) is None:
                return

    def _moves(self) -> Iterator[tuple[float, ...]]:
        """The scene's motion, one move at a time."""
        motion, done = self._session.scene.motion, 0
        assert motion is not None
        while motion.rounds == 0 or done < motion.rounds:
            for point in motion.waypoints:
                self._session.arm.move_j(point, motion.speed, motion.acceleration)
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
