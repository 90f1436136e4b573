"""Program under guard in bench `faults`: it moves the arm and reports what the guard raises. A process of its own.

Its manners, words with commas between them:

    fork         it has forked a worker, which lives on and does nothing
    blocking     its on_event never returns from the first stop
    descriptors  it has 1100 files open before it starts
    resets       it resets three times before anything has happened
    again        after a stop it asks for the motion again, without a reset
    late-reset   on a line of input after a stop it resets, and asks for the motion again
"""

from __future__ import annotations

import json
import multiprocessing
import os
import sys
import threading
import time
from contextlib import suppress
from typing import Any

from coneskin.core.errors import ConeSkinError
from coneskin.robot.guard.signals.journal import GuardEvent
from coneskin.session.session import Session, guard

FILES = 1100


def say(**facts: Any) -> None:
    print(json.dumps(facts), flush=True)


def main(scene: str, recording: str, timeout: str, goal: str, manners: str = "") -> None:
    from pathlib import Path

    words = set(manners.split(",")) - {""}
    if "descriptors" in words:
        open_many()
    on_event = block if "blocking" in words else None
    try:
        with guard(scene, recording=Path(recording), start_timeout=float(timeout), on_event=on_event) as session:
            if "fork" in words:
                multiprocessing.get_context("fork").Process(target=time.sleep, args=(60.0,), daemon=True).start()
            if "resets" in words:
                for _ in range(3):
                    with suppress(ConeSkinError):
                        session.reset(0.2)
            children = session._processes.children.items()
            say(activated=time.monotonic(), pids={name: child.pid for name, child in children})
            _move(session, json.loads(goal), words)
            sys.stdin.read()  # stay under guard until the trial is over
    except ConeSkinError as exc:
        say(refused=type(exc).__name__, why=str(exc))


def open_many() -> None:
    """Open many files, so that later descriptors are above 1024."""
    import resource

    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(most, FILES + 1000), most))
    for _ in range(FILES):
        os.open(os.devnull, os.O_RDONLY)


def block(event: GuardEvent) -> None:
    """Never return from the first stop."""
    if event.name == "stopping":
        threading.Event().wait()


def _move(session: Session, goal: list[float], manners: set[str]) -> None:
    assert session.scene.arm is not None
    internal = session.scene.arm.control == "internal"
    try:
        if internal:
            sys.stdin.readline()
            session.arm.move_j(goal, 1.0, 2.0)  # far softer than the stop that the scene asks for
        else:
            end = time.monotonic() + 20.0
            while time.monotonic() < end:
                session.check()
                time.sleep(0.005)
    except ConeSkinError as exc:
        say(raised=type(exc).__name__, why=str(exc), at=time.monotonic())
    else:
        say(arrived=True)
        return
    if "late-reset" in manners:
        sys.stdin.readline()
        with suppress(ConeSkinError):
            session.reset(1.0)
    if internal and manners & {"again", "late-reset"}:
        with suppress(ConeSkinError):
            session.arm.move_j(goal, 1.0, 2.0)


if __name__ == "__main__":
    main(*sys.argv[1:])
