"""Kinds of fault of the program: it forks, freezes, asks too early or too late, blocks, or starts again and again."""

from __future__ import annotations

import time

from .kind import (
    BOTH,
    EXTERNAL,
    INTERNAL,
    FaultKind,
    away,
    breaks,
    halt,
    kill,
    pause,
    slow,
    then,
    touch,
)
from .setup import CLOCK, Setup
from .trial import Trial

PROGRAM_SILENCE = 0.25  # s; without a sign of life of the program
CHILD_SILENCE = 0.34  # s; without one of the driver process or of the guard watchdog
STAYS = 0.9  # s; until an arm that is started again after each stop stands for good
RESTARTS = (5, 10, 20, 50, 100, 300)  # ms
BROKEN = "raise SystemExit('a file of the current folder was imported')\n"


def restarted(how: str, wait: int) -> FaultKind:
    """Return the kind of a touch while the mover starts again after each stop."""
    return FaultKind(
        f"touch; {how} starts again after {wait} ms",
        then(Trial.start_again, touch) if how == "raw" else touch,
        STAYS,
        controls=EXTERNAL,
        touched=True,
        restarts=True,
        variant=wait in ((10, 100) if how == "loop" else (5, 50, 300)),
        setup=Setup(reaction='kind = "stop"\ndeceleration_rad_s2 = 10', mover=f"{how} {wait}"),
    )


def thaw_and_ask(t: Trial) -> float:
    """Ask for a reset and for a motion while the driver process hangs, then let it live again."""
    t.program.say(go=True)
    time.sleep(1.5)
    t.thaw_all()
    time.sleep(0.5)
    return CLOCK()


def with_files(name: str, variant: bool = False) -> FaultKind:
    """Return the kind of a file in the current folder with the name of a module that the guard imports."""
    return FaultKind(
        f"{name} in the current folder", touch, touched=True, variant=variant, setup=Setup(files=((name, BROKEN),))
    )


def manner(name: str, word: str, *parts: object, **more: object) -> FaultKind:
    """Return the kind of a fault with a program of these manners."""
    return FaultKind(name, then(*parts), setup=Setup(manners=(word,)), **more)  # type: ignore[arg-type]


def touch_and_kill(t: Trial) -> float:
    """Touch the skin, and kill the guard once its stop is out; the time of the touch counts."""
    touched_at = touch(t)
    then(pause(0.05), kill("guard"))(t)
    return touched_at


PROGRAM_KINDS = (
    # it has forked, and dies
    manner("forked program killed", "fork", kill("program"), recorder=False, answers=False),
    # frozen while it moves
    FaultKind("program frozen", halt("program"), PROGRAM_SILENCE, answers=False, after=Trial.thaw_all),
    FaultKind("watchdog frozen", halt("watchdog"), CHILD_SILENCE, controls=EXTERNAL, after=Trial.thaw_all),
    away("program frozen", halt("program"), PROGRAM_SILENCE, answers=False, after=Trial.thaw_all),
    away("watchdog frozen", halt("watchdog"), CHILD_SILENCE, EXTERNAL, after=Trial.thaw_all),
    slow("program frozen", halt("program"), PROGRAM_SILENCE, answers=False, after=Trial.thaw_all),
    slow("watchdog frozen", halt("watchdog"), CHILD_SILENCE, EXTERNAL, after=Trial.thaw_all),
    # asked too early, or too late
    manner("three resets beforehand, then a touch", "resets", touch, touched=True),
    manner("asked to move on after a touch", "again", touch, touched=True, controls=INTERNAL),
    manner(
        "reset and motion while the driver is frozen",
        "late-reset",
        Trial.latch,
        halt("driver"),
        thaw_and_ask,
        touched=True,
        still=True,
        controls=INTERNAL,
    ),
    # its on_event blocks
    manner("blocking on_event, a touch", "blocking", touch, touched=True, answers=False),
    manner("blocking on_event, guard killed", "blocking", touch_and_kill, touched=True, answers=False),
    # more than 1024 descriptors
    manner("1100 files open, then a touch", "descriptors", touch, touched=True),
    # what lies in the current folder
    with_files("serial.py"),
    with_files("json.py", variant=True),
    # started again after each stop
    *[restarted(how, wait) for how in ("loop", "raw") for wait in RESTARTS],
    # late frames that creep
    *[
        FaultKind(
            f"skin later by {ms} ms a second",
            lambda t, ms=ms: t.skins(slow=1e-3 * ms),  # type: ignore[misc]
            0.25 / (1e-3 * ms) + 0.1,
            controls=BOTH,
            variant=ms > 200,
        )
        for ms in (200, 500)
    ],
    # the touch phase is dead; then a touch
    *[
        FaultKind(
            f"{channel} dead, then a touch",
            then(breaks(saturate_after=0, saturate_count=0, stuck_channel=channel), touch),
            touched=True,
            variant=channel != "touch_current",
        )
        for channel in ("touch_current", "touch_c", "touch_d")
    ],
)
