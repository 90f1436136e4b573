"""Kinds of fault of the processes, alone and two at once, and of the program under guard, while the arm moves."""

from __future__ import annotations

import time

from coneskin.robot.driver.liveness import GUARD_SILENCE
from tests.support.scenes import ESCALATE

from .kind import (
    BOTH,
    EXTERNAL,
    FALLBACK_TIME,
    INTERNAL,
    WATCHDOG_TIME,
    FaultKind,
    away,
    breaks,
    end,
    full_disk,
    halt,
    kill,
    pause,
    says,
    slow,
    then,
    together,
    touch,
    unplug,
)
from .setup import CLOCK, Setup
from .trial import Trial

PROCESS_KINDS = (
    # the processes
    FaultKind("guard killed", kill("guard")),
    FaultKind("guard frozen", halt("guard"), GUARD_SILENCE, after=Trial.thaw_all),
    FaultKind("guard told to end", end("guard")),
    FaultKind("driver killed", kill("driver"), controls=INTERNAL),
    FaultKind("driver frozen", halt("driver"), WATCHDOG_TIME, controls=INTERNAL, after=Trial.thaw_all),
    FaultKind(
        "driver frozen, then a touch",
        then(halt("driver"), touch),
        ESCALATE,
        controls=INTERNAL,
        touched=True,
        after=Trial.thaw_all,
    ),
    FaultKind("driver told to end", end("driver"), controls=INTERNAL, variant=True),
    FaultKind("watchdog killed", kill("watchdog"), controls=EXTERNAL),
    FaultKind("watchdog told to end", end("watchdog"), controls=EXTERNAL, variant=True),
    FaultKind(
        "watchdog frozen, then a touch",
        then(halt("watchdog"), touch),
        controls=EXTERNAL,
        touched=True,
        after=Trial.thaw_all,
        variant=True,
    ),
    FaultKind("program killed", kill("program"), recorder=False, answers=False),
    FaultKind("program told to end", end("program"), recorder=False, answers=False, variant=True),
    FaultKind(
        "program frozen, then a touch",
        then(halt("program"), touch),
        touched=True,
        answers=False,
        after=Trial.thaw_all,
    ),
    FaultKind("disk full, then a touch", then(full_disk, touch), touched=True, recorder=False),
    # two at once
    FaultKind("guard and driver killed", together(kill("guard"), kill("driver")), WATCHDOG_TIME, controls=INTERNAL),
    FaultKind(
        "guard frozen and driver killed",
        together(halt("guard"), kill("driver")),
        WATCHDOG_TIME,
        controls=INTERNAL,
        after=Trial.thaw_all,
        variant=True,
    ),
    FaultKind(
        "guard and driver frozen",
        together(halt("guard"), halt("driver")),
        WATCHDOG_TIME,
        controls=INTERNAL,
        after=Trial.thaw_all,
    ),
    FaultKind("guard and watchdog killed", together(kill("guard"), kill("watchdog")), controls=EXTERNAL),
    FaultKind(
        "guard and watchdog frozen",
        together(halt("guard"), halt("watchdog")),
        FALLBACK_TIME,
        controls=EXTERNAL,
        after=Trial.thaw_all,
    ),
    FaultKind("skin unplugged and RTDE closed", together(unplug, says("close rtde"))),
    FaultKind(
        "skin silent and dashboard closed", together(breaks(stall_after=0), says("close dashboard")), variant=True
    ),
    FaultKind("a touch and guard killed", together(touch, kill("guard")), touched=True),
    FaultKind("a touch and driver killed", together(touch, kill("driver")), controls=INTERNAL, touched=True),
    FaultKind("a touch and RTDE closed", together(touch, says("close rtde")), touched=True),
    FaultKind(
        "driver frozen and script ports closed",
        together(halt("driver"), says("close scripts")),
        ESCALATE,
        controls=INTERNAL,
        after=Trial.thaw_all,
    ),
    FaultKind("script ports and dashboard closed", together(says("close scripts"), says("close dashboard"))),
    FaultKind("skin unplugged and program killed", together(unplug, kill("program")), recorder=False, answers=False),
)


PROGRAM_SILENCE = 0.25  # s; without a sign of life of the program
CHILD_SILENCE = 0.34  # s; without one of the driver process or of the guard watchdog
SETTLE_TIME = 0.9  # s; until an arm that is started again after each stop stands for good
RESTART_DELAYS = (5, 10, 20, 50, 100, 300)  # ms
BROKEN_MODULE = "raise SystemExit('a file of the current folder was imported')\n"


def restarted(how: str, wait: int) -> FaultKind:
    """Return the kind of a touch while the mover starts again after each stop."""
    return FaultKind(
        f"touch; {how} starts again after {wait} ms",
        then(Trial.start_again, touch) if how == "raw" else touch,
        SETTLE_TIME,
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
        f"{name} in the current folder",
        touch,
        touched=True,
        variant=variant,
        setup=Setup(files=((name, BROKEN_MODULE),)),
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
    *[restarted(how, wait) for how in ("loop", "raw") for wait in RESTART_DELAYS],
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
