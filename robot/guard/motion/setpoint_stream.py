"""Reaction motion: it plans the motion away from a touch and streams its setpoints. Pure.

In every second control cycle a new target goes out to the driver process. For an arm that another program moves, it
goes to a setpoint program in the controller. Built only where a reaction of the scene may move the arm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.arm.workspace import Workspace
from coneskin.robot.driver.messages import SetJointVelocity
from coneskin.robot.driver.values import ControllerState, JointVelocitySetpoint, SetpointProgram
from coneskin.robot.guard.signals.joint_current import OutsideTorque, ResistanceMonitor
from coneskin.robot.guard.signals.journal import EventName, Outputs, describe_way, emit
from coneskin.robot.reaction.bare_side import MAX_BARE_WAY, BareSides
from coneskin.robot.reaction.contact_supervision import ContactSupervision
from coneskin.robot.reaction.motion_choice import ReactionMotion, plan_reaction_motion
from coneskin.robot.reaction.retreat import plan_retreat, retreat_step
from coneskin.robot.reaction.types import ArmState, ContactOnLink, Done, JointVelocity, Reaction
from coneskin.robot.stop.stop_monitor import STANDSTILL_SAMPLES

_SPEED_TOLERANCE = 0.03  # rad/s; absolute part of the tolerance of a joint's speed
_RELATIVE_TOLERANCE = 0.3  # ratio; its relative part, to the leading joint's commanded speed
_MAX_DEVIATION_TIME = 0.25  # s for which a joint may be out of tolerance
_MAX_RAMP_TIME = 0.25  # s; longest time that is allowed in addition for taking up the commanded speed
_MAX_OVERSPEED = 0.1  # rad/s above every commanded speed; such a motion ends it at once
_MAX_APPROACH = 0.005  # m that a touched point may come nearer to what touched it; more ends it at once


class _FollowingErrorMonitor:
    """Monitor of one reaction motion, from the host time on at which it begins [s]."""

    def __init__(self, now: float) -> None:
        #: newest command; top speed of all [rad/s]; progress below which the motion has gone backwards [m]
        self._commands: tuple[JointVelocity, float, float] | None = None
        self._in_tolerance_at = now
        self._fast = 0  # samples in a row above the top speed

    def command(self, step: JointVelocity) -> None:
        """Take what the arm is commanded now."""
        _, top, least = self._commands or (step, 0.0, step.progress - _MAX_APPROACH)
        self._commands = step, max(top, *map(abs, step.qd)), least

    def exceeded(self, state: ControllerState, progress: float) -> bool:
        """Take a measured state and tell whether the arm moves otherwise than commanded.

        A slower motion in the same direction is within tolerance: the controller's speed slider makes it so. The
        progress is that of the motion [m].
        """
        if self._commands is None:
            return False
        commanded, top, least = self._commands
        self._fast = self._fast + 1 if state.speed > top + _MAX_OVERSPEED else 0
        if self._fast >= STANDSTILL_SAMPLES or progress < least:
            return True
        leading = max(map(abs, commanded.qd))
        if _difference(state.qd, commanded.qd) <= _SPEED_TOLERANCE + _RELATIVE_TOLERANCE * leading:
            self._in_tolerance_at = state.time
            return False
        allowed = _MAX_DEVIATION_TIME + min(_MAX_RAMP_TIME, leading / commanded.acceleration)
        return state.time - self._in_tolerance_at > allowed


def _difference(qd: Joints, commanded: Joints) -> float:
    """Return the largest difference of a joint's speed from the best-fitting part of what is commanded [rad/s]."""
    square = sum(b * b for b in commanded)
    dot = sum(a * b for a, b in zip(qd, commanded, strict=True))
    part = min(1.0, max(0.0, dot / square)) if square else 0.0
    return max(abs(a - part * b) for a, b in zip(qd, commanded, strict=True))


_SETPOINT_PERIOD = 0.004  # s; every second controller cycle, so that no setpoint queues
_START_TIMEOUT = 0.5  # s after which a setpoint program that does not run will not start any more
_MAX_BARE_SPEED = 0.008  # m/s outward of what no skin covers, where allowed: a rigid thing stops it within 0.1 mm
_BARE_STEP = 0.02  # s ahead over which that speed is taken


class ReactionPlanner:
    """Planner that begins the motion that a reaction wants.

    Args:
        watchdog_hz: of the setpoint program in the controller. None where the driver process moves the arm.
        table: height in the base frame that the arm must not go below while it moves [m].
        bare: sides of the arm that no skin covers. None where there are none.
        held_braking: as of `ArmStop`.

    Attributes:
        torque: from outside on the joints.
    """

    def __init__(
        self,
        model: ArmModel,
        watchdog_hz: float | None = None,
        table: float | None = None,
        bare: BareSides | None = None,
        held_braking: Callable[[Joints, Joints], float] | None = None,
    ) -> None:
        self._held_braking = held_braking
        self.torque = OutsideTorque(model)
        self._bare = bare
        self._model = model
        self._watchdog_hz = watchdog_hz
        self._token = 0
        self._workspace = Workspace(model, table)

    def begin(
        self, reaction: Reaction, at_touch: ArmState, here: ArmState, contacts: Sequence[ContactOnLink], out: Outputs
    ) -> MotionStream | str:
        """Begin to move away, or return why that cannot be.

        Args:
            reaction: its kind is "retreat" or "comply".
            at_touch: the arm when the touch was seen.
            here: the arm now, standing.
            contacts: the touches, as they were last seen.
        """
        if self.torque.now is None:
            return "the controller sends no motor currents: nothing shows what the arm presses on"
        reaction = self._as_held(reaction, here, contacts)
        motion = plan_reaction_motion(self._model, reaction, at_touch, here, contacts, self._workspace)
        if isinstance(motion, str):
            return motion
        if self._bare is not None and reaction.bare_lead == "stop":
            toward: ReactionMotion | str = motion
            if motion.how == "push":
                away = replace(reaction, kind="retreat")
                toward = plan_reaction_motion(self._model, away, here, here, contacts, self._workspace)
            if isinstance(toward, str):
                return toward
            step = toward.update(here, contacts)
            if isinstance(step, Done):
                return step.reason
            time = (reaction.distance - step.progress) / step.away
            there = [q + time * v for q, v in zip(here.q, step.qd, strict=True)]
            if why := _bare_way(self._bare, here.q, there, motion.how):
                return why
        program = None
        if self._watchdog_hz is not None:
            self._token += 1
            program = SetpointProgram(self._token, reaction.deceleration, self._watchdog_hz)
        return MotionStream(motion, self._model, reaction, self.torque, self._bare, here, contacts, program, out)

    def _as_held(self, reaction: Reaction, here: ArmState, contacts: Sequence[ContactOnLink]) -> Reaction:
        """Return a reaction whose acceleration, with which it also brakes, the motors hold on the way that begins."""
        plan = plan_retreat(self._model, here, contacts, reaction)
        step = plan if isinstance(plan, Done) else retreat_step(plan, here)
        if isinstance(step, Done) or self._held_braking is None:
            return reaction
        return replace(reaction, acceleration=min(reaction.acceleration, self._held_braking(here.q, step.qd)))


def _bare_way(bare: BareSides, q: Joints, there: Sequence[float], how: str) -> str:
    """Return why the arm must not go there from q. Empty where no bare side moves outward by more than a little."""
    way, part = bare.way(q, there)
    if way <= MAX_BARE_WAY:
        return ""
    return (
        f"no skin covers the {part}, which would lead: it may move outward by {1e3 * MAX_BARE_WAY:g} mm, not more; "
        f'cover it, or write bare_side = "{"fast" if how else "allowed"}" in [reaction]'
    )


class MotionStream:
    """Stream of setpoints for one motion that is under way.

    Args:
        motion: what to do.
        torque: from outside on the joints.
        bare: sides that no skin covers, or None.
        here: the arm as it begins.
        contacts: the touches then.
        program: that follows the setpoints. None where the driver process does.

    Attributes:
        how: as of the motion.
        progress: how far it has got [m].
    """

    def __init__(
        self,
        motion: ReactionMotion,
        model: ArmModel,
        reaction: Reaction,
        torque: OutsideTorque,
        bare: BareSides | None,
        here: ArmState,
        contacts: Sequence[ContactOnLink],
        program: SetpointProgram | None,
        out: Outputs,
    ) -> None:
        self._motion, self._program, self._torque = motion, program, torque
        self.progress, self.how = 0.0, motion.how
        self._bare = None if reaction.bare_lead == "fast" else bare
        self._slow_lead = self._bare is not None and reaction.bare_lead == "allowed"
        self._supervision = ContactSupervision(model, here.q, contacts, self.how == "push", self._slow_lead)
        self._resistance = ResistanceMonitor(model, torque, self.how == "push")
        self._start, self._began = here.q, here.time
        self._sent = -math.inf
        self._braking: float | None = None  # how far the touched surface went on until this began [m]
        self._following_error = _FollowingErrorMonitor(here.time)
        self._details = {"how": self.how} if self.how else {}
        emit(out, EventName.RETREATING, here.time, **self._details)

    def resisted(self, now: float, q: Joints, contacts: Sequence[ContactOnLink]) -> Done | None:
        """Return Done where the newest frame of a touch, of a host time [s], shows that the motion must end."""
        why = self._supervision.resistance(now, q, contacts)
        return Done(why, self.progress) if why else None

    def update(self, state: ControllerState, contacts: Sequence[ContactOnLink], out: Outputs) -> Done | None:
        """Go on from a measured state and the touches there are now, or return Done where the motion is over."""
        torque = self._torque
        step = self._motion.update(ArmState(state.time, state.q, state.qd, torque.now, torque.spread), contacts)
        self.progress = step.progress
        if self._braking is None:
            self._braking = max(-step.progress, 0.0)
        if isinstance(step, Done):
            return step
        if contacts and (over := self.resisted(state.time, state.q, contacts)) is not None:
            return over
        if why := self._resistance.resistance(state.q, contacts):
            return Done(why, step.progress)
        program, first = self._program, self._sent == -math.inf
        exceeded = self._following_error.exceeded(state, step.progress)
        started = state.program_running or state.time - self._began < _START_TIMEOUT
        if program is not None and not state.program_running and (exceeded or not started):
            return Done("its program does not run on the controller", step.progress)
        if exceeded:
            return Done("the arm does not move as commanded: something else moves it", step.progress)
        if state.time - self._sent >= _SETPOINT_PERIOD - 1e-9:
            if self._bare is not None:
                limited = self._limit(self._bare, state, step)
                if isinstance(limited, str):
                    return Done(limited, step.progress)
                step = limited
            if program is None:
                out.append(SetJointVelocity(step.qd, step.acceleration))
            else:
                out.append(JointVelocitySetpoint(program.token, step.qd, step.acceleration))
                if first:
                    out.append(program)
            if step.clipped_by and first:
                emit(out, EventName.MOTION_LIMITED, state.time, by=list(step.clipped_by))
            self._sent = state.time
            self._following_error.command(step)
        return None

    def _limit(self, bare: BareSides, state: ControllerState, step: JointVelocity) -> JointVelocity | str:
        """Return the step no faster than a bare side may move outward, or why there is none."""
        ahead = [q + _BARE_STEP * v for q, v in zip(state.q, step.qd, strict=True)]
        if not self._slow_lead:
            return _bare_way(bare, self._start, ahead, self.how) or step
        speed = bare.way(state.q, ahead)[0] / _BARE_STEP
        if speed <= _MAX_BARE_SPEED:
            return step
        share = _MAX_BARE_SPEED / speed
        by = (*step.clipped_by, "bare side")
        return replace(step, qd=tuple(share * v for v in step.qd), away=share * step.away, clipped_by=by)

    def report(self, now: float, over: Done, out: Outputs) -> str:
        """Report the end of the motion at a host time [s], and return it in words."""
        details = {"progress": over.progress, "complete": over.complete, "why": over.reason, **self._details}
        if over.progress < 0.0:
            details["braking"] = self._braking
        emit(out, EventName.RETREATED, now, **details)
        return f"{describe_way(details, 'retreat')}: {over.reason}"

    def end(self, out: Outputs) -> None:
        """Void the setpoints, after a stop has been sent."""
        if self._program is not None:
            out.append(JointVelocitySetpoint(0, (0.0,) * len(self._start), 0.0))
