"""The decision: what to do at a touch. A pure function of the contacts and the state of the arm."""

from __future__ import annotations

from collections.abc import Sequence

from .commands import ArmState, ContactOnLink, Done, JointVelocity, Reaction, Stop
from .retreat import RetreatPlan, plan_retreat, retreat_step
from .space import Space
from .ur_models import ArmModel

__all__ = [
    "ArmState",
    "ContactOnLink",
    "Done",
    "JointVelocity",
    "Reaction",
    "RetreatPlan",
    "Stop",
    "plan_retreat",
    "react",
    "retreat_step",
]


def react(
    model: ArmModel,
    state: ArmState,
    contacts: Sequence[ContactOnLink],
    reaction: Reaction,
    space: Space | None = None,
) -> tuple[Stop, RetreatPlan | None] | None:
    """What to do now, and then.

    Args:
        model: the arm.
        state: the arm as measured when the touch was seen.
        contacts: all touches of this frame.
        reaction: the settings.
        space: the room that the arm has while it retreats; without it nothing is in the way.

    Returns:
        None without a contact. Otherwise the stop to send at once, whatever else is true; and, for "retreat" and where
        there is a way out, the plan to follow with ``retreat_step`` from then on: at once where the arm is in speed
        mode, else from its standstill. Where there is none, the reason of the stop says why.

    Raises:
        KinematicsError: a contact is on a link that there is not.
    """
    if not contacts:
        return None
    links = sorted({contact.link for contact in contacts})
    touched = "touch on link " + ", ".join(str(link) for link in links)
    if reaction.kind != "retreat":
        return Stop(reaction.deceleration, touched), None
    plan = plan_retreat(model, state, contacts, reaction, space)
    if isinstance(plan, Done):
        return Stop(reaction.deceleration, f"{touched}; no retreat: {plan.reason}"), None
    return Stop(reaction.deceleration, touched), plan
