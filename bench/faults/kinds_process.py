"""Kinds of fault of the processes, alone and two at once, while the arm moves."""

from __future__ import annotations

from coneskin.robot.driver.messages import HEARTBEAT_TIMEOUT
from coneskin.testing.scenes import ESCALATE

from .kind import (
    EXTERNAL,
    FALLBACK,
    INTERNAL,
    WATCHDOG,
    FaultKind,
    breaks,
    end,
    full_disk,
    halt,
    kill,
    says,
    then,
    together,
    touch,
    unplug,
)
from .trial import Trial

PROCESS_KINDS = (
    # the processes
    FaultKind("guard killed", kill("guard")),
    FaultKind("guard frozen", halt("guard"), HEARTBEAT_TIMEOUT, after=Trial.thaw_all),
    FaultKind("guard told to end", end("guard")),
    FaultKind("driver killed", kill("driver"), controls=INTERNAL),
    FaultKind("driver frozen", halt("driver"), WATCHDOG, controls=INTERNAL, after=Trial.thaw_all),
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
    FaultKind("guard and driver killed", together(kill("guard"), kill("driver")), WATCHDOG, controls=INTERNAL),
    FaultKind(
        "guard frozen and driver killed",
        together(halt("guard"), kill("driver")),
        WATCHDOG,
        controls=INTERNAL,
        after=Trial.thaw_all,
        variant=True,
    ),
    FaultKind(
        "guard and driver frozen",
        together(halt("guard"), halt("driver")),
        WATCHDOG,
        controls=INTERNAL,
        after=Trial.thaw_all,
    ),
    FaultKind("guard and watchdog killed", together(kill("guard"), kill("watchdog")), controls=EXTERNAL),
    FaultKind(
        "guard and watchdog frozen",
        together(halt("guard"), halt("watchdog")),
        FALLBACK,
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
