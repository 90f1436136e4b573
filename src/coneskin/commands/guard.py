"""``coneskin guard``: guard the arm of a scene, and move it if the scene says how.

example:
  coneskin guard scene.toml              until Ctrl-C; type "reset" and Enter after a collision
  coneskin guard scene.toml --simulated --once   as `coneskin init --simulated` wrote it: a touch stops a simulated arm

A simulated arm runs into the scene's [[body]] tables, where there are any (pip install 'coneskin[physics]').
Keys of a scene: docs/look-up/scene.md. Exit code: 0 nothing happened, 1 a mistake or a fault, 3 a collision; Ctrl-C and
SIGTERM do not change it. `coneskin doctor scene.toml --check` tells whether a guard can start with a scene.
coneskin is not a safety-rated device; read docs/safety.md before you use it.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import queue
import shlex
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from coneskin.core.errors import Collision, ConeSkinError, RobotRefused
from coneskin.core.text import positive_seconds
from coneskin.robot.guard.signals.journal import SLIDER_HOLDS, EventName, GuardEvent
from coneskin.session.outcome import NOT_CONFIRMED, STANDS, exit_code, stands

from .simulated_arm import simulated_arm
from .terminal import print_hint, print_line, typed_lines

if TYPE_CHECKING:
    from coneskin.scene.values.scene import Scene
    from coneskin.session.event_publisher import EventPublisher
    from coneskin.session.session import Session

_START_TIMEOUT = 20.0  # s for the guard to become active
_IDLE_TIME = 0.1  # s between two looks at the guard
_LINE_PAUSE = 0.3  # s without a line after which all earlier ones have been read


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add = parser.add_argument
    add("scene", type=Path, metavar="SCENE", help="scene file, TOML")
    add("--simulated", action="store_true", help="simulate the controller at the scene's host, and the scene's bodies")
    publish_help = "send each event as JSON: udp://, zmq:// or mqtt://127.0.0.1:PORT; may be repeated"
    add("--publish", metavar="URL", action="append", default=[], help=publish_help)
    add("--publish-beyond", action="store_true", help="allow an address of another computer")
    add("--once", action="store_true", help="end after the first collision or fault")
    add("--duration-s", type=positive_seconds, metavar="S", help="end after this time [s] and the move under way")
    add("--json", action="store_true", help="print each event as a JSON object, one per line")


def run(args: argparse.Namespace) -> int:
    """Guard the arm of a scene."""
    from coneskin.scene.reader import load_scene

    scene = load_scene(args.scene)
    from coneskin.session.event_publisher import EventPublisher

    with contextlib.ExitStack() as stack:
        opened = (contextlib.closing(EventPublisher(url, args.publish_beyond, scene.arm_label)) for url in args.publish)
        publishers = [stack.enter_context(publisher) for publisher in opened]
        try:
            return _guard(args, scene, publishers)
        finally:
            for url, publisher in zip(args.publish, publishers, strict=True):
                if publisher.dropped:
                    counts = f"{publisher.dropped} of {publisher.sent + publisher.dropped} events"
                    print(f"coneskin guard: {counts} were not taken by {url.rpartition('@')[2]}", file=sys.stderr)


def _guard(args: argparse.Namespace, scene: Scene, publishers: Sequence[EventPublisher]) -> int:
    from coneskin.robot.guard.signals.event_text import EventLines
    from coneskin.session.session import guard

    lines = EventLines()

    def show(event: GuardEvent) -> None:
        for publisher in publishers:
            publisher.publish(event, session.began)
        if event.name == EventName.GUARD_EXITED:
            return  # the error that ends this program contains it
        facts = {"t": event.time - session.began, "name": event.name, **event.details}
        print_line(json.dumps(facts) if args.json else lines.describe(event, session.began))

    signal.signal(signal.SIGTERM, signal.default_int_handler)  # as Ctrl-C: the arm is stopped, the recording closed
    start_timeout = _START_TIMEOUT if args.duration_s is None else min(_START_TIMEOUT, args.duration_s)
    session = guard(scene, on_event=show, start_timeout=start_timeout)
    work = _Work(session, math.inf if args.duration_s is None else args.duration_s, args.once)
    try:
        arm = simulated_arm(scene, bodies=True) if args.simulated else contextlib.nullcontext()
        with arm as session.pressed_by, session:
            if session.recording and not args.json:
                print_line(f"recording to {session.recording}")
            work.run()
    except KeyboardInterrupt:
        print(f"coneskin guard: ended by you; {_last_words(session)}", file=sys.stderr)
    else:
        if scene.arm is not None and (words := _last_words(session)) != STANDS:
            print(f"coneskin guard: {words}", file=sys.stderr)
    if session.recording and session.recording.exists() and not args.json:  # none of a guard that did not start
        print_hint(f"next: coneskin replay {shlex.quote(str(session.recording))} --events")
    return max(work.code, exit_code(session.events, scene.arm is not None))


def _last_words(session: Session) -> str:
    """Return what is known of the arm when everything has ended."""
    if session.scene.arm is None:
        return "there is no arm in the scene"
    if not any(event.name == EventName.ACTIVATED for event in session.events):
        return "the guard was not active yet, and has not moved the arm"
    if not stands(session.events):
        return f"{NOT_CONFIRMED}: look at the arm"
    latched = [str(event.details.get("why")) for event in session.events if event.name == EventName.LATCHED]
    return f"{STANDS}; {SLIDER_HOLDS}" if latched and latched[-1].endswith(SLIDER_HOLDS) else STANDS


class _Work:
    """Work of the command while it guards, in an entered session and for a time [s]; ``code`` is that of its errors."""

    def __init__(self, session: Session, duration: float, once: bool) -> None:
        self.code, self._end = 0, math.inf
        self._session, self._duration, self._once = session, duration, once

    def run(self) -> None:
        """Guard until the end."""
        person, stopped, arm = _Person(), False, self._session.scene.arm
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
                held = arm is not None and arm.control == "external"  # without a guard, at standstill
                if (lost and (self._once or not held)) or not (lost or stopped):
                    raise
                print_line(f"coneskin guard: {exc}", sys.stderr)
                if self._once:
                    return
                if lost:
                    self._hold()

    def _lost(self) -> bool:
        """Tell whether the guard hangs, or is gone."""
        try:
            self._session.check_guard()
        except ConeSkinError:
            return True
        return False

    def _offer_reset(self, person: _Person) -> None:
        """Wait for a person to let the arm move again."""
        again = "; its motion then goes on" if self._session.scene.motion else ""
        person.ignore_earlier_lines()
        print_line(f'type "reset" and Enter to let the arm move again{again}; Ctrl-C ends the guard', sys.stderr)
        while time.monotonic() < self._end and not person.serve(self._session, 0.2):
            self._session.check_guard()

    def _hold(self) -> None:
        """Stay while an externally controlled arm has no guard, so that it is held at standstill."""
        said = "the arm is held at standstill from here until the guard lives again, or you end this with Ctrl-C"
        print_line(said, sys.stderr)
        while time.monotonic() < self._end and self._lost():
            time.sleep(0.1)

    def _watch(self, person: _Person) -> None:
        """Make the scene's motion, or wait, until the end or until the guard stops the arm."""
        moves = self._moves() if self._session.scene.motion else None
        while time.monotonic() < self._end:
            self._session.check()
            if self._once and self._session.scene.arm is None and exit_code(self._session.events, False):
                return
            if moves is None:
                person.answer_idle_line()
            elif next(moves, None) is None:
                return

    def _moves(self) -> Iterator[tuple[float, ...]]:
        """Make the scene's motion, one move at a time."""
        motion, done = self._session.scene.motion, 0
        assert motion is not None
        while motion.rounds == 0 or done < motion.rounds:
            for point in motion.waypoints:
                self._session.arm.move_j(point, motion.speed, motion.acceleration)
                yield point
            done += 1


class _Person:
    """Person at the terminal."""

    def __init__(self) -> None:
        self._lines = typed_lines()

    def ignore_earlier_lines(self) -> None:
        """Ignore what was typed before a person could know of the stop, and say so."""
        ignored = 0
        with contextlib.suppress(queue.Empty):
            while self._lines.get(timeout=_LINE_PAUSE):
                ignored += 1
        if ignored:
            print(f"{ignored} line(s) typed before the arm was latched are ignored", file=sys.stderr, flush=True)

    def answer_idle_line(self) -> None:
        """Take a line, if one comes within a moment, while there is nothing to reset."""
        with contextlib.suppress(queue.Empty):
            self._lines.get(timeout=_IDLE_TIME)
            print("ignored: the arm is not latched", file=sys.stderr, flush=True)

    def serve(self, session: Session, timeout: float) -> bool:
        """Take a line, if one comes within the timeout [s]; return True after a reset."""
        stop = session.latched_stop  # what has been said when the line comes
        try:
            line = self._lines.get(timeout=timeout)
        except queue.Empty:
            return False
        if line.strip().lower() != "reset":
            print('type "reset" and Enter to let the arm move again', flush=True)
            return False
        try:
            session.reset(stop=stop)
        except RobotRefused as exc:
            print(exc, file=sys.stderr, flush=True)
            return False
        return True
