"""Touches by more than a fingertip: a palm over the seam, a grip, a clamp, several fingers, each a list of touches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from coneskin.core.errors import SensorError
from coneskin.geometry.frustum import Frustum

from .scripted_touch import ScriptedTouch

__all__ = ["clamp", "fingers", "grip", "palm_over_seam"]


def palm_over_seam(cone: Frustum, touch: ScriptedTouch, angle: float) -> list[ScriptedTouch]:
    """Press on both sides of the seam at equal u, as a palm does that lies over it.

    Args:
        cone: the active area.
        touch: when, where along the side, how firmly on each side; its phi is not used.
        angle: of each press from its edge of the sensor [rad].
    """
    return _at(cone, touch, [(touch.u, angle), (touch.u, cone.wrap - angle)])


def grip(cone: Frustum, touch: ScriptedTouch, second_force: float | None = None) -> list[ScriptedTouch]:
    """Press on opposite sides at equal u, as a hand does that closes around the link.

    Args:
        cone: the active area.
        touch: the first press.
        second_force: of the opposite one [N]; as the first by default.
    """
    return clamp(cone, touch, touch.u, second_force)


def clamp(cone: Frustum, touch: ScriptedTouch, u: float, second_force: float | None = None) -> list[ScriptedTouch]:
    """Press on opposite sides at two places along the link, as it does that is caught between two things.

    Args:
        cone: the active area.
        touch: the first press.
        u: slant distance of the opposite one from end 1 [m].
        second_force: of the opposite one [N]; as the first by default.
    """
    first, second = _at(cone, touch, [(touch.u, touch.phi), (u, (touch.phi + math.pi) % (2.0 * math.pi))])
    return [first, second if second_force is None else replace(second, force=second_force)]


def fingers(cone: Frustum, touch: ScriptedTouch, offsets: Sequence[tuple[float, float]]) -> list[ScriptedTouch]:
    """Press with several fingers around a place.

    Args:
        cone: the active area.
        touch: when, around which place, and how firmly each.
        offsets: of each finger along the side and around it [m].
    """
    radius = cone.radius_at(touch.u)
    return _at(cone, touch, [(touch.u + along, touch.phi + around / radius) for along, around in offsets])


def _at(cone: Frustum, touch: ScriptedTouch, places: Sequence[tuple[float, float]]) -> list[ScriptedTouch]:
    for u, phi in places:
        if not (0.0 <= u <= cone.slant and 0.0 <= phi <= cone.wrap):
            raise SensorError(
                f"each press must lie on the sensor: u up to {cone.slant:g} m and phi up to {cone.wrap:g} rad, got "
                f"{u!r} m and {phi!r} rad"
            )
    return [replace(touch, u=u, phi=phi) for u, phi in places]
