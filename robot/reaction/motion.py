"""Reaction motions of an arm that stands after a touch: along the normal, back the way it came, or with the push. Pure.

The three are used in the same way: ``step`` returns in each control cycle how the joints are to move, or the end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.workspace import ArmSweep, Workspace

from .admittance import AdmittanceMotion
from .backtrack import BacktrackPlan, PathHistory, backtrack_step, plan_backtrack
from .contact_supervision import clamped
from .retreat import RetreatPlan, plan_retreat, retreat_step
from .types import ArmState, ContactOnLink, Done, JointVelocity, Reaction

__all__ = [
    "ReactionMotion",
    "plan_reaction_motion",
    "plan_way_back",
]


class ReactionMotion(Protocol):
    """Bounded motion away from a touch.

    Attributes:
        how: "", "path" or "push": how the arm leaves.
    """

    how: str

    def update(self, state: ArmState, contacts: Sequence[ContactOnLink]) -> JointVelocity | Done:
        """Return what to do in this control cycle, with the current touches."""


class _PlannedMotion:
    """Retreat along the normal of the touch, or the way back along the path. Later touches change neither."""

    def __init__(self, plan: RetreatPlan | BacktrackPlan) -> None:
        self._plan = plan
        self.how = "path" if isinstance(plan, BacktrackPlan) else ""

    def update(self, state: ArmState, contacts: Sequence[ContactOnLink]) -> JointVelocity | Done:  # noqa: ARG002
        """Return the next step."""
        plan = self._plan
        return backtrack_step(plan, state) if isinstance(plan, BacktrackPlan) else retreat_step(plan, state)


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
        model: the arm.
        reaction: its kind is "retreat" or "comply".
        at_touch: the arm when the touch was seen.
        state: the arm now, standing.
        contacts: the touches, as they were last seen.
        space: the room that the arm has.
    """
    if reaction.kind == "comply":
        return AdmittanceMotion(model, state, reaction, space)
    if clamped(contacts):
        return "touches on opposite sides, or on two links, may hold the arm between them"
    plan = plan_retreat(model, at_touch, contacts, reaction, space, ArmSweep.begin(model, state.q))
    return plan.reason if isinstance(plan, Done) else _PlannedMotion(plan)


def plan_way_back(
    model: ArmModel,
    reaction: Reaction,
    state: ArmState,
    contacts: Sequence[ContactOnLink],
    history: PathHistory,
    space: Workspace,
    since: float,
) -> ReactionMotion | str:
    """Return the motion back the way of a retreat that was resisted, or why there is none.

    It must not press on any touch.

    Args:
        model: the arm.
        reaction: the settings.
        state: the arm now, standing.
        contacts: the touches there are now.
        history: where the arm has been.
        space: the room that the arm has. Its own links do not count, because it has just come this way.
        since: when the motion away began [s]. The way back ends there.
    """
    if not contacts:
        return "nothing touches any more"
    if any(not contact.location_valid for contact in contacts):
        return "the place of a touch is not certain, and it might press on it"
    back = plan_backtrack(model, state, history, reaction, replace(space, avoid_self=False), since)
    if isinstance(back, Done):
        return back.reason
    return _approached_touch(model, state, contacts, back) or _PlannedMotion(back)


def _approached_touch(model: ArmModel, state: ArmState, contacts: Sequence[ContactOnLink], back: BacktrackPlan) -> str:
    """Return why going back would press on a touch; empty where it does not."""
    from coneskin.robot.arm.kinematics import link_pose, point_jacobian

    first = backtrack_step(back, ArmState(state.time, state.q))
    if isinstance(first, Done):
        return first.reason
    for contact in contacts:
        rows = point_jacobian(model, state.q, contact.link, contact.point)
        normal = link_pose(model, state.q, contact.link).rotate(contact.normal)
        speed = sum(
            n * sum(j * v for j, v in zip(row, first.qd, strict=True)) for n, row in zip(normal, rows, strict=True)
        )
        if speed > 1e-3:
            return f"it leads towards the touch on link {contact.link}"
    return ""
