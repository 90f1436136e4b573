"""Text of events: one line for people each."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from coneskin.core.text import printable
from coneskin.robot.guard.signals.journal import EventName, GuardEvent, describe_way

_END_CAUSE = "the guard was told to end"  # on purpose: no reset is needed
_RELEASE_CAUSE = "the touch is over"  # ends only the motion of an arm that gives way
_TOUCH_WORDS = {
    EventName.CONTACT: "touch",
    EventName.CONTACT_LOCATED: "touch located",
    EventName.CONTACT_EXTENDED: "touch is not one disc",
}
_LONG_CAUSE = 30  # characters; a cause that is longer is said in full once
_STANDSTILL_SPEED = 5e-4  # rad/s; a speed below it reads as 0.000
_PUSH_LIMITS = {"level", "damping", "place"}  # limits of an arm that gives way, and of no other


def describe(event: GuardEvent, start: float) -> str:
    """Return the line for an event; ``start`` is the host time that counts as 0 [s]."""
    try:
        text = _words(event)
    except (LookupError, TypeError, ValueError, AttributeError):  # recorded by another version, or damaged
        text = f"{event.name}: {json.dumps(event.details)}"
    return printable(f"{event.time - start:9.4f} s  {text}")


class EventLines:
    """Lines for the events of a run, one after the other: the cause of a stop is said in full once."""

    def __init__(self) -> None:
        self._cause = ""

    def describe(self, event: GuardEvent, start: float) -> str:
        """Return the line for the next event; ``start`` is the host time that counts as 0 [s]."""
        key = "what" if event.name == EventName.FAULT else "why"
        said = event.details.get(key)
        if event.name not in (EventName.STOPPING, EventName.LATCHED, EventName.FAULT) or not isinstance(said, str):
            return describe(event, start)
        cause, then, rest = said.partition("; then ")
        if event.name == EventName.STOPPING:
            self._cause = cause
        elif cause == self._cause and len(cause) > _LONG_CAUSE:
            short = "that has stopped the arm" if event.name == EventName.FAULT else "as said above"
            return describe(event._replace(details={**event.details, key: short + then + rest}), start)
        return describe(event, start)


def _words(event: GuardEvent) -> str:
    d = event.details
    text: str
    match event.name:
        case EventName.CONTACT | EventName.CONTACT_LOCATED | EventName.CONTACT_EXTENDED:
            what = _TOUCH_WORDS[event.name]
            place = f"u = {1e3 * d['u']:.1f} mm, phi = {math.degrees(d['phi']):.1f} deg{_certainty(d)}"
            text = f"{what} on {d['sensor']} ({d['link']}) at {place}; level {d['level']:.2f}{_force(d)}"
        case EventName.TOUCH_ENDED:
            text = f"touch on {d['sensor']} ended"
        case EventName.STOPPING:
            text = f"stop: {d['why']}"
        case EventName.DECELERATING:
            text = (
                f"decelerating: {d['speed']:.3f} rad/s" if d["speed"] >= _STANDSTILL_SPEED else "the arm moves no more"
            )
        case EventName.STANDSTILL:
            text = f"standstill: {d['speed']:.4f} rad/s; stop paths tried: {', '.join(d['paths'])}"
        case EventName.RETREATED:
            gave_way = d.get("how") == "push" or d["why"] == _RELEASE_CAUSE
            text = f"{describe_way({**d, 'how': 'push'} if gave_way else d)}: {d['why']}"
        case EventName.LATCHED if d["why"].startswith(_END_CAUSE):
            text = f"the arm stands and the guard ends: {d['why']}"
        case EventName.LATCHED:
            text = f"latched until a manual reset: {d['why']}"
        case EventName.ESCALATED:
            text = f"the stop is not confirmed: escalating to the {d['path']} path"
        case EventName.STOP_FAILED:
            speed = "its speed is not known" if d["speed"] is None else f"{d['speed']:.3f} rad/s"
            often = "once" if d["rounds"] == 1 else f"{d['rounds']} times"
            text = f"standstill NOT confirmed, {speed}: all stop paths used {often}; use the emergency stop"
        case EventName.MOTION_LIMITED:
            what = "giving way" if _PUSH_LIMITS & set(d["by"]) else "retreat"
            text = f"{what} slower than set, because of {', '.join(d['by'])}"
        case EventName.SPEED_LIMITED:
            slider = f"slider from {100.0 * d['before']:.0f} % to {100.0 * d['slider']:.0f} %"
            why = f"{d['sensor']} would move at {100.0 * d['ratio']:.0f} % of its permissible speed"
            text = f"speed limited: {slider}; {why}" if d["sensor"] else f"speed less limited: {slider}"
        case EventName.SPEED_REDUCED:
            text = f"speed reduced: slider from {100.0 * d['before']:.0f} % to {100.0 * d['slider']:.0f} %"
        case EventName.RESUMED:
            text = f"no touch any more: speed slider back to {100.0 * d['slider']:.0f} %"
        case EventName.RETREATING if "how" in d:
            text = {"push": "giving way to the push"}[d["how"]]
        case EventName.WAITING:
            text = "waiting: " + "; ".join(d["reasons"])
        case EventName.NOT_COMMISSIONED:
            text = f"not commissioned, the arm only stops: {d['what']}"
        case EventName.REFUSED:
            text = f"{d['what']} refused: " + "; ".join(d["reasons"])
        case (
            EventName.FAULT
            | EventName.MESSAGE
            | EventName.GUARD_EXITED
            | EventName.ENDING
            | EventName.GUARD_UNRESPONSIVE
            | EventName.GUARD_RESPONSIVE
            | EventName.FALLBACK_STOP
            | EventName.RECORDING_GAP
            | EventName.SKIN_LINE
        ):
            text = f"{event.name}: {d['what']}"
        case _:
            text = event.name
    return f"{text} ({d['count']} times since the last report)" if "count" in d else text


def _certainty(details: Mapping[str, Any]) -> str:
    """Return how certain a place is: how far off it may be with 95 %, along the longer axis of its ellipse."""
    elongation, ellipse = details.get("elongation"), details.get("ellipse")
    if not details["location_valid"] and elongation is not None:
        return f" (several contacts, or a long one: half-length {1e3 * elongation[0]:.0f} mm, ratio unknown)"
    reach = "" if ellipse is None else f"+- {max(0.1, 1e3 * math.hypot(*ellipse[0])):.1f} mm"
    if details["location_valid"]:
        return f", {reach}" if reach else ""
    return f" (not certain yet; {reach} if it is one contact)" if reach else " (not certain yet)"


def _force(details: Mapping[str, Any]) -> str:
    """Return the force of a touch in words, where its sensor's calibration knows any."""
    if "force" not in details:
        return ""
    if details["force"] is None:
        return ", lighter or firmer than the forces of the calibration"
    force, deviation = details["force"]
    return f", {force:.1f} N +- {2.0 * deviation:.1f} N"
