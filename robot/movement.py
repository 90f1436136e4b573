"""What the arm does once it stands after a touch: away along the normal, back the way it came, or with the push. Pure.

The three are used in the same way: ``step`` says in each control cycle how the joints are to move, or that it is over.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from .commands import ArmState, ContactOnLink, Done, JointVelocity, Reaction
from .comply import Compliance, begin_compliance, comply_step
from .retreat import RetreatPlan, plan_retreat, retreat_step
from .space import Space
from .trail import PathBack, Trail, path_back, path_back_step
from .ur_models import ArmModel

__all__ = ["Comply", "GoBack", "Movement", "Retreat", "choose_movement"]


_CAME = 0.02  # rad/s; an arm slower than this has not run into anything


class Movement(Protocol):
    """A bounded motion away from a touch.

    Attributes:
        how: "", "path" or "push": how the arm leaves.
    """

    how: str

    def step(self, state: ArmState, contacts: Sequence[ContactOnLink]) -> JointVelocity | Done:
        """What to do in this control cycle, with the touches there are now."""


class Retreat:
    """Along the normal of the touch (``retreat.py``)."""

    how = ""

    def __init__(self, plan: RetreatPlan) -> None:
        self._plan = plan

    def step(self, state: ArmState, contacts: Sequence[ContactOnLink]) -> JointVelocity | Done:  # noqa: ARG002
        """The touches that come later do not change the direction."""
        return retreat_step(self._plan, state)


class GoBack:
    """Along the arm's own recent path (``trail.py``)."""

    how = "path"

    def __init__(self, plan: PathBack) -> None:
        self._plan = plan

    def step(self, state: ArmState, contacts: Sequence[ContactOnLink]) -> JointVelocity | Done:  # noqa: ARG002
        """The touches do not change the path."""
        return path_back_step(self._plan, state)


class Comply:
    """With the push (``comply.py``)."""

    how = "push"

    def __init__(self, start: Compliance) -> None:
        self._now = start

    def step(self, state: ArmState, contacts: Sequence[ContactOnLink]) -> JointVelocity | Done:
        """As firmly as it is pushed now."""
        self._now, step = comply_step(self._now, state, contacts)
        return step


def choose_movement(
    model: ArmModel,
    reaction: Reaction,
    at_touch: ArmState,
    state: ArmState,
    contacts: Sequence[ContactOnLink],
    trail: Trail,
    space: Space,
) -> Movement | str:
    """The movement that a reaction wants, or why there is none.

    Args:
        model: the arm.
        reaction: its kind is "retreat" or "comply".
        at_touch: the arm when the touch was seen.
        state: the arm now, standing.
        contacts: the touches, as they were last seen.
        trail: where the arm has been.
        space: the room that the arm has; on the way back, which it has just come, its own links do not count.
    """
    if reaction.kind == "comply":
        return Comply(begin_compliance(model, state, reaction, space))
    plan = plan_retreat(model, at_touch, contacts, reaction, space)
    if not isinstance(plan, Done):
        return Retreat(plan)
    if reaction.fallback != "path":
        return plan.reason
    if max(map(abs, at_touch.qd)) < _CAME:
        return f"{plan.reason}; no way back: the arm stood when it was touched"
    back = path_back(model, state, trail, reaction, replace(space, itself=False))
    if isinstance(back, Done):
        return f"{plan.reason}; no way back: {back.reason}"
    if towards := _towards(model, state, contacts, back):
        return f"{plan.reason}; no way back: {towards}"
    return GoBack(back)


def _towards(model: ArmModel, state: ArmState, contacts: Sequence[ContactOnLink], back: PathBack) -> str:
    """Why going back would press on a touch whose place is known; empty where it does not."""
    from .kinematics import link_pose, point_jacobian

    first = path_back_step(back, ArmState(state.time, state.q))
    if isinstance(first, Done):
        return first.reason
    for contact in contacts:
        if not contact.location_valid:
            continue
        rows = point_jacobian(model, state.q, contact.link, contact.point)
        normal = link_pose(model, state.q, contact.link).rotate(contact.normal)
        speed = sum(
            n * sum(j * v for j, v in zip(row, first.qd, strict=True)) for n, row in zip(normal, rows, strict=True)
        )
        if speed > 1e-3:
            return f"it leads towards the touch on link {contact.link}"
    return ""
