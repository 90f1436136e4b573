"""What the events of a guard amount to, as the error that a program gets."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from . import errors
from .errors import Collision, ConeSkinError, MissingExtra, RobotConnectionError, RobotRefused, SceneError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .robot.journal import GuardEvent
    from .scene import Scene

__all__ = [
    "NOT_SEEN",
    "STANDS",
    "STILL_LEAVING",
    "braking_time",
    "death",
    "exit_code",
    "reasons",
    "stands",
    "stop_error",
]

STANDS = "the arm stands"
STILL_LEAVING = "the arm has stood and still moves away from the touch"
NOT_SEEN = "the arm was NOT seen to stand"
_MOVING = ("armed", "slowing", "resumed", "stopping", "retreating")
_MARGIN = 0.5  # s for the events to come, on a busy machine


def braking_time(scene: Scene) -> float:
    """How long the arm of a scene may brake until a standstill is seen, whatever moves it and stops it [s]."""
    from .robot.ur_models import model

    assert scene.arm is not None
    reactions = [scene.any_touch, *(rule.reaction for rule in scene.rules)]
    slowest = min(reaction.deceleration for reaction in reactions)
    fastest = max(model(scene.arm.model).joint_speed)
    return scene.limits.stop_budget(fastest, slowest) + _MARGIN


def stop_error(stop: GuardEvent, contact: GuardEvent | None, outcome: str) -> Collision | RobotRefused:
    """The error for a stop.

    Args:
        stop: the event "stopping".
        contact: the event that says where the touch is, if there is one.
        outcome: STANDS, STILL_LEAVING or NOT_SEEN.
    """
    if contact is None or stop.details["why"] != "touch":
        return RobotRefused(f"the guard has stopped the arm: {stop.details['why']}; {outcome}")
    where = contact.details
    return Collision(
        f"{where['sensor']} on the {where['link']} was touched at u = {1e3 * where['u']:.1f} mm, "
        f"phi = {math.degrees(where['phi']):.1f} deg; {outcome}, until a person resets the guard"
    )


def death(event: GuardEvent) -> ConeSkinError:
    """The error that a guard died of, of the kind that it was there."""
    kind = getattr(errors, str(event.details.get("error")), RobotConnectionError)
    if kind in (SceneError, MissingExtra):  # made of parts, of which only the message has come
        kind = RobotRefused
    error: ConeSkinError = kind(event.details["what"])
    return error


def reasons(event: GuardEvent) -> list[str]:
    """Why a guard waits or refuses, one line each."""
    details = event.details
    return [str(reason) for reason in details.get("reasons", [details.get("what", event.name)])]


def stands(events: Sequence[GuardEvent]) -> bool:
    """Whether the arm was seen standing at last, and nothing has let it move since."""
    for event in reversed(events):
        if event.name in ("standstill", "latched"):
            return True
        if event.name == "kept":
            return bool(event.details["stands"])
        if event.name in _MOVING:
            return False
    return False


def exit_code(events: Sequence[GuardEvent]) -> int:
    """What a program that has guarded ends with: 0 nothing has happened, 1 a fault, 3 a collision."""
    on_purpose = {event.details["what"] for event in events if event.name == "ending"}
    stops = [event.details["why"] for event in events if event.name == "stopping"]
    if "touch" in stops:
        return 3
    lost = [event.name for event in events if event.name in ("died", "hung")]
    return 1 if lost or not on_purpose.issuperset(stops) else 0
