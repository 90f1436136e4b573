"""Kind of fault of bench `faults`, and the parts that its injections are made of."""

from __future__ import annotations

import resource
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .setup import ARM_SILENCE, CLOCK, GOAL, LONG_SLOW, USUAL_SETUP, Setup
from .trial import Trial

BOTH, INTERNAL, EXTERNAL = ("internal", "external"), ("internal",), ("external",)
FRAME_TIME = 0.001  # s
WATCHDOG_TIME = 0.25  # s; 1 / watchdog_hz
FEW_FRAMES_TIME = 0.02  # s; a fault in the frames themselves shows within a few of them, and the loop has to run
DEVIATION_TIME = 0.35  # s; an arm that takes up its speed may deviate from the command for 0.25 s and v / a
SLOWDOWN_TIME = 0.2  # s; a touched arm that becomes faster again is given the time of a slowdown
START_TIME = 0.05  # s; a program needs 10 ms to start, and five states have to show that the arm moves
LATCHED_SILENCE = 0.25  # s; a latched arm without states is stopped again and again, at least every 0.2 s
FALLBACK_TIME = 1.05  # s; the process that started the guard has heard nothing for 1 s, and opens its sockets


@dataclass(frozen=True)
class FaultKind:
    """Kind of fault.

    Attributes:
        name: for people, and for --kinds.
        inject: injects the fault; returns the time from which the arm has to stand within the budget.
        notice: time within which the guard must notice [s].
        controls: the control modes in which it makes sense.
        touched: the skin is touched, so that the arm may retreat.
        tolerated: the arm may go on; then it is touched, and the time counts from the touch.
        recorder: False where the recording ends with the fault, because the recorder is gone.
        answers: the program is there to be informed.
        before: the fault is there before the guard is active, so the guard has to refuse.
        arm: there is an arm left whose standstill can be measured; otherwise time runs until the guard sends its stop.
        after: what happens once the arm stands; nothing of it may move the arm.
        variant: close to another kind; a quick campaign leaves it out.
        setup: of the trial: reaction, skins, what moves the arm, what the program does besides.
        still: the arm stands already, and may not move at all.
        restarts: what moves the arm starts again after each stop; time runs until the arm stands for good.
    """

    name: str
    inject: Callable[[Trial], float]
    notice: float = FEW_FRAMES_TIME
    controls: tuple[str, ...] = BOTH
    touched: bool = False
    tolerated: bool = False
    recorder: bool = True
    answers: bool = True
    before: bool = False
    arm: bool = True
    after: Callable[[Trial], object] | None = None
    variant: bool = False
    setup: Setup = USUAL_SETUP
    still: bool = False
    restarts: bool = False


def frozen_controller(t: Trial) -> float:
    """Freeze the controller, and with it the arm; time counts from when it goes on."""
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
    """Start a program that moves the arm on, in place of the one that runs."""
    at = CLOCK()
    t.send_script(f"def other():\n  movej({GOAL}, a=2, v=1)\nend\n")
    return at


def full_disk(t: Trial) -> float:
    """Keep the file that the recorder writes from growing."""
    at, size = CLOCK(), t.recording.stat().st_size + t.rng.randrange(5000)
    resource.prlimit(t.program.pid, resource.RLIMIT_FSIZE, (size, size))
    return at


def together(*parts: Callable[[Trial], float]) -> Callable[[Trial], float]:
    """Inject one after the other, as quickly as possible; the time of the first counts."""

    def inject(t: Trial) -> float:
        return min([part(t) for part in parts])

    return inject


def then(*parts: Callable[[Trial], float]) -> Callable[[Trial], float]:
    """Inject one after the other; the time of the last counts."""

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
    name: str,
    inject: Callable[[Trial], float],
    notice: float = FEW_FRAMES_TIME,
    controls: tuple[str, ...] = BOTH,
    **more: Any,
) -> FaultKind:
    """Inject while the arm moves away from a touch."""
    return FaultKind(
        f"moving away: {name}", then(Trial.move_away, inject), notice, controls=controls, touched=True, **more
    )


def slow(
    name: str,
    inject: Callable[[Trial], float],
    notice: float = FEW_FRAMES_TIME,
    controls: tuple[str, ...] = BOTH,
    **more: Any,
) -> FaultKind:
    """Inject while the arm goes on slowly, away from a touch."""
    injects = then(Trial.go_slow, inject)
    return FaultKind(
        f"slow: {name}", injects, notice, controls=controls, touched=True, setup=Setup(reaction=LONG_SLOW), **more
    )


def says(line: str) -> Callable[[Trial], float]:
    return lambda t: t.controller(line)


def kill(process: str) -> Callable[[Trial], float]:
    return lambda t: t.signal(process, signal.SIGKILL)


def halt(process: str) -> Callable[[Trial], float]:
    return lambda t: t.signal(process, signal.SIGSTOP)


def end(process: str) -> Callable[[Trial], float]:
    return lambda t: t.signal(process, signal.SIGTERM)


def pause(seconds: float = 0.5) -> Callable[[Trial], float]:
    """Let time pass."""

    def wait(_: Trial) -> float:
        time.sleep(seconds)
        return CLOCK()

    return wait


def unplug(t: Trial) -> float:
    return t.skins(unplug=True)


touch = Trial.touch
