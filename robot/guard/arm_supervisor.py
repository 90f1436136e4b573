"""Supervisor of the arm under guard: it stops it, sees it stand, moves it away and latches. Pure.

What is decided is one value, and how it changes is one table (``phase``). Here are the senses and the hands of that:
what is measured becomes a cue, and what follows from it becomes commands.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from coneskin.core.errors import RobotRefused
from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.driver.messages import EndReaction, Release, StopProgram
from coneskin.robot.driver.protocol import ArmDriver
from coneskin.robot.driver.values import ControllerState, StopPath
from coneskin.robot.reaction.rules import RuleSet
from coneskin.robot.reaction.types import ArmState, Done, Reaction
from coneskin.robot.stop.arm_stop import ArmStop
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.robot.stop.state_age import StateAge

from .activation import ControllerNeeds
from .phase import Act, Cue, Phase, Supervision, transition
from .signals.contact import Contact, TouchRecord
from .signals.journal import SLIDER_HOLDS, TOUCH_CAUSE, EventName, Outputs, emit
from .speed.speed_reduction import SpeedReduction

if TYPE_CHECKING:  # a reaction that only stops loads neither
    from .controller_heartbeat import ControllerHeartbeat
    from .motion.setpoint_stream import MotionStream, ReactionPlanner
    from .speed.speed_limit import SpeedLimit

#: kept as in ``core``
_ACTIVE_PHASE: Final = Phase.ACTIVE
_SLOWED_PHASE: Final = Phase.SLOWED
_RETREATING_PHASE: Final = Phase.RETREATING
_PLACE_TIME: Final = 0.3  # s that a standing arm waits for the place of a touch; at 12 bits it takes 10 to 60 frames


def _arm_state(state: ControllerState) -> ArmState:
    return ArmState(state.time, state.q, state.qd)


class ArmSupervisor:
    """Supervisor of one arm.

    Args:
        model: the arm.
        driver: of the arm's controller.
        rules: what the arm does when it is touched.
        paths: the stop paths that there are. The first is used for every stop, the others where it does not work.
            Without DRIVER, what moves the arm is not known here.
        planner: of motions away from a touch. None where no reaction moves the arm.
        heartbeat: supervision of the program that moves the arm. None where that is the driver process.
        speed_limit: of the skins' surfaces. None where nothing limits them.
        held_braking: as of `ArmStop`.

    Attributes:
        model, driver, heartbeat: as given.
        supervision: all that is decided about the arm.
        state: newest measured state, or None before the first.
        backup_ready: True once the process that stops the arm without this one is ready: driver process or watchdog.
        internal_control: True where the driver process moves the arm.
        speed_reduction: of the slow reaction. It has to know where the controller's speed slider is.
        state_age: of the controller's states.

    Raises:
        RobotRefused: a reaction moves the arm, and there is no planner.
    """

    def __init__(
        self,
        model: ArmModel,
        driver: ArmDriver,
        rules: RuleSet,
        limits: MonitoringLimits,
        paths: tuple[StopPath, ...],
        planner: ReactionPlanner | None = None,
        heartbeat: ControllerHeartbeat | None = None,
        speed_limit: SpeedLimit | None = None,
        held_braking: Callable[[Joints, Joints], float] | None = None,
    ) -> None:
        self.supervision = Supervision()
        self.state: ControllerState | None = None
        self.driver = driver
        self.backup_ready = False
        self.heartbeat = heartbeat
        self.internal_control = StopPath.DRIVER in paths
        self.model = model
        self._rules = rules
        self._touches = TouchRecord(rules)
        self._speed_limit = speed_limit
        self.speed_reduction = SpeedReduction(model, self._needs_slider, limits.arm_silence)
        if planner is None and self._rules.move:
            raise RobotRefused("a reaction that moves the arm away needs a planner")
        self._limits = limits
        self._planner = planner
        self._motion: MotionStream | None = None  # that is under way
        self._at_touch: ArmState | None = None  # in which the cause of the newest stop was seen
        self.state_age = StateAge(limits.arm_silence)
        self._stop = ArmStop(limits, paths, held_braking)
        self._reaction = rules.default  # the one that is under way
        self._sent = False  # the stop for a touch whose event comes next

    @property
    def phase(self) -> Phase:
        """Phase in which the arm is."""
        return self.supervision.phase

    @property
    def needs(self) -> ControllerNeeds:
        """What it needs of the controller."""
        heartbeat = None if self.heartbeat is None else self.heartbeat.required
        by_slider = StopPath.SLIDER in self._stop.paths
        setpoints = self._rules.move and not self.internal_control
        return ControllerNeeds(self._needs_slider, by_slider, setpoints, heartbeat)

    def blockers(self, now: float) -> list[str]:
        """Return why the arm must not be put under guard at a host time [s], one line each. Empty where it may.

        Whether a program runs does not matter: a guard may be there before the program is.
        """
        blockers = []
        if not self.backup_ready:
            process = "the arm's driver" if self.internal_control else "the guard watchdog"
            blockers.append(f"{process} is not ready")
        if self._needs_slider and self.speed_reduction.known(now) is None:
            blockers.append("the position of the controller's speed slider is not known")
        if self.heartbeat is not None and (blocker := self.heartbeat.blocker()):
            blockers.append(blocker)
        state = self.state
        if self.speed_reduction.halted and state is not None and state.program_running:
            blockers.append(
                "a stop has put the speed slider to 0 and a program runs: end the program first, because a slider that "
                "is raised under a program gives a protective stop"
            )
        if state is None or self.state_age.silent(now):
            return [*blockers, "the controller is silent"]
        if trouble := self.state_age.trouble(now):
            blockers.append(trouble)
        if state.stopped_by_safety:
            blockers.append("the controller's own safety system holds the arm: see its screen")
        if not state.powered:
            blockers.append("the arm is not powered, or its brakes are not released")
        limits = zip(state.q, self.model.joint_lower, self.model.joint_upper, strict=True)
        for number, (q, low, high) in enumerate(limits, 1):
            if not low <= q <= high:
                blockers.append(f"joint {number} must be within {low:.3f} to {high:.3f} rad, it is at {q:.3f} rad")
        return blockers

    @property
    def _speed(self) -> float:
        """Newest speed of the leading joint [rad/s]. Infinite before the first."""
        return math.inf if self.state is None else self.state.speed

    @property
    def _needs_slider(self) -> bool:
        return "slow" in self._rules.kinds or self._speed_limit is not None

    def release(self, number: int, out: Outputs) -> None:
        """Ask the process that moves or holds the arm to let the program move it, and to acknowledge this number."""
        self.speed_reduction.release(out)  # before a program runs that it would move at once
        out.append(Release(number))

    def withdraw(self, out: Outputs) -> None:
        """Take a release back."""
        if self.internal_control:
            out.append(StopProgram(self._rules.default.deceleration))

    def activate(self) -> None:
        """React from now on. The program may move the arm."""
        self.supervision, _ = transition(self.supervision, Cue.ACTIVATED)
        self._reaction = self._rules.default
        self._stop.watch.forget()
        if self._speed_limit is not None:
            self._speed_limit.forget()

    def stop_for_touch(self, link: int, level: float, out: Outputs) -> None:
        """Send the stop for a touch that begins, before anything else is known of it. ``touch`` has to come next.

        Where the reaction to a touch of this link's DH frame, and this level, only slows the arm, there is none.
        """
        reaction = self._rules.choose(link, level, self._speed) if self._rules.rules else self._rules.default
        if self.phase is Phase.ACTIVE and reaction.kind != "slow":
            self._stop.send(StopProgram(reaction.deceleration), out)
            self._sent = True

    def touch(self, now: float, contact: Contact, began: bool, out: Outputs) -> None:
        """Take a touch that has begun, or has changed, at a host time [s]."""
        phase, touches, motion = self.phase, self._touches, self._motion
        if phase is Phase.ACTIVE:
            touches.begin(contact, self._speed)
        reaction = touches.update(contact)
        if phase is Phase.ACTIVE:
            self._reaction, slow = reaction, self.speed_reduction
            if reaction.kind == "slow" and slow.begin(
                now, self.state, self._as_held(reaction), self._limits, [contact.on_link()], out
            ):
                self._follow(now, Cue.SLOWED, "", out)
                return
        elif phase is Phase.SLOWED and reaction.kind != "slow":
            self._reaction = reaction
        elif motion is not None and motion.how == "push":  # touches are what that follows
            if reaction.kind in ("slow", "comply", self._reaction.kind):
                return
            self._reaction = reaction
        elif not (phase is Phase.RETREATING and began):
            return
        self._follow(now, Cue.TOUCHED, TOUCH_CAUSE, out, contact)

    def feed_contacts(self, now: float, contacts: Sequence[Contact], out: Outputs) -> None:
        """Take what the newest frames say of every touch that there is, at a host time [s]."""
        for contact in contacts:
            self.touch(now, contact, False, out)
        self._touches.feed(contacts, self.phase in (Phase.STOPPING, Phase.PLACING))
        motion, state = self._motion, self.state
        if motion is not None and state is not None and contacts:
            over = motion.resisted(now, state.q, self._touches.contacts)
            if over is not None:
                self._end_motion(now, Cue.OVER, over, out)

    def abandon_motion(self, now: float, why: str, out: Outputs) -> None:
        """End the motion away at a host time [s], and let none follow: it cannot be supervised any more."""
        if self._motion is not None:
            self._end_motion(now, Cue.ABANDONED, Done(why, self._motion.progress), out)

    def fault(self, now: float, why: str, out: Outputs) -> None:
        """Stop because something is wrong, and do not move any more."""
        self._follow(now, Cue.FAULTED, why, out)

    def end(self, now: float, out: Outputs) -> None:
        """Leave the speed slider as it was found once the arm stands latched: the guard ends, at a host time [s]."""
        self.supervision = replace(self.supervision, ending=True)
        if self.phase in (Phase.STARTING, Phase.LATCHED):
            self._put_slider_back(now, out)

    def lose(self, paths: frozenset[StopPath], now: float, for_good: bool = True) -> None:
        """Drop stop paths that are lost, or that this stop must not count on, and use the next one at once."""
        self._stop.lose(paths, now, for_good)

    def sample(self, state: ControllerState, out: Outputs) -> None:
        """Take a measured state."""
        self.state = state
        stop, measured_at, phase = self._stop, self.state_age.feed(state), self.supervision.phase
        if self._planner is not None:
            self._planner.torque.feed(state, phase is _ACTIVE_PHASE and not self._touches.contacts)
        if state.stopped_by_safety or not state.powered:
            self._bar("the controller has stopped the arm itself")  # nothing of ours moves it then
        elif self.state_age.newest.stepped:
            self._bar("the controller's clock has stepped")
        if phase.brakes:
            if self.state_age.newest.fresh and self._stands(state, measured_at, out):
                self.speed_reduction.put_back(state.time, out)
                self._decide(state, state.time + _PLACE_TIME, out)
        elif phase is _RETREATING_PHASE:
            self._move(state, out)
        elif phase is _ACTIVE_PHASE:
            if self._speed_limit is not None and (
                why := self._speed_limit.sample(state, self.speed_reduction.known(state.time), out)
            ):
                self._follow(state.time, Cue.FAULTED, why, out)
        elif phase is Phase.SLOWED:
            self.speed_reduction.sample(state, measured_at, self._touches.contacts)
        elif why := stop.watch.moved(state, bool(self._touches.contacts)):
            self._follow(state.time, Cue.MOVED, why, out)
        elif phase is Phase.PLACING:
            self._decide(state, self.supervision.decide_by, out)
        elif phase is Phase.STANDING:
            stop.insist(state, out)
            self._latch(state, out)

    def poll(self, now: float, fair: float, out: Outputs) -> None:
        """Decide what only the passing of time shows, ``fair`` without that for which the guard was held up [s]."""
        stop, phase = self._stop, self.supervision.phase
        if phase.brakes:
            path, rounds = stop.escalate(now, out)
            if path is not None:
                emit(out, EventName.ESCALATED, now, path=path.value)
            if rounds:
                speed = None if self.state is None else self.state.speed
                emit(out, EventName.STOP_FAILED, now, rounds=rounds, speed=speed)
            self.speed_reduction.note_stop(stop.used)
        elif phase is _SLOWED_PHASE:
            slowed = self.speed_reduction.now
            if why := self.speed_reduction.poll(now, fair, bool(self._touches.contacts)):
                contact = self._touches.find(0 if slowed is None else slowed.approach.exceeded[0])
                self._follow(now, Cue.FAULTED, why, out, contact)
            elif slowed is None or slowed.over(now):
                self._follow(now, Cue.FREED, "", out)
                self.speed_reduction.put_back(now, out)
                emit(out, EventName.RESUMED, now, slider=self.speed_reduction.slider)
        elif phase.stands and self.state_age.silent(fair):
            self._follow(now, Cue.MOVED, "the controller fell silent", out)

    # ---- what it does

    def _follow(self, now: float, cue: Cue, what: str, out: Outputs, contact: Contact | None = None) -> None:
        """Take a cue, and do at once what follows from it: send the stop, then report it."""
        then, act = transition(self.supervision, cue, what)
        if act is Act.STOP:
            self._begin_stop(now, StopProgram(self._reaction.deceleration), out)
            self._touches.placed = ()
            self._at_touch = None if self.state is None else _arm_state(self.state)
        elif act is Act.HALT:
            self._begin_stop(now, EndReaction(self._reaction.deceleration), out)
        self.supervision = then
        if act is Act.STOP or act is Act.HALT:
            named = {} if contact is None else {"contact": contact.summary()}
            emit(out, EventName.STOPPING, now, why=then.why, stop=then.stop, **named)

    def _end_motion(self, now: float, cue: Cue, over: Done, out: Outputs) -> None:
        motion = self._begin_stop(now, EndReaction(self._reaction.deceleration), out)
        assert motion is not None
        self.supervision, _ = transition(self.supervision, cue, motion.report(now, over, out))

    def _begin_stop(self, now: float, command: StopProgram | EndReaction, out: Outputs) -> MotionStream | None:
        if self._sent:
            self._sent = False
        else:
            self._stop.send(command, out)
        self.speed_reduction.note_stop(self._stop.used)
        motion, state, self._motion = self._motion, self.state, None
        if motion is not None:
            motion.end(out)
        self._stop.begin(now, None if self.state_age.silent(now) else state)
        return motion

    def _as_held(self, reaction: Reaction) -> Reaction:
        """Return a reaction whose stop is no harder than the motors hold now."""
        return replace(reaction, deceleration=min(reaction.deceleration, self._stop.held(self.state)))

    def _stands(self, state: ControllerState, measured_at: float, out: Outputs) -> bool:
        """Take a fresh state of a stop under way, report what it shows, and tell whether the arm stands."""
        slows, stands = self._stop.update(state, measured_at)
        if slows:
            emit(out, EventName.DECELERATING, state.time, speed=state.speed)
        if stands:
            paths = [path.value for path in self._stop.used]
            emit(out, EventName.STANDSTILL, state.time, speed=state.speed, paths=paths)
        return stands

    def _bar(self, why: str) -> None:
        """Let nothing of ours move the arm before the next stop. Who ends a motion under way names the fault."""
        if not self.supervision.barred:
            self.supervision = replace(self.supervision, barred=why)

    def _decide(self, state: ControllerState, decide_by: float, out: Outputs) -> None:
        """Decide what the standing arm does. The place of a touch may need a while to become certain."""
        if stale := self.state_age.stale(state.time):
            self._bar(stale)
        now, touches = self.supervision, self._touches
        mover = "the driver" if self.internal_control else "a program"
        # a stop that the controller made may have been one of ours
        bar = now.barred if self._stop.first_was_enough else f"{mover} did not stop the arm"
        wanted = now.may_move and bool(touches.placed)
        if wanted:
            self._reaction = touches.hardest()  # how firm it was shows by now
            wanted = self._reaction.kind not in ("stop", "slow")
        if wanted and not bar and not touches.all_placed and state.time < decide_by:
            self.supervision, _ = transition(now, Cue.WAITS, decide_by=decide_by)
            return
        self._stop.watch.end()
        if wanted and not bar:
            assert self._planner is not None
            here = _arm_state(state)
            begun = self._planner.begin(self._reaction, self._at_touch or here, here, touches.placed, out)
            if not isinstance(begun, str):
                self._motion = begun
                self.supervision, _ = transition(now, Cue.MOVES_AWAY)
                self._move(state, out)
                return
            bar = begun
        self._stop.stay(state)
        self.supervision, _ = transition(now, Cue.STAYS, f"no retreat: {bar}" if wanted else "")
        self._latch(state, out)

    def _move(self, state: ControllerState, out: Outputs) -> None:
        if self._motion is not None and not self.supervision.barred:
            over = self._motion.update(state, self._touches.contacts, out)
            if over is not None:
                self._end_motion(state.time, Cue.OVER, over, out)

    def _latch(self, state: ControllerState, out: Outputs) -> None:
        """Latch an arm that has kept standing for long enough, and report it."""
        stop = self._stop
        if stop.watch.confirmed or state.stopped_by_safety:
            held = SLIDER_HOLDS if self.speed_reduction.halted and state.program_running else ""
            what = "the controller does not show the protective stop" if stop.unconfirmed(state) else held
            self.supervision, _ = transition(self.supervision, Cue.LATCHES, what)
            emit(out, EventName.LATCHED, state.time, why=self.supervision.why, stop=self.supervision.stop)
            self._put_slider_back(state.time, out)

    def _put_slider_back(self, now: float, out: Outputs) -> None:
        if self.supervision.ending and self._speed_limit is not None:
            self._speed_limit.end(now, self.speed_reduction.known(now), out)
