"""The program under guard in bench/faults.py: it moves the arm, and says what it is told. A process of its own."""

from __future__ import annotations

import json
import sys
import time
from typing import Any

from coneskin.errors import ConeSkinError
from coneskin.session import Session, guard


def say(**facts: Any) -> None:
    print(json.dumps(facts), flush=True)


def main(scene: str, recording: str, timeout: str, goal: str) -> None:
    from pathlib import Path

    try:
        with guard(scene, recording=Path(recording), start_timeout=float(timeout)) as session:
            children = session._children.items()
            say(armed=time.monotonic(), pids={name: child.pid for name, child in children})
            _move(session, json.loads(goal))
            sys.stdin.read()  # stay under guard until the trial is over
    except ConeSkinError as exc:
        say(refused=type(exc).__name__, why=str(exc))


def _move(session: Session, goal: list[float]) -> None:
    assert session.scene.arm is not None
    try:
        if session.scene.arm.control == "owner":
            sys.stdin.readline()
            session.arm.move_j(goal, 1.0, 2.0)  # far softer than the stop that the scene asks for
        else:
            end = time.monotonic() + 20.0
            while time.monotonic() < end:
                session.check()
                time.sleep(0.005)
    except ConeSkinError as exc:
        say(told=type(exc).__name__, why=str(exc), at=time.monotonic())
    else:
        say(arrived=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
