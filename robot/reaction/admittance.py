"""Admittance law of a compliant reaction: the arm gives way as firmly as the skin is pushed, without a spring. Pure.

    v_wanted = speed * min(1, (level - threshold) / (full_level - threshold))        along -n, of the touched point
    v       += (v_wanted - v) * (1 - exp(-dt / _DAMPING_TIME))                       so that it neither jumps nor rings

Point and normal are taken anew in each cycle, where the touch is then; where that is not known, or where touches push
against each other, the arm stands. Each cycle is one step of a retreat (``retreat.py``) from where the arm is, so its
limits are the same. It ends with the touch, or when the distance or the time is used up. The arm stands when it begins;
it is stopped and latched at the end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from coneskin.robot.arm.model import ZERO_VELOCITY, ArmModel
from coneskin.robot.arm.workspace import ArmSweep, Workspace

from .contact_supervision import opposed
from .retreat import DISTANCE_TOLERANCE, RetreatPlan, plan_retreat, retreat_step
from .types import ArmState, ContactOnLink, Done, JointVelocity, Reaction

__all__ = ["AdmittanceState", "admittance_step", "begin_admittance"]

_DAMPING_TIME = 0.05  # s; a person's push rises in 50 ms and more
_MIN_SPEED = 1e-3  # m/s; slower counts as standing


@dataclass(frozen=True, slots=True)
class AdmittanceState:
    """State of a compliant motion; each step makes the next.

    Attributes:
        model: the arm.
        reaction: the settings.
        space: the room that the arm has, or None.
        sweep: where the whole arm was when the motion began.
        start_time: [s].
        time: of the last step [s].
        speed: of the touched point that was wanted then [m/s].
        progress: how far touched points have given way so far [m].
        plan: of the last step, whose tracks start where the touched points were then; None where nothing pushed.
    """

    model: ArmModel
    reaction: Reaction
    space: Workspace | None
    sweep: ArmSweep
    start_time: float
    time: float
    speed: float = 0.0
    progress: float = 0.0
    plan: RetreatPlan | None = None


def begin_admittance(
    model: ArmModel, state: ArmState, reaction: Reaction, space: Workspace | None = None
) -> AdmittanceState:
    """Return the first state of a compliant motion, with the arm standing as in ``state``."""
    return AdmittanceState(model, reaction, space, ArmSweep.begin(model, state.q), state.time, state.time)


def _wanted_speed(reaction: Reaction, contacts: Sequence[ContactOnLink]) -> float:
    """Return the speed at which to give way to the firmest of these touches [m/s]."""
    most = 0.0
    for contact in contacts:
        span = reaction.full_level - contact.threshold
        above = contact.level - contact.threshold
        share = above / span if span > 0.0 else 1.0 if above > 0.0 else 0.0
        most = max(most, min(1.0, share))
    return reaction.speed * most


def admittance_step(
    now: AdmittanceState, state: ArmState, contacts: Sequence[ContactOnLink]
) -> tuple[AdmittanceState, JointVelocity | Done]:
    """Return the next state, and what to do in this control cycle; the same for the same arguments.

    Args:
        now: where it is.
        state: the arm as measured.
        contacts: the touches there are; without one it is over.
    """
    reaction = now.reaction
    progress = now.progress
    if now.plan is not None:
        progress += max(0.0, _made(now.plan, state))
    if not contacts:
        return now, Done("the touch is over", progress, complete=True)
    if not progress < reaction.distance - DISTANCE_TOLERANCE:
        return now, Done("the distance is made", progress)
    if not state.time - now.start_time < reaction.time_budget:
        return now, Done(f"the time of {reaction.time_budget} s is over", progress)
    placed = all(contact.location_valid for contact in contacts)  # as a push ends, its place is lost before itself
    against = placed and opposed(now.model, state.q, contacts)
    wanted = _wanted_speed(reaction, contacts) if placed and not against else 0.0
    share = 1.0 - math.exp(-max(0.0, state.time - now.time) / _DAMPING_TIME)
    speed = now.speed + share * (wanted - now.speed)
    if speed < _MIN_SPEED or not placed or against:
        still = replace(now, time=state.time, speed=speed, progress=progress, plan=None)
        clipped_by = ("opposed" if against else "level" if placed else "place",)
        # what is not known, or on the other side, may be pressed now: brake as a stop does, not as a push ends
        rate = reaction.acceleration if placed and not against else max(reaction.acceleration, reaction.deceleration)
        return still, JointVelocity(ZERO_VELOCITY, rate, 0.0, progress, clipped_by)
    setting = replace(reaction, speed=speed, distance=reaction.distance - progress)
    plan = plan_retreat(now.model, state, contacts, setting, now.space, now.sweep)
    step = plan if isinstance(plan, Done) else retreat_step(plan, state)
    if isinstance(plan, Done) or isinstance(step, Done):
        assert isinstance(step, Done)
        return now, Done(step.reason, progress)
    clipped = step.clipped_by
    if wanted < reaction.speed:
        clipped += ("level",)
    if speed < 0.99 * wanted:  # it gets there, but never quite
        clipped += ("damping",)
    after = replace(now, time=state.time, speed=speed, progress=progress, plan=plan)
    return after, replace(step, progress=progress, clipped_by=clipped)


def _made(plan: RetreatPlan, state: ArmState) -> float:
    """Return how far the touched points of a plan have come since it was made [m]; the farthest."""
    step = retreat_step(replace(plan, reaction=replace(plan.reaction, time_budget=60.0)), state)
    return step.progress
