"""Kinds of fault of what the guard is connected to: the skin, the controller, the network, another driver.

Those of the network drop every packet while the arm lives, on all ports or on some. Those of the driver need
--external-control SCRIPT: Universal Robots' own external_control.urscript moves the arm, and external_control_peer.py
is the driver, on the other end of its reverse interface. To the guard the motion is another's; it stops the arm.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from .kind import (
    EXTERNAL,
    FEW_FRAMES_TIME,
    FRAME_TIME,
    INTERNAL,
    WATCHDOG_TIME,
    FaultKind,
    a_program,
    away,
    breaks,
    frozen_controller,
    halt,
    kill,
    killed_controller,
    pause,
    says,
    shorted,
    slow,
    then,
    together,
    touch,
    unplug,
    wires,
)
from .setup import ARM_SILENCE, SKIN_SILENCE, STUCK_FRAMES, Setup
from .trial import MOTIONS, Trial

SKIN_KINDS = (
    # nothing but a touch: the campaign's own baseline
    FaultKind("touch", touch, touched=True),
    # the skin
    FaultKind("skin silent", breaks(stall_after=0), SKIN_SILENCE),
    FaultKind("skin silent for 0.3 s", breaks(stall_after=0, stall_frames=300), SKIN_SILENCE, variant=True),
    FaultKind("skin skips 50 frames", breaks(stall_after=0, stall_frames=50), 0.05 + FEW_FRAMES_TIME),
    FaultKind("skin drops every third frame", breaks(drop_every=3)),
    FaultKind("skin drops every 60th frame", breaks(drop_every=60), tolerated=True, variant=True),
    FaultKind("skin corrupt, every second frame", breaks(corrupt_every=2)),
    FaultKind("skin corrupt, every frame", breaks(corrupt_every=1), SKIN_SILENCE, variant=True),
    FaultKind("skin sends garbage between frames", breaks(garbage_every=1)),
    FaultKind("skin stuck", breaks(stuck_after=0), STUCK_FRAMES * FRAME_TIME + FEW_FRAMES_TIME),
    FaultKind(
        "skin stuck, supply alone",
        breaks(stuck_after=0, stuck_channel="supply"),
        STUCK_FRAMES * FRAME_TIME + FEW_FRAMES_TIME,
        variant=True,
    ),
    FaultKind("skin saturated", breaks(saturate_after=0)),
    FaultKind("skin saturated, one guide", breaks(saturate_after=0, stuck_channel="radial_c"), variant=True),
    FaultKind("skin stuck at zero", breaks(saturate_after=0, saturate_count=0), variant=True),
    FaultKind("skin replays what it sent", lambda t: t.skins(replay=300)),
    FaultKind("skin out of order", breaks(swap_every=2)),
    FaultKind("skin sends everything twice", breaks(duplicate_every=1), variant=True),
    FaultKind("skin cut in a frame, once", breaks(cut_after=0), tolerated=True),
    FaultKind("skin cut in a frame, then silent", breaks(cut_after=0, stall_after=1), SKIN_SILENCE, variant=True),
    FaultKind("skin later and later", lambda t: t.skins(slow=1.0), 2.0 * SKIN_SILENCE + FEW_FRAMES_TIME),
    FaultKind("skin's process frozen", halt("skin"), SKIN_SILENCE, after=Trial.thaw_all, variant=True),
    FaultKind("skin unplugged", unplug, variant=True),
    FaultKind("skin unplugged and back", unplug, after=lambda t: t.skins(plug=True)),
    FaultKind("skin restarts", breaks(restart_after=0)),
    FaultKind("skin's clock jumps", breaks(clock_jump_after=0)),
    FaultKind("skin reports a self-test fault", breaks(status_after=0), variant=True),
    *[FaultKind(f"wire of {name} open", wires(f"open-{name}"), variant=name != "A") for name in "ABCD"],
    shorted("A", "ground", variant=True),
    shorted("B", "ground", variant=True),
    shorted("C", "supply"),
    shorted("D", "supply", variant=True),
    shorted("A", "B"),
    shorted("C", "D", variant=True),
    shorted("A", "C", touched=True),  # one sheet on the other is what a touch is: here, a firm one in a corner
)


CONTROLLER_KINDS = (
    # the controller
    FaultKind("controller frozen for 0.5 s", frozen_controller),
    FaultKind("controller killed", killed_controller, ARM_SILENCE, arm=False),
    FaultKind("RTDE closed", says("close rtde")),
    FaultKind(
        "RTDE silent", says("rtde silent"), ARM_SILENCE, after=lambda t: t.controller("rtde normal"), variant=True
    ),
    FaultKind("dashboard closed", says("close dashboard")),
    FaultKind("dashboard silent, then a touch", then(says("dashboard silent"), touch), touched=True),
    FaultKind("script ports closed", says("close scripts")),
    FaultKind("protective stop", says("protective stop")),
    FaultKind("emergency stop", says("emergency stop")),
    # with internal control the program's end is a fault by itself, before the touch
    FaultKind("another program started, then a touch", then(a_program, touch), touched=True, controls=EXTERNAL),
)


UPLOAD_TIME = 0.2  # s; the stop that goes through is not the first one
CUT_NETWORK_SAID = says("cut network")


def restore(t: Trial) -> None:
    """Let the network live again; nothing may move the arm then."""
    t.controller("restore network")


NETWORK_KINDS = (
    FaultKind("network cut", CUT_NETWORK_SAID, ARM_SILENCE + WATCHDOG_TIME, controls=INTERNAL, after=restore),
    FaultKind(
        "network cut, then a touch",
        then(CUT_NETWORK_SAID, touch),
        WATCHDOG_TIME,
        controls=INTERNAL,
        touched=True,
        after=restore,
    ),
    FaultKind(
        "network cut for 0.1 s",
        then(CUT_NETWORK_SAID, pause(0.1), says("restore network")),
        WATCHDOG_TIME,
        controls=INTERNAL,
        tolerated=True,
    ),
    FaultKind(
        "network cut and program killed",
        then(CUT_NETWORK_SAID, kill("program")),
        WATCHDOG_TIME,
        INTERNAL,
        answers=False,
    ),
    FaultKind(
        "network cut, controller's heartbeat",
        CUT_NETWORK_SAID,
        ARM_SILENCE + WATCHDOG_TIME,
        controls=EXTERNAL,
        setup=Setup(arm='controller_heartbeat = "required"', mover="heartbeat"),
        after=restore,
    ),
    FaultKind("RTDE cut", says("cut rtde"), ARM_SILENCE + UPLOAD_TIME),
    FaultKind("script ports cut, then a touch", then(says("cut scripts"), touch), UPLOAD_TIME, touched=True),
    FaultKind("dashboard cut, then a touch", then(says("cut dashboard"), touch), touched=True),
    FaultKind(
        "script ports and dashboard cut, then a touch",
        then(says("cut scripts"), says("cut dashboard"), touch),
        2.0 * UPLOAD_TIME,
        touched=True,
    ),
    FaultKind(
        "script ports and dashboard cut and guard killed",
        then(says("cut scripts"), says("cut dashboard"), kill("guard")),
        2.0 * UPLOAD_TIME,
    ),
    away("network cut", CUT_NETWORK_SAID, WATCHDOG_TIME, after=restore),
    slow("network cut", CUT_NETWORK_SAID, ARM_SILENCE + WATCHDOG_TIME, INTERNAL, after=restore),
)


SWITCH_TIME = 0.3  # s in which the guard sees a switch to local control
REQUIRED = 'controller_heartbeat = "required"'


def switch(t: Trial) -> float:
    """Switch to local control."""
    t.happened = t.controller("local control")
    return t.happened


def switch_and_touch(t: Trial) -> float:
    """Switch to local control, and touch the skin soon after; time runs from the switch."""
    at = switch(t)
    time.sleep(0.2 * t.rng.random())
    t.touch()
    return at


def switched(mover: str, how: str, controls: tuple[str, ...] = EXTERNAL) -> list[FaultKind]:
    """Return the kinds of a switch to local control in one motion: alone, and just before a touch."""
    slack = SWITCH_TIME + WATCHDOG_TIME + FEW_FRAMES_TIME  # a servoj has nothing but the controller's watchdog
    setup = Setup(reaction='kind = "stop"', arm=REQUIRED if mover in MOTIONS else "", mover=mover)
    return [
        FaultKind(f"local control in {how}", switch, slack, setup=setup, controls=controls),
        FaultKind(
            f"local control in {how}, then a touch",
            switch_and_touch,
            slack,
            setup=setup,
            touched=True,
            controls=controls,
        ),
    ]


#: a person switches the pendant to local control while the arm moves: the slider and the controller's watchdog are left
SWITCH_KINDS = (
    *switched("", "the guard's own move_j", controls=INTERNAL),
    *(kind for mover in MOTIONS for kind in switched(mover, mover.removeprefix("in ").replace("heartbeat", "movej"))),
    *switched("loop 20", "a loop of ur_rtde"),
)


CHILD_SILENCE = 0.34  # s; without a sign of life of the driver process or of the guard watchdog
HEARTBEAT_TIMEOUT = 0.55  # s; without one of the guard
DRIVER_MODES = ("servoj", "speedj")  # how the script moves the arm


def driven(
    name: str, inject: Callable[[Trial], float], notice: float = FEW_FRAMES_TIME, **more: object
) -> list[FaultKind]:
    """Return the kinds of a fault in both ways in which the script moves the arm."""
    return [
        FaultKind(
            f"external_control, {how}: {name}",
            inject,
            notice,
            controls=EXTERNAL,
            setup=Setup(mover=f"driver {how}"),
            variant=how == "speedj",
            **more,  # type: ignore[arg-type]
        )
        for how in DRIVER_MODES
    ]


DRIVER_KINDS = (
    *driven("touch", touch, touched=True),
    *driven("skin silent", breaks(stall_after=0), SKIN_SILENCE),
    *driven("guard killed", kill("guard")),
    *driven("guard frozen", halt("guard"), HEARTBEAT_TIMEOUT, after=Trial.thaw_all),
    *driven("watchdog killed", kill("watchdog")),
    *driven("watchdog frozen", halt("watchdog"), CHILD_SILENCE, after=Trial.thaw_all),
    *driven("guard and watchdog killed", together(kill("guard"), kill("watchdog"))),
    *driven("protective stop", says("protective stop")),
    *driven("another program started, then a touch", then(a_program, touch), touched=True),
    # the script waits 0.2 s for its driver, and stops by itself
    *driven("driver killed, then a touch", then(kill("mover"), touch), touched=True),
    *driven("driver frozen, then a touch", then(halt("mover"), touch), touched=True, after=Trial.thaw_all),
)
