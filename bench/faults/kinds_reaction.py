"""Kinds of fault while the arm reacts, stands latched, or is to be refused, and of contacts in each reaction.

Whatever the arm does, the surface must not go towards a contact by much more than in a bare stop.
"""

from __future__ import annotations

from coneskin.robot.driver.liveness import GUARD_SILENCE

from .kind import (
    DEVIATION_TIME,
    EXTERNAL,
    FEW_FRAMES_TIME,
    INTERNAL,
    LATCHED_SILENCE,
    SLOWDOWN_TIME,
    START_TIME,
    WATCHDOG_TIME,
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
from .motion import AHEAD, BEHIND, Touch
from .setup import COMPLY, RETREAT, SLOW, Setup
from .trial import Trial

SLOW_MAY_TAKE = 2.0  # s; an arm that goes on slowly stops when it presses, not before
REACTIONS = {"retreat": RETREAT, "comply": COMPLY, "slow": SLOW}
SEAM_WIDTH = 0.35  # rad on each side
SECOND_HAND_DELAY = 0.25  # s; by then an arm that was stopped moves away

#: name -> touches, model of the sheets, sensors
CONTACTS = {
    "palm over the seam": ((Touch(phi=SEAM_WIDTH, force=4.0), Touch(phi=6.28 - SEAM_WIDTH, force=4.0)), "field", 1),
    "wide palm over the seam": ((Touch(phi=1.0, force=3.0), Touch(phi=5.28, force=3.0)), "field", 1),
    "grip": ((Touch(phi=AHEAD), Touch(phi=BEHIND)), "field", 1),
    "second hand behind": ((Touch(), Touch(phi=BEHIND, after=SECOND_HAND_DELAY)), "field", 1),
    "second hand beside": ((Touch(), Touch(u=0.22, phi=2.6, after=SECOND_HAND_DELAY)), "field", 1),
    "growing press": ((Touch(force=2.0), Touch(after=0.05, force=18.0, rise=0.5)), "ladder", 1),
    "hard growing press": ((Touch(force=2.0), Touch(after=0.05, force=98.0, rise=0.5)), "ladder", 1),
    "clamp of two links": ((Touch(), Touch(sensor="1", phi=BEHIND)), "ladder", 2),
    "second hand on another skin": ((Touch(), Touch(sensor="1", phi=BEHIND, after=SECOND_HAND_DELAY)), "ladder", 2),
}
#: contacts that are close to others, and left out of a quick campaign but for a retreat
VARIANTS = ("wide palm over the seam", "second hand beside", "growing press")


def contact(reaction: str, name: str) -> FaultKind:
    """Return the kind of a contact in a reaction."""
    touches, sheets, skins = CONTACTS[name]
    return FaultKind(
        f"{reaction}: {name}",
        lambda t: Trial.press(t, *touches),
        SLOW_MAY_TAKE if reaction == "slow" else FEW_FRAMES_TIME,
        touched=True,
        variant=reaction != "retreat" and name in VARIANTS,
        setup=Setup(reaction=REACTIONS[reaction], sheets=sheets, skins=skins),
    )


CONTACT_KINDS = tuple(contact(reaction, name) for name in CONTACTS for reaction in REACTIONS)


REACTION_KINDS = (
    # while it moves away from a touch
    away("guard killed", kill("guard")),
    away("guard frozen", halt("guard"), WATCHDOG_TIME, after=Trial.thaw_all),
    away("driver killed", kill("driver"), WATCHDOG_TIME, controls=INTERNAL, variant=True),
    away("driver frozen", halt("driver"), WATCHDOG_TIME, controls=INTERNAL, after=Trial.thaw_all),
    away(
        "guard and driver frozen",
        together(halt("guard"), halt("driver")),
        WATCHDOG_TIME,
        INTERNAL,
        after=Trial.thaw_all,
    ),
    away(
        "guard and watchdog frozen",
        together(halt("guard"), halt("watchdog")),
        WATCHDOG_TIME,
        EXTERNAL,
        after=Trial.thaw_all,
    ),
    away("guard and watchdog killed", together(kill("guard"), kill("watchdog")), WATCHDOG_TIME, EXTERNAL, variant=True),
    away("program killed", kill("program"), recorder=False, answers=False, variant=True),
    away("another program", a_program, DEVIATION_TIME),
    away("skin unplugged", unplug),
    away("RTDE closed", says("close rtde")),
    away("script ports closed", says("close scripts"), variant=True),
    away("protective stop", says("protective stop"), variant=True),
    # while it goes on slowly under a touch
    slow("guard killed", kill("guard")),
    slow("guard frozen", halt("guard"), GUARD_SILENCE, after=Trial.thaw_all),
    slow("driver killed", kill("driver"), WATCHDOG_TIME, controls=INTERNAL, variant=True),
    slow("driver frozen", halt("driver"), WATCHDOG_TIME, controls=INTERNAL, after=Trial.thaw_all, variant=True),
    slow("skin unplugged", unplug),
    slow("RTDE closed", says("close rtde"), variant=True),
    slow("program killed", kill("program"), recorder=False, answers=False, variant=True),
    slow("another program", a_program, SLOWDOWN_TIME, controls=INTERNAL),  # an external one just goes on slowly as well
    # while it stands latched
    FaultKind("latched: a program starts", then(Trial.latch, a_program), START_TIME, touched=True, still=True),
    FaultKind(
        "latched: RTDE silent, then a program",
        then(Trial.latch, says("rtde silent"), pause(), a_program),
        LATCHED_SILENCE,
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
