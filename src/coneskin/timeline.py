"""Events as lines for people."""

from __future__ import annotations

import math

from .robot.journal import GuardEvent

__all__ = ["describe"]

_ENDED = "the guard was told to end"  # on purpose: nobody needs to reset it
_RELEASED = "the touch is over"  # ends a movement only where the arm gives way to it
_PUSH = {"level", "damping", "place"}  # what slows only an arm that gives way


def describe(event: GuardEvent, start: float) -> str:
    """One line for an event.

    Args:
        event: what happened.
        start: host time that counts as 0 [s].
    """
    d = event.details
    match event.name:
        case "contact" | "contact_placed":
            sure = "" if d["location_valid"] else " (place not settled yet)"
            text = (
                f"{'touch' if event.name == 'contact' else 'the touch'} on {d['sensor']} ({d['link']}): "
                f"u = {1e3 * d['u']:.1f} mm, phi = {math.degrees(d['phi']):.1f} deg, level {d['level']:.2f}{sure}"
            )
        case "touch_ended":
            text = f"touch on {d['sensor']} ended"
        case "stopping":
            text = f"stop: {d['why']}"
        case "slower":
            text = f"joint speed falling: {d['speed']:.3f} rad/s"
        case "standstill":
            text = f"standing: {d['speed']:.4f} rad/s, by {', '.join(d['ways'])}"
        case "retreated":
            gave_way = d.get("how") == "push" or d["why"] == _RELEASED
            text = f"{'gave way' if gave_way else 'retreated'} {1e3 * d['progress']:.1f} mm: {d['why']}"
        case "latched" if d["why"].startswith(_ENDED):
            text = f"the arm stands and the guard ends: {d['why']}"
        case "latched":
            text = f"latched until a person resets: {d['why']}"
        case "escalated":
            text = f"no slowdown: next way to stop, {d['way']}"
        case "not_standing":
            speed = "its speed is not known" if d["speed"] is None else f"{d['speed']:.3f} rad/s"
            text = f"NOT standing, {speed}: round {d['rounds']} of all ways to stop is over; use the emergency stop"
        case "clipped":
            what = "giving way" if _PUSH & set(d["by"]) else "retreat"
            text = f"{what} slower than set, because of {', '.join(d['by'])}"
        case "slowing":
            text = f"slower: speed slider from {100.0 * d['before']:.0f} % to {100.0 * d['slider']:.0f} %"
        case "resumed":
            text = f"free again: speed slider back to {100.0 * d['slider']:.0f} %"
        case "retreating" if "how" in d:
            text = {"path": "going back the way the arm came", "push": "giving way to the push"}[d["how"]]
        case "waiting":
            text = "waiting: " + "; ".join(d["reasons"])
        case "refused":
            text = f"{d['what']} refused: " + "; ".join(d["reasons"])
        case "fault" | "message" | "died" | "ending" | "hung" | "heard" | "kept" | "missing":
            text = f"{event.name}: {d['what']}"
        case _:
            text = event.name
    return f"{event.time - start:9.4f} s  {text}"
