"""Kinds of fault while the arm reacts to a touch, stands latched, or is to be refused."""

from __future__ import annotations

from coneskin.robot.driver.messages import HEARTBEAT_TIMEOUT

from .kind import (
    DEVIATION,
    EXTERNAL,
    INTERNAL,
    SILENT,
    SLOWER,
    STARTS,
    WATCHDOG,
    FaultKind,
    a_program,
    away,
    breaks,
    halt,
    kill,
    killed_controller,
    pause,
    says,
    slow,
    then,
    together,
    unplug,
    wires,
)
from .motion import Touch
from .trial import Trial

REACTION_KINDS = (
    # while it moves away from a touch
    away("guard killed", kill("guard")),
    away("guard frozen", halt("guard"), WATCHDOG, after=Trial.thaw_all),
    away("driver killed", kill("driver"), WATCHDOG, controls=INTERNAL, variant=True),
    away("driver frozen", halt("driver"), WATCHDOG, controls=INTERNAL, after=Trial.thaw_all),
    away("guard and driver frozen", together(halt("guard"), halt("driver")), WATCHDOG, INTERNAL, after=Trial.thaw_all),
    away(
        "guard and watchdog frozen",
        together(halt("guard"), halt("watchdog")),
        WATCHDOG,
        EXTERNAL,
        after=Trial.thaw_all,
    ),
    away("guard and watchdog killed", together(kill("guard"), kill("watchdog")), WATCHDOG, EXTERNAL, variant=True),
    away("program killed", kill("program"), recorder=False, answers=False, variant=True),
    away("another program", a_program, DEVIATION),
    away("skin unplugged", unplug),
    away("RTDE closed", says("close rtde")),
    away("script ports closed", says("close scripts"), variant=True),
    away("protective stop", says("protective stop"), variant=True),
    # while it goes on slowly under a touch
    slow("guard killed", kill("guard")),
    slow("guard frozen", halt("guard"), HEARTBEAT_TIMEOUT, after=Trial.thaw_all),
    slow("driver killed", kill("driver"), WATCHDOG, controls=INTERNAL, variant=True),
    slow("driver frozen", halt("driver"), WATCHDOG, controls=INTERNAL, after=Trial.thaw_all, variant=True),
    slow("skin unplugged", unplug),
    slow("RTDE closed", says("close rtde"), variant=True),
    slow("program killed", kill("program"), recorder=False, answers=False, variant=True),
    slow("another program", a_program, SLOWER, controls=INTERNAL),  # an external one just goes on slowly as well
    # while it stands latched
    FaultKind("latched: a program starts", then(Trial.latch, a_program), STARTS, touched=True, still=True),
    FaultKind(
        "latched: RTDE silent, then a program",
        then(Trial.latch, says("rtde silent"), pause(), a_program),
        SILENT,
        controls=EXTERNAL,
        touched=True,
        still=True,
    ),
    # before the guard arms
    FaultKind("refused: skin silent", breaks(stall_after=0), before=True, variant=True),
    FaultKind("refused: skin broken wire", wires("open-A"), before=True),
    FaultKind("refused: skin touched", lambda t: t.press(Touch(u=0.1, phi=1.0, duration=60.0)), before=True),
    FaultKind("refused: protective stop", says("protective stop"), before=True),
    FaultKind("refused: emergency stop", says("emergency stop"), before=True, variant=True),
    FaultKind("refused: RTDE silent", says("rtde silent"), before=True, variant=True),
    FaultKind("refused: controller killed", killed_controller, before=True, arm=False),
)
