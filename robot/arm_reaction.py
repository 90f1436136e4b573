"""What the guard does with the arm: stop it, see it stand, move it away, latch. Pure: states and time in, commands out.

    ARMED --stop--> STOPPING --standing--> RETREATING --made, or over--> HALTING --standing--> LATCHED
     |  ^              ^ |                                                                     |    ^
     |  +-- free --+   | +-- standing, and no movement is wanted or possible ------------------|----+
     +-- slow --> SLOWED --not slower, too long, a harder touch, a fault                       |
                       +---------- something moves the arm again, or nobody can see it --------+

A stop counts when measured joint speed says so, and is not given up before. Nothing but a person's reset leaves LATCHED
for good, and the arm is watched until it is armed again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from coneskin.errors import RobotRefused

from .arm_checks import arm_faults
from .commands import ArmState, ContactOnLink, Reaction
from .controller_clock import ControllerClock
from .latch import Latch
from .outputs import Command, Output, Outputs, tell
from .owner_messages import Clear, Halt, Stop
from .phase import Phase
from .rules import Rule, Rules
from .slow_down import SlowDown
from .speed_slider import decode_fraction
from .state_reader import ControllerState, decode_state
from .stop_watch import StopWatch, Use, Way
from .ur_models import ArmModel
from .watch import Watch

if TYPE_CHECKING:  # a reaction that only stops loads neither
    from .leaving import Leaving
    from .mover import Mover

__all__ = ["ArmReaction", "Command", "Output", "Outputs", "Phase"]

_RESTARTS = 3  # times that a latched arm was moved again, from which on it is stopped by the strongest way


class ArmReaction:
    """One arm under guard.

    Args:
        model: the arm.
        reaction: what it does when it is touched and no rule fits.
        watch: the limits.
        ways: the ways to stop that there are; the first is used for every stop, the others where it does not work.
            Without OWNER, whoever moves the arm is not known here.
        rules: reactions with conditions.
        mover: moves the arm away; None where no reaction does.

    Attributes:
        phase: where it is.
        state: newest measured state, or None before the first.
        owner_ready: whether the process is ready that stops the arm when this one is gone: the owner, or the keeper.
        owned: whether ur_rtde moves the arm, in a process of ours.
        slow_down: of the slow reaction; it has to know where the controller's speed slider is.

    Raises:
        RobotRefused: a reaction moves the arm, and there is no mover.
    """

    #: how what the arm's controller sends is read; here, so that a guard without an arm loads neither
    decode_state = staticmethod(decode_state)
    decode_slider = staticmethod(decode_fraction)

    def __init__(
        self,
        model: ArmModel,
        reaction: Reaction,
        watch: Watch,
        ways: tuple[Way, ...],
        rules: tuple[Rule, ...] = (),
        mover: Mover | None = None,
    ) -> None:
        self.phase = Phase.STARTING
        self.state: ControllerState | None = None
        self.owner_ready = False
        self.slow_down = SlowDown()
        self.owned = Way.OWNER in ways
        self._model = model
        self._rules = Rules(reaction, rules)
        self._plain = not rules and reaction.kind in ("stop", "retreat")
        if mover is None and self._rules.move:
            raise RobotRefused("a reaction that moves the arm away needs a mover")
        self._watch = watch
        self._ways = ways
        self._mover = mover
        self._first = ways[0]
        self._clock = ControllerClock()
        self._stop: StopWatch | None = None
        self._leaving: Leaving | None = None
        self._reaction = reaction  # the one that is under way
        self._at_touch: ArmState | None = None
        self._touch_speed = 0.0
        self._levels: dict[int, float] = {}  # link -> firmest since the touch began
        self._contacts: Sequence[ContactOnLink] = ()  # now
        self._placed: Sequence[ContactOnLink] = ()  # as last seen while the arm stopped
        self._fresh = -math.inf  # host time of the newest state that was a new one
        self._may_move, self._why = False, ""
        self._latch: Latch | None = None
        self._restarts = 0  # since it was armed

    @property
    def needs_slider(self) -> bool:
        """Whether a reaction may use the controller's speed slider."""
        return "slow" in self._rules.kinds

    @property
    def steers(self) -> bool:
        """Whether a reaction may move an arm that is not ours, through a program that follows."""
        return self._rules.move and not self.owned

    def arm(self, out: Outputs) -> None:
        """Let the program move the arm, and react from now on."""
        self.phase, self._reaction = Phase.ARMED, self._rules.default
        self._latch, self._restarts = None, 0
        if Way.OWNER in self._ways:
            out.append(Clear())

    def touch(self, now: float, link: int, level: float, began: bool, out: Outputs) -> None:
        """A touch of a link has begun, or has changed, at a host time [s] and with a level."""
        phase = self.phase
        if phase is Phase.ARMED:
            if self._plain:  # nothing to choose: the stop is out before anything is looked at
                self._stop_now(now, "touch", True, out)
            self._touch_speed, self._levels = math.inf if self.state is None else self.state.speed, {link: level}
            if self._plain:
                return
            reaction = self._reaction = self._rules.choose(link, level, self._touch_speed)
            if reaction.kind == "slow" and self.slow_down.begin(now, self._touch_speed, reaction, self._watch, out):
                self.phase = Phase.SLOWED
            else:
                self._stop_now(now, "touch", True, out)
            return
        self._levels[link] = max(level, self._levels.get(link, 0.0))
        if phase is Phase.SLOWED or (phase is Phase.RETREATING and self._reaction.kind == "comply"):
            reaction = self._rules.choose(link, level, self._touch_speed)
            if reaction.kind in ("slow", self._reaction.kind):
                return
            self._reaction = reaction
            if phase is Phase.SLOWED:
                self._stop_now(now, "touch", True, out)
            else:
                self._halt(now, "touch", out)
        elif phase is Phase.RETREATING and began:
            self._halt(now, "touch", out)

    def locate(self, contacts: Sequence[ContactOnLink]) -> None:
        """Say where the touches are that there are now."""
        self._contacts = contacts
        if contacts and self.phase is Phase.STOPPING:
            self._placed = contacts

    def fault(self, now: float, why: str, out: Outputs) -> None:
        """Something is wrong: stop, and do not move any more."""
        if self.phase in (Phase.ARMED, Phase.SLOWED):
            self._stop_now(now, why, False, out)
        elif self.phase is Phase.RETREATING:
            self._halt(now, why, out)
        elif self.phase is Phase.STOPPING:
            self._why, self._may_move = why, False

    def lose(self, ways: frozenset[Way], now: float, for_good: bool = True) -> None:
        """These ways to stop are gone, or this stop shall not count on them: take the next one at once."""
        self._ways = tuple(way for way in self._ways if way not in ways or not for_good)
        if self._stop is not None:
            self._stop.forget(ways, now)

    def sample(self, state: ControllerState, out: Outputs) -> None:
        """Take a measured state."""
        if self.state is None or state.controller_time != self.state.controller_time:
            self._fresh = state.time
        self.state = state
        measured_at = self._clock.measured_at(state.time, state.controller_time)
        if self._mover is not None:
            self._mover.note(measured_at, state.q)
        if self._stop is not None:
            self._follow(self._stop, state, measured_at, out)
        elif self._leaving is not None:
            self._move(state, self._leaving, out)
        elif self.slow_down.now is not None:
            self.slow_down.now.sample(state.time, state.speed)
        elif self._latch is not None and self._latch.moved(state, bool(self._contacts)):
            self._restarts += 1
            self._stop_now(state.time, self._again("something moved the arm"), False, out)

    def look(self, now: float, out: Outputs) -> None:
        """What only the passing of time shows."""
        if (stop := self._stop) is not None:
            self._escalate(now, stop, out)
        elif self.phase is Phase.SLOWED:
            if why := self.slow_down.look(now, bool(self._contacts)):
                self._stop_now(now, why, False, out)
            elif self.slow_down.over(now):
                self.phase = Phase.ARMED
                self.slow_down.put_back(now, out)
                tell(out, "resumed", now, slider=self.slow_down.slider)
        elif self.phase is Phase.LATCHED and self.silent(now):
            self._stop_now(now, self._again("the controller fell silent"), False, out)

    def silent(self, now: float) -> bool:
        """Whether the controller's newest state is too old; one that repeats itself is."""
        return now - self._fresh > self._watch.arm_silence

    def unsound(self, now: float) -> list[str]:
        """Why the arm must not be armed, one line each."""
        wrong = []
        if not self.owner_ready:
            wrong.append("ur_rtde is not ready" if self.owned else "the process that watches the guard is not ready")
        if self.needs_slider and not self.slow_down.knows(now):
            wrong.append("where the controller's speed slider is, is not known")
        if self.state is None or self.silent(now):
            return [*wrong, "the controller is silent"]
        return wrong + arm_faults(self._model, self.state)

    # ---- what it does

    def _again(self, what: str) -> str:
        """Why a latched arm is stopped once more: what it was first, and this."""
        return f"{self._why.partition('; then ')[0]}; then {what}"

    def _escalate(self, now: float, stop: StopWatch, out: Outputs) -> None:
        rounds, used = stop.rounds, len(stop.used)
        for way in stop.next_ways(now):
            out.append(Use(way, self._reaction.deceleration))
            if len(stop.used) > used:
                tell(out, "escalated", now, way=way.value)
        if stop.rounds > rounds and (stop.rounds & rounds) == 0:  # the first, second, fourth ... time
            tell(out, "not_standing", now, rounds=stop.rounds, speed=None if self.state is None else self.state.speed)

    def _stop_now(self, now: float, why: str, may_move: bool, out: Outputs) -> None:
        self._begin(now, Phase.STOPPING, Stop(self._reaction.deceleration), out)
        self._why, self._may_move = why, may_move
        state = self.state
        self._placed, self._at_touch = (), None if state is None else ArmState(state.time, state.q, state.qd)
        tell(out, "stopping", now, why=why)

    def _halt(self, now: float, why: str, out: Outputs) -> None:
        self._begin(now, Phase.HALTING, Halt(self._reaction.deceleration), out)
        self._why = why
        tell(out, "stopping", now, why=why)

    def _begin(self, now: float, phase: Phase, command: Stop | Halt, out: Outputs) -> None:
        ways = self._ways
        if self._restarts >= _RESTARTS and Way.PROTECTIVE in ways:
            ways = (Way.PROTECTIVE, *(way for way in ways if way is not Way.PROTECTIVE))
        for first in ways[:1]:
            out.append(command if first is Way.OWNER else Use(first, command.deceleration))
        if self._leaving is not None:
            self._leaving.end(out)
        state, watch = self.state, self._watch
        speed = None if state is None or self.silent(now) else state.speed
        budget = watch.stop_budget(speed or 0.0, command.deceleration)
        self._stop = StopWatch(now, speed, ways, watch.escalate, budget, watch.standstill, watch.arm_silence)
        self._leaving = self._latch = None
        self.phase = phase

    def _follow(self, stop: StopWatch, state: ControllerState, measured_at: float, out: Outputs) -> None:
        before = stop.slowed_at
        stop.sample(state.time, state.speed, measured_at)
        if before is None and stop.slowed_at is not None and not stop.rippled:
            tell(out, "slower", state.time, speed=state.speed)
        if stop.standing_at is None:
            return
        tell(out, "standstill", state.time, speed=state.speed, ways=[way.value for way in stop.used])
        self._stop = None
        self.slow_down.put_back(state.time, out)
        if self.phase is Phase.HALTING or not (self._may_move and self._placed):
            self._stay(state.time, self._why, out)
            return
        self._reaction = self._rules.hardest(self._levels.items(), self._touch_speed)  # how firm it was shows by now
        if self._reaction.kind in ("stop", "slow"):
            self._stay(state.time, self._why, out)
        elif stop.used != [self._first]:
            who = "ur_rtde" if self.owned else "a program"
            self._stay(state.time, f"{self._why}; no retreat: {who} did not stop the arm", out)
        else:
            self._begin_movement(state, out)

    def _begin_movement(self, state: ControllerState, out: Outputs) -> None:
        assert self._mover is not None
        here = ArmState(state.time, state.q, state.qd)
        leaving = self._mover.begin(self._reaction, self._at_touch or here, here, self._placed, out)
        if isinstance(leaving, str):
            self._stay(state.time, f"{self._why}; no retreat: {leaving}", out)
            return
        self.phase, self._leaving = Phase.RETREATING, leaving
        self._move(state, leaving, out)

    def _move(self, state: ControllerState, leaving: Leaving, out: Outputs) -> None:
        over = leaving.step(state, self._contacts, out)
        if over is not None:
            made = "gave way" if leaving.how == "push" else "retreat"
            self._why += f"; {made} {1e3 * over.progress:.1f} mm: {over.reason}"
            details = {"progress": over.progress, "complete": over.complete, "why": over.reason, **leaving.details}
            self._begin(state.time, Phase.HALTING, Halt(self._reaction.deceleration), out)
            tell(out, "retreated", state.time, **details)

    def _stay(self, now: float, why: str, out: Outputs) -> None:
        self.phase, self._why = Phase.LATCHED, why
        self._latch = Latch(self._watch.standstill)
        tell(out, "latched", now, why=why)
