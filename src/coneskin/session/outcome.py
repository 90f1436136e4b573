"""Outcome of a guarded run: its events as the error, the sentence and the exit code that a program gets."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from coneskin.core import errors
from coneskin.core.errors import Collision, ConeSkinError, MissingExtra, RobotConnectionError, RobotRefused, SceneError
from coneskin.robot.guard.signals.journal import TOUCH_CAUSE, EventName, GuardEvent

if TYPE_CHECKING:
    from coneskin.scene.values.scene import Scene

    from .event_log import EventLog

STANDS = "the arm stands"
STILL_RETREATING = "the arm has stood and still moves away from the touch"
NOT_CONFIRMED = "standstill of the arm NOT confirmed"
_MOVING_EVENTS = (
    EventName.ACTIVATED,
    EventName.SPEED_REDUCED,
    EventName.RESUMED,
    EventName.STOPPING,
    EventName.RETREATING,
)
_REACTION_TIMEOUT = 6.0  # s beyond the braking time in which a reaction ends
_EVENT_MARGIN = 0.5  # s for the events to come, on a busy machine


def braking_time(scene: Scene) -> float:
    """Return the longest time in which the arm of a scene comes to a confirmed standstill after a stop [s]."""
    assert scene.arm is not None
    reactions = [scene.default_reaction, *(rule.reaction for rule in scene.rules)]
    slowest = min(reaction.deceleration for reaction in reactions)
    fastest = max(scene.arm.arm_model.joint_speed)
    return scene.monitoring_limits.stop_budget(fastest, slowest) + _EVENT_MARGIN


def await_outcome(log: EventLog, since: int, standstill_time: float) -> str:
    """Return the outcome of the newest stop, as far as it is known in time.

    Args:
        since: position of the first event that counts.
        standstill_time: time in which the arm comes to a confirmed standstill [s].
    """
    end = time.monotonic() + standstill_time + _REACTION_TIMEOUT
    while True:
        newest = max(i for i, event in enumerate(log.events) if i >= since and event.name == EventName.STOPPING)
        if log.wait_for((EventName.STANDSTILL, EventName.LATCHED), standstill_time, newest) is None:
            return NOT_CONFIRMED
        latched = log.wait_for((EventName.LATCHED,), max(end - time.monotonic(), 0.0), newest)
        if not any(event.name == EventName.STOPPING for event in log.events[newest + 1 :]):
            return STANDS if latched else STILL_RETREATING
        if time.monotonic() >= end:
            return NOT_CONFIRMED


def stop_error(
    stop: GuardEvent, contact: GuardEvent | None, outcome: str, reaction: str = ""
) -> Collision | RobotRefused:
    """Return the error for a stop.

    Args:
        contact: the event that says where the touch is, if there is one.
        outcome: STANDS, STILL_RETREATING or NOT_CONFIRMED.
        reaction: what the reaction did, as the event "latched" says it; empty where that is not known.
    """
    if contact is None or not _is_touch(stop):
        return RobotRefused(f"the guard has stopped the arm: {stop.details['why']}; {outcome}")
    where = contact.details
    return Collision(
        f"{where['sensor']} on the {where['link']} was touched at u = {1e3 * where['u']:.1f} mm, "
        f"phi = {math.degrees(where['phi']):.1f} deg; {outcome}, until a person resets the guard"
        + (f" ({reaction})" if reaction else ""),
        contact,
        outcome == STANDS,
        reaction,
        int(stop.details.get("stop", 0)),
    )


def _is_touch(event: GuardEvent) -> bool:
    """Tell whether an event is a stop for a touch, one included that the arm moved into too far while it was slow."""
    details = event.details
    return event.name == EventName.STOPPING and (details["why"] == TOUCH_CAUSE or "contact" in details)


def activation_error(
    events: Sequence[GuardEvent], describe_line: Callable[[Sequence[str]], str] = lambda _: ""
) -> RobotRefused:
    """Return the error of a guard that has not become active, with all that stood against it.

    Args:
        describe_line: says what is wrong with the skin's line, given the reasons.
    """
    waiting = next((event for event in reversed(events) if event.name == EventName.WAITING), None)
    faults = [str(event.details["what"]) for event in events if event.name in (EventName.FAULT, EventName.GUARD_EXITED)]
    waited_for = reasons(waiting) if waiting else []
    line = describe_line(waited_for)
    listed = list(dict.fromkeys([*faults, *([line] if line else []), *waited_for])) or ["its process sent nothing"]
    return RobotRefused("the guard did not become active:\n" + "\n".join(f"  {line}" for line in listed))


def exit_error(event: GuardEvent) -> ConeSkinError:
    """Return the error that ended a guard, of the type that it had there."""
    kind = getattr(errors, str(event.details.get("error")), RobotConnectionError)
    if kind in (SceneError, MissingExtra):  # they are made of parts, of which only the message has come
        kind = RobotRefused
    error: ConeSkinError = kind(event.details["what"])
    return error


def reasons(event: GuardEvent) -> list[str]:
    """Return why a guard waits or refuses, one line each."""
    details = event.details
    return [str(reason) for reason in details.get("reasons", [details.get("what", event.name)])]


def stands(events: Sequence[GuardEvent]) -> bool:
    """Tell whether the arm was last seen standing, for as long as it takes, and nothing has let it move since."""
    for event in reversed(events):
        if event.name == EventName.LATCHED:  # a standstill may be one between two starts of a program
            return True
        if event.name == EventName.FALLBACK_STOP:
            return bool(event.details["stands"])
        if event.name in _MOVING_EVENTS:
            return False
    return False


def exit_code(events: Sequence[GuardEvent], arm: bool) -> int:
    """Return the exit code of a guarded run: 0 nothing has happened, 1 a fault, 3 a collision.

    Args:
        arm: whether the scene has one; without one a touch counts as a collision.
    """
    on_purpose = {event.details["what"] for event in events if event.name == EventName.ENDING}
    stops = [event.details["why"] for event in events if event.name == EventName.STOPPING]
    names = {event.name for event in events}
    if any(map(_is_touch, events)) or (not arm and EventName.CONTACT in names):
        return 3
    if not arm and EventName.FAULT in names:
        return 1
    lost = [event.name for event in events if event.name in (EventName.GUARD_EXITED, EventName.GUARD_UNRESPONSIVE)]
    return 1 if lost or not on_purpose.issuperset(stops) else 0
