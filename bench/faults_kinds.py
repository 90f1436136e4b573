"""What goes wrong in bench/faults.py: one entry for each kind of fault, with the time in which it must be noticed."""

from __future__ import annotations

import resource
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from faults_trial import ARM_SILENCE, CLOCK, GOAL, RETREAT, SKIN_SILENCE, SLOW, STUCK, Trial
from scenes import ESCALATE

from coneskin.robot.owner_messages import SILENCE

BOTH, OWNER, FOREIGN = ("owner", "foreign"), ("owner",), ("foreign",)
FRAME = 0.001
WATCHDOG = 0.25  # s: 1 / watchdog_hz
FEW = 0.02  # s: a fault in the frames themselves shows within a few of them, and the loop has to run
ASTRAY = 0.35  # s: an arm that takes up its speed may differ from what it is told for 0.25 s and v / a
SLOWER = 0.2  # s: a touched arm that becomes faster again is given the time of a slowdown
STARTS = 0.05  # s: a program needs 10 ms to start, and five states have to show that the arm moves
SILENT = 0.25  # s: a latched arm that nobody sees is stopped again and again, at least every 0.2 s
LAST = 1.05  # s: the process that started the guard has heard nothing for 1 s, and opens its sockets


@dataclass(frozen=True)
class FaultKind:
    """A kind of fault.

    Attributes:
        name: for people, and for --kinds.
        inject: does it; returns the time from which the arm has to stand within the budget.
        notice: time within which the guard must notice [s].
        controls: the control modes in which it makes sense.
        touched: the skin is touched, so that the arm may retreat.
        tolerated: the arm may go on; then it is touched, and the time counts from the touch.
        recorder: what is recorded ends with the fault, because what records is gone.
        answers: the program is there to be told.
        before: it is wrong before the guard arms, so the guard has to refuse.
        arm: there is an arm left whose standstill can be measured; otherwise time runs until the guard sends its stop.
        after: what happens once the arm stands; nothing of it may move the arm.
        variant: close to another kind; a quick campaign leaves it out.
        reaction: of the scene.
        still: the arm stands already, and may not move at all.
    """

    name: str
    inject: Callable[[Trial], float]
    notice: float = FEW
    controls: tuple[str, ...] = BOTH
    touched: bool = False
    tolerated: bool = False
    recorder: bool = True
    answers: bool = True
    before: bool = False
    arm: bool = True
    after: Callable[[Trial], object] | None = None
    variant: bool = False
    reaction: str = RETREAT
    still: bool = False


def frozen_controller(t: Trial) -> float:
    """The arm of a controller that is frozen is frozen too: time counts from when it goes on."""
    t.happened = CLOCK()
    t.simulated.freeze()
    time.sleep(2.0 * ARM_SILENCE)
    t.simulated.thaw()
    return CLOCK()


def killed_controller(t: Trial) -> float:
    at = CLOCK()
    t.simulated.kill()
    return at


def a_program(t: Trial) -> float:
    """Somebody starts a program that moves the arm on, in place of the one that runs."""
    at = CLOCK()
    t.send_script(f"def other():\n  movej({GOAL}, a=2, v=1)\nend\n")
    return at


def full_disk(t: Trial) -> float:
    """The file that the recorder writes cannot grow any more."""
    at, size = CLOCK(), t.recording.stat().st_size + t.rng.randrange(5000)
    resource.prlimit(t.program.pid, resource.RLIMIT_FSIZE, (size, size))
    return at


def together(*parts: Callable[[Trial], float]) -> Callable[[Trial], float]:
    """One after the other, as quickly as possible; the time of the first counts."""

    def inject(t: Trial) -> float:
        return min([part(t) for part in parts])

    return inject


def then(*parts: Callable[[Trial], float]) -> Callable[[Trial], float]:
    """One after the other; the time of the last counts."""

    def inject(t: Trial) -> float:
        return [part(t) for part in parts][-1]

    return inject


def breaks(**faults: int | str) -> Callable[[Trial], float]:
    return lambda t: t.breaks(**faults)


def wires(wiring: str) -> Callable[[Trial], float]:
    return lambda t: t.breaks(wiring=wiring, wiring_after=0)


def shorted(a: str, b: str, touched: bool = False, variant: bool = False) -> FaultKind:
    return FaultKind(f"{a} shorted to {b}", wires(f"short-{a}-{b}"), touched=touched, variant=variant)


def away(
    name: str, inject: Callable[[Trial], float], notice: float = FEW, controls: tuple[str, ...] = BOTH, **more: Any
) -> FaultKind:
    """While the arm moves away from a touch."""
    return FaultKind(
        f"moving away: {name}", then(Trial.move_away, inject), notice, controls=controls, touched=True, **more
    )


def slow(
    name: str, inject: Callable[[Trial], float], notice: float = FEW, controls: tuple[str, ...] = BOTH, **more: Any
) -> FaultKind:
    """While the arm goes on slowly under a touch."""
    injects = then(Trial.go_slow, inject)
    return FaultKind(f"slow: {name}", injects, notice, controls=controls, touched=True, reaction=SLOW, **more)


def says(line: str) -> Callable[[Trial], float]:
    return lambda t: t.controller(line)


def kill(who: str) -> Callable[[Trial], float]:
    return lambda t: t.signal(who, signal.SIGKILL)


def halt(who: str) -> Callable[[Trial], float]:
    return lambda t: t.signal(who, signal.SIGSTOP)


def end(who: str) -> Callable[[Trial], float]:
    return lambda t: t.signal(who, signal.SIGTERM)


def pause(_: Trial) -> float:
    time.sleep(0.5)
    return CLOCK()


def unplug(t: Trial) -> float:
    return t.skins(unplug=True)


touch = Trial.touch

KINDS = (
    # nothing but a touch: the campaign's own floor
    FaultKind("touch", touch, touched=True),
    # the skin
    FaultKind("skin silent", breaks(stall_after=0), SKIN_SILENCE),
    FaultKind("skin silent for 0.3 s", breaks(stall_after=0, stall_frames=300), SKIN_SILENCE, variant=True),
    FaultKind("skin skips 50 frames", breaks(stall_after=0, stall_frames=50), 0.05 + FEW),
    FaultKind("skin drops every third frame", breaks(drop_every=3)),
    FaultKind("skin drops every 60th frame", breaks(drop_every=60), tolerated=True, variant=True),
    FaultKind("skin corrupt, every second frame", breaks(corrupt_every=2)),
    FaultKind("skin corrupt, every frame", breaks(corrupt_every=1), SKIN_SILENCE, variant=True),
    FaultKind("skin sends garbage between frames", breaks(garbage_every=1)),
    FaultKind("skin stuck", breaks(stuck_after=0), STUCK * FRAME + FEW),
    FaultKind(
        "skin stuck, supply alone", breaks(stuck_after=0, stuck_channel="supply"), STUCK * FRAME + FEW, variant=True
    ),
    FaultKind("skin saturated", breaks(saturate_after=0)),
    FaultKind("skin saturated, one guide", breaks(saturate_after=0, stuck_channel="radial_c"), variant=True),
    FaultKind("skin stuck at zero", breaks(saturate_after=0, saturate_count=0), variant=True),
    FaultKind("skin replays what it sent", lambda t: t.skins(replay=300)),
    FaultKind("skin out of order", breaks(swap_every=2)),
    FaultKind("skin sends everything twice", breaks(duplicate_every=1), variant=True),
    FaultKind("skin cut in a frame, once", breaks(cut_after=0), tolerated=True),
    FaultKind("skin cut in a frame, then silent", breaks(cut_after=0, stall_after=1), SKIN_SILENCE, variant=True),
    FaultKind("skin later and later", lambda t: t.skins(slow=1.0), 2.0 * SKIN_SILENCE + FEW),
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
    FaultKind("another program started, then a touch", then(a_program, touch), touched=True),
    # the processes
    FaultKind("guard killed", kill("guard")),
    FaultKind("guard frozen", halt("guard"), SILENCE, after=Trial.thaw_all),
    FaultKind("guard told to end", end("guard")),
    FaultKind("owner killed", kill("owner"), controls=OWNER),
    FaultKind("owner frozen", halt("owner"), WATCHDOG, controls=OWNER, after=Trial.thaw_all),
    FaultKind(
        "owner frozen, then a touch",
        then(halt("owner"), touch),
        ESCALATE,
        controls=OWNER,
        touched=True,
        after=Trial.thaw_all,
    ),
    FaultKind("owner told to end", end("owner"), controls=OWNER, variant=True),
    FaultKind("keeper killed", kill("keeper"), controls=FOREIGN),
    FaultKind("keeper told to end", end("keeper"), controls=FOREIGN, variant=True),
    FaultKind(
        "keeper frozen, then a touch",
        then(halt("keeper"), touch),
        controls=FOREIGN,
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
    FaultKind("guard and owner killed", together(kill("guard"), kill("owner")), WATCHDOG, controls=OWNER),
    FaultKind(
        "guard frozen and owner killed",
        together(halt("guard"), kill("owner")),
        WATCHDOG,
        controls=OWNER,
        after=Trial.thaw_all,
        variant=True,
    ),
    FaultKind(
        "guard and owner frozen",
        together(halt("guard"), halt("owner")),
        WATCHDOG,
        controls=OWNER,
        after=Trial.thaw_all,
    ),
    FaultKind("guard and keeper killed", together(kill("guard"), kill("keeper")), controls=FOREIGN),
    FaultKind(
        "guard and keeper frozen",
        together(halt("guard"), halt("keeper")),
        LAST,
        controls=FOREIGN,
        after=Trial.thaw_all,
    ),
    FaultKind("skin unplugged and RTDE closed", together(unplug, says("close rtde"))),
    FaultKind(
        "skin silent and dashboard closed", together(breaks(stall_after=0), says("close dashboard")), variant=True
    ),
    FaultKind("a touch and guard killed", together(touch, kill("guard")), touched=True),
    FaultKind("a touch and owner killed", together(touch, kill("owner")), controls=OWNER, touched=True),
    FaultKind("a touch and RTDE closed", together(touch, says("close rtde")), touched=True),
    FaultKind(
        "owner frozen and script ports closed",
        together(halt("owner"), says("close scripts")),
        ESCALATE,
        controls=OWNER,
        after=Trial.thaw_all,
    ),
    FaultKind("script ports and dashboard closed", together(says("close scripts"), says("close dashboard"))),
    FaultKind("skin unplugged and program killed", together(unplug, kill("program")), recorder=False, answers=False),
    # while it moves away from a touch
    away("guard killed", kill("guard")),
    away("guard frozen", halt("guard"), WATCHDOG, after=Trial.thaw_all),
    away("owner killed", kill("owner"), WATCHDOG, controls=OWNER, variant=True),
    away("owner frozen", halt("owner"), WATCHDOG, controls=OWNER, after=Trial.thaw_all),
    away("guard and owner frozen", together(halt("guard"), halt("owner")), WATCHDOG, OWNER, after=Trial.thaw_all),
    away("guard and keeper frozen", together(halt("guard"), halt("keeper")), WATCHDOG, FOREIGN, after=Trial.thaw_all),
    away("guard and keeper killed", together(kill("guard"), kill("keeper")), WATCHDOG, FOREIGN, variant=True),
    away("program killed", kill("program"), recorder=False, answers=False, variant=True),
    away("another program", a_program, ASTRAY),
    away("skin unplugged", unplug),
    away("RTDE closed", says("close rtde")),
    away("script ports closed", says("close scripts"), variant=True),
    away("protective stop", says("protective stop"), variant=True),
    # while it goes on slowly under a touch
    slow("guard killed", kill("guard")),
    slow("guard frozen", halt("guard"), SILENCE, after=Trial.thaw_all),
    slow("owner killed", kill("owner"), WATCHDOG, controls=OWNER, variant=True),
    slow("owner frozen", halt("owner"), WATCHDOG, controls=OWNER, after=Trial.thaw_all, variant=True),
    slow("skin unplugged", unplug),
    slow("RTDE closed", says("close rtde"), variant=True),
    slow("program killed", kill("program"), recorder=False, answers=False, variant=True),
    slow("another program", a_program, SLOWER, controls=OWNER),  # a foreign one just goes on slowly as well
    # while it stands latched
    FaultKind("latched: a program starts", then(Trial.latch, a_program), STARTS, touched=True, still=True),
    FaultKind(
        "latched: RTDE silent, then a program",
        then(Trial.latch, says("rtde silent"), pause, a_program),
        SILENT,
        controls=FOREIGN,
        touched=True,
        still=True,
    ),
    # before the guard arms
    FaultKind("refused: skin silent", breaks(stall_after=0), before=True, variant=True),
    FaultKind("refused: skin broken wire", wires("open-A"), before=True),
    FaultKind("refused: skin touched", lambda t: t.skins(touch={"u": 0.1, "phi": 1.0, "duration": 60.0}), before=True),
    FaultKind("refused: protective stop", says("protective stop"), before=True),
    FaultKind("refused: emergency stop", says("emergency stop"), before=True, variant=True),
    FaultKind("refused: RTDE silent", says("rtde silent"), before=True, variant=True),
    FaultKind("refused: controller killed", killed_controller, before=True, arm=False),
)
