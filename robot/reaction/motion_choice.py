"""Reaction motions of an arm that stands after a touch: along the normal, or with the push. Pure.

Both are used in the same way: ``step`` returns in each control cycle how the joints are to move, or the end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, TypeAlias

from coneskin.robot.arm.kinematics import link_name
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.workspace import ArmSweep, Workspace, part_in_front

from .contact_supervision import clamped, opposed
from .retreat import DISTANCE_TOLERANCE, RetreatPlan, plan_retreat, retreat_step
from .types import ArmState, ContactOnLink, Done, JointVelocity, Reaction

_DAMPING_TIME = 0.05  # s; a person's push rises in 50 ms and more
_MIN_SPEED = 1e-3  # m/s; slower counts as standing
_PUSH_DAMPING = 1500.0  # N s/m; between a push that the joints feel and the speed at which it is followed
_MAX_CARRIED = 15.0  # N that something else may take off a push whose touch does not become lighter
_FOLLOWED_SHARE = 0.5  # of a firm push that is followed, while nothing takes anything off it
_LIGHTER = 0.01  # of the level; six times its noise
_MAX_STOPPING_WAY = 0.001  # m of any point of the arm; one that stops within it has squeezed nothing


class _PushStep(NamedTuple):
    """One step of a motion that follows a push."""

    time: float  # [s]
    speed: float = 0.0  # of the touched point that was wanted [m/s]
    progress: float = 0.0  # how far touched points had given way [m]
    plan: RetreatPlan | None = None  # whose tracks start where the touched points were; None where nothing pushed


class _AdmittanceMotion:
    """Compliant motion of an arm that stands as it begins: it gives way as firmly as the skin is pushed.

        v_wanted = speed * min(1, (level - threshold) / (full_level - threshold))    along -n, of the touched point
        v       += (v_wanted - v) * (1 - exp(-dt / _DAMPING_TIME))                   so that it neither jumps nor rings

    The joints have to feel the push as well: with the force F that drives the arm along its motion, t . qd / v with the
    torque t from outside, v is at most F / _PUSH_DAMPING. What presses against the arm behind, where a skin is or not,
    takes that force away. So the arm comes to rest where both are equal, and presses no harder than it is pushed. Where
    the touch has not become lighter meanwhile, it rests as soon as 15 N of the push are gone.

    Point and normal are taken anew in each cycle, where the touch is then. Where that is not known, or where touches
    push against each other, the arm stands. Each cycle is one step of a retreat (``retreat``) from where the arm is, so
    its limits are the same. It ends with the touch, or when the distance or the time is used up.

    Args:
        state: of the arm, standing.
        space: the room that the arm has, or None.

    Attributes:
        last: step.
    """

    how = "push"  #: the arm leaves with it

    def __init__(self, model: ArmModel, state: ArmState, reaction: Reaction, space: Workspace | None = None) -> None:
        self._model = model
        self._reaction = reaction
        self._space = space
        self._sweep = ArmSweep.begin(model, state.q)
        self._began = state.time
        self._strongest = 0.0, 0.0  # push since the touch became lighter [N], and its level
        self.last = _PushStep(state.time)

    def update(self, state: ArmState, contacts: Sequence[ContactOnLink]) -> JointVelocity | Done:
        """Return what to do in this control cycle, as firm as the current push.

        Args:
            contacts: the touches there are. Without one it is over.
        """
        reaction = self._reaction
        last, progress = self.last, self.last.progress
        if last.plan is not None:
            progress += max(0.0, last.plan.place(state.q)[1])
        if not contacts:
            return Done("the touch is over", progress, complete=True)
        if not progress < reaction.distance - DISTANCE_TOLERANCE:
            return Done("the distance is made", progress)
        if not state.time - self._began < reaction.time_budget:
            return Done(f"the time of {reaction.time_budget} s is over", progress)
        if state.torque is None:
            return Done("the controller sends no motor currents: nothing shows what the arm presses on", progress)
        placed = all(contact.location_valid for contact in contacts)  # as a push ends, its place is lost before itself
        against = placed and opposed(self._model, state.q, contacts)
        wanted = _wanted_speed(reaction, contacts) if placed and not against else 0.0
        share = 1.0 - math.exp(-max(0.0, state.time - last.time) / _DAMPING_TIME)
        speed = last.speed + share * (wanted - last.speed)
        if speed < _MIN_SPEED or not placed or against:
            self.last = _PushStep(state.time, speed, progress)
            light = "level" if wanted < _MIN_SPEED else "damping"
            clipped_by = ("opposed" if against else light if placed else "place",)
            # what is not known, or on the other side, may be pressed now: brake as a stop does, not as a push ends
            gentle = placed and not against
            rate = reaction.acceleration if gentle else max(reaction.acceleration, reaction.deceleration)
            return JointVelocity((0.0,) * len(state.q), rate, 0.0, progress, clipped_by)
        setting = replace(reaction, speed=speed, distance=reaction.distance - progress)
        plan = plan_retreat(self._model, state, contacts, setting, self._space, self._sweep)
        step = plan if isinstance(plan, Done) else retreat_step(plan, state)
        if isinstance(plan, Done) or isinstance(step, Done):
            assert isinstance(step, Done)
            return Done(step.reason, progress)
        clipped, driven = step.clipped_by, 0.0
        if step.away > 0.0:
            rows = zip(state.torque, state.doubt or (0.0,) * len(step.qd), step.qd, strict=True)
            driven = sum(t * v - doubt * abs(v) for t, doubt, v in rows) / step.away
        if step.away > (most := max(0.0, self._free_push(driven, contacts)) / _PUSH_DAMPING):
            share = most / step.away
            rate = reaction.deceleration if most < last.speed else reaction.acceleration
            step = replace(step, qd=tuple(share * v for v in step.qd), away=most, acceleration=rate)
            clipped, speed = (*clipped, "push"), most
        if wanted < reaction.speed:
            clipped += ("level",)
        if speed < 0.99 * wanted:  # it gets there, but never quite
            clipped += ("damping",)
        self.last = _PushStep(state.time, speed, progress, plan)
        return replace(step, progress=progress, clipped_by=clipped)

    def _free_push(self, driven: float, contacts: Sequence[ContactOnLink]) -> float:
        """Return how much of a push [N] may be followed: what is left of it above what something else may carry."""
        level = max(contact.level for contact in contacts)
        strongest, then = self._strongest
        if driven >= strongest or level < then - _LIGHTER:
            self._strongest = strongest, then = driven, level
        if strongest <= _MAX_CARRIED:
            return driven
        return (1.0 - (strongest - driven) / _MAX_CARRIED) * max(_MAX_CARRIED, _FOLLOWED_SHARE * strongest)


def _wanted_speed(reaction: Reaction, contacts: Sequence[ContactOnLink]) -> float:
    """Return the speed at which to give way to the firmest of these touches [m/s]."""
    most = 0.0
    for contact in contacts:
        span = reaction.full_level - contact.threshold
        above = contact.level - contact.threshold
        share = above / span if span > 0.0 else 1.0 if above > 0.0 else 0.0
        most = max(most, min(1.0, share))
    return reaction.speed * most


class _PlannedMotion:
    """Retreat along the normal of the touch. Later touches do not change it."""

    how = ""  #: the arm leaves by itself

    def __init__(self, plan: RetreatPlan) -> None:
        self._plan = plan

    def update(self, state: ArmState, contacts: Sequence[ContactOnLink]) -> JointVelocity | Done:  # noqa: ARG002
        """Return the next step."""
        return retreat_step(self._plan, state)


#: bounded motion away from a touch
ReactionMotion: TypeAlias = "_AdmittanceMotion | _PlannedMotion"


def plan_reaction_motion(
    model: ArmModel,
    reaction: Reaction,
    at_touch: ArmState,
    state: ArmState,
    contacts: Sequence[ContactOnLink],
    space: Workspace,
) -> ReactionMotion | str:
    """Return the motion that a reaction wants, or why there is none.

    Args:
        reaction: its kind is "retreat" or "comply".
        at_touch: the arm when the touch was seen.
        state: the arm now, standing.
        contacts: the touches, as they were last seen.
    """
    for contact in contacts:
        if not contact.location_valid:  # nobody knows yet what is in front of it, or behind
            return f"the place of the touch on the {link_name(contact.link)} is not known"
    sweep = ArmSweep.begin(model, state.q)
    if sweep.distance(at_touch.q) > _MAX_STOPPING_WAY:
        for contact in contacts:
            if part := part_in_front(model, state.q, contact.link, contact.point, contact.normal):
                return f"while it stopped, the arm may have caught what touches it against its own {part}"
    if reaction.kind == "comply":
        return _AdmittanceMotion(model, state, reaction, space)
    if clamped(contacts):
        return "touches on opposite sides, or on two links, may hold the arm between them"
    plan = plan_retreat(model, at_touch, contacts, reaction, space, sweep)
    return plan.reason if isinstance(plan, Done) else _PlannedMotion(plan)
